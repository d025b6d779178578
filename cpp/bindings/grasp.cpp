#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <Eigen/LU>
#include <map>
#include <optional>
#include <string>

#include "bindings.hpp"
#include "graspatlas/errors.hpp"
#include "graspatlas/grasp/bspline_patch.hpp"
#include "graspatlas/grasp/derived_patch.hpp"
#include "graspatlas/grasp/grasp_system.hpp"
#include "graspatlas/grasp/round_patch.hpp"
#include "graspatlas/manifold/lease.hpp"

namespace py = pybind11;

namespace graspatlas {

namespace {

Placement placement_from(const Eigen::Matrix4d& T) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if (!(R * R.transpose()).isIdentity(1e-6) || R.determinant() < 0.0 || !T.allFinite())
    throw Error("a placement must be a homogeneous 4x4 matrix with a rotation in its upper left corner");
  return {R, T.topRightCorner<3, 1>()};
}

Eigen::Matrix4d matrix_from(const Placement& placement) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = placement.rotation;
  T.topRightCorner<3, 1>() = placement.translation;
  return T;
}

ParameterUnit unit_from(const std::string& name) {
  if (name == "number") return ParameterUnit::number;
  if (name == "m") return ParameterUnit::length;
  throw Error("the unit of a B-spline's parameters is 'number' or 'm', not '" + name + "'");
}

const char* name_of(ParameterUnit unit) { return unit == ParameterUnit::length ? "m" : "number"; }

/// For Python, whose objects are not const: it cannot change a patch.
std::shared_ptr<Patch> shared(const std::shared_ptr<const Patch>& patch) {
  return std::const_pointer_cast<Patch>(patch);
}

using Stack = py::array_t<double>;

Stack stack(std::vector<py::ssize_t> shape) { return Stack(std::move(shape)); }

constexpr py::ssize_t kGraspsBetweenSignals = 1024;  // so that Ctrl-C is heard

ArrayTable grasp_arrays(GraspSystem& shared, const DoubleArray& X) {
  const Lease own(shared);
  GraspSystem& system = *own;
  const py::ssize_t n = checked_rows(X, system.configuration_size()), m = system.contact_count(),
                    dof = system.object_dof();
  const py::ssize_t actuated = system.actuated_count();
  Stack hand_points = stack({n, m, 3}), object_points = stack({n, m, 3}), hand_normals = stack({n, m, 3}),
        object_normals = stack({n, m, 3}), J = stack({n, 3 * m, actuated}), G = stack({n, dof, 3 * m}),
        T = stack({n, 4, 4});
  std::vector<ContactPoint> contacts(m);
  RowMatrix J_one(3 * m, actuated), Gt_one(3 * m, dof);
  using Map3 = Eigen::Map<Eigen::Vector3d>;
  for (py::ssize_t i = 0; i < n; ++i) {
    if (i % kGraspsBetweenSignals == kGraspsBetweenSignals - 1 && PyErr_CheckSignals() != 0)
      throw py::error_already_set();
    const double* x = X.data(i, 0);
    system.contact_points(x, contacts.data());
    for (py::ssize_t c = 0; c < m; ++c) {
      Map3(hand_points.mutable_data(i, c, 0)) = contacts[c].hand_point;
      Map3(object_points.mutable_data(i, c, 0)) = contacts[c].object_point;
      Map3(hand_normals.mutable_data(i, c, 0)) = contacts[c].hand_normal;
      Map3(object_normals.mutable_data(i, c, 0)) = contacts[c].object_normal;
    }
    const int joint = system.model().object_joint_index();
    using Row4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
    Eigen::Map<Row4>(T.mutable_data(i, 0, 0)) =
        joint < 0 ? Eigen::Matrix4d::Identity() : matrix_from(system.model().placement(joint));
    if (dof == 0) continue;
    system.grasp_matrices(x, J_one, Gt_one);
    Eigen::Map<RowMatrix>(J.mutable_data(i, 0, 0), 3 * m, actuated) = J_one;
    Eigen::Map<RowMatrix>(G.mutable_data(i, 0, 0), dof, 3 * m) = Gt_one.transpose();
  }
  ArrayTable out;
  out["T_palm_object"] = T;
  out["hand_points"] = hand_points;
  out["object_points"] = object_points;
  out["hand_normals"] = hand_normals;
  out["object_normals"] = object_normals;
  out["J"] = J;
  out["G"] = G;
  return out;
}

void bind_model(py::module_& module) {
  py::class_<JointInfo>(module, "JointInfo", "A joint's name and its places in q and v.")
      .def_readonly("name", &JointInfo::name)
      .def_readonly("q_index", &JointInfo::q_index)
      .def_readonly("q_size", &JointInfo::q_size)
      .def_readonly("v_index", &JointInfo::v_index)
      .def_readonly("v_size", &JointInfo::v_size)
      .def_readonly("prismatic", &JointInfo::prismatic);
  py::class_<Model, py::smart_holder>(module, "Model", "Hand and object as one kinematic tree.")
      .def(py::init([](const std::string& urdf, const std::string& object) {
             return std::make_unique<Model>(urdf, ObjectJoint::from_name(object));
           }),
           py::arg("urdf"), py::arg("object_joint"))
      .def("__reduce__",
           by_arguments<Model>([](const Model& m) { return py::make_tuple(m.urdf(), m.object_joint().name()); }))
      .def_property_readonly("q_size", &Model::q_size, "Numbers in q.")
      .def_property_readonly("v_size", &Model::v_size, "Numbers in a velocity.")
      .def_property_readonly("hand_q_size", &Model::hand_q_size, "Numbers in the hand's part of q.")
      .def_property_readonly("hand_v_size", &Model::hand_v_size, "Numbers in the hand's part of a velocity.")
      .def_property_readonly("hand_joints", &Model::hand_joints, "Moving joints of the hand, in the order of q.")
      .def_property_readonly("lower_limits", &Model::lower_limits, "Lower joint limits [hand_q_size].")
      .def_property_readonly("upper_limits", &Model::upper_limits, "Upper joint limits [hand_q_size].")
      .def_property_readonly("neutral", &Model::neutral, "Neutral configuration [q_size].")
      .def_property_readonly(
          "frames",
          [](const Model& model) {
            std::map<std::string, std::pair<int, Eigen::Matrix4d>> out;
            for (const FrameInfo& frame : model.hand_frames())
              out[frame.name] = {frame.joint, matrix_from(frame.placement)};
            return out;
          },
          "Frame name -> (joint, placement of the frame in the joint [4 x 4]).")
      .def_property_readonly("object_joint", &Model::object_joint_index,
                             "Joint that carries the object; -1 without one.")
      .def(
          "frame_placements",
          [](Model& model, const DoubleArray& q) {
            model.update(checked_vector(q, model.q_size(), "q"), false);
            std::map<std::string, Eigen::Matrix4d> out;
            for (const FrameInfo& frame : model.hand_frames())
              out[frame.name] = matrix_from(model.placement(frame.joint)) * matrix_from(frame.placement);
            return out;
          },
          py::arg("q"), "Frame name -> T_world_frame [4 x 4] at q.");
}

using Cubics = Eigen::Matrix<double, Eigen::Dynamic, 4>;
using Points3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;

void bind_patches(py::module_& module) {
  py::class_<Patch, py::smart_holder>(module, "Patch", "A parametrised piece of surface.")
      .def(
          "evaluate",
          [](const Patch& patch, double u, double v) {
            PatchPoint p;
            patch.evaluate(u, v, p);
            std::map<std::string, Eigen::Vector3d> out;
            out["o"] = p.o, out["m"] = p.m, out["a"] = p.a, out["b"] = p.b;
            out["o_u"] = p.o_u, out["m_u"] = p.m_u, out["a_u"] = p.a_u, out["b_u"] = p.b_u;
            out["o_v"] = p.o_v, out["m_v"] = p.m_v, out["a_v"] = p.a_v, out["b_v"] = p.b_v;
            return out;
          },
          py::arg("u"), py::arg("v"), "Point o, normal m, tangents a and b, and their derivatives by u and v.");
  py::class_<PlanePatch, Patch, py::smart_holder>(module, "PlanePatch", "The x-z plane of a placement, normal y.")
      .def(py::init([](const Eigen::Matrix4d& T) { return std::make_unique<PlanePatch>(placement_from(T)); }),
           py::arg("T"))
      .def("__reduce__",
           by_arguments<PlanePatch>([](const PlanePatch& p) { return py::make_tuple(matrix_from(p.placement())); }));
  py::class_<RevolutionPatch, Patch, py::smart_holder>(module, "RevolutionPatch",
                                                       "A surface of revolution about y of a placement.")
      .def(py::init([](const Eigen::Matrix4d& T, const std::vector<double>& breaks, const Cubics& coefficients) {
             return std::make_unique<RevolutionPatch>(placement_from(T), breaks, coefficients);
           }),
           py::arg("T"), py::arg("breaks"), py::arg("coefficients"))
      .def("__reduce__", by_arguments<RevolutionPatch>([](const RevolutionPatch& p) {
             return py::make_tuple(matrix_from(p.placement()), p.outline().breaks(), p.outline().coefficients());
           }));
  py::class_<TorusPatch, Patch, py::smart_holder>(module, "TorusPatch",
                                                  "A torus about y of a placement; a sphere with a ring of radius 0.")
      .def(py::init([](const Eigen::Matrix4d& T, double ring, double tube) {
             return std::make_unique<TorusPatch>(placement_from(T), ring, tube);
           }),
           py::arg("T"), py::arg("ring_radius"), py::arg("tube_radius"))
      .def("__reduce__", by_arguments<TorusPatch>([](const TorusPatch& p) {
             return py::make_tuple(matrix_from(p.placement()), p.ring_radius(), p.tube_radius());
           }));
  py::class_<EllipsoidPatch, Patch, py::smart_holder>(module, "EllipsoidPatch",
                                                      "An ellipsoid with its semi-axes along x, y, z of a placement.")
      .def(py::init([](const Eigen::Matrix4d& T, const Eigen::Vector3d& semi_axes) {
             return std::make_unique<EllipsoidPatch>(placement_from(T), semi_axes);
           }),
           py::arg("T"), py::arg("semi_axes"))
      .def("__reduce__", by_arguments<EllipsoidPatch>([](const EllipsoidPatch& p) {
             return py::make_tuple(matrix_from(p.placement()), p.semi_axes());
           }));
  py::class_<BSplinePatch, Patch, py::smart_holder>(module, "BSplinePatch", "A tensor-product B-spline.")
      .def(py::init([](std::pair<int, int> degrees, const std::vector<double>& u_knots,
                       const std::vector<double>& v_knots, const Points3& control_points, const std::string& unit) {
             return std::make_unique<BSplinePatch>(BSplineBasis(degrees.first, u_knots),
                                                   BSplineBasis(degrees.second, v_knots), control_points,
                                                   unit_from(unit));
           }),
           py::arg("degrees"), py::arg("u_knots"), py::arg("v_knots"), py::arg("control_points"), py::arg("unit"))
      .def("__reduce__", by_arguments<BSplinePatch>([](const BSplinePatch& p) {
             return py::make_tuple(py::make_tuple(p.u().degree(), p.v().degree()), p.u().knots(), p.v().knots(),
                                   Points3(p.control_points().transpose()), name_of(p.u_unit()));
           }));
  py::class_<FlippedPatch, Patch, py::smart_holder>(module, "FlippedPatch", "A patch with the opposite normal.")
      .def(py::init([](std::shared_ptr<Patch> patch) { return std::make_unique<FlippedPatch>(std::move(patch)); }),
           py::arg("patch"))
      .def("__reduce__",
           by_arguments<FlippedPatch>([](const FlippedPatch& p) { return py::make_tuple(shared(p.patch())); }));
  py::class_<CurvePatch, Patch, py::smart_holder>(module, "CurvePatch", "A curve u(s), v(s) on a patch.")
      .def(py::init(
               [](std::shared_ptr<Patch> patch, const std::vector<double>& breaks, const Cubics& u, const Cubics& v) {
                 return std::make_unique<CurvePatch>(std::move(patch), PiecewiseCubic(breaks, u, "a curve"),
                                                     PiecewiseCubic(breaks, v, "a curve"));
               }),
           py::arg("patch"), py::arg("breaks"), py::arg("u"), py::arg("v"))
      .def("__reduce__", by_arguments<CurvePatch>([](const CurvePatch& p) {
             return py::make_tuple(shared(p.patch()), p.u().breaks(), p.u().coefficients(), p.v().coefficients());
           }));
  py::class_<PatchParameter>(module, "PatchParameter", "One parameter of a patch: frozen, or an unknown.")
      .def(py::init<bool, double, bool, double, double>(), py::arg("free"), py::arg("value"), py::arg("periodic"),
           py::arg("lower"), py::arg("upper"))
      .def("__reduce__", by_arguments<PatchParameter>([](const PatchParameter& p) {
             return py::make_tuple(p.free, p.value, p.periodic, p.lower, p.upper);
           }));
  py::class_<ContactSide>(module, "ContactSide", "A patch on a joint of the model.")
      .def(py::init(
               [](int joint, const Eigen::Matrix4d& T, std::shared_ptr<Patch> patch, const PatchParameter& u,
                  const PatchParameter& v) { return ContactSide{joint, placement_from(T), std::move(patch), u, v}; }),
           py::arg("joint"), py::arg("T_joint_frame"), py::arg("patch"), py::arg("u"), py::arg("v"))
      .def("__reduce__", by_arguments<ContactSide>([](const ContactSide& c) {
             return py::make_tuple(c.joint, matrix_from(c.frame), shared(c.patch), c.u, c.v);
           }));
}

/// The arguments of a system's constructor.
py::tuple arguments_of(const GraspSystem& system) {
  py::list sides;
  for (const Contact& contact : system.contacts()) sides.append(py::make_tuple(contact.hand, contact.object));
  return py::make_tuple(std::make_shared<Model>(system.model()), sides, Matrix(system.motions()), system.length_scale(),
                        system.lower_limits(), system.upper_limits(), Matrix(system.transmission()));
}

}  // namespace

void bind_grasp(py::module_& module) {
  bind_model(module);
  bind_patches(module);
  py::class_<GraspSystem, System, py::smart_holder>(module, "GraspSystem",
                                                    "The relevant grasps R of a hand and an object.")
      .def(py::init([](const std::shared_ptr<Model>& model,
                       const std::vector<std::pair<ContactSide, ContactSide>>& sides, const Matrix& motions,
                       double length_scale, const std::vector<double>& lower, const std::vector<double>& upper,
                       const std::optional<Matrix>& transmission) {
             std::vector<Contact> contacts;
             for (const auto& [hand, object] : sides) contacts.push_back({hand, object});
             const int h = model->hand_v_size();
             // A model of its own: Python may use the other at any time.
             return std::make_unique<GraspSystem>(GraspParts{std::make_shared<Model>(*model), std::move(contacts),
                                                             motions, length_scale, lower, upper,
                                                             transmission.value_or(Matrix::Identity(h, h))});
           }),
           py::arg("model"), py::arg("contacts"), py::arg("motions"), py::arg("length_scale"), py::arg("lower"),
           py::arg("upper"), py::arg("transmission") = py::none())
      .def("__reduce__", by_arguments<GraspSystem>(arguments_of))
      .def_property_readonly("n_contacts", &GraspSystem::contact_count, "Number of contacts.")
      .def_property_readonly("n_parameters", &GraspSystem::parameter_count, "Free patch parameters.")
      .def_property_readonly(
          "hand_q_size", [](const GraspSystem& system) { return system.model().hand_q_size(); },
          "Numbers of a point that are the hand's; they come first.")
      .def_property_readonly("object_dof", &GraspSystem::object_dof, "Degrees of freedom of the object.")
      .def_property_readonly("bound_names", &GraspSystem::bound_names, "Name of each bound, in the order of slack.")
      .def("grasp_arrays", &grasp_arrays, py::arg("X"),
           "For grasps X [n x configuration_size]: T_palm_object, contact points and normals, J and G, as "
           "arrays.");
}

}  // namespace graspatlas
