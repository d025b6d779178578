#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace graspatlas {

/// Convex hulls in wrench space, R^3 in the plane and R^6 in space, as Ferrari and Canny (1992) measure them.
///
/// Made for few points (at most `kMaxPoints`) and very many hulls. A hull grows point by point: the facets that a new
/// point sees give way to those that join it to their rim. Facets are simplices. A point within rounding of a facet's
/// plane counts as in it, so that the flat faces of friction pyramids become fans of simplices and no slivers.
///
/// The surface is a chain: facets with signs, corners in ascending order, and no neighbours. A ridge belongs to the rim
/// when its signs among the facets seen do not cancel. So the surface stays closed whatever rounding does: where points
/// are all but in one plane it may fold, but it still encloses the same volume, and no facet nearer to the origin than
/// the hull's own can be missing.
template <int D>
class WrenchHull {
 public:
  using Point = Eigen::Matrix<double, D, 1>;
  using Points = Eigen::Matrix<double, D, Eigen::Dynamic>;
  using Corners = std::array<std::uint16_t, D>;

  /// A convex body that is asked how far it reaches in a direction, a facet's normal. It writes a point of its own that
  /// is about as far, numbered one more than the last, and returns a bound of how far any is. The facet's corners are
  /// the points of these numbers; what is further away than `least` need not be known better.
  using Reach = std::function<double(const Point& direction, const Corners& corners, double least, Point& furthest)>;

  static constexpr int kMaxPoints = 4095;
  static constexpr int kRoundCorners = 8;  // of each disc, with which the hull of round cones starts

  /// Radius of the largest ball around the origin in the hull of the points; zero when the origin is not inside.
  ///
  /// Only what is nearest to the origin is ever refined (Zheng 2013): the hull of some points lies in that of all, and
  /// as soon as no point lies beyond its nearest facet, that facet belongs to both.
  double ball_radius(const Eigen::Ref<const Points>& points);

  /// The same for round friction cones: the hull of the discs n_i + mu (cos(a) s_i + sin(a) t_i).
  ///
  /// `axes` has three columns for each contact, the wrenches of unit forces along n_i, s_i and t_i. The radius is found
  /// from below, to one part in ten thousand; for grasps so symmetric that the ball touches the hull nearly everywhere,
  /// to what 300,000 facets give.
  double ball_radius(const Eigen::Ref<const Points>& axes, double friction);

  /// The same for a convex body, from some of its points, one of its reaches as `least`, and its reach in directions.
  ///
  /// The radius is that of a ball in the hull of points of the body, a lower bound; an upper one is the least reach. It
  /// ends when these are within `relative_gap`, or with the lower bound there is after the most points or facets.
  double ball_radius(const Eigen::Ref<const Points>& points, double least, double relative_gap, const Reach& reach);

  /// A facet: the plane of its corners, points of the last hull, in the direction of its outward unit normal.
  struct Side {
    Point normal;
    double distance;  ///< of its plane from the origin
    Corners corners;
  };

  /// Facets of the last hull whose planes are at most so far from the origin, the nearest first; none where that hull
  /// is flat.
  std::vector<Side> sides_within(double distance) const;

  /// Volume of the hull of the points; zero when they lie in one plane.
  double volume(const Eigen::Ref<const Points>& points);

 private:
  struct Facet {
    Point normal;     // outward unit normal
    double offset;    // of its plane from the centre
    double distance;  // of its plane from the origin; negative when the origin is beyond
    Corners corners;  // ascending
    int sign;         // in the chain: of this order of the corners
  };
  struct Ridge {
    std::uint64_t key;  // its corners
    int sign;
  };

  bool start(const Eigen::Ref<const Points>& points);
  template <class Furthest>
  double grow(double relative_gap, std::size_t max_facets, Furthest furthest);
  void add(int point);
  void append_facet(const Corners& corners, int sign);

  Points points_;  // seen from the centre, a point inside the hull
  int count_ = 0;
  Point origin_;       // of the wrenches, seen from the centre
  double flat_ = 0.0;  // a point this near to a plane lies in it
  std::vector<Facet> facets_;
  std::vector<Ridge> rim_;
};

extern template class WrenchHull<2>;
extern template class WrenchHull<3>;
extern template class WrenchHull<6>;

}  // namespace graspatlas
