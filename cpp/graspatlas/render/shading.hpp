#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace graspatlas {

/// Triangles as they are lit, [f x 3 corners x ...]: places [m], normals, and nearness on the screen; and of each its
/// linear colour and opacity [f x 4].
struct Surfaces {
  const float* points;
  const float* normals;
  const float* nearness;
  const float* colours;
};

/// A lamp far away: unit vector towards it, and its intensity.
struct Lamp {
  Eigen::Vector3f direction;
  float intensity;
};

/// What the first lamp does not reach: depths towards it on a raster in its own axes.
struct ShadowMap {
  Eigen::Matrix3d axes;    ///< rows: right, up, towards the lamp
  Eigen::Vector3d origin;  ///< of the raster in these axes [m]
  double pixel;            ///< its size [m]
  int width, height;
  const float* depths;  ///< [height x width], along the third axis from the origin [m]
};

/// Light that fragments send to a camera, linear, and how squarely they face it.
///
/// `triangles` [n] and `weights` [n x 3] are fragments of a raster. Diffuse light of all lamps and of the surroundings,
/// their mirror images with soft edges, and a brighter rim where a surface is seen at a flat angle. `shadow` may be
/// null. Writes `light` [n x 3] and `facing` [n], 0 to 1.
void shade(const Surfaces& surfaces, const std::int64_t* triangles, const float* weights, std::int64_t n,
           const Eigen::Vector3f& camera, const std::vector<Lamp>& lamps, const ShadowMap* shadow, float* light,
           float* facing, int threads);

/// Lays fragments over a picture of linear light [pixels x 3], in their order: those of one pixel the farthest first.
void lay_over(float* picture, const std::int64_t* pixels, const float* opacities, const float* light, std::int64_t n);

/// Screen colours of linear light, 0 to 255: each pixel [height x width x 3] is the mean of samples x samples of the
/// picture [(height * samples) x (width * samples) x 3]. Bright light saturates softly.
void develop(const float* picture, int width, int height, int samples, std::uint8_t* colours, int threads);

/// A picture [height x width x channels] enlarged, bilinear between the middles of its pixels.
void enlarge(const float* from, int from_width, int from_height, int channels, float* to, int width, int height,
             int threads);

/// A picture [height x width] blurred by a Gauss function of `sigma` pixels, mirrored at its edges.
void blur(const float* from, int width, int height, double sigma, float* to, int threads);

}  // namespace graspatlas
