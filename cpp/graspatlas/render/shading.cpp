#include "graspatlas/render/shading.hpp"

#include <algorithm>
#include <cmath>

#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

using Eigen::Map;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kLift = 0.0015;  // points are lifted off their surface before they are looked up in a shadow [m]
constexpr double kTaps[] = {-1.7, 0.0, 1.7};  // pixels of a shadow map, both ways, at which a point is looked up
constexpr float kAmbient = 0.20f, kSky = 0.10f, kGloss = 0.42f;
constexpr float kKnee = 0.7f;  // light above this saturates
constexpr float kGamma = 2.2f;
constexpr double kBlurReach = 4.0;  // a Gauss function ends after so many sigma

/// The pixel at a place within a picture's side; the nearest one for a place beyond, the first for one that is none.
int pixel_at(double place, int side) { return place > 0.0 ? static_cast<int>(std::min(place, side - 1.0)) : 0; }

/// Share of the lamp that reaches a point with a unit normal, with a soft edge.
float lit(const ShadowMap& map, const Vector3f& point, const Vector3f& normal) {
  const Vector3d raised = map.axes * (point.cast<double>() + kLift * normal.cast<double>()) - map.origin;
  const double x = raised.x() / map.pixel, y = raised.y() / map.pixel;
  int reached = 0;
  for (const double dy : kTaps) {
    const int row = pixel_at(y + dy, map.height);
    for (const double dx : kTaps) {
      const int column = pixel_at(x + dx, map.width);
      reached += map.depths[static_cast<std::int64_t>(row) * map.width + column] < raised.z();
    }
  }
  return static_cast<float>(reached) / 9.0f;
}

/// Mirror image of a lamp with a soft edge and a wide faint halo, by the cosine of the angle off its middle.
float softbox(float cosine) {
  const float near = std::clamp((cosine - 0.90f) / 0.08f, 0.0f, 1.0f);
  const float square = cosine * cosine, fourth = square * square;
  const float halo = cosine > 0.0f ? fourth * fourth * fourth : 0.0f;
  return 0.55f * near * near * (3.0f - 2.0f * near) + 0.18f * halo;
}

/// Light of a point with a linear colour; unit normal and unit vector to the camera are on one side.
Vector3f light_of(const Vector3f& colour, const Vector3f& normal, const Vector3f& to_camera, float share,
                  const std::vector<Lamp>& lamps) {
  const float facing = std::clamp(normal.dot(to_camera), 0.0f, 1.0f);
  const Vector3f mirrored = 2.0f * facing * normal - to_camera;
  float diffuse = kAmbient + kSky * normal.z(), gloss = 0.0f;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const float intensity = lamps[i].intensity * (i == 0 ? share : 1.0f);
    diffuse += intensity * std::max(normal.dot(lamps[i].direction), 0.0f);
    gloss += intensity * softbox(mirrored.dot(lamps[i].direction));
  }
  const float away = 1.0f - facing, square = away * away;
  const float fresnel = 0.04f + 0.5f * square * square * away;
  const float shine = kGloss * gloss + fresnel * (0.55f + 0.35f * mirrored.z());
  return colour * (diffuse * (1.0f - 0.5f * fresnel)) + Vector3f::Constant(shine);
}

/// Screen colour of linear light, 0 to 255.
std::uint8_t screen_colour(float light) {
  if (!(light > 0.0f)) return 0;
  if (light > kKnee) light = kKnee + (1.0f - kKnee) * (1.0f - std::exp(-(light - kKnee) / (1.0f - kKnee)));
  return static_cast<std::uint8_t>(std::lround(255.0f * std::min(std::pow(light, 1.0f / kGamma), 1.0f)));
}

/// Weights of a Gauss function from its middle outwards; with their mirror images they sum to one.
std::vector<float> gauss(double sigma) {
  std::vector<double> weights(static_cast<std::size_t>(kBlurReach * sigma + 0.5) + 1);
  double sum = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double x = static_cast<double>(i) / sigma;
    weights[i] = std::exp(-0.5 * x * x);
    sum += (i == 0 ? 1.0 : 2.0) * weights[i];
  }
  std::vector<float> out;
  for (const double weight : weights) out.push_back(static_cast<float>(weight / sum));
  return out;
}

/// Place in [0, size) that a place beyond an edge mirrors.
int mirrored(int place, int size) {
  const int period = 2 * size;
  place = ((place % period) + period) % period;
  return place < size ? place : period - 1 - place;
}

/// One row of a blurred picture from a row with margins on both sides.
void blur_row(const float* padded, int width, const std::vector<float>& weights, float* to) {
  const int reach = static_cast<int>(weights.size()) - 1;
  const float* middle = padded + reach;
  for (int x = 0; x < width; ++x) to[x] = weights[0] * middle[x];
  for (int i = 1; i <= reach; ++i)
    for (int x = 0; x < width; ++x) to[x] += weights[i] * (middle[x - i] + middle[x + i]);
}

}  // namespace

void shade(const Surfaces& surfaces, const std::int64_t* triangles, const float* weights, std::int64_t n,
           const Vector3f& camera, const std::vector<Lamp>& lamps, const ShadowMap* shadow, float* light, float* facing,
           int threads) {
  parallel_for(threads, n, [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t i = first; i < last; ++i) {
      const std::int64_t t = triangles[i];
      // On the screen weights are linear, in space they are by nearness.
      Vector3f w = Map<const Vector3f>(weights + 3 * i).cwiseProduct(Map<const Vector3f>(surfaces.nearness + 3 * t));
      w /= w.sum();
      using Corners = Eigen::Matrix<float, 3, 3>;  // one column each
      const Vector3f point = Map<const Corners>(surfaces.points + 9 * t) * w;
      Vector3f normal = Map<const Corners>(surfaces.normals + 9 * t) * w;
      const Vector3f to_camera = (camera - point).normalized();
      normal.normalize();
      if (normal.dot(to_camera) < 0.0f) normal = -normal;
      const float share = shadow ? lit(*shadow, point, normal) : 1.0f;
      facing[i] = std::clamp(normal.dot(to_camera), 0.0f, 1.0f);
      const Vector3f colour = Map<const Vector3f>(surfaces.colours + 4 * t);
      Map<Vector3f>(light + 3 * i) = light_of(colour, normal, to_camera, share, lamps);
    }
  });
}

void lay_over(float* picture, const std::int64_t* pixels, const float* opacities, const float* light, std::int64_t n) {
  for (std::int64_t i = 0; i < n; ++i) {
    float* under = picture + 3 * pixels[i];
    for (int k = 0; k < 3; ++k) under[k] += opacities[i] * (light[3 * i + k] - under[k]);
  }
}

void develop(const float* picture, int width, int height, int samples, std::uint8_t* colours, int threads) {
  const std::int64_t stride = 3 * static_cast<std::int64_t>(width) * samples;
  const float share = 1.0f / static_cast<float>(samples * samples);
  parallel_for(threads, height, [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t row = first; row < last; ++row)
      for (int column = 0; column < width; ++column) {
        const float* corner = picture + row * samples * stride + 3 * static_cast<std::int64_t>(column) * samples;
        for (int k = 0; k < 3; ++k) {
          float sum = 0.0f;
          for (int i = 0; i < samples; ++i)
            for (int j = 0; j < samples; ++j) sum += corner[i * stride + 3 * j + k];
          colours[3 * (row * width + column) + k] = screen_colour(sum * share);
        }
      }
  });
}

void enlarge(const float* from, int from_width, int from_height, int channels, float* to, int width, int height,
             int threads) {
  /// The places before and after a pixel's middle, and the share of the second.
  const auto between = [](int pixel, int size, int from_size, int& before, int& after) {
    const double place = (pixel + 0.5) * from_size / size - 0.5;
    before = std::clamp(static_cast<int>(std::floor(place)), 0, from_size - 1);
    after = std::min(before + 1, from_size - 1);
    return static_cast<float>(std::clamp(place - before, 0.0, 1.0));
  };
  parallel_for(threads, height, [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t row = first; row < last; ++row) {
      int above, below, left, right;
      const float down = between(static_cast<int>(row), height, from_height, above, below);
      const float* upper = from + static_cast<std::int64_t>(above) * from_width * channels;
      const float* lower = from + static_cast<std::int64_t>(below) * from_width * channels;
      for (int column = 0; column < width; ++column) {
        const float across = between(column, width, from_width, left, right);
        float* out = to + (row * width + column) * channels;
        for (int k = 0; k < channels; ++k) {
          const int a = left * channels + k, b = right * channels + k;
          const float first_row = upper[a] + across * (upper[b] - upper[a]);
          const float second_row = lower[a] + across * (lower[b] - lower[a]);
          out[k] = first_row + down * (second_row - first_row);
        }
      }
    }
  });
}

void blur(const float* from, int width, int height, double sigma, float* to, int threads) {
  const std::vector<float> weights = gauss(sigma);
  const int reach = static_cast<int>(weights.size()) - 1;
  // Along the columns: each row is a sum of rows.
  std::vector<float> between(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  parallel_for(threads, height, [&](int, std::int64_t first, std::int64_t last) {
    for (std::int64_t row = first; row < last; ++row) {
      float* out = between.data() + row * width;
      for (int i = -reach; i <= reach; ++i) {
        const float* other = from + static_cast<std::int64_t>(mirrored(static_cast<int>(row) + i, height)) * width;
        const float weight = weights[static_cast<std::size_t>(std::abs(i))];
        for (int x = 0; x < width; ++x) out[x] += weight * other[x];
      }
    }
  });
  parallel_for(threads, height, [&](int, std::int64_t first, std::int64_t last) {
    std::vector<float> padded(static_cast<std::size_t>(width + 2 * reach));
    for (std::int64_t row = first; row < last; ++row) {
      const float* line = between.data() + row * width;
      for (int x = -reach; x < width + reach; ++x)
        padded[static_cast<std::size_t>(x + reach)] = line[mirrored(x, width)];
      blur_row(padded.data(), width, weights, to + row * width);
    }
  });
}

}  // namespace graspatlas
