#include <limits>

#include "graspatlas/render/corner_normals.hpp"
#include "graspatlas/render/raster.hpp"
#include "graspatlas/render/shading.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using namespace graspatlas;

// Triangles that give trouble: beyond the picture, of no size, far away, and of corners that are no numbers.
std::vector<double> troublesome(int count, Random& random) {
  std::vector<double> corners;
  for (int i = 0; i < 9 * count; ++i) corners.push_back(random.uniform(-20.0, 80.0));
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300,
                        -1e18};
  for (int t = 0; t < count; t += 5) corners[9 * t + random.below(9)] = bad[random.below(4)];
  for (int t = 1; t < count; t += 7)
    for (int k = 0; k < 3; ++k) corners[9 * t + 3 + k] = corners[9 * t + k];
  return corners;
}

void paint(int width, int height, Random& random) {
  const int count = 60;
  const std::vector<double> corners = troublesome(count, random);
  const Raster raster(corners.data(), count, width, height);
  const auto seen = raster.nearest(2), alone = raster.nearest(1);
  require(seen.size() == alone.size(), "a picture is the same from any number of threads");
  std::vector<float> nearness(static_cast<std::size_t>(width) * height, 0.0f);
  for (const Fragment& fragment : seen) {
    require(fragment.pixel >= 0 && fragment.pixel < width * height, "fragments lie in the picture");
    nearness[static_cast<std::size_t>(fragment.pixel)] = fragment.nearness - 1.0f;
  }
  const auto before = raster.in_front_of(nearness.data(), 2);
  std::vector<std::int64_t> triangles, pixels;
  std::vector<float> weights, points, normals, near, colours(4 * count, 0.5f);
  for (const Fragment& fragment : before) {
    triangles.push_back(fragment.triangle);
    pixels.push_back(fragment.pixel);
    weights.insert(weights.end(), fragment.weights.begin(), fragment.weights.end());
  }
  for (int i = 0; i < 9 * count; ++i) {
    points.push_back(static_cast<float>(random.normal()));
    normals.push_back(i % 30 < 9 ? 0.0f : static_cast<float>(random.normal()));
    if (i % 3 == 0) near.push_back(i % 21 == 0 ? 0.0f : 1.0f);
  }
  const auto n = static_cast<std::int64_t>(before.size());
  std::vector<float> light(3 * before.size()), facing(before.size()), opacities(before.size(), 0.3f);
  const ShadowMap map{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), 1e-3, width, height, nearness.data()};
  shade({points.data(), normals.data(), near.data(), colours.data()}, triangles.data(), weights.data(), n,
        Eigen::Vector3f(1.0f, 2.0f, 3.0f), {{Eigen::Vector3f::UnitZ(), 0.8f}}, &map, light.data(), facing.data(), 2);
  std::vector<float> picture(3 * nearness.size(), 0.2f), blurred(nearness.size()), large(12 * nearness.size());
  lay_over(picture.data(), pixels.data(), opacities.data(), light.data(), n);
  std::vector<std::uint8_t> screen(3 * nearness.size());
  develop(picture.data(), width, height, 1, screen.data(), 2);
  blur(nearness.data(), width, height, random.uniform(0.2, 30.0), blurred.data(), 2);
  enlarge(picture.data(), width, height, 3, large.data(), 2 * width, 2 * height, 2);
}

}  // namespace

void pictures() {
  Random random(11);
  for (const auto& [width, height] : {std::pair{64, 48}, std::pair{1, 1}, std::pair{3, 100}, std::pair{200, 2}})
    for (int i = 0; i < 5; ++i) paint(width, height, random);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 50; ++i) points.push_back(Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
  std::vector<std::array<int, 3>> faces;
  for (int i = 0; i < 200; ++i) faces.push_back({random.below(50), random.below(50), random.below(50)});
  require(corner_normals(points, faces, 0.7).size() == 600, "every corner has its normal");
  require(corner_normals({}, {}, 0.7).empty(), "of nothing there is none");
}

}  // namespace strain
