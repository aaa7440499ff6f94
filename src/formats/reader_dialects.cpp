#include "formats/reader_dialects.h"

#include <algorithm>
#include <set>

#include "bielle/model/error.h"
#include "formats/reader_loops.h"
#include "math/direction.h"
#include "model/number_text.h"

namespace bielle {
namespace {

const std::map<std::string, ClosureKind> kClosureKinds = {
    {"spherical", ClosureKind::Ball3D}, {"ball", ClosureKind::Ball3D},   {"continuous", ClosureKind::Hinge5D},
    {"revolute", ClosureKind::Hinge5D}, {"hinge", ClosureKind::Hinge5D}, {"fixed", ClosureKind::Weld6D},
    {"prismatic", ClosureKind::Slider}};

// Of elements that change no mechanism. What is in neither list is told.
const std::set<std::string> kHarmless = {"link",         "joint",   "material",    "mujoco",      "sensor",
                                         "ros2_control", "version", "drake:joint", "transmission"},
                            kHarmlessOfJoint = {"parent", "child",       "origin",
                                                "axis",   "limit",       "dynamics",
                                                "mimic",  "calibration", "safety_controller",
                                                "safety"},
                            kHarmlessOfLink = {"inertial", "visual", "collision",
                                               "contact",  "sensor", "self_collision_checking",
                                               "material"},
                            kHarmlessOfSdfJoint = {"parent", "child", "pose", "axis", "physics", "sensor"},
                            kChangingOfGazebo = {"link",    "model",          "springStiffness", "springReference",
                                                 "gravity", "turnGravityOff", "static"};

// Such as <joint_properties friction="0.0"/> of onshape-to-robot.
bool isZero(const XMLElement& e) {
  const tinyxml2::XMLAttribute* a = e.FirstAttribute();
  if (!a || e.FirstChild()) return false;
  for (std::vector<double> v; a; a = a->Next(), v.clear())
    if (!parseNumbers(a->Value(), v) || std::any_of(v.begin(), v.end(), [](double x) { return x != 0; })) return false;
  return true;
}

class DialectReader {
 public:
  DialectReader(bool for_drake, UrdfFile& tree, YamlFile& settings)
      : for_drake_(for_drake), tree_(tree), settings_(settings) {
    X_WL_[tree.root] = {};
    for (const UrdfJoint& joint : tree.joints) X_WL_[joint.child] = X_WL_[joint.parent] * joint.joint.X_PJ;
  }

  void read(const XMLElement& robot) {
    settings_.path = tree_.path;
    for (const XMLElement* e : getChildren(robot)) {
      const std::string tag = getTag(*e);
      if (tag == "loop_joint" || tag == "constraint" || tag == "loop")
        readLoop(*e);
      else if (tag == "coupling")
        readCoupling(*e);
      else if (tag == "gazebo")
        readGazebo(*e);
      else if (!kHarmless.count(tag) && tag.rfind("drake:", 0) != 0 && !(for_drake_ && tag == "frame"))
        leaveOut(*e);
      if (tag == "joint" && getAttribute(e, "independent") == "false")
        tree_.dependent.push_back(getAttribute(e, "name"));
      if (tag == "joint" || tag == "link")
        for (const XMLElement* inner : getChildren(*e))
          if (!(tag == "joint" ? kHarmlessOfJoint : kHarmlessOfLink).count(getTag(*inner)) &&
              getTag(*inner).rfind("drake:", 0) != 0)
            leaveOut(*inner);
    }
    for (const auto& [tag, lines] : left_out_)
      tree_.warnings.push_back(tree_.path + ": <" + tag + ">" + formatLines(lines) +
                               ": it is left out: no such element is known here");
    if (!plugins_.empty()) tree_.harmless.push_back(tree_.path + ": <gazebo> <plugin>" + formatLines(plugins_));
  }

 private:
  [[noreturn]] void fail(const XMLElement& e, const std::string& problem, const std::string& remedy) const {
    throw InputError(tree_.path, describe(e), problem, remedy);
  }
  void warn(const XMLElement& e, const std::string& problem) {
    tree_.warnings.push_back(tree_.path + ": " + describe(e) + ": " + problem);
  }
  void leaveOut(const XMLElement& e) {
    if (!isZero(e)) left_out_[getTag(e)].insert(e.GetLineNum());
  }

  const XMLElement& getChild(const XMLElement& e, const char* tag, const char* remedy) const {
    const XMLElement* child = e.FirstChildElement(tag);
    if (!child) fail(e, std::string("it has no <") + tag + ">", remedy);
    return *child;
  }

  std::vector<double> parse(const XMLElement& e, const std::string& text, size_t count, const std::string& what) const {
    std::vector<double> v;
    if (!parseNumbers(text, v) || v.size() != count)
      fail(e, what + " is not made of " + std::to_string(count) + " finite number" + (count > 1 ? "s" : ""),
           "correct it");
    return v;
  }
  Vector3d getTriple(const XMLElement& e, const char* attribute, const Vector3d& otherwise) const {
    const char* text = e.Attribute(attribute);
    if (!text) return otherwise;
    const std::vector<double> v = parse(e, text, 3, std::string("its attribute '") + attribute + "'");
    return {v[0], v[1], v[2]};
  }
  SE3 getPlace(const XMLElement* e) const {
    if (!e) return {};
    const Matrix3d R = makeRotation(getTriple(*e, "rpy", Vector3d::Zero()));
    return {R, getTriple(*e, "xyz", Vector3d::Zero())};
  }
  Vector3d getDirection(const XMLElement& e) const {
    const Vector3d axis = getTriple(e, "xyz", Vector3d::UnitX());
    if (!(axis.norm() > 1e-12)) fail(e, "it is not a direction", "give a non-zero vector");
    return axis.normalized();
  }

  // Of an element or, in SDF, of its text.
  std::string getLink(const XMLElement& e, const char* attribute) const {
    const std::string link = attribute ? getAttribute(&e, attribute) : getText(e);
    if (!X_WL_.count(link)) fail(e, "there is no link '" + link + "'", "declare the link or correct the name");
    return link;
  }
  ClosureSpec makeClosure(const XMLElement& e) const {
    ClosureSpec closure;
    closure.name = getAttribute(&e, "name");
    if (closure.name.empty()) closure.name = nameClosure("loop_" + std::to_string(e.GetLineNum()), settings_);
    const std::string type = getAttribute(&e, "type");
    const auto kind = kClosureKinds.find(type);
    if (kind == kClosureKinds.end())
      fail(e, "its type '" + type + "' cannot close a loop", "use spherical, continuous, revolute, prismatic or fixed");
    closure.kind = kind->second;
    return closure;
  }
  void add(ClosureSpec closure, const std::string& link1, const SE3& X_L1, const std::string& link2, const SE3& X_L2) {
    closure.frame1 = addUrdfFrame(tree_, closure.name + "_link1", link1, X_L1);
    closure.frame2 = addUrdfFrame(tree_, closure.name + "_link2", link2, X_L2);
    settings_.closures.push_back(closure);
  }

  void readLoop(const XMLElement& e) {
    struct Words {
      const char *link1, *link2, *origin1, *origin2;
    };
    const bool is_plus = getTag(e) == "loop", is_family = e.FirstChildElement("parent") || e.FirstChildElement("child");
    const Words words = is_plus     ? Words{"predecessor", "successor", nullptr, nullptr}
                        : is_family ? Words{"parent", "child", "parent_origin", "child_origin"}
                                    : Words{"link1", "link2", nullptr, nullptr};
    ClosureSpec closure = makeClosure(e);
    const XMLElement &end1 = getChild(e, words.link1, "name the link"),
                     &end2 = getChild(e, words.link2, "name the link");
    const auto find = [&](const XMLElement& end, const char* origin) {
      return getPlace(is_plus ? end.FirstChildElement("origin") : is_family ? e.FirstChildElement(origin) : &end);
    };
    SE3 X_1 = find(end1, words.origin1), X_2 = find(end2, words.origin2);
    if (hasAxis(closure.kind)) {
      const XMLElement *axis = e.FirstChildElement("axis"), *axis1 = e.FirstChildElement("parent_axis"),
                       *axis2 = e.FirstChildElement("child_axis");
      if (!axis) axis = axis1;
      closure.axis = axis ? getDirection(*axis) : Vector3d::UnitX();
      if (axis && getAttribute(axis, "frame") == "parent") closure.axis = X_1.R.transpose() * closure.axis;
      if (axis2)
        X_2.R = X_2.R * Eigen::Quaterniond::FromTwoVectors(closure.axis, getDirection(*axis2)).toRotationMatrix();
    }
    add(closure, getLink(end1, "link"), X_1, getLink(end2, "link"), X_2);
  }

  void readGazebo(const XMLElement& gazebo) {
    for (const XMLElement* e : getChildren(gazebo)) {
      if (getTag(*e) == "joint")
        readSdfJoint(*e);
      else if (getTag(*e) == "plugin" && !readMimicPlugin(*e, tree_))
        plugins_.insert(e->GetLineNum());
      else if (kChangingOfGazebo.count(getTag(*e)))
        warn(*e, "it is left out");
    }
  }

  void readSdfJoint(const XMLElement& e) {
    ClosureSpec closure = makeClosure(e);
    const std::string parent = getLink(getChild(e, "parent", "name the link"), nullptr),
                      child = getLink(getChild(e, "child", "name the link"), nullptr);
    SE3 X_CJ;
    for (const XMLElement* inner : getChildren(e))
      if (!kHarmlessOfSdfJoint.count(getTag(*inner))) leaveOut(*inner);
    if (const XMLElement* pose = e.FirstChildElement("pose")) {
      const std::vector<double> v = parse(*pose, getText(*pose), 6, "it");
      X_CJ = {makeRotation({v[3], v[4], v[5]}), {v[0], v[1], v[2]}};
      const std::string frame = getAttribute(pose, "relative_to");
      if (frame == "__model__")
        X_CJ = X_WL_.at(child).inverse() * X_CJ;
      else if (!frame.empty())
        X_CJ = X_WL_.at(child).inverse() * X_WL_.at(getLink(*pose, "relative_to")) * X_CJ;
    }
    const SE3 X_WJ = X_WL_.at(child) * X_CJ;
    if (hasAxis(closure.kind)) {
      const XMLElement& axis = getChild(e, "axis", "give one");
      const XMLElement& xyz = getChild(axis, "xyz", "give its direction");
      const std::vector<double> v = parse(xyz, getText(xyz), 3, "it");
      closure.axis = {v[0], v[1], v[2]};
      if (!(closure.axis.norm() > 1e-12)) fail(xyz, "it is not a direction", "give a non-zero vector");
      closure.axis.normalize();
      const XMLElement* in_model = axis.FirstChildElement("use_parent_model_frame");  // of SDF up to 1.6
      const std::string frame = getAttribute(&xyz, "expressed_in");
      if (frame == "__model__" || (in_model && (getText(*in_model) == "1" || getText(*in_model) == "true")))
        closure.axis = X_WJ.R.transpose() * closure.axis;
      else if (!frame.empty())
        fail(xyz, "its attribute 'expressed_in' is not read here", "give the axis in the frame of the joint");
      if (axis.FirstChildElement("limit") || axis.FirstChildElement("dynamics"))
        warn(axis, "limits and damping of a joint that closes a loop are left out");
    }
    add(closure, parent, X_WL_.at(parent).inverse() * X_WJ, child, X_CJ);
  }

  const UrdfJoint* findCarrier(const std::string& link) const {
    const auto it = std::find_if(tree_.joints.begin(), tree_.joints.end(),
                                 [&](const UrdfJoint& joint) { return joint.child == link; });
    return it == tree_.joints.end() ? nullptr : &*it;
  }
  // Links from one to the root.
  std::vector<std::string> listAncestors(std::string link) const {
    std::vector<std::string> out = {link};
    while (const UrdfJoint* joint = findCarrier(link)) out.push_back(link = joint->parent);
    return out;
  }

  void readCoupling(const XMLElement& e) {
    ClosureSpec closure;
    closure.kind = ClosureKind::Coupler;
    closure.name = getAttribute(&e, "name");
    if (closure.name.empty()) closure.name = nameClosure("coupling_" + std::to_string(e.GetLineNum()), settings_);
    const auto ancestors1 = listAncestors(getLink(getChild(e, "predecessor", "name the link"), "link")),
               ancestors2 = listAncestors(getLink(getChild(e, "successor", "name the link"), "link"));
    const XMLElement& ratio = getChild(e, "ratio", "give its value");
    const double value = parse(ratio, getAttribute(&ratio, "value"), 1, "its attribute 'value'")[0];
    const auto addChain = [&](const std::vector<std::string>& chain, const std::vector<std::string>& other,
                              double factor) {
      for (const std::string& link : chain) {
        if (std::find(other.begin(), other.end(), link) != other.end()) return;
        const UrdfJoint& joint = *findCarrier(link);
        if (joint.joint.kind == JointKind::Fixed) continue;
        if (getNv(joint.joint.kind) != 1)
          fail(e, "joint '" + joint.joint.name + "' between its links does not have exactly one coordinate",
               "couple revolute and prismatic joints");
        closure.coefficients[joint.joint.name] += factor;
      }
    };
    addChain(ancestors1, ancestors2, -value);
    addChain(ancestors2, ancestors1, 1);
    settings_.closures.push_back(closure);
  }

  const bool for_drake_;
  UrdfFile& tree_;
  YamlFile& settings_;
  std::map<std::string, SE3> X_WL_;                // of the links in the root, with all joints at zero
  std::set<int> plugins_;                          // lines
  std::map<std::string, std::set<int>> left_out_;  // tag -> lines
};

}  // namespace

void readDialects(const XMLElement& robot, bool for_drake, UrdfFile& tree, YamlFile& settings) {
  DialectReader(for_drake, tree, settings).read(robot);
  if (!for_drake) readTransmissions(robot, tree, settings);
}

bool readMimicPlugin(const XMLElement& plugin, UrdfFile& tree) {
  const XMLElement *leader = plugin.FirstChildElement("joint"), *follower = plugin.FirstChildElement("mimicJoint");
  if (!leader || !follower) return false;
  const auto find = [&](const XMLElement& e) -> UrdfJoint& {
    const std::string name = getText(e);
    const auto found = std::find_if(tree.joints.begin(), tree.joints.end(), [&](const UrdfJoint& joint) {
      return joint.joint.name == name && getNv(joint.joint.kind) == 1;
    });
    if (found == tree.joints.end())
      throw InputError(tree.path, "<plugin>: " + describe(e), "'" + name + "' is no joint with one coordinate",
                       "name one");
    return *found;
  };
  const auto get = [&](const char* tag, double usual) {
    const XMLElement* e = plugin.FirstChildElement(tag);
    std::vector<double> v;
    if (e && (!parseNumbers(getText(*e), v) || v.size() != 1))
      throw InputError(tree.path, "<plugin>: " + describe(*e), "it is not a finite number", "correct it");
    return e ? v[0] : usual;
  };
  UrdfJoint& joint = find(*follower);
  const UrdfJoint& other = find(*leader);
  if (!joint.mimicked.empty()) return true;
  joint.mimicked = other.joint.name;
  joint.multiplier = get("multiplier", 1);
  joint.offset = get("offset", 0);
  return true;
}

}  // namespace bielle
