#include "formats/reader_drake.h"

#include <algorithm>
#include <cmath>
#include <locale>
#include <map>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "formats/reader_loops.h"
#include "math/direction.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool isOfDrake(const std::string& name) { return name.rfind("drake:", 0) == 0; }

bool hasDrakeElement(const XMLElement& element) {
  for (const XMLElement* e : getChildren(element))
    if (isOfDrake(getTag(*e)) || hasDrakeElement(*e)) return true;
  return false;
}

class DrakeReader {
 public:
  DrakeReader(const XMLElement& robot, UrdfFile& file, YamlFile& settings)
      : robot_(robot), file_(file), settings_(settings) {}

  void read() {
    for (const XMLElement* e : getChildren(robot_))
      if (isJoint(*e)) readJoint(*e);
    for (const XMLElement* e : getChildren(robot_, "frame")) frames_[getAttribute(e, "name")] = e;
    for (const XMLElement* e : getChildren(robot_)) {
      const std::string& tag = getTag(*e);
      if (tag == "transmission")
        readTransmission(*e);
      else if (tag == "drake:ball_constraint")
        readBallConstraint(*e);
      else if (tag == "drake:linear_bushing_rpy")
        readBushing(*e);
      else if (tag == "drake:tendon_constraint")
        readDrakeTendon(*e, file_, settings_);
      else if (tag == "drake:linear_spring_damper")
        readSpringDamper(*e);
      // What may collide is of no meaning here.
      else if (isOfDrake(tag) && tag != "drake:joint" && tag != "drake:collision_filter_group")
        warn(*e, "it is left out");
    }
  }

 private:
  [[noreturn]] void fail(const XMLElement& e, const std::string& problem, const std::string& remedy) const {
    throw InputError(file_.path, describe(e), problem, remedy);
  }

  void warn(const XMLElement& e, const std::string& problem) {
    file_.warnings.push_back(file_.path + ": " + describe(e) + ": " + problem);
  }

  const XMLElement& getChild(const XMLElement& e, const std::string& tag) const {
    const XMLElement* child = e.FirstChildElement(tag.c_str());
    if (!child) fail(e, "it has no <" + tag + ">", "give one");
    return *child;
  }

  // Finite numbers of an attribute.
  std::vector<double> getNumbers(const XMLElement& e, const char* attribute, size_t count) const {
    const std::string text = getAttribute(&e, attribute);
    std::istringstream stream(text);
    stream.imbue(std::locale::classic());
    std::vector<double> values;
    for (double value; values.size() <= count && stream >> value;)
      if (std::isfinite(value)) values.push_back(value);
    if (!stream.eof() || values.size() != count)
      fail(e,
           std::string("its attribute '") + attribute + "', \"" + text + "\", is not made of " + std::to_string(count) +
               " finite number(s)",
           "correct it");
    return values;
  }

  double getNumber(const XMLElement& e) const { return getNumbers(e, "value", 1)[0]; }

  double getChildNumber(const XMLElement& e, const std::string& tag, bool may_be_zero) const {
    const XMLElement& child = getChild(e, tag);
    const double value = getNumber(child);
    if (value < 0 || (value == 0 && !may_be_zero))
      fail(child, "its value is not " + std::string(may_be_zero ? "zero or more" : "positive"), "correct it");
    return value;
  }

  Vector3d getChildVector(const XMLElement& e, const std::string& tag) const {
    const std::vector<double> values = getNumbers(getChild(e, tag), "value", 3);
    return {values[0], values[1], values[2]};
  }

  std::string getLink(const XMLElement& e, const std::string& tag) const {
    const XMLElement& child = getChild(e, tag);
    const std::string name = getAttribute(&child, "name");
    if (!file_.links.count(name))
      fail(child, "there is no link '" + name + "'", "declare the link or correct the name");
    return name;
  }

  UrdfJoint* findJoint(const std::string& name) {
    const auto it = std::find_if(file_.joints.begin(), file_.joints.end(),
                                 [&name](const UrdfJoint& joint) { return joint.joint.name == name; });
    return it == file_.joints.end() ? nullptr : &*it;
  }

  void readJoint(const XMLElement& e) {
    UrdfJoint& joint = *findJoint(getAttribute(&e, "name"));
    const XMLElement* limit = e.FirstChildElement("limit");
    if (!limit || getNv(joint.joint.kind) != 1) return;
    const bool lower = limit->Attribute("lower"), upper = limit->Attribute("upper");
    if (lower != upper && joint.joint.kind != JointKind::Continuous) {
      joint.lower = VectorXd::Constant(1, lower ? getNumbers(*limit, "lower", 1)[0] : -kInfinity);
      joint.upper = VectorXd::Constant(1, upper ? getNumbers(*limit, "upper", 1)[0] : kInfinity);
    }
    if (limit->Attribute("effort") && !joint.effort) effortless_.insert(joint.joint.name);
  }

  void readTransmission(const XMLElement& e) {
    const XMLElement* kind = e.FirstChildElement("type");
    const std::string type = kind ? getText(*kind) : getAttribute(&e, "type");
    if (type.empty()) fail(e, "it has no <type>", "give transmission_interface/SimpleTransmission");
    if (type.find("SimpleTransmission") == std::string::npos)
      return warn(e, "it is left out: it is not a SimpleTransmission");
    const XMLElement &driven = getChild(e, "joint"), &actuator = getChild(e, "actuator");
    const std::string name = getAttribute(&driven, "name");
    const UrdfJoint* joint = findJoint(name);
    if (!joint) fail(driven, "there is no joint '" + name + "'", "correct the name");
    if (getNv(joint->joint.kind) != 1)
      return warn(e, "it is left out: joint '" + name + "' does not have exactly one coordinate");
    if (effortless_.count(name)) return warn(e, "it is left out: the effort limit of joint '" + name + "' is 0");
    for (const MotorSpec& other : settings_.motors)
      if (other.joint == name) return warn(e, "it is left out: joint '" + name + "' already has a motor");
    MotorSpec motor;
    motor.joint = name;
    const double inertia =
        actuator.FirstChildElement("drake:rotor_inertia") ? getChildNumber(actuator, "drake:rotor_inertia", true) : 0;
    const double ratio =
        actuator.FirstChildElement("drake:gear_ratio") ? getChildNumber(actuator, "drake:gear_ratio", false) : 1;
    if (ratio == 1) {
      motor.armature = inertia;
    } else {
      motor.drive.ratio = ratio;  // the armature is that of the drive
      motor.drive.rotor_inertia = inertia;
    }
    if (const XMLElement* gains = actuator.FirstChildElement("drake:controller_gains")) warn(*gains, "it is left out");
    for (const XMLElement* owner : {&e, &actuator})
      if (const XMLElement* reduction = owner->FirstChildElement("mechanicalReduction");
          reduction && getText(*reduction) != "1")
        warn(*reduction, "it is left out, as by Drake; <drake:gear_ratio> gives the gear");
    settings_.motors.push_back(motor);
  }

  // Drake gives them no names; ours are in an attribute that it does not look at.
  void readBallConstraint(const XMLElement& e) {
    const std::string tag = getTag(e);
    ClosureSpec closure;
    closure.name = getAttribute(&e, "name");
    if (closure.name.empty()) closure.name = nameClosure("ball_" + std::to_string(e.GetLineNum()), settings_);
    closure.kind = ClosureKind::Ball3D;
    const std::string a = getLink(e, tag + "_body_A"), b = getLink(e, tag + "_body_B");
    const Vector3d p_AP = getChildVector(e, tag + "_p_AP"), p_BQ = getChildVector(e, tag + "_p_BQ");
    closure.frame1 = addUrdfFrame(file_, closure.name + "_frame1", a, {Matrix3d::Identity(), p_AP});
    closure.frame2 = addUrdfFrame(file_, closure.name + "_frame2", b, {Matrix3d::Identity(), p_BQ});
    settings_.closures.push_back(closure);
  }

  // A link, or a <frame name link xyz rpy> on one.
  std::pair<std::string, SE3> findFrame(const XMLElement& e, const std::string& tag) const {
    const XMLElement& entry = getChild(e, tag);
    const auto frame = frames_.find(getAttribute(&entry, "name"));
    if (frame == frames_.end()) return {getLink(e, tag), {}};
    const XMLElement& f = *frame->second;
    const auto get = [&](const char* attribute) {
      const std::vector<double> v =
          f.Attribute(attribute) ? getNumbers(f, attribute, 3) : std::vector<double>{0.0, 0.0, 0.0};
      return Vector3d(v[0], v[1], v[2]);
    };
    const std::string link = getAttribute(&f, "link");
    if (!file_.links.count(link)) fail(f, "there is no link '" + link + "'", "declare the link or correct the name");
    return {link, {makeRotation(get("rpy")), get("xyz")}};
  }

  void readBushing(const XMLElement& e) {
    std::optional<ClosureSpec> closure = makeBushing(getChildVector(e, "drake:bushing_torque_stiffness"),
                                                     getChildVector(e, "drake:bushing_force_stiffness"));
    if (!closure) fail(e, "it is not as stiff as a ball, a hinge or a weld", kBushingRemedy);
    warn(e, describeBushing(*closure));
    closure->name = nameClosure("bushing_" + std::to_string(e.GetLineNum()), settings_);
    const auto [a, X_A] = findFrame(e, "drake:bushing_frameA");
    const auto [c, X_C] = findFrame(e, "drake:bushing_frameC");
    closure->frame1 = addUrdfFrame(file_, closure->name + "_frame1", a, X_A);
    closure->frame2 = addUrdfFrame(file_, closure->name + "_frame2", c, X_C);
    settings_.closures.push_back(*closure);
  }

  void readSpringDamper(const XMLElement& e) {
    const std::string tag = getTag(e);
    PointSpringSpec spec{getLink(e, tag + "_body_A"), getLink(e, tag + "_body_B"), {}};
    spec.spring.name = getAttribute(&e, "name");
    if (spec.spring.name.empty())
      spec.spring.name = namePointSpring("spring_" + std::to_string(e.GetLineNum()), settings_);
    spec.spring.point1 = getChildVector(e, tag + "_p_AP");
    spec.spring.point2 = getChildVector(e, tag + "_p_BQ");
    spec.spring.rest = getChildNumber(e, tag + "_free_length", false);
    spec.spring.stiffness = getChildNumber(e, tag + "_stiffness", true);
    spec.spring.damping = getChildNumber(e, tag + "_damping", true);
    if (spec.spring.stiffness == 0 && spec.spring.damping == 0)
      return warn(e, "it is left out: it has neither stiffness nor damping");
    settings_.point_springs.push_back(spec);
  }

  const XMLElement& robot_;
  UrdfFile& file_;
  YamlFile& settings_;
  std::map<std::string, const XMLElement*> frames_;
  std::set<std::string> effortless_;  // joints with a limit of effort of zero, which Drake does not drive
};

}  // namespace

std::optional<ClosureSpec> makeBushing(const Vector3d& torque, const Vector3d& force) {
  const auto free = (torque.array() == 0).count();
  if (!(force.array() > 0).all() || (torque.array() < 0).any() || free == 2) return {};
  ClosureSpec closure;
  closure.kind = free == 3 ? ClosureKind::Ball3D : free == 1 ? ClosureKind::Hinge5D : ClosureKind::Weld6D;
  if (free == 1) closure.axis = (torque.array() == 0).cast<double>();
  return closure;
}

std::string describeBushing(const ClosureSpec& bushing) {
  return std::string("its springs become a ") +
         (bushing.kind == ClosureKind::Ball3D    ? "ball"
          : bushing.kind == ClosureKind::Hinge5D ? "hinge"
                                                 : "weld") +
         " that does not give";
}

// The length a_1 q_1 + a_2 q_2 + .. + offset stays between limits. In SDF values are text.
void readDrakeTendon(const XMLElement& e, UrdfFile& file, YamlFile& settings) {
  const std::string tag = getTag(e);
  const auto fail = [&](const XMLElement& element, const std::string& problem) {
    throw InputError(file.path, describe(element), problem, "correct it");
  };
  const auto parse = [&](const XMLElement& element, const std::string& text) {
    std::vector<double> v;
    if (!parseNumbers(text, v) || v.size() != 1) fail(element, "its value is not a finite number");
    return v[0];
  };
  const auto isInfinite = [](const std::string& text) { return text.find("inf") != std::string::npos; };
  const auto get = [&](const char* what, double usual) {
    const XMLElement* child = e.FirstChildElement((tag + what).c_str());
    const std::string text = child && child->GetText() ? getText(*child) : getAttribute(child, "value");
    return !child || isInfinite(text) ? usual : parse(*child, text);  // by default, limits are infinite
  };
  ClosureSpec coupler;
  coupler.kind = ClosureKind::Coupler;
  coupler.name = nameClosure("tendon_" + std::to_string(e.GetLineNum()), settings);
  double most = kMostPlay;
  for (const XMLElement* term : getChildren(e, (tag + "_joint").c_str())) {
    const std::string name = getAttribute(term, "name");
    const auto joint = std::find_if(file.joints.begin(), file.joints.end(), [&](const UrdfJoint& candidate) {
      return candidate.joint.name == name && getNv(candidate.joint.kind) == 1;
    });
    if (joint == file.joints.end()) fail(*term, "'" + name + "' is no joint with one coordinate");
    if (joint->joint.kind == JointKind::Prismatic) most = kMostSlidePlay;
    if (!coupler.coefficients.emplace(name, parse(*term, getAttribute(term, "a"))).second)
      fail(*term, "joint '" + name + "' is listed twice");
  }
  const double lower = get("_lower_limit", -kInfinity), upper = get("_upper_limit", kInfinity),
               play = (upper - lower) / 2;
  const std::string about = file.path + ": " + describe(e) + ": ";
  if (!(play >= 0 && play <= most) || coupler.coefficients.size() < 2) {
    file.warnings.push_back(about + "it is left out: its limits are too wide for a coupler with play");
    return;
  }
  coupler.offset = (lower + upper) / 2 - get("_offset", 0);
  settings.closures.push_back(coupler);
  file.warnings.push_back(about + "it is read as a coupler; its play of " + formatNumber(play) +
                          " to either side is left out");
}

bool isForDrake(const XMLElement& robot) { return robot.Attribute("xmlns:drake") || hasDrakeElement(robot); }

bool isJoint(const XMLElement& element) { return getTag(element) == "joint" || getTag(element) == "drake:joint"; }

void removeDrake(XMLElement& robot) {
  for (XMLElement* e = robot.FirstChildElement(); e; e = e->NextSiblingElement()) {
    if (!isJoint(*e)) continue;
    if (getTag(*e) == "drake:joint" && getAttribute(e, "type") != "planar") e->SetAttribute("type", "floating");
    if (XMLElement* dynamics = e->FirstChildElement("dynamics"); dynamics && getTag(*e) == "drake:joint")
      e->DeleteChild(dynamics);  // of several numbers
    e->SetName("joint");
    XMLElement* limit = e->FirstChildElement("limit");
    if (!limit) limit = &addElement(*e, "limit");
    for (const char* attribute : {"effort", "velocity"})
      if (!limit->Attribute(attribute)) limit->SetAttribute(attribute, "0");
  }
}

void readDrakeElements(const XMLElement& robot, UrdfFile& file, YamlFile& settings) {
  settings.path = file.path;
  DrakeReader(robot, file, settings).read();
}

}  // namespace bielle
