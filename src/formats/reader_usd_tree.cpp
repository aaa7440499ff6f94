// Which joints of a file of USD carry bodies, and which close loops.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "bielle/model/error.h"
#include "formats/reader_loops.h"
#include "formats/reader_usd.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// Of the joints, those of low rank carry bodies before others: first drives, which can close no loop, then what the file leaves in its
// tree, slides first, since turns are usual where loops are cut, and balls last, since a loop cut there takes the fewest rows.
int getRank(const UsdJoint& joint) {
  const int excluded = joint.is_excluded ? 1 : 0;
  const bool has_range = std::isfinite(joint.lower) || std::isfinite(joint.upper);
  if (joint.is_driven) return excluded;
  const bool is_stiff = joint.kind == JointKind::Prismatic || joint.kind == JointKind::Fixed;
  const int kind = is_stiff ? 0 : joint.kind == JointKind::Spherical ? 3 : has_range ? 1 : 2;
  return 2 + 4 * excluded + kind;
}

// Sets of bodies that are tied to each other.
class Islands {
 public:
  explicit Islands(size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0); }

  int find(int body) {
    int& parent = parents_[static_cast<size_t>(body)];
    while (parent != parents_[static_cast<size_t>(parent)]) parent = parents_[static_cast<size_t>(parent)];
    return parent;
  }
  bool join(int a, int b) {
    a = find(a), b = find(b);
    if (a == b) return false;
    parents_[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
    return true;
  }

 private:
  std::vector<int> parents_;
};

}  // namespace

void UsdReader::chooseCarriers() {
  Islands islands(bodies_.size());
  for (size_t i = 1; i < bodies_.size(); ++i)
    if (bodies_[i].is_kinematic) islands.join(0, static_cast<int>(i));
  std::vector<UsdJoint*> order;
  for (UsdJoint& joint : joints_) order.push_back(&joint);
  std::stable_sort(order.begin(), order.end(), [](auto* a, auto* b) { return getRank(*a) < getRank(*b); });
  for (UsdJoint* joint : order) joint->is_carrying = joint->length == 0 && islands.join(joint->body[0], joint->body[1]);
  std::vector<std::string> chosen;
  for (const UsdJoint& joint : joints_) {
    if (joint.is_carrying) continue;
    if (!joint.siblings.empty()) failForSeveral(joint);
    if (joint.is_driven)
      failUsd(path_, *joint.prim, "all joints of its loop have drives", "remove the drive of one joint of the loop");
    if (!joint.is_excluded) chosen.push_back(joint.name);
  }
  if (!chosen.empty())
    tree_.warnings.push_back(path_ + ": loops: the file does not say which joints close them: " + listItems(chosen) +
                             "; physics:excludeFromArticulation = true marks others");
  neighbours_.resize(bodies_.size());
  for (size_t j = 0; j < joints_.size(); ++j)
    for (const int end : {0, 1})
      if (joints_[j].is_carrying)
        neighbours_[static_cast<size_t>(joints_[j].body[end])].push_back(
            {joints_[j].body[1 - end], static_cast<int>(j)});
  for (auto& others : neighbours_) std::sort(others.begin(), others.end());
}

void UsdReader::addTree() {
  is_added_.assign(bodies_.size(), false);
  is_added_[0] = true;
  addBelow(0);
  for (size_t i = 1; i < bodies_.size(); ++i)
    if (bodies_[i].is_kinematic && !is_added_[i]) addRoot(static_cast<int>(i));
  for (size_t i = 1; i < bodies_.size(); ++i) {
    if (is_added_[i]) continue;
    std::vector<int> island = {static_cast<int>(i)};
    std::set<int> found = {island[0]};
    for (size_t k = 0; k < island.size(); ++k)
      for (const auto& [other, joint] : neighbours_[static_cast<size_t>(island[k])])
        if (found.insert(other).second) island.push_back(other);
    std::sort(island.begin(), island.end());
    addRoot(chooseRoot(island));
  }
  for (const UsdSite& site : sites_)
    addFrame(site.name, getLink(site.body), bodies_[static_cast<size_t>(site.body)].X_SL.inverse() * site.X_SF);
  addMotors();
  for (const UsdJoint& joint : joints_)
    if (!joint.is_carrying) addClosure(joint);
}

// The root of an articulation; else the first that no joint has as its second body; else the first.
int UsdReader::chooseRoot(const std::vector<int>& island) const {
  for (const int body : island)
    if (const UsdPrim* prim = bodies_[static_cast<size_t>(body)].prim;
        prim && prim->hasApi("PhysicsArticulationRootAPI"))
      return body;
  for (const int body : island) {
    const auto& joints = neighbours_[static_cast<size_t>(body)];
    if (std::none_of(joints.begin(), joints.end(),
                     [&](const auto& to) { return joints_[static_cast<size_t>(to.second)].body[1] == body; }))
      return body;
  }
  return island[0];
}

// A body that nothing carries: free, unless it is kinematic.
void UsdReader::addRoot(int body) {
  const UsdBody& owner = bodies_[static_cast<size_t>(body)];
  UrdfJoint root;
  root.parent = "world";
  root.child = owner.name;
  root.joint.kind = owner.is_kinematic ? JointKind::Fixed : JointKind::FreeFlyer;
  if (owner.is_kinematic) root.joint.X_PJ = owner.X_WS;
  const bool is_first = !owner.is_kinematic && !joint_names_.count("root_joint");
  root.joint.name = is_first ? "root_joint" : owner.name + "_root_joint";
  root.joint.name = makeUnusedName(root.joint.name, [this](const auto& made) { return joint_names_.count(made) > 0; });
  joint_names_.insert(root.joint.name);
  tree_.joints.push_back(root);
  addLink(owner);
  is_added_[static_cast<size_t>(body)] = true;
  addBelow(body);
}

// The bodies on another one, depth first in the order of the file.
void UsdReader::addBelow(int body) {
  for (const auto& [other, index] : neighbours_[static_cast<size_t>(body)]) {
    if (is_added_[static_cast<size_t>(other)]) continue;
    is_added_[static_cast<size_t>(other)] = true;
    const UsdJoint& joint = joints_[static_cast<size_t>(index)];
    addCarried(joint, joint.body[0] == body ? 0 : 1);
    addBelow(other);
  }
}

// A joint that carries its first body turns the other way about its axis.
void UsdReader::addCarried(const UsdJoint& joint, int parent_end) {
  const SE3 &X_PJ = joint.X_SJ[parent_end], &X_CJ = joint.X_SJ[1 - parent_end];
  const UsdBody& parent = bodies_[static_cast<size_t>(joint.body[parent_end])];
  UsdBody& child = bodies_[static_cast<size_t>(joint.body[1 - parent_end])];
  if (joint.kind == JointKind::Revolute || joint.kind == JointKind::Spherical) child.X_SL.p = X_CJ.p;
  UrdfJoint out;
  out.parent = parent.name;
  out.child = child.name;
  out.joint.name = joint.name;
  out.joint.kind = joint.kind;
  out.joint.X_PJ = parent.X_SL.inverse() * X_PJ * (X_CJ.inverse() * child.X_SL);
  if (!joint.coordinate.empty()) {
    out.joint.axis = (X_CJ.R * (parent_end == 0 ? joint.axis : Vector3d(-joint.axis))).normalized();
    const bool has_range = std::isfinite(joint.lower) || std::isfinite(joint.upper);
    if (has_range) out.lower = VectorXd::Constant(1, joint.lower), out.upper = VectorXd::Constant(1, joint.upper);
    if (!has_range && joint.kind == JointKind::Revolute) out.joint.kind = JointKind::Continuous;
    if (std::isfinite(joint.velocity)) out.velocity = joint.velocity;
    if (joint.force.damping != 0 || joint.force.friction != 0) yaml_.joint_forces.push_back({joint.name, joint.force});
  }
  if (joint.kind != JointKind::Fixed && joint.armature > 0) yaml_.armature[joint.name] = joint.armature;
  tree_.joints.push_back(std::move(out));
  addLink(child);
}

void UsdReader::addMotors() {
  for (const UsdJoint& joint : joints_) {
    if (!joint.is_driven) continue;
    MotorSpec motor;
    motor.joint = joint.name;
    if (std::isfinite(joint.effort)) motor.effort = joint.effort;
    yaml_.motors.push_back(motor);
  }
}

namespace {

bool hasDirections(ClosureKind kind) { return kind != ClosureKind::Ball3D && kind != ClosureKind::Distance; }

}  // namespace

void UsdReader::addClosure(const UsdJoint& joint) {
  constexpr double kRounding = 1e-12;  // of sites, which go through other matrices
  ClosureSpec closure;
  closure.name = joint.name;
  closure.kind = joint.length > 0                     ? ClosureKind::Distance
                 : joint.kind == JointKind::Spherical ? ClosureKind::Ball3D
                 : joint.kind == JointKind::Revolute  ? ClosureKind::Hinge5D
                 : joint.kind == JointKind::Prismatic ? ClosureKind::Slider
                                                      : ClosureKind::Weld6D;
  if (joint.length > 0) closure.length = joint.length;
  closure.axis = joint.axis;
  for (const int end : {0, 1}) {
    const UsdBody& body = bodies_[static_cast<size_t>(joint.body[end])];
    const SE3 X_LF = body.X_SL.inverse() * joint.X_SJ[end];
    std::string& frame = end == 0 ? closure.frame1 : closure.frame2;
    frame = findUrdfFrame(tree_, body.name, X_LF, !hasDirections(closure.kind), kRounding);
    if (!frame.empty()) continue;
    frame = makeUnusedName(joint.name + "_frame" + std::to_string(end + 1),
                           [this](const std::string& made) { return link_names_.count(made) > 0; });
    link_names_.insert(frame);
    addFrame(frame, body.name, X_LF);
  }
  if (std::isfinite(joint.lower) || std::isfinite(joint.upper))
    note(joint.prim->line, "range of a joint that closes a loop");
  if (joint.force.damping != 0 || joint.force.friction != 0 || joint.armature != 0)
    note(joint.prim->line, "damping, friction or armature of a joint that closes a loop");
  yaml_.closures.push_back(closure);
}

// Frame 1 of a joint in its frame 0, where the bodies of the file stand.
SE3 UsdReader::calcMotion(const UsdJoint& joint) const {
  const auto place = [&](int end) { return bodies_[static_cast<size_t>(joint.body[end])].X_WS * joint.X_SJ[end]; };
  return place(0).inverse() * place(1);
}

// Where the bodies of the file stand: there loops are closed.
void UsdReader::addStart() {
  constexpr double kApart = 1e-3;  // m, rad: more than rounding
  Reference reference;
  reference.name = "initial";
  bool has_moved = false;
  for (const UsdJoint& joint : joints_) {
    if (!joint.is_carrying) continue;
    const SE3 X = calcMotion(joint);
    const Eigen::Quaterniond turn(X.R);
    double q = 0;
    SE3 rest = X;
    if (joint.kind == JointKind::Revolute) {
      q = std::remainder(2 * std::atan2(turn.vec().dot(joint.axis), turn.w()), 2 * kPi);
      for (const double way : {-2 * kPi, 2 * kPi})
        if ((q < joint.lower || q > joint.upper) && q + way >= joint.lower && q + way <= joint.upper) q += way;
      rest.R = makeAxisRotation(joint.axis, -q) * X.R;
    } else if (joint.kind == JointKind::Prismatic) {
      q = joint.axis.dot(X.p);
      rest.p -= q * joint.axis;
    } else if (joint.kind == JointKind::Spherical) {
      rest.R.setIdentity();
    }
    if (rest.p.norm() > kApart || log3(rest.R).norm() > kApart)
      note(joint.prim->line, "joint", "its bodies do not stand where it holds them; it is read, and they move there");
    if (std::abs(std::clamp(q, joint.lower, joint.upper) - q) > kApart) {
      note(joint.prim->line, "joint", "its bodies stand outside its range");
      continue;
    }
    // What the file says of it, too, where these are not other digits: the places have it rounded.
    constexpr double kSame = 1e-9;
    if (!joint.coordinate.empty()) {
      const double given = getCoordinateUnit(joint) *
                           getNumber(*joint.prim, "state:" + joint.coordinate + ":physics:position", HUGE_VAL, true);
      if (std::abs(given - q) < kSame) q = given;
    }
    q = std::clamp(q, joint.lower, joint.upper);
    if (!joint.coordinate.empty()) reference.joints[joint.name] = {q};
    has_moved = has_moved || std::abs(q) > 1e-6;
  }
  for (const UrdfJoint& joint : tree_.joints) {
    const bool is_free = joint.joint.kind == JointKind::FreeFlyer;
    if (!is_free && joint.joint.kind != JointKind::Spherical) continue;
    const auto place = [&](const std::string& link) {
      const auto found =
          std::find_if(bodies_.begin(), bodies_.end(), [&](const UsdBody& body) { return body.name == link; });
      return found->X_WS * found->X_SL;
    };
    const SE3 X = (place(joint.parent) * joint.joint.X_PJ).inverse() * place(joint.child);
    const Eigen::Quaterniond turn(X.R);
    std::vector<double>& q = reference.joints[joint.joint.name];
    if (is_free) q = {X.p.x(), X.p.y(), X.p.z()};
    has_moved = has_moved || !X.R.isIdentity(1e-6) || (is_free && !X.p.isZero(1e-6));
    for (const double x : {turn.x(), turn.y(), turn.z(), turn.w()}) q.push_back(x);
  }
  if (has_moved || !yaml_.closures.empty()) yaml_.references.push_back(reference);
}

}  // namespace bielle
