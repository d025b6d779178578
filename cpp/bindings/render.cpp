#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"
#include "graspatlas/render/corner_normals.hpp"
#include "graspatlas/render/raster.hpp"
#include "graspatlas/render/shading.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using LongArray = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using Shape = std::vector<py::ssize_t>;

/// An Error unless an array has this shape; -1 is any length.
void check_shape(const py::array& array, const Shape& shape, const char* what) {
  bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t i = 0; fits && i < shape.size(); ++i)
    fits = shape[i] < 0 || array.shape(static_cast<py::ssize_t>(i)) == shape[i];
  if (fits) return;
  std::string wanted;
  for (const auto length : shape) wanted += (wanted.empty() ? "" : ", ") + (length < 0 ? "n" : std::to_string(length));
  throw Error(std::string(what) + " must have the shape [" + wanted + "]");
}

void check_size(int width, int height) {
  if (width < 1 || height < 1) throw Error("a picture needs at least one pixel each way");
}

void check_below(const LongArray& numbers, std::int64_t count, const char* what) {
  for (py::ssize_t i = 0; i < numbers.size(); ++i)
    if (numbers.data()[i] < 0 || numbers.data()[i] >= count)
      throw Error(std::string(what) + " must be below " + std::to_string(count));
}

ArrayTable table_of(const std::vector<Fragment>& fragments) {
  const auto n = static_cast<py::ssize_t>(fragments.size());
  py::array_t<std::int64_t> pixels(n), triangles(n);
  py::array_t<float> weights = matrix<float>(n, 3), nearness(n);
  for (py::ssize_t i = 0; i < n; ++i) {
    const Fragment& fragment = fragments[static_cast<std::size_t>(i)];
    pixels.mutable_data()[i] = fragment.pixel;
    triangles.mutable_data()[i] = fragment.triangle;
    std::copy(fragment.weights.begin(), fragment.weights.end(), weights.mutable_data() + 3 * i);
    nearness.mutable_data()[i] = fragment.nearness;
  }
  ArrayTable out;
  out["pixels"] = pixels;
  out["triangles"] = triangles;
  out["weights"] = weights;
  out["nearness"] = nearness;
  return out;
}

ArrayTable nearest_fragments(const DoubleArray& corners, int width, int height) {
  check_shape(corners, {-1, 3, 3}, "corners");
  check_size(width, height);
  std::vector<Fragment> found;
  {
    py::gil_scoped_release release;
    found = Raster(corners.data(), corners.shape(0), width, height).nearest(available_threads());
  }
  return table_of(found);
}

ArrayTable fragments_in_front(const DoubleArray& corners, int width, int height, const FloatArray& nearness) {
  check_shape(corners, {-1, 3, 3}, "corners");
  check_size(width, height);
  check_shape(nearness, {static_cast<py::ssize_t>(width) * height}, "nearness");
  std::vector<Fragment> found;
  {
    py::gil_scoped_release release;
    found = Raster(corners.data(), corners.shape(0), width, height).in_front_of(nearness.data(), available_threads());
  }
  return table_of(found);
}

using LampTuple = std::pair<Eigen::Vector3f, float>;
/// axes [3 x 3], origin [3], size of a pixel, depths [h x w]; see ShadowMap.
using ShadowTuple = std::tuple<Eigen::Matrix3d, Eigen::Vector3d, double, FloatArray>;

std::pair<py::array_t<float>, py::array_t<float>> shaded(const FloatArray& points, const FloatArray& normals,
                                                         const FloatArray& nearness, const FloatArray& colours,
                                                         const LongArray& triangles, const FloatArray& weights,
                                                         const Eigen::Vector3f& camera,
                                                         const std::vector<LampTuple>& lamps,
                                                         const std::optional<ShadowTuple>& shadow) {
  const py::ssize_t f = points.ndim() > 0 ? points.shape(0) : 0, n = triangles.size();
  check_shape(points, {f, 3, 3}, "points");
  check_shape(normals, {f, 3, 3}, "normals");
  check_shape(nearness, {f, 3}, "nearness");
  check_shape(colours, {f, 4}, "colours");
  check_shape(triangles, {n}, "triangles");
  check_shape(weights, {n, 3}, "weights");
  check_below(triangles, f, "triangles");
  std::vector<Lamp> lit_by;
  for (const auto& [direction, intensity] : lamps) lit_by.push_back({direction, intensity});
  ShadowMap map{};
  if (shadow) {
    const auto& [axes, origin, pixel, depths] = *shadow;
    check_shape(depths, {-1, -1}, "depths");
    map = {axes, origin, pixel, static_cast<int>(depths.shape(1)), static_cast<int>(depths.shape(0)), depths.data()};
    check_size(map.width, map.height);
  }
  py::array_t<float> light = matrix<float>(n, 3), facing(n);
  const Surfaces surfaces{points.data(), normals.data(), nearness.data(), colours.data()};
  float *to_light = light.mutable_data(), *to_facing = facing.mutable_data();
  {
    py::gil_scoped_release release;
    shade(surfaces, triangles.data(), weights.data(), n, camera, lit_by, shadow ? &map : nullptr, to_light, to_facing,
          available_threads());
  }
  return {light, facing};
}

void laid_over(py::array_t<float, py::array::c_style>& picture, const LongArray& pixels, const FloatArray& opacities,
               const FloatArray& light) {
  const py::ssize_t n = pixels.size();
  check_shape(picture, {-1, 3}, "picture");
  check_shape(pixels, {n}, "pixels");
  check_shape(opacities, {n}, "opacities");
  check_shape(light, {n, 3}, "light");
  check_below(pixels, picture.shape(0), "pixels");
  lay_over(picture.mutable_data(), pixels.data(), opacities.data(), light.data(), n);
}

py::array_t<std::uint8_t> developed(const FloatArray& picture, int width, int height, int samples) {
  check_size(width, height);
  if (samples < 1) throw Error("a pixel needs at least one sample");
  check_shape(picture, {static_cast<py::ssize_t>(width) * height * samples * samples, 3}, "picture");
  py::array_t<std::uint8_t> out(Shape{height, width, 3});
  std::uint8_t* to = out.mutable_data();
  py::gil_scoped_release release;
  develop(picture.data(), width, height, samples, to, available_threads());
  return out;
}

py::array_t<float> enlarged(const FloatArray& picture, int width, int height) {
  check_size(width, height);
  check_shape(picture, {-1, -1, -1}, "picture");
  const auto h = static_cast<int>(picture.shape(0)), w = static_cast<int>(picture.shape(1));
  const auto channels = static_cast<int>(picture.shape(2));
  check_size(w, h);
  py::array_t<float> out(Shape{height, width, channels});
  float* to = out.mutable_data();
  py::gil_scoped_release release;
  enlarge(picture.data(), w, h, channels, to, width, height, available_threads());
  return out;
}

py::array_t<float> blurred(const FloatArray& picture, double sigma) {
  check_shape(picture, {-1, -1}, "picture");
  if (!(sigma > 0.0 && sigma < 1e4)) throw Error("sigma must be positive and below 10000 pixels");
  const auto h = static_cast<int>(picture.shape(0)), w = static_cast<int>(picture.shape(1));
  check_size(w, h);
  py::array_t<float> out = matrix<float>(h, w);
  float* to = out.mutable_data();
  py::gil_scoped_release release;
  blur(picture.data(), w, h, sigma, to, available_threads());
  return out;
}

py::array_t<double> normals_at_corners(const DoubleArray& points, const LongArray& triangles, double crease) {
  check_shape(points, {-1, 3}, "points");
  check_shape(triangles, {-1, 3}, "triangles");
  check_below(triangles, points.shape(0), "triangles");
  std::vector<Eigen::Vector3d> places(static_cast<std::size_t>(points.shape(0)));
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = Eigen::Map<const Eigen::Vector3d>(points.data() + 3 * i);
  std::vector<std::array<int, 3>> faces(static_cast<std::size_t>(triangles.shape(0)));
  for (std::size_t t = 0; t < faces.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) faces[t][k] = static_cast<int>(triangles.data()[3 * t + k]);
  std::vector<Eigen::Vector3d> normals;
  {
    py::gil_scoped_release release;
    normals = corner_normals(places, faces, crease);
  }
  py::array_t<double> out(Shape{triangles.shape(0), 3, 3});
  if (!normals.empty()) std::memcpy(out.mutable_data(), normals.data(), normals.size() * sizeof(Eigen::Vector3d));
  return out;
}

}  // namespace

void bind_render(py::module_& module) {
  module.def("nearest_fragments", &nearest_fragments, py::arg("corners"), py::arg("width"), py::arg("height"),
             "What is seen of triangles [f x 3 x 3] at each pixel of a picture; see raster.hpp.");
  module.def("fragments_in_front", &fragments_in_front, py::arg("corners"), py::arg("width"), py::arg("height"),
             py::arg("nearness"), "All of triangles that is nearer than a picture's pixels; see raster.hpp.");
  module.def("shaded", &shaded, py::arg("points"), py::arg("normals"), py::arg("nearness"), py::arg("colours"),
             py::arg("triangles"), py::arg("weights"), py::arg("camera"), py::arg("lamps"), py::arg("shadow"),
             "Light [n x 3] of fragments, and how squarely they face the camera [n]; see shading.hpp.");
  module.def("lay_over", &laid_over, py::arg("picture").noconvert(), py::arg("pixels"), py::arg("opacities"),
             py::arg("light"), "Lays fragments over a picture [pixels x 3], which is changed; see shading.hpp.");
  module.def("developed", &developed, py::arg("picture"), py::arg("width"), py::arg("height"), py::arg("samples"),
             "Screen colours [h x w x 3] of linear light; see shading.hpp.");
  module.def("enlarged", &enlarged, py::arg("picture"), py::arg("width"), py::arg("height"),
             "A picture [h x w x channels] at another size, bilinear.");
  module.def("blurred", &blurred, py::arg("picture"), py::arg("sigma"),
             "A picture [h x w] blurred by a Gauss function of so many pixels, mirrored at its edges.");
  module.def("corner_normals", &normals_at_corners, py::arg("points"), py::arg("triangles"), py::arg("crease"),
             "Unit normals at the corners of triangles [t x 3 x 3]; see corner_normals.hpp.");
}

}  // namespace graspatlas
