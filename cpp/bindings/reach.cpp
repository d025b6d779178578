#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "bindings.hpp"
#include "graspatlas/collision/collision_batch.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"
#include "graspatlas/reach/reach_batch.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

constexpr py::ssize_t kTargetsForThreads = 16;  // fewer are done before other threads have started

/// Poses [n x 4 x 4], checked for their shape and numbers.
std::vector<Placement> placements_from(const DoubleArray& poses) {
  if (poses.ndim() != 3 || poses.shape(1) != 4 || poses.shape(2) != 4)
    throw Error("poses must have the shape [n, 4, 4]");
  using Row4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  std::vector<Placement> out;
  for (py::ssize_t i = 0; i < poses.shape(0); ++i) {
    const Eigen::Map<const Row4> T(poses.data(i, 0, 0));
    if (!T.allFinite()) throw Error("poses must hold finite numbers; see pose " + std::to_string(i));
    out.push_back({T.topLeftCorner<3, 3>(), T.topRightCorner<3, 1>()});
  }
  return out;
}

std::shared_ptr<ReachBatch> make_reach_batch(const Model& model, int joint, const Eigen::Matrix4d& frame,
                                             const std::vector<double>& lower, const std::vector<double>& upper,
                                             const CollisionBatch& scene, const std::vector<int>& arm_at,
                                             const std::vector<int>& hand_at, int seeds, int postures) {
  const Placement in_joint{frame.topLeftCorner<3, 3>(), frame.topRightCorner<3, 1>()};
  return std::make_shared<ReachBatch>(
      ReachScene{{model, joint, in_joint, lower, upper}, scene.shared_scene(), arm_at, hand_at, seeds, postures});
}

ArrayTable solve(ReachBatch& batch, const DoubleArray& targets, const DoubleArray& hand) {
  const std::vector<Placement> placements = placements_from(targets);
  const py::ssize_t n = targets.shape(0);
  if (hand.ndim() != 2 || hand.shape(0) != n || hand.shape(1) != batch.hand_size())
    throw Error("hand must have the shape [targets, " + std::to_string(batch.hand_size()) + "]");
  for (py::ssize_t i = 0; i < hand.size(); ++i)
    if (!std::isfinite(hand.data()[i])) throw Error("hand must hold finite numbers");
  std::vector<Reached> reached(static_cast<std::size_t>(n));
  py::array_t<double> q = matrix<double>(n, batch.arm_size());
  double* to = q.mutable_data();
  const double* postures = hand.data();
  bool interrupted = false;
  {
    py::gil_scoped_release release;
    batch.solve(n < kTargetsForThreads ? 1 : available_threads(), placements.data(), postures, n, to, reached.data(),
                [&interrupted] {
                  py::gil_scoped_acquire acquire;
                  interrupted = PyErr_CheckSignals() != 0;
                  return !interrupted;
                });
  }
  if (interrupted) throw py::error_already_set();
  py::array_t<int> statuses(n), pairs(n);
  for (py::ssize_t i = 0; i < n; ++i) {
    statuses.mutable_at(i) = static_cast<int>(reached[static_cast<std::size_t>(i)].status);
    pairs.mutable_at(i) = reached[static_cast<std::size_t>(i)].pair;
  }
  ArrayTable out;
  out["q"] = q;
  out["statuses"] = statuses;
  out["pairs"] = pairs;
  return out;
}

}  // namespace

void bind_reach(py::module_& module) {
  py::class_<ReachBatch, std::shared_ptr<ReachBatch>>(
      module, "ReachBatch", "An arm with a hand that looks for its postures; safe to call from any number of threads.")
      .def(py::init(&make_reach_batch), py::arg("model"), py::arg("joint"), py::arg("frame"), py::arg("lower"),
           py::arg("upper"), py::arg("scene"), py::arg("arm_at"), py::arg("hand_at"), py::arg("seeds"),
           py::arg("postures"),
           "From the arm alone, the joint that carries its frame, the frame in it [4 x 4], the limits [nq], the "
           "collisions of arm and hand, and where their numbers stand there; see reach_batch.hpp.")
      .def("solve", &solve, py::arg("targets"), py::arg("hand"),
           "Postures q [n x nq] that bring the frame to targets [n x 4 x 4] with the hand at its postures [n x hand], "
           "NaN where none was found; statuses [n] (0 found, 1 no posture, 2 all hit something) and, of the latter, "
           "the pairs of shapes that hit.");
}

}  // namespace graspatlas
