#include "formats/drake.h"

#include <cmath>
#include <set>

#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "formats/format_warnings.h"
#include "formats/robot_text.h"
#include "formats/urdf_writer.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// Gives body i another frame N, fixed to its own frame B; its joint does not move.
void turnBody(int i, const SE3& X_BN, ModelParts& parts) {
  const SE3 X_NB = X_BN.inverse();
  const auto turn = [&](int body, SE3& X) {
    if (body == i) X = X_NB * X;
  };
  parts.joints[i].X_PJ = parts.joints[i].X_PJ * X_BN;
  parts.bodies[i].inertia = parts.bodies[i].inertia.transformed(X_NB);
  for (Joint& joint : parts.joints) turn(joint.parent, joint.X_PJ);
  for (Frame& frame : parts.frames)
    if (frame.name != parts.bodies[i].name) turn(frame.body, frame.X_BF);
  for (Visual& visual : parts.visuals) turn(visual.body, visual.X_BV);
  for (Shape& shape : parts.shapes) turn(shape.body, shape.X_BS);
  for (ContactFrame& contact : parts.contacts) turn(contact.body, contact.X_BF);
  for (Closure& closure : parts.closures) turn(closure.body1, closure.X_B1), turn(closure.body2, closure.X_B2);
  for (PointSpring& spring : parts.point_springs) {
    if (spring.body1 == i) spring.point1 = X_NB.act(spring.point1);
    if (spring.body2 == i) spring.point2 = X_NB.act(spring.point2);
  }
}

class DrakeWriter {
 public:
  explicit DrakeWriter(const Model& model) : warnings_(model), parts_(takeParts(model)) {
    for (size_t i = 1; i < parts_.joints.size(); ++i)
      if (parts_.joints[i].kind == JointKind::Universal) alignUniversal(static_cast<int>(i));
    addGround();
  }

  UrdfText write() {
    XMLDocument document;
    XMLElement& robot = addUrdfTree(ModelBuilder::restore(parts_), true, document, warnings_);
    setAttributes(robot, {{"xmlns:drake", "http://drake.mit.edu"}});
    for (const Closure& closure : parts_.closures) writeClosure(closure, robot);
    for (const PointSpring& spring : parts_.point_springs) writeSpring(spring, robot);
    for (const Motor& motor : parts_.motors) writeMotor(motor, robot);
    warnMassless();
    warnings_.addArmature(false);
    warnings_.addTargets();
    warnings_.addYamlOnly(MotorData::Gears);
    return {formatXml(document), warnings_.get()};
  }

 private:
  void warn(const std::string& element, const std::string& problem) { warnings_.add(element, problem); }

  void alignUniversal(int i) {
    Joint& joint = parts_.joints[i];
    if (std::abs(joint.axis.dot(joint.axis2)) > 1e-12)
      throw InputError(parts_.name, "universal joint '" + joint.name + "'",
                       "its axes are not perpendicular, which Drake does not support",
                       "change the model, or replace it by two revolute joints");
    if (joint.axis == Vector3d::UnitX() && joint.axis2 == Vector3d::UnitY()) return;
    SE3 X_BN;
    X_BN.R << joint.axis, joint.axis2, joint.axis.cross(joint.axis2);
    turnBody(i, X_BN, parts_);
    joint.axis = Vector3d::UnitX();
    joint.axis2 = Vector3d::UnitY();
    warn("link '" + parts_.bodies[i].name + "'",
         "its frame is turned: a universal joint turns about x and y of its link");
  }

  // Whether Drake's constraints of balls can hold it.
  static bool isBalls(const Closure& c) {
    return c.kind == ClosureKind::Ball3D || c.kind == ClosureKind::Hinge5D || c.kind == ClosureKind::Weld6D;
  }

  // A link fixed to the ground, for what is tied to it.
  void addGround() {
    bool is_used = false;
    for (const Closure& c : parts_.closures) is_used |= isBalls(c) && (c.body1 == 0 || c.body2 == 0);
    for (const PointSpring& spring : parts_.point_springs) is_used |= spring.body1 == 0 || spring.body2 == 0;
    if (!is_used) return;
    for (const Frame& frame : parts_.frames)
      if (frame.body == 0 && frame.name != "world" && frame.X_BF.p.isZero(0) && frame.X_BF.R.isIdentity(0))
        ground_ = frame.name;
    if (!ground_.empty()) return;
    std::set<std::string> taken;
    for (const Frame& frame : parts_.frames) taken.insert(frame.name);
    for (const Body& body : parts_.bodies) taken.insert(body.name);
    ground_ = "ground";
    while (taken.count(ground_)) ground_ += "_";
    parts_.frames.push_back({ground_, 0, SE3()});
  }

  const std::string& getLink(int body) const { return body == 0 ? ground_ : parts_.bodies[body].name; }

  // The names of its entries begin with its own.
  static void addEntry(XMLElement& e, const char* entry, const char* attribute, const std::string& text) {
    addElement(e, (getTag(e) + entry).c_str(), {{attribute, text}});
  }

  void writeClosure(const Closure& c, XMLElement& robot) {
    const std::string element = "closure '" + c.name + "'";
    if (c.kp != 0 || c.kd != 0) warn(element, "its gains kp and kd are left out");
    switch (c.kind) {
      case ClosureKind::Ball3D:
        return writeBall(c, "", Vector3d::Zero(), robot);
      case ClosureKind::Hinge5D:
        writeBall(c, ".1", kDrakeHingeLever * c.axis, robot);
        return writeBall(c, ".2", -kDrakeHingeLever * c.axis, robot);
      case ClosureKind::Weld6D:
        for (int k = 0; k < 3; ++k)
          writeBall(c, "." + std::to_string(k + 1), kDrakeWeldLever * Vector3d::Unit(k), robot);
        return;
      case ClosureKind::Coupler:  // a <mimic> of the tree, or told there
        return;
      case ClosureKind::Distance:
        return warn(element,
                    "it is left out: Drake's files have no rod; MultibodyPlant::AddDistanceConstraint() makes one of " +
                        formatNumber(c.length) + " m");
      case ClosureKind::Slider:
        return warn(element, "it is left out: Drake has no such constraint; cut the loop at another joint instead");
    }
  }

  // Holds a point of both frames together. Drake does not look at the name, our reader does.
  void writeBall(const Closure& c, const std::string& suffix, const Vector3d& point, XMLElement& robot) {
    std::string name = c.name + suffix;
    while (!balls_.insert(name).second) name += "_";
    XMLElement& ball = addElement(robot, "drake:ball_constraint", {{"name", name}});
    addEntry(ball, "_body_A", "name", getLink(c.body1));
    addEntry(ball, "_body_B", "name", getLink(c.body2));
    addEntry(ball, "_p_AP", "value", formatExact(c.X_B1.act(point)));
    addEntry(ball, "_p_BQ", "value", formatExact(c.X_B2.act(point)));
  }

  void writeSpring(const PointSpring& spring, XMLElement& robot) {
    const std::string element = "point spring '" + spring.name + "'";
    double rest = spring.rest;
    if (spring.stiffness != 0)
      rest -= spring.preload / spring.stiffness;
    else if (spring.preload != 0)
      warn(element, "its preload without a stiffness is left out");
    if (spring.stiffness == 0 && spring.damping == 0) return;
    if (spring.stiffness != 0 && !(rest > 0))
      return warn(element, "it is left out: it would have no tension at a length of " + formatNumber(rest) +
                               " m, which Drake requires to be positive");
    if (!(rest > 0)) rest = 1;  // of a damper alone, on which it has no effect
    XMLElement& e = addElement(robot, "drake:linear_spring_damper", {{"name", spring.name}});
    addEntry(e, "_body_A", "name", getLink(spring.body1));
    addEntry(e, "_p_AP", "value", formatExact(spring.point1));
    addEntry(e, "_body_B", "name", getLink(spring.body2));
    addEntry(e, "_p_BQ", "value", formatExact(spring.point2));
    addEntry(e, "_free_length", "value", formatExact(rest));
    addEntry(e, "_stiffness", "value", formatExact(spring.stiffness));
    addEntry(e, "_damping", "value", formatExact(spring.damping));
  }

  // The gear of the drive, unless the armature is given beside it.
  void writeMotor(const Motor& motor, XMLElement& robot) {
    const double ratio = motor.drive.ratio, reflected = ratio * ratio * motor.drive.rotor_inertia;
    const bool by_drive = ratio > 0 && std::abs(reflected - motor.armature) <= 1e-12 * motor.armature;
    XMLElement& e = addElement(robot, "transmission", {{"name", motor.name + "_transmission"}});
    addText(e, "type", "transmission_interface/SimpleTransmission");
    addText(addElement(e, "joint", {{"name", motor.name}}), "hardwareInterface", "EffortJointInterface");
    XMLElement& actuator = addElement(e, "actuator", {{"name", motor.name}});
    const double inertia = by_drive ? motor.drive.rotor_inertia : motor.armature;
    addElement(actuator, "drake:rotor_inertia", {{"value", formatExact(inertia)}});
    addElement(actuator, "drake:gear_ratio", {{"value", formatExact(by_drive ? ratio : 1)}});
  }

  void warnMassless() {
    for (size_t i = 1; i < parts_.bodies.size(); ++i)
      if (!(parts_.bodies[i].inertia.mass > 0))
        warn("link '" + parts_.bodies[i].name + "'", "it has no mass, which Drake may reject");
  }

  FormatWarnings warnings_;
  ModelParts parts_;
  std::string ground_;
  std::set<std::string> balls_;  // their names
};

}  // namespace

UrdfText formatDrake(const Model& model) { return DrakeWriter(model).write(); }

}  // namespace bielle
