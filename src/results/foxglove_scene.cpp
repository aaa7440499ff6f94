#include "results/foxglove_scene.h"

#include <array>
#include <cmath>
#include <map>

#include "formats/mesh.h"
#include "math/direction.h"
#include "results/skeleton.h"

namespace bielle {
namespace {

// A corner that several triangles share is listed once. Returns whether the file could be read.
bool addMesh(const Visual& visual, const std::string& directory, foxglove::SceneEntity& entity) {
  const Eigen::Matrix3Xd corners = readTriangles(visual.mesh, directory);
  if (corners.cols() == 0) return false;
  foxglove::TriangleListPrimitive& mesh = *entity.add_triangles();
  setPose(visual.X_BV, *mesh.mutable_pose());
  setColor(visual.rgba, *mesh.mutable_color());
  std::map<std::array<double, 3>, int> indices;
  for (Eigen::Index i = 0; i < corners.cols(); ++i) {
    const Vector3d p = visual.size.cwiseProduct(corners.col(i));
    const auto [it, is_new] = indices.emplace(std::array{p.x(), p.y(), p.z()}, mesh.points_size());
    if (is_new) setVector(p, *mesh.add_points());
    mesh.add_indices(static_cast<std::uint32_t>(it->second));
  }
  return true;
}

bool addVisual(const Visual& visual, const std::string& directory, foxglove::SceneEntity& entity) {
  const Vector3d& size = visual.size;
  switch (visual.shape) {
    case Visual::Shape::Box:
      addCube(visual.X_BV, size, visual.rgba, entity);
      return true;
    case Visual::Shape::Cylinder: {
      foxglove::CylinderPrimitive& cylinder = *entity.add_cylinders();
      setPose(visual.X_BV, *cylinder.mutable_pose());
      setVector({2 * size[0], 2 * size[0], size[1]}, *cylinder.mutable_size());
      cylinder.set_bottom_scale(1);
      cylinder.set_top_scale(1);
      setColor(visual.rgba, *cylinder.mutable_color());
      return true;
    }
    case Visual::Shape::Sphere: {
      foxglove::SpherePrimitive& sphere = *entity.add_spheres();
      setPose(visual.X_BV, *sphere.mutable_pose());
      setVector(Vector3d::Constant(2 * size[0]), *sphere.mutable_size());
      setColor(visual.rgba, *sphere.mutable_color());
      return true;
    }
    case Visual::Shape::Mesh:
      return addMesh(visual, directory, entity);
  }
  return false;
}

}  // namespace

void setTimestamp(double time, google::protobuf::Timestamp& out) {
  const long long ns = std::llround(time * 1e9);
  out.set_seconds(ns / 1'000'000'000);
  out.set_nanos(static_cast<int>(ns % 1'000'000'000));
}

void setQuaternion(const Matrix3d& R, foxglove::Quaternion& out) {
  const Eigen::Quaterniond q(R);
  out.set_x(q.x());
  out.set_y(q.y());
  out.set_z(q.z());
  out.set_w(q.w());
}

void setPose(const SE3& X, foxglove::Pose& out) {
  setVector(X.p, *out.mutable_position());
  setQuaternion(X.R, *out.mutable_orientation());
}

void setColor(const Eigen::Vector4d& rgba, foxglove::Color& out) {
  out.set_r(rgba[0]);
  out.set_g(rgba[1]);
  out.set_b(rgba[2]);
  out.set_a(rgba[3]);
}

foxglove::SceneEntity& addEntity(const std::string& id, const std::string& frame, foxglove::SceneUpdate& scene) {
  foxglove::SceneEntity& entity = *scene.add_entities();
  entity.mutable_timestamp();
  entity.set_id(id);
  entity.set_frame_id(frame);
  entity.set_frame_locked(true);
  return entity;
}

void addCube(const SE3& X, const Vector3d& edges, const Eigen::Vector4d& rgba, foxglove::SceneEntity& entity) {
  foxglove::CubePrimitive& cube = *entity.add_cubes();
  setPose(X, *cube.mutable_pose());
  setVector(edges, *cube.mutable_size());
  setColor(rgba, *cube.mutable_color());
}

void addForce(const Vector3d& point, const Vector3d& force, double scale, const Eigen::Vector4d& rgba,
              foxglove::SceneEntity& entity) {
  constexpr double kHead = 0.25, kWidth = 0.03;  // shares of the length
  const double length = scale * force.norm();
  // Arrows point along x.
  Matrix3d x_to_z;
  x_to_z << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  foxglove::ArrowPrimitive& arrow = *entity.add_arrows();
  setPose({calcRotationOfZ(force) * x_to_z, point}, *arrow.mutable_pose());
  arrow.set_shaft_length((1 - kHead) * length);
  arrow.set_shaft_diameter(kWidth * length);
  arrow.set_head_length(kHead * length);
  arrow.set_head_diameter(2.5 * kWidth * length);
  setColor(rgba, *arrow.mutable_color());
}

foxglove::SceneUpdate makeRobotScene(const LoadedRobot& robot, const std::string& prefix, double opacity) {
  const Model& model = robot.model;
  foxglove::SceneUpdate scene;
  for (int i = 0; i < model.numBodies(); ++i)
    addEntity("body/" + model.bodies()[i].name, i > 0 ? prefix + model.bodies()[i].name : kWorldFrame, scene);
  std::vector<bool> is_drawn(model.numBodies(), false);
  const auto add = [&](Visual visual) {
    visual.rgba[3] *= opacity;
    if (addVisual(visual, robot.directory, *scene.mutable_entities(visual.body))) is_drawn[visual.body] = true;
  };
  for (const Visual& visual : model.visuals()) add(visual);
  for (const Visual& visual : listSkeleton(model, is_drawn)) add(visual);
  return scene;
}

}  // namespace bielle
