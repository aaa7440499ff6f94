// Joints, drives and what other programs add to them in files of USD.
#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "formats/reader_usd.h"
#include "math/constants.h"
#include "model/listing.h"

namespace bielle {
namespace {

bool isAngular(const UsdJoint& joint) { return joint.kind == JointKind::Revolute; }

// Numbers of a value as words, for Decimals.
std::string spaceOut(std::string_view value) {
  std::string text(value);
  for (char& c : text)
    if (c == '(' || c == ')' || c == ',') c = ' ';
  return text;
}

bool isFloat(std::string_view type) { return type.find("float") == 0 || (!type.empty() && type.back() == 'f'); }

}  // namespace

double UsdReader::getForceUnit(const UsdJoint& joint) const {
  return kilogram_ * meter_ * (isAngular(joint) ? meter_ : 1);
}

double UsdReader::getCoordinateUnit(const UsdJoint& joint) const { return isAngular(joint) ? kDegree : meter_; }

void UsdReader::readJoint(const UsdPrim& prim) {
  if (!getFlag(prim, "physics:jointEnabled", true)) return note(prim.line, "joint that is not enabled");
  UsdJoint joint;
  joint.prim = &prim;
  if (!readKind(joint)) return;
  for (const int end : {0, 1}) readFrame(joint, end);
  if (joint.body[0] == joint.body[1]) return note(prim.line, "joint between parts of one body");
  joint.is_excluded = getFlag(prim, "physics:excludeFromArticulation", false);
  for (const char* limit : {"physics:breakForce", "physics:breakTorque"})
    if (std::isfinite(getNumber(prim, limit, HUGE_VAL, true)))
      note(prim.line, std::string(limit), "left out: joints do not break here");
  joint.name = makeName(prim, joint_names_);
  if (joint.axes.size() > 1) return addChain(joint);
  readDrive(joint);
  readExtensions(joint);
  joints_.push_back(std::move(joint));
}

// Whether it holds anything. \throws InputError for joints that are not supported
bool UsdReader::readKind(UsdJoint& joint) {
  const UsdPrim& prim = *joint.prim;
  const std::string_view type = prim.type;
  const std::string axis = getUsdText(prim, "physics:axis");
  if (!axis.empty() && axis != "X" && axis != "Y" && axis != "Z")
    failUsd(path_, prim, "its physics:axis is '" + axis + "'", "use X, Y or Z");
  if (!axis.empty()) joint.axis = Vector3d::Unit(axis[0] - 'X');
  if (type == "PhysicsRevoluteJoint" || type == "PhysicsPrismaticJoint") {
    joint.kind = type == "PhysicsRevoluteJoint" ? JointKind::Revolute : JointKind::Prismatic;
    joint.coordinate = isAngular(joint) ? "angular" : "linear";
    readRange(joint, "physics:lowerLimit", "physics:upperLimit");
    return true;
  }
  if (type == "PhysicsSphericalJoint") {
    joint.kind = JointKind::Spherical;
    for (const char* cone : {"physics:coneAngle0Limit", "physics:coneAngle1Limit"})
      if (const double limit = getNumber(prim, cone, -1, true); limit >= 0 && std::isfinite(limit))
        note(prim.find(cone)->line, cone, "the limits of a ball are left out");
    for (const char* unlimited : {"physics:lowerLimit", "physics:upperLimit"}) prim.find(unlimited);
    return true;
  }
  if (type == "PhysicsFixedJoint") return true;
  if (type == "PhysicsJoint") return readSix(joint);
  if (type == "PhysicsDistanceJoint") {
    const double least = getNumber(prim, "physics:minDistance", -1, true),
                 most = getNumber(prim, "physics:maxDistance", -1, true);
    if (!(least == most && least > 0))
      failUsd(path_, prim, "it is a rope: its physics:minDistance is not its physics:maxDistance, or not positive",
              "give both the same length");
    joint.length = least * meter_;
    joint.is_excluded = true;  // no tree hangs on a rod without a body
    return true;
  }
  failUsd(path_, prim, "it is a " + std::string(type) + ", which is not supported",
          type.find("Gear") != std::string_view::npos || type.find("Rack") != std::string_view::npos
              ? "couple the two joints by NewtonMimicAPI or PhysxMimicJointAPI in its place"
              : "replace it by revolute, prismatic, spherical and fixed joints");
}

void UsdReader::readRange(UsdJoint& joint, std::string_view lower, std::string_view upper) const {
  constexpr double kFar = 1e30;  // some write the largest float for none
  const double unit = getCoordinateUnit(joint);
  const double low = getNumber(*joint.prim, lower, -HUGE_VAL, true),
               high = getNumber(*joint.prim, upper, HUGE_VAL, true);
  if (!(low <= high)) failUsd(path_, *joint.prim, "its range is empty", "give the lower limit first");
  if (low > -kFar) joint.lower = low * unit;
  if (high < kFar) joint.upper = high * unit;
}

// Where the joint is in one of its bodies, by the prim that it names.
void UsdReader::readFrame(UsdJoint& joint, int end) {
  const UsdPrim& prim = *joint.prim;
  const std::string number = std::to_string(end), place = "physics:localPos" + number,
                    turn = "physics:localRot" + number;
  const UsdPrim* target = findTarget(prim, "physics:body" + number);
  if (target && !places_.count(target))
    failUsd(path_, prim, "its physics:body" + number + " is no part of the robot: <" + target->getPath() + ">",
            "name a rigid body");
  const int body = target ? body_of_.at(target) : 0;
  const UsdTransform& M = places_.at(target);
  const UsdBody& owner = bodies_[static_cast<size_t>(body)];
  const Vector3d p = getUsdVector(path_, prim, place, Vector3d::Zero());
  const Matrix3d R = getUsdRotation(path_, prim, turn);
  joint.body[end] = body;
  if (body > 0 && target == owner.prim) {
    joint.X_SJ[end] = {R, calcUsdScale(M).cwiseProduct(p)};
  } else {
    const SE3 X_WT = target ? calcUsdPlace(path_, *target, M) : SE3(M.topLeftCorner<3, 3>() / meter_, Vector3d::Zero());
    joint.X_SJ[end] = owner.X_WS.inverse() * SE3(X_WT.R * R, M.topLeftCorner<3, 3>() * p + M.topRightCorner<3, 1>());
  }
  if (!joint.X_SJ[end].p.allFinite()) failUsd(path_, prim, "its place is not finite", "give smaller numbers");
  if (const UsdProperty* found = prim.find(place))
    lengths_.add(spaceOut(found->value), calcUsdScale(M).maxCoeff(), isFloat(found->type));
  // An angle is twice that of its quaternion.
  if (const UsdProperty* found = prim.find(turn)) angles_.add(spaceOut(found->value), 2, isFloat(found->type));
}

// A joint with a drive has a motor; its stiffness and damping are a servo, which is not part of a robot here.
void UsdReader::readDrive(UsdJoint& joint) {
  const UsdPrim& prim = *joint.prim;
  constexpr std::string_view kDrive = "PhysicsDriveAPI:";
  for (const std::string& schema : prim.listMetadata("apiSchemas")) {
    if (schema.rfind(kDrive, 0) != 0) continue;
    const std::string name = schema.substr(kDrive.size()), prefix = "drive:" + name + ":physics:";
    if (joint.coordinate.empty() || (name != joint.coordinate)) {
      if (!joint.siblings.empty() && (contains(joint.siblings, name) || joint.coordinate != joint.siblings[0]))
        continue;
      note(prim.line, schema, "left out: it does not drive the one coordinate of its joint");
      for (const char* key :
           {"maxForce", "stiffness", "damping", "type", "targetPosition", "targetVelocity", "maxVelocity"})
        prim.find(prefix + key);
      continue;
    }
    const double effort = getNumber(prim, prefix + "maxForce", HUGE_VAL, true);
    const double stiffness = getNumber(prim, prefix + "stiffness", 0), damping = getNumber(prim, prefix + "damping", 0);
    const double velocity = getNumber(prim, prefix + "maxVelocity", HUGE_VAL, true);
    for (const char* key : {"targetPosition", "targetVelocity"}) prim.find(prefix + key);
    if (!(effort >= 0)) failUsd(path_, prim, "the maxForce of its drive is negative", "give 0 or more");
    if (effort == 0) {
      note(prim.line, schema, "left out: its maxForce is 0");
      continue;
    }
    joint.is_driven = true;
    constexpr double kFar = 1e30;
    if (effort < kFar) joint.effort = getForceUnit(joint) * effort;
    if (velocity > 0 && velocity < kFar) joint.velocity = getCoordinateUnit(joint) * velocity;
    if (stiffness != 0 || damping != 0)
      note(prim.line, schema, "its servo (stiffness, damping) is left out: it becomes an ideal motor");
    if (getUsdText(prim, prefix + "type") == "acceleration")
      note(prim.line, schema, "its type is acceleration: its maxForce is read as that of a force");
  }
}

// What PhysX, Newton and MuJoCo say of a joint; the first that is given.
void UsdReader::readExtensions(UsdJoint& joint) {
  const UsdPrim& prim = *joint.prim;
  const auto get = [&](std::initializer_list<const char*> names) {
    double first = 0;
    for (const char* name : names)
      if (const double value = getNumber(prim, name, 0, true); first == 0 && value > 0 && value < 1e30) first = value;
    return first;
  };
  const double unit =
      joint.coordinate.empty() ? kilogram_ * meter_ * meter_ : getForceUnit(joint) / (isAngular(joint) ? 1 : meter_);
  joint.armature = unit * get({"physxJoint:armature", "newton:armature", "mjc:armature"});
  if (joint.coordinate.empty()) return;
  const double velocity = get({"physxJoint:maxJointVelocity", "newton:velocityLimit"});
  if (velocity > 0) joint.velocity = std::min(joint.velocity, getCoordinateUnit(joint) * velocity);
  const double force = getForceUnit(joint), damping = get({"newton:damping"}), per_radian = get({"mjc:damping"});
  joint.force.damping =
      damping > 0 ? force * damping / getCoordinateUnit(joint) : force * per_radian / (isAngular(joint) ? 1 : meter_);
  joint.force.friction = force * get({"newton:friction", "mjc:frictionloss"});
}

UsdJoint* UsdReader::findJoint(const UsdPrim* prim) {
  const auto found = std::find_if(joints_.begin(), joints_.end(), [prim](const UsdJoint& j) { return j.prim == prim; });
  return found == joints_.end() ? nullptr : &*found;
}

// An actuator of MuJoCo or Newton drives the joint that it names.
void UsdReader::readActuator(const UsdPrim& prim) {
  const std::string kind(prim.type);
  UsdJoint* joint = findJoint(findTarget(prim, kind == "MjcActuator" ? "mjc:target" : "newton:targets"));
  const std::optional<std::vector<double>> gears =
      prim.find("mjc:gear") ? parseUsdNumbers(prim.find("mjc:gear")->value) : std::nullopt;
  const double most = getNumber(prim, "mjc:forceRange:max", 0, true),
               input = getNumber(prim, "mjc:ctrlRange:max", 0, true);
  const std::string bias = getUsdText(prim, "mjc:biasType");
  for (const UsdProperty& property : prim.properties) property.is_used = true;
  if (!joint || joint->coordinate.empty() || !joint->siblings.empty())
    return note(prim.line, kind, "it is left out: motors can only drive joints with one coordinate");
  joint->is_driven = true;
  const bool is_servo = kind == "NewtonActuator" || (!bias.empty() && bias != "none");
  if (is_servo) note(prim.line, kind, "its servo is left out: it becomes an ideal motor");
  const double gear = gears && !gears->empty() ? std::abs((*gears)[0]) : 1, force = most > 0   ? most
                                                                                    : is_servo ? 0
                                                                                               : input;
  if (force > 0 && std::isfinite(gear * force) && gear > 0)
    joint->effort = std::min(joint->effort, getForceUnit(*joint) * gear * force);
}

// Joints of MuJoCo between the same two bodies act one after the other, with links without mass in between.
void UsdReader::chainJoints() {
  std::map<std::pair<int, int>, UsdJoint*> last;
  for (UsdJoint& joint : joints_) {
    if (!joint.prim->hasApi("MjcJointAPI") || joint.coordinate.empty() || joint.is_excluded || !joint.siblings.empty())
      continue;
    UsdJoint*& before = last[{joint.body[0], joint.body[1]}];
    if (before) {
      UsdBody between;
      between.name = makeUnusedName(getLink(joint.body[1]) + "/" + before->name,
                                    [this](const std::string& made) { return link_names_.count(made) > 0; });
      between.X_WS = bodies_[static_cast<size_t>(joint.body[1])].X_WS;
      link_names_.insert(between.name);
      before->body[1] = joint.body[0] = static_cast<int>(bodies_.size());
      joint.X_SJ[0] = joint.X_SJ[1];
      bodies_.push_back(std::move(between));
      note(joint.prim->line, "second MjcJointAPI between two bodies", "read as one after the other, as MuJoCo does");
    }
    before = &joint;
  }
}

// A joint that follows another: q = coef0 + coef1 q of the leader; PhysX has q + gearing q of the leader + offset = 0.
void UsdReader::readMimic(const UsdJoint& joint) {
  const UsdPrim& prim = *joint.prim;
  const UsdPrim* leader = nullptr;
  double multiplier = 1, offset = 0;  // of the joint's unit
  if (prim.hasApi("NewtonMimicAPI") || prim.hasApi("MjcEqualityJointAPI")) {
    if (!getFlag(prim, "newton:mimicEnabled", true)) return note(prim.line, "NewtonMimicAPI that is not enabled");
    leader = findTarget(prim, "newton:mimicJoint");
    multiplier = getNumber(prim, "newton:mimicCoef1", getNumber(prim, "mjc:coef1", 1));
    offset = getNumber(prim, "newton:mimicCoef0", getNumber(prim, "mjc:coef0", 0) / (isAngular(joint) ? kDegree : 1));
    if (!leader) leader = findTarget(prim, "mjc:target");
    for (const char* higher : {"mjc:coef2", "mjc:coef3", "mjc:coef4"})
      if (getNumber(prim, higher, 0) != 0)
        failUsd(path_, prim, "its " + std::string(higher) + " makes it follow by a curve",
                "keep coef0 and coef1 alone");
  }
  for (const std::string& schema : prim.listMetadata("apiSchemas")) {
    constexpr std::string_view kMimic = "PhysxMimicJointAPI:";
    if (schema.rfind(kMimic, 0) != 0) continue;
    const std::string prefix = "physxMimicJoint:" + schema.substr(kMimic.size()) + ":";
    const UsdPrim* reference = findTarget(prim, prefix + "referenceJoint");
    const double gearing = getNumber(prim, prefix + "gearing", 1), at = getNumber(prim, prefix + "offset", 0);
    for (const char* key : {"referenceJointAxis", "naturalFrequency", "dampingRatio"}) prim.find(prefix + key);
    if (leader || !reference) continue;
    leader = reference, multiplier = -gearing, offset = -at;
  }
  if (!leader) return;
  const UsdJoint* other = findJoint(leader);
  if (!other || other->coordinate.empty() || !other->is_carrying || !other->siblings.empty())
    failUsd(path_, prim,
            "the joint that it follows, <" + leader->getPath() + ">, closes a loop or has not one coordinate",
            "name another one");
  if (joint.coordinate.empty() || !joint.is_carrying || !joint.siblings.empty())
    failUsd(path_, prim, "it follows another joint, but closes a loop or has not one coordinate", "remove its mimic");
  const auto found = std::find_if(tree_.joints.begin(), tree_.joints.end(),
                                  [&](const UrdfJoint& j) { return j.joint.name == joint.name; });
  const double lengths = (isAngular(joint) ? 1 : meter_) / (isAngular(*other) ? 1 : meter_);
  found->mimicked = other->name;
  found->multiplier = multiplier * lengths;
  found->offset = offset * getCoordinateUnit(joint);
}

}  // namespace bielle
