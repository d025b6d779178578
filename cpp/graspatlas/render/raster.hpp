#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace graspatlas {

/// A pixel that a triangle covers.
struct Fragment {
  std::int64_t pixel;  ///< its number in the picture, row by row
  std::int32_t triangle;
  std::array<float, 3> weights;  ///< barycentric coordinates on the screen
  float nearness;                ///< interpolated
};

/// A z-buffer rasteriser: which triangles are seen at which pixels. A pixel is covered when its middle is.
///
/// Bands of rows are filled at the same time, and each triangle by triangle: the answer is the same from any number of
/// threads.
class Raster {
 public:
  /// `corners` [count x 3 x 3] on the screen: x to the right and y down in pixels, and a nearness that is larger for
  /// nearer points and linear on the screen. They must outlive the raster; what is not finite covers nothing.
  Raster(const double* corners, std::int64_t count, int width, int height);

  /// The nearest triangle of each pixel that is covered, in the order of the pixels; of equally near ones the last.
  std::vector<Fragment> nearest(int threads) const;

  /// All that is nearer than the picture's pixels are, `nearness` [width * height], in the order of the pixels, at each
  /// the farthest first.
  std::vector<Fragment> in_front_of(const float* nearness, int threads) const;

 private:
  struct Box {
    std::int32_t triangle;
    int left, top, right, bottom;  // pixels, all included
  };

  int bands() const;
  template <class Visit>
  void fill(const Box& box, int top, int bottom, Visit visit) const;
  template <class Band>
  std::vector<Fragment> by_bands(int threads, Band band) const;
  Fragment fragment_at(std::int64_t pixel, std::int32_t triangle) const;

  const double* corners_;
  int width_, height_;
  std::vector<Box> boxes_;  // of the triangles that may cover pixels
};

}  // namespace graspatlas
