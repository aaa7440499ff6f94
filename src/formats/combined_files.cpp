// The model of a URDF, or of what stands for it, and a YAML file.
#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "dynamics/rod_friction.h"
#include "formats/reader_dialects.h"
#include "formats/reader_loops.h"
#include "formats/robot_files.h"
#include "formats/rounding_warnings.h"
#include "math/constants.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr const char* kRootJoint = "root_joint";  // of a root that is not the world

template <typename Joints>
auto findJoint(Joints& joints, const std::string& name) {
  return std::find_if(joints.begin(), joints.end(), [&name](const UrdfJoint& j) { return j.joint.name == name; });
}

// Joint kinds that the YAML file assigns to joints of the URDF.
void retypeJoints(const YamlFile& yaml, UrdfFile& urdf) {
  for (const auto& [name, type] : yaml.joint_types) {
    const auto it = findJoint(urdf.joints, name);
    if (it == urdf.joints.end()) {
      urdf.warnings.push_back(yaml.path + ": key 'joint_name': joint '" + name +
                              "' is not in the URDF and is skipped; correct its name or remove it");
      continue;
    }
    // The limits and the friction of the file belong to its own coordinate.
    if (getNv(type.kind) != getNv(it->joint.kind)) {
      it->lower = it->upper = VectorXd();
      it->effort = it->velocity = std::nullopt;
      if (it->damping != 0 || it->friction != 0)
        urdf.warnings.push_back(urdf.path + ": joint '" + name +
                                "': its <dynamics> is left out, since the YAML file makes it " + getName(type.kind));
      it->damping = it->friction = 0;
    }
    it->joint.kind = type.kind;
    if (type.kind != JointKind::Universal) continue;
    it->joint.axis = type.axis;
    it->joint.axis2 = type.axis2;
  }
}

// Links without mass, fixed to others.
void addFrames(const YamlFile& yaml, UrdfFile& urdf) {
  for (const FrameSpec& frame : yaml.frames) {
    const std::string element = "frame '" + frame.name + "'", joint_name = frame.name + "_joint";
    if (!urdf.links.count(frame.link))
      throw InputError(yaml.path, element, "there is no link '" + frame.link + "'", "correct the name");
    if (findJoint(urdf.joints, joint_name) != urdf.joints.end() ||
        !urdf.links.emplace(frame.name, UrdfLink{frame.name, {}, {}, {}}).second)
      throw InputError(yaml.path, element, "there is a link or joint of this name already", "rename it");
    UrdfJoint joint;
    joint.parent = frame.link;
    joint.child = frame.name;
    joint.joint.name = joint_name;
    joint.joint.kind = JointKind::Fixed;
    joint.joint.X_PJ = frame.X_LF;
    urdf.joints.push_back(joint);
  }
}

// Two revolute joints, with a cross in between, for every universal one.
void splitUniversalJoints(double cross_inertia, UrdfFile& urdf) {
  constexpr double kMass = 1e-9;  // kg: nothing without mass has inertia
  const auto getSuffix = [](const Vector3d& axis) {
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    return std::string("_") + "XYZ"[largest];
  };
  std::vector<UrdfJoint> joints;
  for (const UrdfJoint& j : urdf.joints) {
    joints.push_back(j);
    if (j.joint.kind != JointKind::Universal) continue;
    UrdfJoint &first = joints.back(), second = j;
    first.child = second.parent = j.joint.name + "_cross";
    first.joint.kind = second.joint.kind = JointKind::Revolute;
    first.joint.name += getSuffix(j.joint.axis);
    second.joint.name += getSuffix(j.joint.axis2);
    second.joint.axis = j.joint.axis2;
    second.joint.X_PJ = SE3();
    urdf.links[first.child] = {first.child, {kMass, Vector3d::Zero(), cross_inertia * Matrix3d::Identity()}, {}, {}};
    joints.push_back(second);
  }
  urdf.joints = std::move(joints);
}

// Names that the robot does not have, with their line.
void checkNames(const UrdfFile& urdf, const YamlFile& yaml, BaseKind base) {
  std::vector<std::string> links = {"world"}, moving, joints, contacts;
  for (const auto& [name, link] : urdf.links) links.push_back(name);
  if (urdf.root != "world") (base == BaseKind::Free ? moving : joints).push_back(kRootJoint);
  for (const UrdfJoint& j : urdf.joints) (j.joint.kind == JointKind::Fixed ? joints : moving).push_back(j.joint.name);
  joints.insert(joints.end(), moving.begin(), moving.end());
  for (const ContactSpec& contact : yaml.contacts) contacts.push_back(contact.name);
  for (const auto& [kind, name, entry] : yaml.names) {
    if (kind == RobotName::Kind::Contact) {
      if (!contains(contacts, name)) entry.failUnknown("contact", name, contacts);
    } else if (!contains(joints, name)) {
      if (kind == RobotName::Kind::Joint) entry.failUnknown("joint", name, moving);
      if (!contains(links, name)) entry.failUnknown("link or joint", name, links);
    }
  }
}

void setImportance(const YamlFile& yaml, UrdfFile& urdf) {
  for (const auto& [name, values] : yaml.importance) {
    const auto it = findJoint(urdf.joints, name);
    if (it == urdf.joints.end() || it->joint.kind == JointKind::Fixed)
      throw InputError(yaml.path, "importance of '" + name + "'", "there is no moving joint of this name",
                       "name a joint of the robot that is not fixed");
    it->joint.position_importance = values[0];
    it->joint.velocity_importance = values[1];
  }
}

// Free bodies of a file that has its own base, fixed to the ground.
void fixBase(UrdfFile& tree, YamlFile& yaml) {
  for (UrdfJoint& j : tree.joints) {
    if (j.joint.kind != JointKind::FreeFlyer || j.parent != tree.root) continue;
    j.joint.kind = JointKind::Fixed;
    yaml.armature.erase(j.joint.name);
    for (Reference& reference : yaml.references) reference.joints.erase(j.joint.name);
  }
}

// The q of a free base is its place in the world. That in which a joint of the file puts it is kept by the references, unless
// their feet say where they stand.
void placeBase(UrdfFile& tree, YamlFile& yaml) {
  for (UrdfJoint& j : tree.joints) {
    if (j.joint.kind != JointKind::FreeFlyer || j.parent != tree.root || yaml.references.empty()) continue;
    for (Reference& reference : yaml.references) {
      const auto given = reference.joints.find(j.joint.name);
      if (given == reference.joints.end() && !reference.feet.empty()) continue;
      std::vector<double>& q = reference.joints[j.joint.name];
      if (q.empty()) q = {0, 0, 0, 0, 0, 0, 1};
      if (q.size() != 7) continue;  // which the builder refuses
      const Vector3d p = j.joint.X_PJ.act(Vector3d(q[0], q[1], q[2]));
      const Eigen::Quaterniond turn(j.joint.X_PJ.R), base(q[6], q[3], q[4], q[5]);
      Eigen::Map<Vector3d>(q.data()) = p;
      Eigen::Map<Eigen::Vector4d>(q.data() + 3) = (turn * base).coeffs();
    }
    j.joint.X_PJ = SE3();
  }
}

// The root link: carried by a free-flyer, or part of the ground. A root named "world" is the ground itself.
void addRoot(const UrdfFile& urdf, BaseKind base, ModelBuilder& builder) {
  if (urdf.root == "world") return;
  Joint joint;
  joint.name = kRootJoint;
  joint.kind = base == BaseKind::Free ? JointKind::FreeFlyer : JointKind::Fixed;
  builder.addLink(urdf.root, "world", joint, urdf.links.at(urdf.root).inertia);
}

void addJoints(const UrdfFile& urdf, const YamlFile& yaml, ModelBuilder& builder) {
  for (const UrdfJoint& j : urdf.joints) {
    JointLimits limits = {j.lower, j.upper, {}};
    std::optional<double> velocity = j.velocity;
    for (const MotorSpec& motor : yaml.motors)
      if (motor.joint == j.joint.name && motor.velocity) velocity = motor.velocity;
    if (velocity && getNv(j.joint.kind) == 1) limits.velocity = VectorXd::Constant(1, *velocity);
    builder.addLink(j.child, j.parent, j.joint, urdf.links.at(j.child).inertia, limits);
  }
  for (const auto& [name, link] : urdf.links)
    for (const Visual& visual : link.visuals) builder.addVisual(name, visual);
  for (const auto& [name, link] : urdf.links)
    for (const Shape& shape : link.shapes) builder.addShape(name, shape);
}

void addMotors(const UrdfFile& urdf, const YamlFile& yaml, ModelBuilder& builder) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  std::map<std::string, double> armature = yaml.armature;
  for (const MotorSpec& motor : yaml.motors) {
    const auto joint = findJoint(urdf.joints, motor.joint);
    const bool found = joint != urdf.joints.end();
    if (motor.armature && armature.count(motor.joint))
      throw InputError(yaml.path, "motor '" + motor.joint + "'", "'motors' and 'armature' both give its armature",
                       "keep one of them");
    const bool armature_of_joint = armature.count(motor.joint) > 0;
    const double from_map = armature_of_joint ? armature[motor.joint] : yaml.motor_armature.value_or(0);
    armature.erase(motor.joint);
    const MotorDrive& drive = motor.drive;
    const bool has_rotor = drive.rotor_inertia != 0 && !armature_of_joint;
    builder.addMotor({motor.joint, 0, 0,
                      motor.armature.value_or(has_rotor ? drive.ratio * drive.ratio * drive.rotor_inertia : from_map),
                      motor.effort.value_or(found ? joint->effort.value_or(inf) : inf),
                      motor.velocity.value_or(found ? joint->velocity.value_or(inf) : inf), motor.torque_loss,
                      motor.continuous_effort.value_or(inf), drive});
  }
  for (const auto& [joint, value] : armature) builder.setArmature(joint, value);
}

class FrameResolver {
 public:
  FrameResolver(const UrdfFile& urdf, const YamlFile& yaml) : urdf_(urdf), yaml_(yaml) {}

  /// A link, or the child of a joint when no link has this name.
  std::string find(const std::string& name, const std::string& element) const {
    if (name == "world" || urdf_.links.count(name)) return name;
    const auto joint = findJoint(urdf_.joints, name);
    if (joint == urdf_.joints.end())
      throw InputError(yaml_.path, element, "there is no link or joint '" + name + "' in the URDF", "correct the name");
    return joint->child;
  }

 private:
  const UrdfFile& urdf_;
  const YamlFile& yaml_;
};

// A coupler named as the joint for every joint that mimics another.
void addMimics(const UrdfFile& urdf, ModelBuilder& builder) {
  for (const UrdfJoint& j : urdf.joints) {
    if (j.mimicked.empty()) continue;
    if (j.mimicked == j.joint.name)
      throw InputError(urdf.path, "joint '" + j.joint.name + "'", "it mimics itself", "name another joint");
    builder.addCoupler(j.joint.name, {{j.joint.name, 1}, {j.mimicked, -j.multiplier}}, j.offset);
  }
}

// Those of the YAML file, and <dynamics> of joints that it does not name.
void addJointForces(const UrdfFile& urdf, const YamlFile& yaml, ModelBuilder& builder) {
  std::set<std::string> named;
  for (const JointForceSpec& spec : yaml.joint_forces) {
    named.insert(spec.joint);
    builder.addJointForce(spec.joint, spec.force);
  }
  for (const UrdfJoint& j : urdf.joints) {
    if ((j.damping == 0 && j.friction == 0) || named.count(j.joint.name)) continue;
    JointForce force;
    force.damping = j.damping;
    force.friction = j.friction;
    builder.addJointForce(j.joint.name, force);
  }
}

// Closures, motors and contacts refer to the tree by name.
void addNamed(const UrdfFile& urdf, const YamlFile& yaml, ModelBuilder& builder) {
  const FrameResolver frames(urdf, yaml);
  for (const ClosureSpec& c : yaml.closures) {
    const std::string element = "closure '" + c.name + "'";
    if (c.kind == ClosureKind::Coupler) {
      builder.addCoupler(c.name, c.coefficients, c.offset, c.kp, c.kd, c.higher);
      continue;
    }
    const std::string frame1 = frames.find(c.frame1, element), frame2 = frames.find(c.frame2, element);
    if (c.kind == ClosureKind::Distance)
      builder.addDistance(c.name, frame1, frame2, c.length, c.kp, c.kd);
    else
      builder.addClosure(c.name, c.kind, frame1, frame2, c.axis, c.kp, c.kd);
  }
  addJointForces(urdf, yaml, builder);
  for (const PointSpringSpec& s : yaml.point_springs) {
    const std::string element = "point spring '" + s.spring.name + "'";
    builder.addPointSpring(frames.find(s.frame1, element), frames.find(s.frame2, element), s.spring);
  }
  for (const ContactSpec& c : yaml.contacts)
    builder.addContact(c.name, frames.find(c.frame, "contact '" + c.name + "'"), c.kind, c.half_length, c.half_width);
  for (const std::string& joint : yaml.serial_joints) builder.addSerialJoint(joint);
  for (Reference reference : yaml.references) {
    if (!reference.height_frame.empty())
      reference.height_frame = frames.find(reference.height_frame, "reference '" + reference.name + "'");
    builder.addReference(reference);
  }
  if (yaml.gravity) builder.setGravity(*yaml.gravity);
}

// Axes of closures are of another file, which rounds in its own way: few digits are exact ones.
RoundingTolerance findTolerance(const UrdfFile& urdf, const YamlFile& yaml) {
  constexpr int kFewest = 4;
  RoundingTolerance tolerance = urdf.rounding;
  if (yaml.rounding)
    tolerance = {*yaml.rounding, *yaml.rounding, true, tolerance.levers};
  else if (yaml.axes.most_digits() >= kFewest)
    tolerance.angle = std::max(tolerance.angle, yaml.axes.calcHalfUnit());
  return tolerance;
}

// Ranges of hinges that are many turns, as those of files whose authors took degrees for radians.
void warnOfDegrees(const UrdfFile& urdf, std::vector<std::string>& warnings) {
  constexpr double kLeast = 15, kMost = 720, kStep = 5;  // others are placeholders, such as 1e4
  std::string names, range, radians;
  for (const UrdfJoint& own : urdf.joints) {
    if (own.joint.kind != JointKind::Revolute || own.lower.size() != 1 || own.upper.size() != 1) continue;
    const double lower = own.lower[0], upper = own.upper[0], most = std::max(std::abs(lower), std::abs(upper));
    if (!(most >= kLeast && most <= kMost) || std::fmod(lower, kStep) != 0 || std::fmod(upper, kStep) != 0) continue;
    names += (names.empty() ? "'" : ", '") + own.joint.name + "'";
    if (!range.empty()) continue;
    range = formatNumber(lower) + " .. " + formatNumber(upper);
    radians = formatNumber(lower * kDegree) + " .. " + formatNumber(upper * kDegree);
  }
  if (names.empty()) return;
  warnings.push_back(urdf.path + ": joints " + names + ": ranges such as " + range +
                     " rad are many turns: if they are degrees, give radians (" + radians +
                     "), and none where there is no limit");
}

}  // namespace

Model combineFiles(RobotFiles files, std::optional<BaseKind> overriding, LoadedRobot* told) {
  auto& [urdf, yaml] = files;
  retypeJoints(yaml, urdf);
  if (yaml.cross_inertia) splitUniversalJoints(*yaml.cross_inertia, urdf);
  addFrames(yaml, urdf);
  const BaseKind base = overriding.value_or(yaml.base.value_or(BaseKind::Free));
  checkNames(urdf, yaml, base);
  setImportance(yaml, urdf);

  if (urdf.has_own_base && base == BaseKind::Fixed) fixBase(urdf, yaml);
  if (urdf.is_urdf && urdf.root == "world") placeBase(urdf, yaml);
  ModelBuilder builder(urdf.name, urdf.path);
  addRoot(urdf, base, builder);
  addJoints(urdf, yaml, builder);
  builder.setSource(yaml.path);
  addMotors(urdf, yaml, builder);
  addNamed(urdf, yaml, builder);
  builder.setSource(urdf.path);
  addMimics(urdf, builder);
  std::vector<std::string>* warnings = told ? &told->warnings : nullptr;
  if (warnings) {
    for (const std::vector<std::string>* own : {&urdf.warnings, &yaml.warnings})
      warnings->insert(warnings->end(), own->begin(), own->end());
    warnOfDegrees(urdf, *warnings);
    if (const size_t count = urdf.harmless.size(); count > 0)  // one line, so that it does not bury the others
      warnings->push_back(urdf.path + ": what changes no mechanism is left out (" + std::to_string(count) +
                          (count > 1 ? " kinds" : " kind") + " of elements; `bielle info " + urdf.path +
                          " --verbose` lists them)");
  }
  RoundedLinkages linkages = findRoundedLinkages(builder.build(warnings), findTolerance(urdf, yaml));
  const std::string& settings = yaml.path.empty() ? urdf.path : yaml.path;
  if (told) {
    warnOfRounding(linkages, urdf.path, settings, *warnings);
    for (const RoundedLinkage& linkage : linkages.locked)
      if (linkage.written >= 0) told->locked.push_back({linkage.closures, linkage.written});
  }
  try {
    // Only to check them: worlds have play and friction of rods, the model does not.
    addPlay(linkages.model, yaml.wear.plays);
    makeRodBearings(linkages.model, yaml.wear.frictions);
  } catch (const InputError& error) {  // which knows no file
    throw InputError(settings, error.element(), error.problem(), error.remedy());
  }
  if (told) told->wear = {listPlays(linkages.model, yaml.wear.plays), yaml.wear.frictions};
  return std::move(linkages.model);
}
}  // namespace bielle
