#pragma once
/// \file Parts of motion_mcap.h: geometry as messages of Foxglove's schemas, and the drawing of a robot.
#include "bielle/formats/reader.h"
#include "foxglove.pb.h"

namespace bielle {

inline constexpr char kWorldFrame[] = "world";

void setTimestamp(double time, google::protobuf::Timestamp& out);

/// Of Vector3 and Point3.
template <typename Message>
void setVector(const Vector3d& v, Message& out) {
  out.set_x(v.x());
  out.set_y(v.y());
  out.set_z(v.z());
}
void setQuaternion(const Matrix3d& R, foxglove::Quaternion& out);
void setPose(const SE3& X, foxglove::Pose& out);
void setColor(const Eigen::Vector4d& rgba, foxglove::Color& out);

/// An entity at time 0 that follows its frame.
foxglove::SceneEntity& addEntity(const std::string& id, const std::string& frame, foxglove::SceneUpdate& scene);

/// A box of given edges.
void addCube(const SE3& X, const Vector3d& edges, const Eigen::Vector4d& rgba, foxglove::SceneEntity& entity);
/// A force [N] at a point, as long as `scale` [m/N] makes it.
void addForce(const Vector3d& point, const Vector3d& force, double scale, const Eigen::Vector4d& rgba,
              foxglove::SceneEntity& entity);

/// One entity per body, in the frame `prefix` + its name: its shapes and meshes (STL, OBJ), as triangles; where it has none
/// that can be read, rods. \param opacity  of all of them, 0 .. 1
foxglove::SceneUpdate makeRobotScene(const LoadedRobot& robot, const std::string& prefix, double opacity);

}  // namespace bielle
