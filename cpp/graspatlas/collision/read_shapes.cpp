#include <coal/BVH/BVH_model.h>
#include <coal/mesh_loader/assimp.h>
#include <coal/mesh_loader/loader.h>
#include <coal/shape/convex.h>
#include <coal/shape/geometric_shapes.h>

#include <map>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <tuple>

#include "graspatlas/collision/collision_shape.hpp"
#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

/// Reads the triangles of each mesh once, without the tree of boxes over them that only collisions need.
class TriangleLoader : public coal::MeshLoader {
 public:
  coal::BVHModelPtr_t load(const std::string& filename, const coal::Vec3s& scale) override {
    coal::BVHModelPtr_t& model = read_[{filename, scale.x(), scale.y(), scale.z()}];
    if (!model) model = read(filename, scale);
    return model;
  }

 private:
  static coal::BVHModelPtr_t read(const std::string& filename, const coal::Vec3s& scale) {
    coal::internal::Loader file;
    file.load(filename);
    coal::internal::TriangleAndVertices mesh;
    coal::internal::buildMesh(scale, file.scene, 0, mesh);
    auto model = std::make_shared<coal::BVHModel<coal::OBBRSS>>();
    model->beginModel();
    model->addSubModel(mesh.vertices_, mesh.triangles_);
    return model;
  }

  std::map<std::tuple<std::string, double, double, double>, coal::BVHModelPtr_t> read_;
};

void take_mesh(const coal::BVHModelBase& mesh, CollisionShape& shape) {
  shape.kind = ShapeKind::mesh;
  shape.points.assign(mesh.vertices->begin(), mesh.vertices->begin() + mesh.num_vertices);
  shape.triangles.reserve(mesh.num_tris);
  for (unsigned int t = 0; t < mesh.num_tris; ++t) {
    const coal::Triangle& triangle = (*mesh.tri_indices)[t];
    shape.triangles.push_back(
        {static_cast<int>(triangle[0]), static_cast<int>(triangle[1]), static_cast<int>(triangle[2])});
  }
}

/// Kind and sizes of one of coal's geometries.
void take_geometry(const coal::CollisionGeometry& geometry, LinkShape& shape) {
  if (const auto* sphere = dynamic_cast<const coal::Sphere*>(&geometry)) {
    shape.kind = ShapeKind::sphere;
    shape.sizes = {sphere->radius, 0.0, 0.0};
  } else if (const auto* capsule = dynamic_cast<const coal::Capsule*>(&geometry)) {
    shape.kind = ShapeKind::capsule;
    shape.sizes = {capsule->radius, 2.0 * capsule->halfLength, 0.0};
  } else if (const auto* cylinder = dynamic_cast<const coal::Cylinder*>(&geometry)) {
    shape.kind = ShapeKind::cylinder;
    shape.sizes = {cylinder->radius, 2.0 * cylinder->halfLength, 0.0};
  } else if (const auto* box = dynamic_cast<const coal::Box*>(&geometry)) {
    shape.kind = ShapeKind::box;
    shape.sizes = 2.0 * box->halfSide;
  } else if (const auto* convex = dynamic_cast<const coal::ConvexBase*>(&geometry)) {
    shape.kind = ShapeKind::convex;
    shape.points.assign(convex->points->begin(), convex->points->begin() + convex->num_points);
  } else if (const auto* mesh = dynamic_cast<const coal::BVHModelBase*>(&geometry)) {
    take_mesh(*mesh, shape);
  } else {
    throw Error("the shape '" + shape.name + "' is no sphere, capsule, cylinder, box or mesh");
  }
}

/// What a message of coal's or Pinocchio's says, without the place in their sources.
std::string reason_of(const std::exception& error) {
  const std::string text = error.what(), mark = "message: ";
  const auto at = text.rfind(mark);
  return at == std::string::npos ? text : text.substr(at + mark.size());
}

/// A URDF's joints and frames, and its geometry of a kind.
struct Tree {
  pinocchio::Model model;
  pinocchio::GeometryModel geometry;
};

Tree read_tree(const std::string& tree, const std::string& urdf, const std::vector<std::string>& package_dirs,
               pinocchio::GeometryType kind) {
  Tree out;
  try {
    pinocchio::urdf::buildModelFromXML(tree, out.model);
    pinocchio::urdf::buildGeom(out.model, std::istringstream(urdf), kind, out.geometry, package_dirs,
                               std::make_shared<TriangleLoader>());
  } catch (const std::exception& error) {
    throw Error(reason_of(error));
  }
  return out;
}

void take_object(const pinocchio::GeometryObject& object, const pinocchio::Model& model, LinkShape& shape) {
  shape.name = object.name;
  shape.link = model.frames[object.parentFrame].name;
  shape.joint = static_cast<int>(object.parentJoint);
  shape.parent_joint = static_cast<int>(model.parents[object.parentJoint]);
  shape.placement = {object.placement.rotation(), object.placement.translation()};
  take_geometry(*object.geometry, shape);
}

}  // namespace

std::vector<LinkShape> read_collision_shapes(const std::string& tree, const std::string& urdf,
                                             const std::vector<std::string>& package_dirs) {
  const Tree read = read_tree(tree, urdf, package_dirs, pinocchio::COLLISION);
  std::vector<LinkShape> shapes(read.geometry.geometryObjects.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) take_object(read.geometry.geometryObjects[i], read.model, shapes[i]);
  return shapes;
}

std::vector<VisualShape> read_visual_shapes(const std::string& tree, const std::string& urdf,
                                            const std::vector<std::string>& package_dirs) {
  Tree read = read_tree(tree, urdf, package_dirs, pinocchio::VISUAL);
  if (read.geometry.geometryObjects.empty()) read = read_tree(tree, urdf, package_dirs, pinocchio::COLLISION);
  std::vector<VisualShape> shapes(read.geometry.geometryObjects.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const pinocchio::GeometryObject& object = read.geometry.geometryObjects[i];
    take_object(object, read.model, shapes[i]);
    const pinocchio::SE3 in_link = read.model.frames[object.parentFrame].placement.actInv(object.placement);
    shapes[i].in_link = {in_link.rotation(), in_link.translation()};
    pinocchio::SE3 at_rest = object.placement;
    for (auto joint = object.parentJoint; joint > 0; joint = read.model.parents[joint])
      at_rest = read.model.jointPlacements[joint] * at_rest;
    shapes[i].at_rest = {at_rest.rotation(), at_rest.translation()};
    shapes[i].colour = object.meshColor;
    shapes[i].file = object.meshPath;
    shapes[i].scale = object.meshScale;
  }
  return shapes;
}

}  // namespace graspatlas
