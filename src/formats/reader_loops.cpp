#include "formats/reader_loops.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "math/direction.h"
#include "model/listing.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

UrdfJoint* findTreeJoint(UrdfFile& tree, const std::string& name) {
  const auto it = std::find_if(tree.joints.begin(), tree.joints.end(),
                               [&name](const UrdfJoint& joint) { return joint.joint.name == name; });
  return it == tree.joints.end() ? nullptr : &*it;
}

constexpr const char* kRobotData = "robot_data.yaml";

const YamlKeys kLoopFileKeys("loop_closures.yaml of others", "",
                             {"closures", "ball_loops", "pin_loops", "dependent", "independent", "actuated_joints",
                              "ball_upgrades"});
const YamlKeys kHingeKeys("loop_closures.yaml of others", "closures[]", {"link_a", "link_b", "point", "axis"});
const YamlKeys kTiedKeys("loop_closures.yaml of others", "ball_loops[], pin_loops[]",
                         {"name", "parent", "child", "parent_xyz", "child_xyz", "axis"});
const YamlKeys kRobotDataKeys("robot_data.yaml of others", "", {"closing_joints", "joints"});
const YamlKeys kClosingKeys("robot_data.yaml of others", "closing_joints[]",
                            {"name", "type", "parent", "child", "origin_xyz_m", "origin_rpy_rad", "axis"});
const YamlKeys kDrivenKeys("robot_data.yaml of others", "joints.JOINT", {"passive"});

class LoopClosuresReader {
 public:
  LoopClosuresReader(const std::string& path, UrdfFile& tree, YamlFile& settings)
      : path_(path), tree_(tree), settings_(settings) {
    X_WL_[tree.root] = {};
    for (const UrdfJoint& joint : tree.joints) X_WL_[joint.child] = X_WL_[joint.parent] * joint.joint.X_PJ;
  }

  void read(const YamlEntry& root) {
    const bool has_joints = find(getPresent(root, kRobotDataKeys), "closing_joints");
    if (fs::path(path_).filename() == kRobotData && !has_joints) return;
    if (!isOfThisRobot(root)) {
      tree_.warnings.push_back(path_ + ": it is left out: it names no link of " + tree_.path);
      return;
    }
    tree_.warnings.push_back(tree_.path + ": its loops are those of " + path_);
    settings_.path = path_;
    if (has_joints) return readRobotData(root);
    for (const auto& [key, entry] : getKnown(root, kLoopFileKeys)) {
      if (key == "closures")
        forEach(entry, [this](const YamlEntry& e) { readHinge(e); });
      else if (key == "ball_loops" || key == "pin_loops")
        forEach(entry, [this, pin = key == "pin_loops"](const YamlEntry& e) { readTied(e, pin); });
      else if (key == "dependent")
        forEach(entry, [this](const YamlEntry& e) { removeMimic(e); });
      else if (key == "independent" || key == "actuated_joints")
        forEach(entry, [this](const YamlEntry& e) { addMotor(e); });
      else
        forEach(entry, [this](const YamlEntry& e) {
          settings_.joint_types.emplace_back(findJoint(e).joint.name,
                                             JointRetyping{JointKind::Spherical, Vector3d::UnitZ(), Vector3d::UnitY()});
        });
    }
  }

 private:
  template <typename Read>
  static void forEach(const YamlEntry& list, const Read& read) {
    for (const YamlEntry& entry : list.getList()) read(entry);
  }

  bool isOfThisRobot(const YamlEntry& root) const {
    for (const auto& [key, entry] : root.getMap()) {
      if (!entry.isList()) continue;
      for (const YamlEntry& loop : entry.getList()) {
        if (!loop.isMap()) continue;
        for (const auto& [name, value] : loop.getMap())
          if ((name == "link_a" || name == "link_b" || name == "parent" || name == "child") &&
              X_WL_.count(value.getText()))
            return true;
      }
    }
    return false;
  }

  UrdfJoint& findJoint(const YamlEntry& entry) {
    UrdfJoint* joint = findTreeJoint(tree_, entry.getText());
    if (!joint) entry.fail("there is no joint '" + entry.getText() + "'", "correct the name");
    return *joint;
  }

  std::string findLink(const YamlEntry& entry) const {
    const std::string name = entry.getText();
    if (!X_WL_.count(name)) entry.fail("there is no link '" + name + "'", "correct the name");
    return name;
  }

  static Vector3d getDirection(const YamlEntry& entry) {
    const Vector3d axis = entry.getVector3();
    const double norm = axis.stableNorm();
    if (!(norm > 1e-12) || !std::isfinite(norm)) entry.fail("it is not a direction", "give a non-zero vector");
    return axis / norm;
  }

  // What is known of an entry, in its order; the rest is told: others may use it.
  std::vector<std::pair<std::string, YamlEntry>> getKnown(const YamlEntry& entry,
                                                          const std::vector<std::string>& known) {
    std::vector<std::pair<std::string, YamlEntry>> fields;
    for (const auto& [key, value] : entry.getMap())
      if (contains(known, key))
        fields.emplace_back(key, value);
      else
        tree_.warnings.push_back(path_ + ": " + value.element() + ": it is left out");
    return fields;
  }

  YamlFields getKnownFields(const YamlEntry& entry, const YamlKeys& known) {
    const auto pairs = getKnown(entry, known);
    return {pairs.begin(), pairs.end()};
  }

  // The same without a word.
  static YamlFields getPresent(const YamlEntry& entry, const std::vector<std::string>& known) {
    YamlFields fields;
    for (const auto& [key, value] : entry.getMap())
      if (contains(known, key)) fields.emplace(key, value);
    return fields;
  }

  void add(const std::string& name, ClosureKind kind, const Vector3d& axis, const std::string& link1, const SE3& X_L1,
           const std::string& link2, const SE3& X_L2) {
    ClosureSpec closure;
    closure.name = name;
    closure.kind = kind;
    closure.axis = axis;
    closure.frame1 = addUrdfFrame(tree_, name + "_frame1", link1, X_L1);
    closure.frame2 = addUrdfFrame(tree_, name + "_frame2", link2, X_L2);
    settings_.closures.push_back(closure);
  }

  void readHinge(const YamlEntry& entry) {
    const YamlFields fields = getKnownFields(entry, kHingeKeys);
    const std::string a = findLink(require(fields, "link_a", entry)), b = findLink(require(fields, "link_b", entry));
    const SE3 X_WP(Matrix3d::Identity(), require(fields, "point", entry).getVector3());
    add(a + "--" + b, ClosureKind::Hinge5D, getDirection(require(fields, "axis", entry)), a,
        X_WL_.at(a).inverse() * X_WP, b, X_WL_.at(b).inverse() * X_WP);
  }

  // Frames that are parallel with all joints at zero.
  void readTied(const YamlEntry& entry, bool is_pin) {
    const YamlFields fields = getKnownFields(entry, kTiedKeys);
    const std::string a = findLink(require(fields, "parent", entry)), b = findLink(require(fields, "child", entry));
    const YamlEntry* name = find(fields, "name");
    const Matrix3d R_ba = X_WL_.at(b).R.transpose() * X_WL_.at(a).R;
    add(name ? name->getText() : a + "--" + b, is_pin ? ClosureKind::Hinge5D : ClosureKind::Ball3D,
        is_pin ? getDirection(require(fields, "axis", entry)) : Vector3d::UnitZ(), a,
        {Matrix3d::Identity(), require(fields, "parent_xyz", entry).getVector3()}, b,
        {is_pin ? R_ba : Matrix3d::Identity(), require(fields, "child_xyz", entry).getVector3()});
  }

  // Besides the loops the file repeats what the URDF has, and says which joints nothing drives.
  void readRobotData(const YamlEntry& root) {
    for (const auto& [key, entry] : getPresent(root, kRobotDataKeys)) {
      if (key == "closing_joints") {
        forEach(entry, [this](const YamlEntry& e) { readClosingJoint(e); });
        continue;
      }
      for (const auto& [name, joint] : entry.getMap()) {
        if (!joint.isMap()) continue;
        const YamlFields fields = getPresent(joint, kDrivenKeys);
        const YamlEntry* passive = find(fields, "passive");
        const UrdfJoint* driven = findTreeJoint(tree_, name);
        if (passive && passive->isWord("false") && driven && getNv(driven->joint.kind) == 1) addMotor(name);
      }
    }
  }

  // A joint where the links stand with all joints at zero.
  void readClosingJoint(const YamlEntry& entry) {
    static const std::map<std::string, ClosureKind> kinds = {
        {"prismatic", ClosureKind::Slider}, {"revolute", ClosureKind::Hinge5D}, {"continuous", ClosureKind::Hinge5D},
        {"spherical", ClosureKind::Ball3D}, {"ball", ClosureKind::Ball3D},      {"fixed", ClosureKind::Weld6D}};
    const YamlFields fields = getPresent(entry, kClosingKeys);
    const std::string a = findLink(require(fields, "parent", entry)), b = findLink(require(fields, "child", entry)),
                      name = require(fields, "name", entry).getText();
    const YamlEntry &type = require(fields, "type", entry), *turn = find(fields, "origin_rpy_rad");
    const auto kind = kinds.find(type.getText());
    if (kind == kinds.end())
      type.fail("a joint '" + type.getText() + "' cannot close a loop",
                "use prismatic, revolute, continuous, spherical or fixed");
    const bool has_axis = hasAxis(kind->second);
    const SE3 X_aJ(turn ? makeRotation(turn->getVector3()) : Matrix3d::Identity(),
                   require(fields, "origin_xyz_m", entry).getVector3());
    add(name, kind->second, has_axis ? getDirection(require(fields, "axis", entry)) : Vector3d::UnitZ(), a, X_aJ, b,
        X_WL_.at(b).inverse() * X_WL_.at(a) * X_aJ);
    for (const auto& [key, value] : entry.getMap())
      if (key == "limits")
        tree_.warnings.push_back(path_ + ": " + value.element() + ": a closure has no range, so it is left out");
  }

  // It follows others by its loop; the line of <mimic> is only near to that.
  void removeMimic(const YamlEntry& entry) {
    UrdfJoint& joint = findJoint(entry);
    if (joint.mimicked.empty()) return;
    joint.mimicked.clear();
    tree_.warnings.push_back(tree_.path + ": joint '" + joint.joint.name +
                             "': its <mimic> is left out, because its loop is in " + path_);
  }

  void addMotor(const YamlEntry& entry) {
    const UrdfJoint& joint = findJoint(entry);
    if (getNv(joint.joint.kind) != 1)
      entry.fail("joint '" + joint.joint.name + "' does not have exactly one coordinate",
                 "name a revolute or prismatic joint");
    addMotor(joint.joint.name);
  }
  void addMotor(const std::string& joint) {
    for (const MotorSpec& other : settings_.motors)
      if (other.joint == joint) return;
    MotorSpec motor;
    motor.joint = joint;
    settings_.motors.push_back(motor);
  }

  const std::string path_;
  UrdfFile& tree_;
  YamlFile& settings_;
  std::map<std::string, SE3> X_WL_;  // of the links in the root, with all joints at zero
};

}  // namespace

std::string findUrdfFrame(const UrdfFile& tree, const std::string& link, const SE3& X_LF, bool is_point,
                          double within) {
  const auto stands = [&](const SE3& X) {
    return (X_LF.p - X.p).isZero(within) && (is_point || (X_LF.R - X.R).isZero(within));
  };
  if (stands({})) return link;
  for (const UrdfJoint& joint : tree.joints)
    if (joint.joint.kind == JointKind::Fixed && joint.parent == link && stands(joint.joint.X_PJ)) return joint.child;
  return "";
}

std::string addUrdfFrame(UrdfFile& tree, std::string name, const std::string& link, const SE3& X_LF) {
  const std::string known = findUrdfFrame(tree, link, X_LF, false, 0);
  if (!known.empty()) return known;
  while (tree.links.count(name) || findTreeJoint(tree, name)) name += "_";
  UrdfJoint joint;
  joint.parent = link;
  joint.child = name;
  joint.joint.name = name + "_frame";
  joint.joint.kind = JointKind::Fixed;
  joint.joint.X_PJ = X_LF;
  while (findTreeJoint(tree, joint.joint.name)) joint.joint.name += "_";
  tree.links[name].name = name;
  tree.joints.push_back(joint);
  return name;
}

fs::path findLoopClosures(const fs::path& urdf) {
  const fs::path directory = urdf.has_parent_path() ? urdf.parent_path() : ".";
  for (const char* name : {"loop_closures.yaml", kRobotData})
    for (const fs::path& place : {directory, directory / "..", directory / "../config"}) {
      std::error_code error;
      const fs::path file = (place / name).lexically_normal();
      if (fs::is_regular_file(file, error)) return file;
    }
  return {};
}

void readLoopClosures(const std::string& path, UrdfFile& tree, YamlFile& settings) {
  readYamlDocument(path, readRobotText(path),
                   [&](const YamlEntry& root) { LoopClosuresReader(path, tree, settings).read(root); });
}

}  // namespace bielle
