#pragma once

#include <vector>

#include "graspatlas/continuation/polytope.hpp"

namespace graspatlas {

/// Points of a facet of a polytope: the centre of its corners, and points between it and some of them. Where a polytope
/// does not list all its vertices, the corners are the ends of chords along the axes.
class FacetSamples {
 public:
  /// Takes those of a facet; `radius` is the chart's. They lie one after another [count x k];
  /// there are none of a facet that is empty.
  void take(const Polytope& polytope, int facet, double radius);

  int count() const { return static_cast<int>(points_.size()) / k_; }
  const double* operator[](int i) const { return &points_[static_cast<std::size_t>(i) * static_cast<std::size_t>(k_)]; }

 private:
  void find_corners(const Polytope& polytope, int facet, double radius);
  void find_chord_ends(const Polytope& polytope, int facet, double radius);
  bool step_onto(const Polytope& polytope, int facet, double radius);
  bool find_chord(const Polytope& polytope, int facet, int axis, double* ends);

  /// Vertices of a facet towards which points are taken; of more some, evenly.
  static constexpr int kMostCorners = 3;
  /// A vertex as near to the facet's plane as this share of the radius lies in it.
  static constexpr double kOnFacet = 1e-9;
  /// Steps towards a facet after which it is taken to be empty.
  static constexpr int kMostSteps = 60;

  int k_ = 1;
  std::vector<double> points_, corners_, u_, across_;
};

}  // namespace graspatlas
