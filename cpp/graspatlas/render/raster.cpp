#include "graspatlas/render/raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

constexpr int kBandRows = 32;
constexpr float kSeam = 1e-5f;       // triangles are widened by this share, so that no gap opens between neighbours
constexpr double kLeastArea = 1e-6;  // of twice a triangle [pixels^2]; smaller ones cover nothing
constexpr std::int32_t kNothing = -1;

/// The first and the last pixel whose middles lie in an interval, within a picture's side.
int first_pixel(double low, int side) { return static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double(side))); }
int last_pixel(double high, int side) {
  return static_cast<int>(std::clamp(std::floor(high - 0.5), -1.0, double(side - 1)));
}

}  // namespace

Raster::Raster(const double* corners, std::int64_t count, int width, int height)
    : corners_(corners), width_(width), height_(height) {
  boxes_.reserve(static_cast<std::size_t>(count));
  for (std::int64_t t = 0; t < count; ++t) {
    const double *a = corners + 9 * t, *b = a + 3, *c = a + 6;
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (!(std::abs(area) > kLeastArea && std::isfinite(area))) continue;
    const auto [left, right] = std::minmax({a[0], b[0], c[0]});
    const auto [top, bottom] = std::minmax({a[1], b[1], c[1]});
    const Box box{static_cast<std::int32_t>(t), first_pixel(left, width), first_pixel(top, height),
                  last_pixel(right, width), last_pixel(bottom, height)};
    if (box.left <= box.right && box.top <= box.bottom) boxes_.push_back(box);
  }
}

int Raster::bands() const { return (height_ + kBandRows - 1) / kBandRows; }

/// visit(pixel, weights, nearness) for the pixels of rows [top, bottom) that a triangle covers.
template <class Visit>
void Raster::fill(const Box& box, int top, int bottom, Visit visit) const {
  const double* corner = corners_ + 9 * static_cast<std::int64_t>(box.triangle);
  // Corners relative to the box's first pixel are small numbers: single precision will do.
  float x[3], y[3], near[3];
  for (int k = 0; k < 3; ++k) {
    x[k] = static_cast<float>(corner[3 * k] - (box.left + 0.5));
    y[k] = static_cast<float>(corner[3 * k + 1] - (box.top + 0.5));
    near[k] = static_cast<float>(corner[3 * k + 2]);
  }
  const float scale = 1.0f / ((x[1] - x[0]) * (y[2] - y[1]) - (y[1] - y[0]) * (x[2] - x[1]));
  float along[3], down[3], zero[3];  // the weight of corner k is along x + down y - zero, by the edge opposite
  for (int k = 0; k < 3; ++k) {
    const int from = (k + 1) % 3, to = (k + 2) % 3;
    along[k] = -(y[to] - y[from]) * scale;
    down[k] = (x[to] - x[from]) * scale;
    zero[k] = along[k] * x[from] + down[k] * y[from];
  }
  for (int row = std::max(box.top, top); row <= box.bottom && row < bottom; ++row) {
    const float dy = static_cast<float>(row - box.top);
    const std::int64_t start = static_cast<std::int64_t>(row) * width_;
    for (int column = box.left; column <= box.right; ++column) {
      const float dx = static_cast<float>(column - box.left);
      std::array<float, 3> w;
      for (int k = 0; k < 3; ++k) w[k] = along[k] * dx + down[k] * dy - zero[k];
      if (w[0] >= -kSeam && w[1] >= -kSeam && w[2] >= -kSeam)
        visit(start + column, w, w[0] * near[0] + w[1] * near[1] + w[2] * near[2]);
    }
  }
}

/// What band(top, bottom, out) appends for each band of rows, in their order.
template <class Band>
std::vector<Fragment> Raster::by_bands(int threads, Band band) const {
  std::vector<std::vector<Fragment>> parts(static_cast<std::size_t>(bands()));
  parallel_for(threads, bands(), [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      const int top = static_cast<int>(i) * kBandRows;
      band(top, std::min(top + kBandRows, height_), parts[static_cast<std::size_t>(i)]);
    }
  });
  std::size_t total = 0;
  for (const auto& part : parts) total += part.size();
  std::vector<Fragment> all;
  all.reserve(total);
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

std::vector<Fragment> Raster::nearest(int threads) const {
  return by_bands(threads, [this](int top, int bottom, std::vector<Fragment>& out) {
    const std::int64_t start = static_cast<std::int64_t>(top) * width_;
    const std::size_t size = static_cast<std::size_t>(bottom - top) * static_cast<std::size_t>(width_);
    std::vector<float> depth(size, -std::numeric_limits<float>::infinity());
    std::vector<std::int32_t> owner(size, kNothing);
    for (const Box& box : boxes_) {
      if (box.bottom < top || box.top >= bottom) continue;
      fill(box, top, bottom, [&](std::int64_t pixel, const std::array<float, 3>&, float nearness) {
        const auto at = static_cast<std::size_t>(pixel - start);
        if (nearness < depth[at]) return;
        depth[at] = nearness;
        owner[at] = box.triangle;
      });
    }
    for (std::size_t at = 0; at < size; ++at)
      if (owner[at] != kNothing) out.push_back(fragment_at(start + static_cast<std::int64_t>(at), owner[at]));
  });
}

std::vector<Fragment> Raster::in_front_of(const float* nearness, int threads) const {
  return by_bands(threads, [this, nearness](int top, int bottom, std::vector<Fragment>& out) {
    for (const Box& box : boxes_) {
      if (box.bottom < top || box.top >= bottom) continue;
      fill(box, top, bottom, [&](std::int64_t pixel, const std::array<float, 3>& weights, float near) {
        if (near > nearness[pixel]) out.push_back({pixel, box.triangle, weights, near});
      });
    }
    std::stable_sort(out.begin(), out.end(), [](const Fragment& a, const Fragment& b) {
      return a.pixel != b.pixel ? a.pixel < b.pixel : a.nearness < b.nearness;
    });
  });
}

/// A triangle at a pixel that it covers, with weights within it: those of the seam are moved onto its edge.
Fragment Raster::fragment_at(std::int64_t pixel, std::int32_t triangle) const {
  const double *a = corners_ + 9 * static_cast<std::int64_t>(triangle), *b = a + 3, *c = a + 6;
  const double x = static_cast<double>(pixel % width_) + 0.5 - a[0],
               y = static_cast<double>(pixel / width_) + 0.5 - a[1];
  const double scale = 1.0 / ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
  const double second = std::clamp((x * (c[1] - a[1]) - y * (c[0] - a[0])) * scale, 0.0, 1.0);
  const double third = std::clamp((y * (b[0] - a[0]) - x * (b[1] - a[1])) * scale, 0.0, 1.0 - second);
  const double first = 1.0 - second - third;
  return {pixel,
          triangle,
          {static_cast<float>(first), static_cast<float>(second), static_cast<float>(third)},
          static_cast<float>(first * a[2] + second * b[2] + third * c[2])};
}

}  // namespace graspatlas
