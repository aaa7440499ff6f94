// The YAML file of a robot. Unknown keys of any map are rejected.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "bielle/model/error.h"
#include "formats/motor_catalogue.h"
#include "formats/robot_files.h"
#include "formats/robot_text.h"
#include "formats/yaml_entry.h"
#include "math/direction.h"
#include "model/stiction.h"

namespace bielle {
namespace {

using Entry = YamlEntry;
using Fields = YamlFields;

constexpr double kMostYaw = 3.1416;  // rad, half a turn of four decimals

std::vector<std::string> listRobotKeys() {
  std::vector<std::string> keys = {"closed_loop", "type", "closure_name", "name_mot"};
  keys.insert(keys.end(), listSharedKeys().begin(), listSharedKeys().end());
  keys.insert(keys.end(), {"joint_name", "joint_type", "cross_inertia", "frames", "model", "generator", "set",
                           "rounding", "play", "rod_friction"});
  return keys;
}

const char* const kRobotOrPart = "robot, part";
const YamlKeys kRobotKeys("robot", "", listRobotKeys());
const YamlKeys kClosureKeys(kRobotOrPart, "closures[]",
                            {"name", "frames", "type", "axis", "length", "joints", "offset", "kp", "kd"});
const YamlKeys kRodFrictionKeys("robot", "rod_friction.CLOSURE",
                                {"coefficient", "radius", "friction_speed", "stiction", "stribeck_speed", "joints"});
const YamlKeys kJointForceKeys(kRobotOrPart, "joint_forces.JOINT",
                               {"stiffness", "rest", "preload", "damping", "friction", "friction_speed", "stiction",
                                "stribeck_speed"});
const YamlKeys kPointSpringKeys(kRobotOrPart, "point_springs.NAME",
                                {"frames", "points", "stiffness", "rest", "preload", "damping"});
const YamlKeys kContactKeys(kRobotOrPart, "contacts.NAME", {"frame", "type", "sole", "length"});
const YamlKeys kReferenceKeys(kRobotOrPart, "references.NAME", {"joints", "height", "feet"});
const YamlKeys kHeightKeys(kRobotOrPart, "references.NAME.height", {"frame", "value"});
const YamlKeys kFootKeys(kRobotOrPart, "references.NAME.feet.CONTACT", {"place", "yaw"});

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

ClosureKind readClosureKind(const Entry& entry) {
  for (ClosureKind kind : {ClosureKind::Weld6D, ClosureKind::Ball3D, ClosureKind::Hinge5D, ClosureKind::Coupler,
                           ClosureKind::Distance, ClosureKind::Slider})
    if (lower(entry.getText()) == getName(kind)) return kind;
  entry.fail("closure type '" + entry.getText() + "' is unknown",
             "use 6d (weld), 5d (hinge), 3d (ball), slider, distance (rod) or coupler");
}

JointRetyping readJointType(const Entry& entry) {
  static const std::map<std::string, JointKind> kinds = {
      {"spherical", JointKind::Spherical},   {"fixed", JointKind::Fixed},         {"revolute", JointKind::Revolute},
      {"continuous", JointKind::Continuous}, {"prismatic", JointKind::Prismatic}, {"planar", JointKind::Planar},
      {"floating", JointKind::FreeFlyer}};
  const std::string type = lower(entry.getText());
  if (const auto it = kinds.find(type); it != kinds.end()) return {it->second, Vector3d::UnitZ(), Vector3d::UnitY()};
  const auto isAxis = [](char c) { return c >= 'x' && c <= 'z'; };
  if (type.size() == 9 && type.compare(0, 7, "ujoint_") == 0 && isAxis(type[7]) && isAxis(type[8]) &&
      type[7] != type[8])
    return {JointKind::Universal, Vector3d::Unit(type[7] - 'x'), Vector3d::Unit(type[8] - 'x')};
  entry.fail(
      "joint type '" + entry.getText() + "' is unknown",
      "use SPHERICAL, UJOINT_ and two different axes (UJOINT_XY), FIXED, REVOLUTE, CONTINUOUS, PRISMATIC, PLANAR "
      "or FLOATING");
}

// "knee_A" and "knee_B" are the ends of "knee"; other pairs get both names.
std::string makeClosureName(const std::string& a, const std::string& b) {
  const std::string stem = a.substr(0, a.size() - 1);
  const char end_a = std::toupper(static_cast<unsigned char>(a.back())),
             end_b = std::toupper(static_cast<unsigned char>(b.back()));
  const bool ends = (end_a == 'A' && end_b == 'B') || (end_a == 'B' && end_b == 'A');
  if (!ends || a.size() != b.size() || b.compare(0, stem.size(), stem) != 0) return a + "--" + b;
  const size_t last = stem.find_last_not_of("_-. ");
  return last == std::string::npos ? a + "--" + b : stem.substr(0, last + 1);
}

// The names in a list.
void addNames(RobotName::Kind kind, const Entry& list, YamlFile& file) {
  for (const Entry& entry : list.getList()) file.names.push_back({kind, entry.getText(), entry});
}

// The keys of a map.
void addKeys(RobotName::Kind kind, const Entry& map, YamlFile& file) {
  for (const auto& [name, entry] : map.getMap()) file.names.push_back({kind, name, entry});
}

// closed_loop, type, closure_name: the published lists.
void readPublishedClosures(const Fields& fields, const Entry& root, YamlFile& file) {
  const Entry *loops = find(fields, "closed_loop"), *types = find(fields, "type"),
              *names = find(fields, "closure_name");
  if (!loops) {
    if (types || names)
      (types ? types : names)->fail("there is no closed_loop", "list the frames of each closure there");
    return;
  }
  const std::vector<Entry> pairs = loops->getList();
  const int n = static_cast<int>(pairs.size());
  const std::vector<Entry> kinds = require(fields, "type", root).getList(n);
  const std::vector<std::string> given = names ? names->getTexts(n) : std::vector<std::string>();
  for (int i = 0; i < n; ++i) {
    const std::vector<std::string> frames = pairs[i].getTexts(2);
    ClosureSpec closure;
    closure.name = names ? given[i] : makeClosureName(frames[0], frames[1]);
    closure.frame1 = frames[0];
    closure.frame2 = frames[1];
    addNames(RobotName::Kind::Frame, pairs[i], file);
    closure.kind = readClosureKind(kinds[i]);
    if (closure.kind == ClosureKind::Coupler)
      kinds[i].fail("a coupler does not connect frames", "list it under `closures` with its joints");
    file.closures.push_back(closure);
  }
}

void readCoupler(const Fields& fields, const Entry& entry, ClosureSpec& closure, YamlFile& file) {
  if (const Entry* frames = find(fields, "frames"))
    frames->fail("a coupler connects coordinates, not frames", "give its joints with their coefficients");
  closure.name = require(fields, "name", entry).getText();
  for (const auto& [joint, coefficient] : require(fields, "joints", entry).getMap()) {
    std::vector<double> polynomial =
        coefficient.isList() ? coefficient.getNumbers() : std::vector<double>{coefficient.getNumber()};
    if (polynomial.empty()) coefficient.fail("it has no coefficient", "give a number, or a list for q, q^2, ..");
    closure.coefficients.emplace(joint, polynomial.front());
    polynomial.erase(polynomial.begin());
    if (!polynomial.empty()) closure.higher.emplace(joint, std::move(polynomial));
    file.names.push_back({RobotName::Kind::Joint, joint, coefficient});
  }
  if (const Entry* offset = find(fields, "offset")) closure.offset = offset->getNumber();
}

void readTiedFrames(const Fields& fields, const Entry& entry, ClosureSpec& closure, YamlFile& file) {
  for (const char* key : {"joints", "offset"})
    if (const Entry* found = find(fields, key)) found->fail("only a coupler has it", "use type coupler or remove it");
  const std::vector<std::string> frames = require(fields, "frames", entry).getTexts(2);
  addNames(RobotName::Kind::Frame, fields.at("frames"), file);
  const Entry* name = find(fields, "name");
  closure.name = name ? name->getText() : makeClosureName(frames[0], frames[1]);
  closure.frame1 = frames[0];
  closure.frame2 = frames[1];
}

void readRodFrictions(const Entry& map, YamlFile& file) {
  for (const auto& [closure, entry] : map.getMap()) {
    const Fields fields = entry.getFields(kRodFrictionKeys);
    RodFriction friction;
    friction.closure = closure;
    friction.coefficient = require(fields, "coefficient", entry).getNumber();
    friction.radius = require(fields, "radius", entry).getNumber();
    if (const Entry* speed = find(fields, "friction_speed")) friction.friction_speed = speed->getNumber();
    if (const Entry* stiction = find(fields, "stiction")) friction.stiction = stiction->getNumber();
    if (const Entry* speed = find(fields, "stribeck_speed")) friction.stribeck_speed = speed->getNumber();
    if (const Entry* joints = find(fields, "joints")) {
      friction.joints = joints->getTexts();
      addNames(RobotName::Kind::Joint, *joints, file);
    }
    file.wear.frictions.push_back(std::move(friction));
  }
}

void readClosures(const Entry& list, YamlFile& file) {
  for (const Entry& entry : list.getList()) {
    const Fields fields = entry.getFields(kClosureKeys);
    ClosureSpec closure;
    closure.kind = readClosureKind(require(fields, "type", entry));
    if (closure.kind == ClosureKind::Coupler)
      readCoupler(fields, entry, closure, file);
    else
      readTiedFrames(fields, entry, closure, file);
    if (const Entry* axis = find(fields, "axis")) {
      if (!hasAxis(closure.kind))
        axis->fail("only a hinge or a slider has an axis", "use type 5d or slider, or remove it");
      closure.axis = axis->getVector3();
      if (axis->isList())
        for (const std::string& number : axis->getTexts()) file.axes.add(number);
    }
    if (const Entry* length = find(fields, "length")) {
      if (closure.kind != ClosureKind::Distance)
        length->fail("only a distance has a length", "use type distance or remove it");
      closure.length = length->getNumber();
      if (!(*closure.length > 0))
        length->fail("the length of a distance is above 0", "correct it; points that coincide are a ball (3d)");
    }
    if (const Entry* kp = find(fields, "kp")) closure.kp = kp->getNumber();
    if (const Entry* kd = find(fields, "kd")) closure.kd = kd->getNumber();
    file.closures.push_back(closure);
  }
}

void readJointTypes(const Fields& fields, YamlFile& file) {
  const Entry *names = find(fields, "joint_name"), *types = find(fields, "joint_type");
  if (!names && !types) return;
  if (!names || !types)
    (names ? names : types)->fail(names ? "there is no joint_type" : "there is no joint_name", "give both lists");
  const std::vector<std::string> joints = names->getTexts();
  const std::vector<Entry> kinds = types->getList(static_cast<int>(joints.size()));
  std::set<std::string> seen;
  for (size_t i = 0; i < joints.size(); ++i) {
    if (!seen.insert(joints[i]).second) names->fail("joint '" + joints[i] + "' is listed twice", "list it once");
    file.joint_types.emplace_back(joints[i], readJointType(kinds[i]));
  }
}

void readFrames(const Entry& map, YamlFile& file) {
  for (const auto& [name, entry] : map.getMap()) {
    const Fields fields = entry.getFields(kFrameKeys);
    FrameSpec frame{name, require(fields, "link", entry).getText(), {}};
    if (const Entry* place = find(fields, "place")) frame.X_LF.p = place->getVector3();
    if (const Entry* rpy = find(fields, "rpy")) {
      constexpr double kTurn = 6.2832;  // rad
      const Vector3d angles = rpy->getVector3();
      frame.X_LF.R = makeRotation(angles);
      if (angles.cwiseAbs().maxCoeff() > kTurn)
        file.warnings.push_back(file.path + ": frame '" + name +
                                "': an angle of its rpy is more than a turn; give radians if degrees were meant");
    }
    file.frames.push_back(frame);
  }
}

void readPlays(const Entry& map, YamlFile& file) {
  for (const auto& [name, entry] : map.getMap()) {
    file.wear.plays.push_back({name, entry.getNumber()});
    if (!(file.wear.plays.back().size >= 0)) entry.fail("it is negative", "give the way from stop to stop, rad or m");
  }
}

double readCrossInertia(const Entry& entry) {
  const double inertia = entry.getNumber();
  if (!(inertia > 0)) entry.fail("it is not positive", "give kg m^2, or leave it out for a cross without inertia");
  return inertia;
}

void readMotors(const Fields& fields, YamlFile& file) {
  const Entry *names = find(fields, "name_mot"), *motors = find(fields, "motors"),
              *catalogue = find(fields, "motor_catalogue");
  if (catalogue && !motors && !find(fields, "roles"))
    catalogue->fail("no motor is taken from it", "give `motors` with a `type`, or remove it");
  if (motors) {
    if (names) file.warnings.push_back(file.path + ": key 'name_mot': it is ignored, 'motors' lists the motors");
    file.motors = readMotorSpecs(*motors, file.path, catalogue);
    addKeys(RobotName::Kind::Joint, *motors, file);
  } else if (names) {
    for (const std::string& joint : names->getTexts()) file.motors.push_back({joint, {}, {}, {}, {}, {}, {}});
    addNames(RobotName::Kind::Joint, *names, file);
  }
  if (const Entry* armature = find(fields, "armature")) {
    if (!armature->isMap()) {
      file.motor_armature = armature->getNumber();
    } else {
      for (const auto& [joint, entry] : armature->getMap()) file.armature[joint] = entry.getNumber();
      addKeys(RobotName::Kind::Joint, *armature, file);
    }
  }
}

void readJointForces(const Entry& map, YamlFile& file) {
  addKeys(RobotName::Kind::Joint, map, file);
  for (const auto& [joint, entry] : map.getMap()) {
    const Fields fields = entry.getFields(kJointForceKeys);
    WholeJointForce whole;
    JointForce& force = whole.force;
    const auto read = [&fields](const char* key, double& value) {
      if (const Entry* found = find(fields, key)) value = found->getNumber();
    };
    read("stiffness", force.stiffness);
    read("rest", force.rest);
    read("preload", force.preload);
    read("damping", force.damping);
    read("friction", force.friction);
    read("friction_speed", force.friction_speed);
    whole.stiction = force.friction;
    read("stiction", whole.stiction);
    read("stribeck_speed", whole.stribeck_speed);
    if (const Entry* found = find(fields, "stiction"); found && !(whole.stiction >= force.friction))
      found->fail("it is less than the friction of sliding", "give what it takes to set the joint in motion");
    if (const Entry* found = find(fields, "stribeck_speed")) {
      if (!(whole.stiction > force.friction))
        found->fail("there is no stiction above the friction", "add `stiction`, or remove it");
      if (!(whole.stribeck_speed > force.friction_speed))
        found->fail("it is not above the friction_speed",
                    "give the speed at which friction has fallen to that of sliding");
    }
    for (const JointForce& part : splitJointForce(whole)) file.joint_forces.push_back({joint, part});
  }
}

void readPointSprings(const Entry& map, YamlFile& file) {
  for (const auto& [name, entry] : map.getMap()) {
    const Fields fields = entry.getFields(kPointSpringKeys);
    const std::vector<std::string> frames = require(fields, "frames", entry).getTexts(2);
    addNames(RobotName::Kind::Frame, fields.at("frames"), file);
    PointSpringSpec spec{frames[0], frames[1], {}};
    PointSpring& spring = spec.spring;
    spring.name = name;
    if (const Entry* points = find(fields, "points")) {
      const std::vector<Entry> list = points->getList(2);
      spring.point1 = list[0].getVector3();
      spring.point2 = list[1].getVector3();
    }
    const auto read = [&fields](const char* key, double& value) {
      if (const Entry* found = find(fields, key)) value = found->getNumber();
    };
    read("stiffness", spring.stiffness);
    read("rest", spring.rest);
    read("preload", spring.preload);
    read("damping", spring.damping);
    if (spring.stiffness != 0 && !find(fields, "rest"))
      entry.fail("it has a stiffness but no rest", "give its length [m] without load, or at its preload");
    file.point_springs.push_back(std::move(spec));
  }
}

void readContacts(const Entry& map, YamlFile& file) {
  for (const auto& [name, entry] : map.getMap()) {
    const Fields fields = entry.getFields(kContactKeys);
    ContactSpec contact;
    contact.name = name;
    contact.frame = require(fields, "frame", entry).getText();
    file.names.push_back({RobotName::Kind::Frame, contact.frame, fields.at("frame")});
    const Entry& type = require(fields, "type", entry);
    const std::string kind = lower(type.getText());
    if (kind != "6d" && kind != "5d" && kind != "3d")
      type.fail("contact type '" + kind + "' is unknown", "use 6d (sole), 5d (edge) or 3d (point)");
    contact.kind = kind == "6d" ? ContactKind::Surface6D : kind == "5d" ? ContactKind::Edge5D : ContactKind::Point3D;
    if (const Entry* length = find(fields, "length")) {
      if (contact.kind != ContactKind::Edge5D) length->fail("only an edge has a length", "use type 5d, or `sole`");
      contact.half_length = length->getNumber() / 2;
    }
    if (const Entry* sole = find(fields, "sole")) {
      if (contact.kind == ContactKind::Point3D) sole->fail("a point has no sole", "use type 6d or remove it");
      if (contact.kind == ContactKind::Edge5D) sole->fail("an edge has no sole", "give its `length`, in metres");
      const std::vector<double> size = sole->getNumbers(2);
      contact.half_length = size[0] / 2;
      contact.half_width = size[1] / 2;
    }
    file.contacts.push_back(contact);
  }
}

// A place alone, or {place, yaw}.
void readFoot(const std::string& contact, const Entry& entry, Reference& reference) {
  if (!entry.isMap()) {
    reference.feet[contact] = entry.getVector3();
    return;
  }
  const Fields fields = entry.getFields(kFootKeys);
  reference.feet[contact] = require(fields, "place", entry).getVector3();
  const Entry* yaw = find(fields, "yaw");
  if (!yaw) return;
  reference.yaws[contact] = yaw->getNumber();
  if (std::abs(reference.yaws[contact]) > kMostYaw) yaw->fail("it is more than half a turn", "give radians, e.g. 0.2");
}

void readReferences(const Entry& map, YamlFile& file) {
  for (const auto& [name, entry] : map.getMap()) {
    const Fields fields = entry.getFields(kReferenceKeys);
    Reference reference;
    reference.name = name;
    if (const Entry* joints = find(fields, "joints")) {
      addKeys(RobotName::Kind::Joint, *joints, file);
      for (const auto& [joint, value] : joints->getMap())
        reference.joints[joint] = value.isList() ? value.getNumbers() : std::vector<double>{value.getNumber()};
    }
    if (const Entry* height = find(fields, "height")) {
      const Fields f = height->getFields(kHeightKeys);
      reference.height_frame = require(f, "frame", *height).getText();
      file.names.push_back({RobotName::Kind::Frame, reference.height_frame, f.at("frame")});
      reference.height = require(f, "value", *height).getNumber();
    }
    if (const Entry* feet = find(fields, "feet")) {
      addKeys(RobotName::Kind::Contact, *feet, file);
      for (const auto& [contact, value] : feet->getMap()) readFoot(contact, value, reference);
    }
    file.references.push_back(reference);
  }
}

void readImportance(const Entry& map, YamlFile& file) {
  addKeys(RobotName::Kind::Joint, map, file);
  for (const auto& [joint, entry] : map.getMap()) {
    const std::vector<double> values = entry.getNumbers(2);
    if (values[0] < 0 || values[1] < 0) entry.fail("a number is negative", "give [position, velocity], 0 or more");
    file.importance.push_back({joint, {values[0], values[1]}});
  }
}

BaseKind readBase(const Entry& entry) {
  const std::string base = entry.getText();
  if (base != "free" && base != "fixed") entry.fail("base '" + base + "' is unknown", "use free or fixed");
  return base == "free" ? BaseKind::Free : BaseKind::Fixed;
}

void readGenerator(const Fields& fields, YamlFile& file) {
  const Entry *generator = find(fields, "generator"), *settings = find(fields, "set");
  if (settings && !generator) settings->fail("there is no generator", "name it under `generator`, or remove the key");
  if (!generator) return;
  if (!file.models.empty()) generator->fail("there is a key 'model' as well", "keep one of them");
  generator->getText();
  file.generator = *generator;
  if (settings) file.settings = *settings;
}

void readRoot(const Entry& root, YamlFile& file) {
  if (root.isMap())
    for (const auto& [key, entry] : root.getMap())
      if (key == "tree") {  // its numbers are expressions
        file.composed = root;
        return;
      }
  const Fields fields = root.getFields(kRobotKeys);
  readPublishedClosures(fields, root, file);
  readJointTypes(fields, file);
  if (const Entry* entry = find(fields, "cross_inertia")) file.cross_inertia = readCrossInertia(*entry);
  readSharedKeys(fields, file);
  if (const Entry* entry = find(fields, "rounding")) {
    file.rounding = entry->getNumber();
    if (!(*file.rounding >= 0 && *file.rounding <= kMostGivenRounding))
      entry->fail("it is not within 0 .. 3e-3",
                  "give by how much angles (rad) and lengths (m) are rounded; 0: not at all");
  }
  if (const Entry* entry = find(fields, "frames")) readFrames(*entry, file);
  if (const Entry* entry = find(fields, "play")) readPlays(*entry, file);
  if (const Entry* entry = find(fields, "rod_friction")) readRodFrictions(*entry, file);
  if (const Entry* entry = find(fields, "model"))
    file.models = entry->isList() ? entry->getTexts() : std::vector<std::string>{entry->getText()};
  readGenerator(fields, file);
}

}  // namespace

const YamlKeys kFrameKeys(kRobotOrPart, "frames.NAME", {"link", "place", "rpy"});

const std::vector<std::string>& listSharedKeys() {
  static const std::vector<std::string> keys = {"motors",        "motor_catalogue", "armature",      "closures",
                                                "joint_forces",  "contacts",        "point_springs", "references",
                                                "serial_joints", "gravity",         "importance",    "base"};
  return keys;
}

void readSharedKeys(const YamlFields& fields, YamlFile& file) {
  readMotors(fields, file);
  if (const Entry* entry = find(fields, "closures")) readClosures(*entry, file);
  if (const Entry* entry = find(fields, "joint_forces")) readJointForces(*entry, file);
  if (const Entry* entry = find(fields, "point_springs")) readPointSprings(*entry, file);
  if (const Entry* entry = find(fields, "contacts")) readContacts(*entry, file);
  if (const Entry* entry = find(fields, "references")) readReferences(*entry, file);
  if (const Entry* entry = find(fields, "serial_joints")) {
    file.serial_joints = entry->getTexts();
    addNames(RobotName::Kind::Joint, *entry, file);
  }
  if (const Entry* entry = find(fields, "importance")) readImportance(*entry, file);
  if (const Entry* entry = find(fields, "gravity")) file.gravity = entry->getVector3();
  if (const Entry* entry = find(fields, "base")) file.base = readBase(*entry);
}

YamlFile parseYaml(const std::string& text, const std::string& path) {
  YamlFile file;
  file.path = path;
  readYamlDocument(path, text, [&](const Entry& root) { readRoot(root, file); });
  return file;
}

YamlFile readYaml(const std::string& path) { return parseYaml(readRobotText(path), path); }

}  // namespace bielle
