#pragma once
/// \file A modifiable copy of a model: placements and inertias may change, names and the tree are fixed.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

class RobotDraft {
 public:
  explicit RobotDraft(const Model& model);

  /// A point fixed in a body, in the body's frame (m).
  struct Place {
    int body = 0;
    Vector3d p = Vector3d::Zero();
  };
  /// Position of a joint in its parent body, or of a frame in its body.
  /// \throws InputError when there is neither, or the name is that of a whole body
  Place getPlace(const std::string& name) const;
  /// A place by name in the frame of `body`: that of getPlace, or the origin for the joint that carries `body`.
  /// \throws InputError when it is fixed to another body
  Vector3d getPlaceIn(int body, const std::string& name) const;
  /// Moves a joint with everything that it carries, or a frame with the closures, springs and contacts attached to it.
  void setPlace(const std::string& name, const Vector3d& p);

  /// Length of a closure that is a distance, m.
  /// \throws InputError when there is no such one
  double getRod(const std::string& closure) const { return rods_[findRod(closure)]; }
  void setRod(const std::string& closure, double length) { rods_[findRod(closure)] = length; }

  /// Stretches a link along `direction` (unit) by `factor`, with `origin` and the mass per length unchanged:
  ///     D = 1 + (factor - 1) d d^T,   m' = factor m,   c' = origin + D (c - origin),   S' = factor D S D         (1)
  /// with S = tr(I) / 2 - I the second moments about the centre of mass; a physical inertia remains physical. Boxes and
  /// cylinders drawn along d are stretched as well.
  void stretch(const std::string& link, const Vector3d& origin, const Vector3d& direction, double factor);

  /// Scales mass and inertia of a link by a positive factor; its centre of mass stays.
  void scaleMass(const std::string& link, double factor);

  /// Adds a point mass to a body, or takes it away if it is negative, at a place in the frame of the body, m; nothing to the ground.
  /// \throws InputError when that leaves no mass, or an inertia that no body has
  void addMass(int body, const Vector3d& at, double mass);

  /// A motor in place of that with its index.
  void setMotor(int index, const Motor& motor) { motors_[static_cast<size_t>(index)] = motor; }

  Model build() const;

 private:
  int findMovable(const std::string& name, bool& is_joint) const;
  int findLink(const std::string& name) const;
  size_t findRod(const std::string& closure) const;
  int findFrameAt(int body, const SE3& X_BF) const;
  int findFrameAt(int body, const Vector3d& p) const;
  std::string getLink(int body) const { return body == 0 ? "world" : model_.bodies()[body].name; }

  Model model_;
  std::vector<SE3> joints_, frames_;
  std::vector<double> rods_;  // of closures
  std::vector<Inertia> inertias_;
  std::vector<Visual> visuals_;
  std::vector<Shape> shapes_;
  std::vector<Motor> motors_;
};

}  // namespace bielle
