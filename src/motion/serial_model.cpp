#include "bielle/motion/serial_model.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <set>

#include "bielle/model/builder.h"
#include "dynamics/linkage_ratio.h"
#include "math/decompositions.h"
#include "model/joint.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr double kSmallestMargin = 1e-6;  // of a linkage that its joints determine
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The linkages of the robot with their serial joints; each must be determined by them.
std::vector<Linkage> listLinkages(const Model& closed, const Reduction& reduction) {
  std::vector<Linkage> linkages;
  for (const ReducedCluster& cluster : reduction.clusters) {
    std::vector<std::string> closures, joints;
    for (int c : cluster.closure_indices) closures.push_back(closed.closures()[c].name);
    int coordinates = 0;
    for (int i : closed.serialJoints())
      if (contains(cluster.joints, i)) {
        joints.push_back(closed.joints()[i].name);
        coordinates += closed.joints()[i].nv;
      }
    const int mobility = cluster.size - static_cast<int>(cluster.spins.size());
    if (joints.empty() || coordinates != mobility)
      throw InputError(closed.name(), "closures " + listItems(closures),
                       "there is no equivalent serial chain: their linkage has mobility " + std::to_string(mobility) +
                           ", but its serial joints (" + listItems(joints) + ") have " + std::to_string(coordinates) +
                           " coordinates",
                       joints.empty() ? "use the closed model; or if one-axis joints determine the linkage, such as a "
                                        "knee or an ankle, list them as serial_joints"
                                      : "list serial joints that determine the linkage, or use the closed model");
    linkages.push_back(makeLinkage(closed, reduction, joints));
  }
  return linkages;
}

void addBodies(const Model& closed, ConstVectorRef q, const std::vector<bool>& frozen, ModelBuilder& builder) {
  for (int i = 1; i < closed.numBodies(); ++i) {
    Joint joint = closed.joints()[i];
    JointLimits limits;
    if (frozen[i]) {
      joint.X_PJ = joint.X_PJ * calcJointPlacement(joint, q.segment(joint.idx_q, joint.nq));
      joint.kind = JointKind::Fixed;
    } else {
      limits = {closed.lowerLimits().segment(joint.idx_v, joint.nv),
                closed.upperLimits().segment(joint.idx_v, joint.nv),
                closed.velocityLimits().segment(joint.idx_v, joint.nv)};
    }
    builder.addLink(closed.bodies()[i].name, closed.bodies()[joint.parent].name, joint, closed.bodies()[i].inertia,
                    limits);
  }
}

// Everything attached to bodies. Placements are relative to the closed bodies, which are now links or fixed frames.
void addAttachments(const Model& closed, ModelBuilder& builder) {
  std::set<std::string> links;
  for (const Body& body : closed.bodies()) links.insert(body.name);
  for (const Frame& frame : closed.frames())
    if (!links.count(frame.name)) builder.addFrame(frame.name, closed.bodies()[frame.body].name, frame.X_BF);
  for (const ContactFrame& contact : closed.contacts()) {
    std::string name;
    for (const Frame& frame : closed.frames())
      if (frame.body == contact.body && frame.X_BF.p == contact.X_BF.p && frame.X_BF.R == contact.X_BF.R)
        name = frame.name;
    if (name.empty())
      builder.addFrame(name = "contact " + contact.name, closed.bodies()[contact.body].name, contact.X_BF);
    builder.addContact(contact.name, name, contact.kind, contact.half_length, contact.half_width);
  }
  for (const Visual& visual : closed.visuals()) builder.addVisual(closed.bodies()[visual.body].name, visual);
  for (const Shape& shape : closed.shapes()) builder.addShape(closed.bodies()[shape.body].name, shape);
  builder.setGravity(closed.gravity());
}

// One motor on a serial joint replaces those of its linkage, Eq. (1).
void addSerialMotor(const Model& closed, const Linkage& linkage, const MatrixXd& R, int j,
                    const SerialModelOptions& options, ModelBuilder& builder) {
  const Eigen::FullPivLU<MatrixXd> lu(R);
  const MatrixXd inverse =
      lu.isInvertible() ? MatrixXd(lu.inverse()) : MatrixXd::Constant(R.rows(), R.cols(), kInfinity);
  double effort = 0, velocity = 0, armature = 0;
  const auto addLimit = [](double& sum, double factor, double limit) {
    if (factor != 0) sum += std::abs(factor) * limit;
  };
  for (int i = 0; i < linkage.size(); ++i) {
    const Motor& motor = closed.motors()[linkage.motors[i]];
    addLimit(effort, R(i, j), motor.effort_limit);
    addLimit(velocity, inverse(j, i), motor.velocity_limit);
    armature += R(i, j) * R(i, j) * motor.armature;
  }
  if (options.armature_kind == SerialModelOptions::Armature::Given) armature = options.armature;
  builder.addMotor(linkage.joint_names[j], armature, effort, velocity);
}

// Motors in the order of the closed model, those of a linkage at the position of its first motor.
void addMotors(const Model& closed, const std::vector<Linkage>& linkages, const SerialModelOptions& options,
               SerialModel& out, ModelBuilder& builder) {
  std::vector<bool> done(linkages.size(), false);
  for (int m = 0; m < closed.nu(); ++m) {
    const auto owner = std::find_if(linkages.begin(), linkages.end(),
                                    [m](const Linkage& linkage) { return contains(linkage.motors, m); });
    const Motor& motor = closed.motors()[m];
    if (owner == linkages.end()) {
      builder.addMotor(motor);
      continue;
    }
    const size_t index = owner - linkages.begin();
    if (done[index]) continue;
    done[index] = true;
    const MatrixXd& R = out.replacements[index].R;
    for (int j = 0; j < owner->size(); ++j) addSerialMotor(closed, *owner, R, j, options, builder);
  }
}

// Those of joints that stay; a frozen joint takes its forces out of the motion, which the serial model cannot say.
void addJointForces(const Model& closed, const std::vector<bool>& frozen, ModelBuilder& builder) {
  for (const JointForce& force : closed.jointForces()) {
    const std::string& name = closed.joints()[force.joint].name;
    if (frozen[force.joint])
      throw InputError(
          closed.name(), "force on joint '" + name + "'", "the serial model freezes this joint",
          "use the closed model, or move spring, damper and friction to joints that the serial model keeps");
    builder.addJointForce(name, force);
  }
}

// The same of springs between points.
void addPointSprings(const Model& closed, const std::vector<bool>& frozen, ModelBuilder& builder) {
  for (const PointSpring& spring : closed.pointSprings()) {
    for (int k : spring.dofs)
      if (const int joint = closed.dofs()[k].joint; frozen[joint])
        throw InputError(
            closed.name(), "point spring '" + spring.name + "'",
            "the serial model freezes joint '" + closed.joints()[joint].name + "', which moves one end of it",
            "use the closed model, or attach it to bodies that the serial model keeps");
    builder.copyPointSpring(closed, spring);
  }
}

void addReferences(const Model& closed, const std::vector<bool>& frozen, SerialModel& out, ModelBuilder& builder) {
  for (Reference reference : closed.references()) {
    for (auto it = reference.joints.begin(); it != reference.joints.end();) {
      const bool drop = frozen[closed.findJoint(it->first)];
      if (drop) out.dropped_targets.push_back(reference.name + ": " + it->first);
      it = drop ? reference.joints.erase(it) : std::next(it);
    }
    builder.addReference(std::move(reference));
  }
}

// Calls copy(from's joint, model's joint) for the joints that both have.
template <typename Copy>
void forCommonJoints(const Model& from, const Model& model, const Copy& copy) {
  for (const Joint& joint : model.joints()) {
    if (joint.nv == 0) continue;
    const int index = from.findJoint(joint.name);
    if (index < 0 || from.joints()[index].kind != joint.kind)
      throw InputError(from.name(), "joint '" + joint.name + "'", "the other model has no such joint",
                       "map between a closed model and the serial model made from it");
    copy(from.joints()[index], joint);
  }
}

}  // namespace

const char* getName(Belief belief) {
  switch (belief) {
    case Belief::Closed:
      return "closed";
    case Belief::Serial:
      return "serial";
    case Belief::Ratio:
      return "ratio";
  }
  return "?";
}

Belief parseBelief(const std::string& name) {
  for (Belief belief : {Belief::Closed, Belief::Serial, Belief::Ratio})
    if (name == getName(belief)) return belief;
  throw InputError("", "model '" + name + "'", "there is no such model of a robot", "give closed, serial or ratio");
}

SerialModelOptions parseSerialArmature(const std::string& text) {
  SerialModelOptions options;
  if (text.empty()) return options;
  if (text == "reflected") {
    options.armature_kind = SerialModelOptions::Armature::Reflected;
    return options;
  }
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, options.armature);
  if (error != std::errc() || stop != end)
    throw InputError("", "armature '" + text + "' of the serial model", "it is neither a number nor 'reflected'",
                     "give kg m^2, e.g. 1e-3");
  return options;
}

SerialModel makeSerialModel(const Model& closed, ConstVectorRef q, const SerialModelOptions& options) {
  SerialModel out;
  out.q_reference = q;
  const Reduction reduction = makeReduction(closed, q);
  const std::vector<Linkage> linkages = listLinkages(closed, reduction);
  std::vector<bool> frozen(closed.numBodies(), false);
  for (const ReducedCluster& cluster : reduction.clusters)
    for (int i : cluster.joints) frozen[i] = !contains(closed.serialJoints(), i);
  for (const Linkage& linkage : linkages) {
    ClusterPoint point(*linkage.cluster);
    VectorXd q_cluster(linkage.cluster->model.nq());
    gatherConfiguration(closed, *linkage.cluster, q, q_cluster);
    LinkageRatio ratio;
    MatrixXd T;
    double margin = 0;
    if (!point.update(*linkage.cluster, q_cluster) || !calcLinkageTangent(linkage, point, T, &margin) ||
        margin < kSmallestMargin || !calcLinkageRatio(linkage, point, ratio))
      throw InputError(closed.name(), "joints " + listItems(linkage.joint_names),
                       "their linkage is at a dead point at the reference, so they do not determine it",
                       "freeze it at another configuration");
    out.replacements.push_back({linkage.motor_names, linkage.joint_names, ratio.R});
  }
  for (int i = 1; i < closed.numBodies(); ++i)
    if (frozen[i]) out.frozen_joints.push_back(closed.joints()[i].name);
  for (const Closure& closure : closed.closures()) out.dropped_closures.push_back(closure.name);

  ModelBuilder builder(closed.name());
  addBodies(closed, q, frozen, builder);
  addAttachments(closed, builder);
  addMotors(closed, linkages, options, out, builder);
  addJointForces(closed, frozen, builder);
  addPointSprings(closed, frozen, builder);
  for (int i : closed.serialJoints()) builder.addSerialJoint(closed.joints()[i].name);
  const Model driven = builder.build();
  for (const Joint& joint : driven.joints()) {
    if (joint.nv == 0 || driven.findMotor(joint.name) >= 0) continue;
    const double armature = closed.armature()[closed.joints()[closed.findJoint(joint.name)].idx_v];
    if (armature > 0) builder.setArmature(joint.name, armature);
  }
  addReferences(closed, frozen, out, builder);
  out.model = builder.build();
  return out;
}

std::vector<int> findRestrictedCoordinates(const Model& from, const Model& model) {
  std::vector<int> coordinates(model.nq());
  forCommonJoints(from, model, [&](const Joint& source, const Joint& target) {
    std::iota(coordinates.begin() + target.idx_q, coordinates.begin() + target.idx_q + target.nq, source.idx_q);
  });
  return coordinates;
}

std::vector<int> findRestrictedDofs(const Model& from, const Model& model) {
  std::vector<int> dofs(model.nv());
  forCommonJoints(from, model, [&](const Joint& source, const Joint& target) {
    std::iota(dofs.begin() + target.idx_v, dofs.begin() + target.idx_v + target.nv, source.idx_v);
  });
  return dofs;
}

VectorXd restrictConfiguration(const Model& from, const Model& model, ConstVectorRef q) {
  return q(findRestrictedCoordinates(from, model));
}

VectorXd restrictVelocity(const Model& from, const Model& model, ConstVectorRef v) {
  return v(findRestrictedDofs(from, model));
}

}  // namespace bielle
