#include <Eigen/Geometry>
#include <memory>
#include <thread>

#include "graspatlas/collision/collision_batch.hpp"
#include "strain.hpp"

namespace strain {

namespace {

using namespace graspatlas;
using Vector3 = Eigen::Vector3d;

constexpr int kJoints = 4;

// A chain of links; `shapes` spheres, cylinders and boxes on each when it is read as a URDF.
std::string chain_urdf(int shapes) {
  const char* kinds[] = {"<sphere radius='0.006'/>", "<cylinder radius='0.005' length='0.02'/>",
                         "<box size='0.01 0.012 0.02'/>"};
  std::string text = "<robot name='chain'>";
  for (int link = 0; link <= kJoints; ++link) {
    text += "<link name='l" + std::to_string(link) + "'>";
    for (int s = 0; s < shapes; ++s)
      text += "<collision><origin xyz='0.0" + std::to_string(s % 4) + " 0.00" + std::to_string(s % 7) +
              " 0'/><geometry>" + kinds[s % 3] + "</geometry></collision>";
    text += "</link>";
    if (link == 0) continue;
    text += "<joint name='j" + std::to_string(link) + "' type='revolute'><parent link='l" + std::to_string(link - 1) +
            "'/><child link='l" + std::to_string(link) + "'/><origin xyz='0.04 0 0'/><axis xyz='" +
            (link % 2 ? "0 0 1" : "0 1 0") + "'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>";
  }
  return text + "</robot>";
}

std::vector<Vector3> ball_points(int count, double radius) {
  Random random(11);
  std::vector<Vector3> points;
  for (int i = 0; i < count; ++i) points.push_back(radius * Vector3(random.direction(3).data()));
  return points;
}

// One of each kind: a hull of many corners too, and a mesh.
std::vector<CollisionShape> object_shapes(int joint) {
  std::vector<CollisionShape> shapes(6);
  shapes[0].kind = ShapeKind::sphere;
  shapes[1].kind = ShapeKind::capsule;
  shapes[2].kind = ShapeKind::cylinder;
  shapes[3].kind = ShapeKind::box;
  shapes[4].kind = ShapeKind::convex;
  shapes[4].points = ball_points(200, 0.012);
  shapes[5].kind = ShapeKind::mesh;
  shapes[5].points = {{0.0, 0.0, 0.0}, {0.03, 0.0, 0.0}, {0.0, 0.03, 0.0}, {0.0, 0.0, 0.03}};
  shapes[5].triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    shapes[i].name = "object" + std::to_string(i);
    shapes[i].joint = joint;
    shapes[i].sizes = {0.01, 0.02, 0.015};
    shapes[i].placement.translation = {0.01 * static_cast<double>(i), 0.0, 0.0};
  }
  return shapes;
}

// The scene is alone in what it holds: shapes and model that it was made of are gone.
std::shared_ptr<const CollisionScene> scene_of(int shapes_a_link, double required) {
  const std::string urdf = chain_urdf(shapes_a_link);
  const Model model(urdf, ObjectJoint::free_flyer);
  std::vector<CollisionShape> shapes;
  for (const LinkShape& shape : read_collision_shapes(urdf, urdf, {})) shapes.push_back(shape);
  const int in_hand = static_cast<int>(shapes.size());
  require(in_hand == shapes_a_link * (kJoints + 1), "all shapes of the URDF are read");
  for (const CollisionShape& shape : object_shapes(model.object_joint_index())) shapes.push_back(shape);
  std::vector<CollisionPair> pairs;
  for (int i = 0; i < in_hand; ++i)
    for (int j = i + 1; j < static_cast<int>(shapes.size()); ++j)
      if (shapes[i].joint + 1 < shapes[j].joint) {
        const bool mesh = shapes[i].kind == ShapeKind::mesh || shapes[j].kind == ShapeKind::mesh;
        pairs.push_back({i, j, mesh ? std::max(required, 0.0) : required});
      }
  return std::make_shared<const CollisionScene>(model, shapes, pairs);
}

std::vector<double> grasps_of(int count) {
  Random random(5);
  std::vector<double> Q;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < kJoints; ++j) Q.push_back(random.uniform(-2.0, 2.0));
    for (int c = 0; c < 3; ++c) Q.push_back(random.uniform(-0.08, 0.16));
    const auto quaternion = random.direction(4);
    Q.insert(Q.end(), quaternion.begin(), quaternion.end());
  }
  return Q;
}

struct Answers {
  std::vector<int> hits;
  std::vector<double> distances;
};

Answers answers_of(CollisionBatch& batch, int threads, const std::vector<double>& Q) {
  const std::int64_t stride = batch.scene().model().q_size(), count = static_cast<std::int64_t>(Q.size()) / stride;
  const int pairs = static_cast<int>(batch.scene().pairs().size());
  Answers out{std::vector<int>(count), std::vector<double>(count)};
  batch.for_grasps(
      threads, Q.data(), count, stride,
      [&](CollisionSpace& space, std::int64_t row) {
        out.hits[row] = space.first_hit();
        require(space.free() == (out.hits[row] < 0), "free is what has no hit");
        const int pair = out.hits[row] < 0 ? static_cast<int>(row) % pairs : out.hits[row];
        const NearestPoints found = space.nearest(pair);
        out.distances[row] = found.distance;
        require(std::isfinite(found.distance), "distances are numbers");
        if (found.distance > 1e-6) {
          require(std::abs((found.on_second - found.on_first).norm() - found.distance) < 1e-8, "points are that far");
          require(std::abs(found.normal.norm() - 1.0) < 1e-8, "normals are of length one");
        }
        require(space.distance_of(found.on_first, batch.scene().pairs()[pair].first) < 1e-4, "points are on shapes");
      },
      [] { return true; });
  return out;
}

// One scene from several threads at a time, each on several more, again and again.
void many_threads(int shapes_a_link, double required) {
  CollisionBatch batch(scene_of(shapes_a_link, required));
  const std::vector<double> Q = grasps_of(60);
  const Answers expected = answers_of(batch, 1, Q);
  int free = 0;
  for (const int hit : expected.hits) free += hit < 0;
  require(free > 0 && free < static_cast<int>(expected.hits.size()), "some grasps are free and some are not");
  std::vector<std::thread> users;
  std::vector<Answers> found(3);
  for (std::size_t user = 0; user < found.size(); ++user)
    users.emplace_back([&, user] { found[user] = answers_of(batch, 2, Q); });
  for (std::thread& user : users) user.join();
  for (const Answers& one : found)
    require(one.hits == expected.hits && one.distances == expected.distances, "threads change no answer");
}

void wrong_scenes() {
  const std::string urdf = chain_urdf(1);
  const Model model(urdf, ObjectJoint::free_flyer);
  const auto refused = [&](auto change, std::vector<CollisionPair> pairs, const char* part) {
    auto shapes = object_shapes(model.object_joint_index());
    change(shapes);
    refuse([&] { CollisionScene(model, shapes, pairs); }, part);
  };
  const auto as_is = [](auto&) {};
  for (const CollisionPair& pair : {CollisionPair{0, 99, 0.0}, {-1, 0, 0.0}, {2, 2, 0.0}, {0, 1, std::nan("")}})
    refused(as_is, {pair}, "pair");
  refused([](auto& shapes) { shapes[1].joint = 99; }, {}, "joint 99");
  refused([](auto& shapes) { shapes[0].sizes[0] = std::nan(""); }, {}, "object0");
  refused([](auto& shapes) { shapes[3].sizes[2] = -1.0; }, {}, "object3");
  refused([](auto& shapes) { shapes[4].points[7][1] = HUGE_VAL; }, {}, "object4");
  refused([](auto& shapes) { shapes[4].points.resize(3); }, {}, "object4");
  refused([](auto& shapes) { shapes[5].triangles[1][2] = 4; }, {}, "corner 4");
  for (const char* text : {"", "<", "<robot name='r'/>"}) refuse([&] { read_collision_shapes(urdf, text, {}); }, "");
  const std::string missing =
      "<robot name='r'><link name='l0'><collision><geometry><mesh filename='none.stl'/></geometry></collision></link>"
      "</robot>";
  refuse([&] { read_collision_shapes(urdf, missing, {}); }, "none.stl");
}

void hulls() {
  const auto ball = ball_points(200, 1.0);
  for (const double distance : distances_from_hull(ball, ball)) require(distance < 1e-9, "corners are on their hull");
  const std::vector<Vector3> outside = {{3.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  const auto distances = distances_from_hull(outside, {{1, 1, 1}, {1, -1, 1}, {1, 1, -1}, {1, -1, -1}, {-1, 0, 0}});
  require(std::abs(distances[0] - 2.0) < 1e-6 && distances[1] == 0.0, "distances from a pyramid");
}

}  // namespace

void collisions() {
  wrong_scenes();
  hulls();
  many_threads(1, 0.0);
  many_threads(6, -0.001);
  many_threads(14, 0.002);
}

}  // namespace strain
