#pragma once
/// \file Builds and validates a Model.
#include <string>
#include <vector>

#include "bielle/model/error.h"
#include "bielle/model/model.h"

namespace bielle {

struct JointLimits {
  VectorXd lower, upper, velocity;  ///< per dof of the joint, or empty for none; rad, m, rad/s, m/s
};

/// The parts of a model, as its accessors return them; for storing a model, or comparing two.
struct ModelParts {
  std::string name;
  Vector3d gravity = Vector3d::Zero();
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<Frame> frames;
  std::vector<Closure> closures;
  std::vector<Motor> motors;
  std::vector<ContactFrame> contacts;
  std::vector<Reference> references;
  std::vector<Visual> visuals;
  std::vector<int> serial_joints;
  VectorXd lower_limits, upper_limits, velocity_limits, armature;  ///< nv
  std::vector<JointForce> joint_forces;
  std::vector<PointSpring> point_springs;
  std::vector<Shape> shapes;
};
ModelParts takeParts(const Model& model);

/// Collects bodies, joints, closures, motors and frames, then validates them and makes the model.
/// Bodies are referred to by the name of the link; "world" is the ground. A link must be declared before it is used;
/// otherwise calls may come in any order. build() throws InputError naming the element and the remedy.
class ModelBuilder {
 public:
  explicit ModelBuilder(std::string name, std::string source = "");

  /// Sets the file named in errors about subsequent additions.
  void setSource(const std::string& source) { source_ = source; }

  /// Adds a link carried by a joint. A Fixed joint merges the link into its parent and leaves a frame with its name.
  /// \param joint kind, placement and axes; its parent index and q/v indices are filled here
  void addLink(const std::string& link, const std::string& parent_link, Joint joint, const Inertia& inertia,
               const JointLimits& limits = {});
  /// Adds an inertia to a link, which may have several.
  void addInertia(const std::string& link, const Inertia& inertia);
  void addFrame(const std::string& name, const std::string& link, const SE3& X_LF);
  /// Closure between two frames (links are frames too); not a coupler, and of a distance the default of addDistance().
  void addClosure(const std::string& name, ClosureKind kind, const std::string& frame1, const std::string& frame2,
                  const Vector3d& axis = Vector3d::UnitZ(), double kp = 0, double kd = 0);
  /// Keeps the origins of two frames as far apart as a massless rod would.
  /// \param length  m, above 0; by default their distance where all coordinates are neutral
  void addDistance(const std::string& name, const std::string& frame1, const std::string& frame2,
                   std::optional<double> length = {}, double kp = 0, double kd = 0);
  /// One that ties frames, all told: its bodies, placements and dofs are filled here. A NaN stands for the default length.
  void addClosure(const std::string& frame1, const std::string& frame2, Closure closure);
  /// Couples joints of one coordinate each: the sum of coefficient times coordinate, or of polynomials of it, is the offset.
  /// \param coefficients  by joint; at least two joints
  /// \param higher  coefficients of the squares, cubes, .. of coordinates, by joint among these
  void addCoupler(const std::string& name, const std::map<std::string, double>& coefficients, double offset = 0,
                  double kp = 0, double kd = 0, const std::map<std::string, std::vector<double>>& higher = {});
  /// Adds a closure of another model whose links and joints have the same names; its frames get the names
  /// closure/frame1 and closure/frame2.
  void copyClosure(const Model& from, const Closure& closure);
  void addMotor(const std::string& joint, double armature = 0,
                double effort_limit = std::numeric_limits<double>::infinity(),
                double velocity_limit = std::numeric_limits<double>::infinity(),
                std::optional<double> torque_loss = {});
  /// A motor on the joint of its name; its indices are filled here. Limits, armature and loss that are not given follow
  /// from its drive: limits are the smaller of both, and an armature of 0 counts as not given.
  void addMotor(Motor motor);
  /// Spring, damper and friction on a joint of one coordinate, or what its friction loses with speed (model/stiction.h).
  void addJointForce(const std::string& joint, JointForce force);
  /// Spring and damper between two bodies. Its points are given in frames 1 and 2 (links are frames too); its bodies and
  /// dofs are filled here.
  void addPointSpring(const std::string& frame1, const std::string& frame2, PointSpring spring);
  /// Adds one of another model whose links have the same names.
  void copyPointSpring(const Model& from, const PointSpring& spring);
  void addContact(const std::string& name, const std::string& frame, ContactKind kind, double half_length,
                  double half_width);
  /// Its joints, contacts and frame must be declared before it.
  void addReference(Reference reference);
  void addVisual(const std::string& link, Visual visual);
  /// Bodies without any get shapes fitted to their visuals by build(). Fitted ones are not added.
  void addShape(const std::string& link, Shape shape);
  void addSerialJoint(const std::string& joint);
  void setGravity(const Vector3d& gravity);
  /// Sets the rotor inertia on every dof of a joint without a motor (a motor has its own).
  void setArmature(const std::string& joint, double armature);

  /// Validates and makes the model. Implausible data are reported in `warnings`, if given.
  Model build(std::vector<std::string>* warnings = nullptr) const;

  /// The model of these parts, bitwise equal to the one that they were taken from.
  /// \throws InputError when an index or a size among them does not fit
  static Model restore(ModelParts parts);

 private:
  struct FramePlace {
    int body;
    SE3 X_BF;
  };
  FramePlace getFrame(const std::string& name, const std::string& element) const;
  void addChecked(Closure closure);
  void finishClosure(const Model& model, Closure& closure) const;
  [[noreturn]] void fail(const std::string& element, const std::string& problem, const std::string& remedy) const;
  void finishDofs(Model& model) const;
  void finishClosures(Model& model) const;
  void finishPointSprings(Model& model) const;
  void finishShapes(Model& model) const;
  void applyDrive(const std::string& element, Motor& motor) const;
  void checkInertias(std::vector<std::string>* warnings) const;
  void checkReference(const Reference& reference) const;

  std::string source_;
  Model model_;
  std::map<std::string, FramePlace> frames_;  ///< links and frames
  std::vector<std::pair<std::string, Inertia>> link_inertias_;
  std::vector<JointLimits> limits_;
  std::map<std::string, double> joint_armature_;
};

}  // namespace bielle
