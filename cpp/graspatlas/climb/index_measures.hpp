#pragma once

#include <functional>
#include <memory>

#include "graspatlas/climb/measure.hpp"
#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/quality/manipulability.hpp"

namespace graspatlas {

/// A number that is read off a grasp, with slopes by central differences.
class NumberMeasure : public Measure {
 public:
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 protected:
  virtual double value(const double* x) = 0;
};

/// What is read off the semi-axes of the manipulability ellipsoid.
enum class AxesIndex { volume, inverse_condition_number, smallest };

/// An index of the manipulability ellipsoid, over the largest `connectivity` semi-axes: zero where one of them is lost.
class AxesMeasure : public NumberMeasure {
 public:
  AxesMeasure(GraspSystem& system, AxesIndex index, int connectivity, double length_unit);

 protected:
  double value(const double* x) override;

 private:
  Manipulability manipulability_;
  AxesIndex index_;
  int connectivity_;
  Vector axes_;
};

/// How near the joints are to the middle of their ranges, between 0 and 1.
class CentralityMeasure : public NumberMeasure {
 public:
  /// `joints` is the number of joints of the hand, those without two limits included.
  CentralityMeasure(const GraspSystem& system, int joints);

 protected:
  double value(const double* x) override;

 private:
  struct Range {
    std::size_t at;  // number of the joint in x
    double middle, half;
  };
  std::vector<Range> ranges_;
  int joints_;
};

/// Rows of numbers [n x c] of grasps X [n x configuration_size] that somebody else computes, as a function in Python.
using RowsFunction = std::function<RowMatrix(const RowMatrix& X)>;

/// Numbers that are computed for whole batches of grasps, by a function that is made anew near each grasp
/// [1 x configuration_size].
class BatchMeasure : public Measure {
 public:
  BatchMeasure(const GraspSystem& system, std::function<RowsFunction(const RowMatrix& x)> near);
  void linearize(const Surroundings& at, double reach, Rows& rows) override;
  bool revisit(const double* x, double* values) override;

 private:
  std::function<RowsFunction(const RowMatrix& x)> near_;
  RowsFunction values_;
  RowMatrix X_;
};

}  // namespace graspatlas
