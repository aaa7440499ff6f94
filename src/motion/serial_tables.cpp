#include "motion/serial_tables.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "dynamics/reduction.h"
#include "math/constants.h"
#include "math/decompositions.h"
#include "model/listing.h"
#include "motion/posture_lift.h"

namespace bielle {
namespace {

constexpr double kSingularPosture = 0.05;      // margin of PostureLift below which R is too large for tables
constexpr int kTableSizes[] = {33, 17, 9, 5};  // values of each joint of linkages with one, two, .. joints

double carryLimit(double factor, double limit) { return factor != 0 ? std::abs(factor) * limit : 0; }
double divideLimit(double limit, double factor) {
  return factor != 0 ? limit / std::abs(factor) : std::numeric_limits<double>::infinity();
}

// A grid over a box, by the index of a node: the last axis changes fastest.
class Grid {
 public:
  explicit Grid(const std::vector<std::vector<double>>& axes) : axes_(axes) {
    for (const auto& axis : axes) size_ *= static_cast<int>(axis.size());
  }
  int size() const { return size_; }
  std::vector<int> split(int node) const {
    std::vector<int> at(axes_.size());
    for (size_t i = axes_.size(); i-- > 0;) {
      at[i] = node % static_cast<int>(axes_[i].size());
      node /= static_cast<int>(axes_[i].size());
    }
    return at;
  }
  int join(const std::vector<int>& at) const {
    int node = 0;
    for (size_t i = 0; i < at.size(); ++i) node = node * static_cast<int>(axes_[i].size()) + at[i];
    return node;
  }
  VectorXd get(int node) const {
    const std::vector<int> at = split(node);
    VectorXd x(static_cast<Eigen::Index>(at.size()));
    for (size_t i = 0; i < at.size(); ++i) x[static_cast<Eigen::Index>(i)] = axes_[i][static_cast<size_t>(at[i])];
    return x;
  }
  int findNearest(const VectorXd& x) const {
    std::vector<int> at;
    for (size_t i = 0; i < axes_.size(); ++i) {
      const auto isNearer = [value = x[static_cast<Eigen::Index>(i)]](double a, double b) {
        return std::abs(a - value) < std::abs(b - value);
      };
      at.push_back(static_cast<int>(std::min_element(axes_[i].begin(), axes_[i].end(), isNearer) - axes_[i].begin()));
    }
    return join(at);
  }
  std::vector<int> listNeighbours(int node) const {
    std::vector<int> out;
    for (size_t i = 0; i < axes_.size(); ++i)
      for (int way : {-1, 1}) {
        std::vector<int> at = split(node);
        at[i] += way;
        if (at[i] >= 0 && at[i] < static_cast<int>(axes_[i].size())) out.push_back(join(at));
      }
    return out;
  }
  // Corners of the cell that a node begins; empty at the far ends.
  std::vector<int> listCorners(int node) const {
    const std::vector<int> at = split(node);
    std::vector<int> out;
    for (unsigned corner = 0; corner < 1u << at.size(); ++corner) {
      std::vector<int> there = at;
      for (size_t i = 0; i < at.size(); ++i) there[i] += corner >> i & 1u;
      for (size_t i = 0; i < at.size(); ++i)
        if (there[i] >= static_cast<int>(axes_[i].size())) return {};
      out.push_back(join(there));
    }
    return out;
  }

 private:
  const std::vector<std::vector<double>>& axes_;
  int size_ = 1;
};

// What the table of a joint covers.
struct Range {
  double lower, upper;
  bool has_lower, has_upper;  // limits of the robot; else the side follows from what is reached
};

Range findRange(const Model& serial, const std::string& name, double reference) {
  const Joint& joint = serial.joints()[static_cast<size_t>(serial.findJoint(name))];
  const double half = joint.kind == JointKind::Prismatic ? 1 : kPi;
  Range range{serial.lowerLimits()[joint.idx_v], serial.upperLimits()[joint.idx_v], true, true};
  range.has_lower = std::isfinite(range.lower), range.has_upper = std::isfinite(range.upper);
  if (!range.has_lower) range.lower = std::min(reference, range.upper) - half;
  if (!range.has_upper) range.upper = std::max(reference, range.lower) + half;
  return range;
}

std::vector<double> listValues(const Range& range, int count) {
  std::vector<double> out;
  for (int k = 0; k < count; ++k) out.push_back(range.lower + (range.upper - range.lower) * k / (count - 1));
  return out;
}

// The closed robot without forces on joints that a serial model freezes, which it cannot say.
Model removeFrozenForces(const Model& closed, ConstVectorRef q) {
  const Reduction reduction = makeReduction(closed, q);
  ModelParts parts = takeParts(closed);
  const auto isFrozen = [&](const JointForce& force) {
    return !contains(closed.serialJoints(), force.joint) &&
           std::any_of(reduction.clusters.begin(), reduction.clusters.end(),
                       [&](const ReducedCluster& cluster) { return contains(cluster.joints, force.joint); });
  };
  parts.joint_forces.erase(std::remove_if(parts.joint_forces.begin(), parts.joint_forces.end(), isFrozen),
                           parts.joint_forces.end());
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace

struct LinkageEvaluator::Data {
  Data(const Model& closed_robot, const SerialModel& serial_robot, size_t index)
      : closed(closed_robot),
        serial(serial_robot.model),
        linkage(makeLinkage(closed, serial_robot.q_reference, serial_robot.replacements[index].joints)),
        lift(closed, serial_robot),
        full(closed),
        chain(serial),
        q_s(restrictConfiguration(closed, serial, serial_robot.q_reference)),
        sign(serial_robot.replacements[index].R.determinant() > 0) {
    for (const std::string& name : linkage.joint_names) {
      const Joint& joint = serial.joints()[static_cast<size_t>(serial.findJoint(name))];
      positions.push_back(joint.idx_q);
      dofs.push_back(joint.idx_v);
    }
    for (const JointForce& force : closed.jointForces())
      if (serial.findJoint(closed.joints()[static_cast<size_t>(force.joint)].name) < 0) forces.push_back(force);
  }

  const Model &closed, &serial;
  Linkage linkage;
  PostureLift lift;
  Workspace full, chain;
  VectorXd q_s;
  bool sign;                         // of det R, on the branch of the reference
  std::vector<int> positions, dofs;  // of the joints in the serial model
  std::vector<JointForce> forces;    // of frozen joints

  MatrixXd getRatio(const MatrixXd& T) const {
    MatrixXd R(linkage.size(), linkage.size());
    for (int i = 0; i < linkage.size(); ++i)
      R.row(i) = T.row(closed.motors()[static_cast<size_t>(linkage.motors[static_cast<size_t>(i)])].dof);
    return R;
  }

  // Eq. (2)
  void addInertia(const MatrixXd& T, LinkagePosture& out) {
    updatePositions(closed, full, lift.q());
    updateMassMatrix(closed, full);
    updatePositions(serial, chain, q_s);
    updateMassMatrix(serial, chain);
    const MatrixXd M = chain.M - MatrixXd(serial.armature().asDiagonal());
    out.inertia = T.transpose() * full.M * T - M(dofs, dofs);
    Eigen::Matrix3Xd c(3, closed.nv()), c_s(3, serial.nv());
    calcComJacobian(closed, full, c);
    calcComJacobian(serial, chain, c_s);
    const Matrix3d& R_WB = full.X_WB[static_cast<size_t>(linkage.cluster->root)].R;
    const MatrixXd change = serial.mass() * c_s(Eigen::all, dofs) - closed.mass() * c * T;
    out.weight = change.transpose() * R_WB;
  }

  // Eqs. (2) and (3)
  void addForces(const MatrixXd& T, LinkagePosture& out) const {
    const int m = linkage.size();
    out.held = out.friction = VectorXd::Zero(m);
    out.damping = MatrixXd::Zero(m, m);
    for (const JointForce& force : forces) {
      const VectorXd row = T.row(force.dof).transpose();
      out.held -= (force.preload - force.stiffness * (lift.q()[force.idx_q] - force.rest)) * row;
      out.damping += force.damping * row * row.transpose();
      out.friction += force.friction * row.cwiseAbs();
    }
  }

  // Eq. (4)
  void addLimits(LinkagePosture& out) const {
    const int m = linkage.size();
    const MatrixXd S = Eigen::FullPivLU<MatrixXd>(out.ratio).inverse();
    out.torque_most = out.speed_most = VectorXd::Zero(m);
    out.torque_alone = out.speed_alone = VectorXd::Constant(m, std::numeric_limits<double>::infinity());
    for (int i = 0; i < m; ++i) {
      const Motor& motor = closed.motors()[static_cast<size_t>(linkage.motors[static_cast<size_t>(i)])];
      for (int j = 0; j < m; ++j) {
        out.torque_most[j] += carryLimit(out.ratio(i, j), motor.effort_limit);
        out.speed_most[j] += carryLimit(S(j, i), motor.velocity_limit);
        out.torque_alone[j] = std::min(out.torque_alone[j], divideLimit(motor.effort_limit, S(j, i)));
        out.speed_alone[j] = std::min(out.speed_alone[j], divideLimit(motor.velocity_limit, out.ratio(i, j)));
      }
    }
  }
};

LinkageEvaluator::LinkageEvaluator(const Model& closed, const SerialModel& serial, size_t linkage)
    : data_(std::make_unique<Data>(closed, serial, linkage)) {}
LinkageEvaluator::~LinkageEvaluator() = default;

std::optional<LinkagePosture> LinkageEvaluator::evaluate(const VectorXd& joints, VectorXd& q) {
  Data& d = *data_;
  for (int j = 0; j < d.linkage.size(); ++j) d.q_s[d.positions[static_cast<size_t>(j)]] = joints[j];
  if (d.lift.setClosedConfiguration(q, 0) != NumericalStatus::Ok ||
      d.lift.setConfiguration(d.q_s, kSingularPosture) != NumericalStatus::Ok)
    return {};
  const MatrixXd T = d.lift.calcTangent()(Eigen::all, d.dofs);
  LinkagePosture out;
  out.ratio = d.getRatio(T);
  const double det = out.ratio.determinant();
  if (!std::isfinite(det) || det == 0 || (det > 0) != d.sign) return {};
  q = d.lift.q();
  out.motors.resize(d.linkage.size());
  for (int i = 0; i < d.linkage.size(); ++i) {
    const Motor& motor = d.closed.motors()[static_cast<size_t>(d.linkage.motors[static_cast<size_t>(i)])];
    out.motors[i] = q[d.closed.joints()[static_cast<size_t>(motor.joint)].idx_q];
  }
  d.addInertia(T, out);
  d.addForces(T, out);
  d.addLimits(out);
  return out;
}

namespace {

class TableMaker {
 public:
  TableMaker(const Model& closed, const SerialModel& serial, size_t index)
      : start_(serial.q_reference), evaluator_(closed, serial, index) {
    const SerialModel::Replacement& replacement = serial.replacements[index];
    const Linkage linkage = makeLinkage(closed, serial.q_reference, replacement.joints);
    table_.joints = replacement.joints;
    table_.motors = replacement.motors;
    table_.carrier = closed.bodies()[static_cast<size_t>(linkage.cluster->root)].name;
    reference_.resize(linkage.size());
    for (int j = 0; j < linkage.size(); ++j) {
      const Joint& joint = closed.joints()[static_cast<size_t>(linkage.joints[static_cast<size_t>(j)])];
      reference_[j] = serial.q_reference[joint.idx_q];
      ranges_.push_back(findRange(serial.model, joint.name, reference_[j]));
    }
  }

  LinkageTable make() {
    for (int pass = 0; pass < kPasses; ++pass) {
      fill();
      if (pass + 1 < kPasses && !shrink()) break;
    }
    measureErrors();
    return std::move(table_);
  }

 private:
  static constexpr int kPasses = 3;

  // From the reference on, each posture from a neighbour.
  void fill() {
    const int count = kTableSizes[std::min(ranges_.size(), std::size(kTableSizes)) - 1];
    table_.axes.clear();
    for (const Range& range : ranges_) table_.axes.push_back(listValues(range, count));
    const Grid grid(table_.axes);
    table_.postures.assign(static_cast<size_t>(grid.size()), {});
    q_.assign(table_.postures.size(), {});
    std::deque<int> reached;
    const auto visit = [&](int node, VectorXd from) {
      std::optional<LinkagePosture>& posture = table_.postures[static_cast<size_t>(node)];
      if (posture || !(posture = evaluator_.evaluate(grid.get(node), from))) return;
      q_[static_cast<size_t>(node)] = std::move(from);
      reached.push_back(node);
    };
    for (visit(grid.findNearest(reference_), start_); !reached.empty(); reached.pop_front())
      for (int neighbour : grid.listNeighbours(reached.front()))
        visit(neighbour, q_[static_cast<size_t>(reached.front())]);
  }

  // Sides without limits come to the next value after those that are reached. False if none does.
  bool shrink() {
    const Grid grid(table_.axes);
    bool any = false;
    for (size_t i = 0; i < ranges_.size(); ++i) {
      int first = static_cast<int>(table_.axes[i].size()), last = -1;
      for (int node = 0; node < grid.size(); ++node)
        if (table_.postures[static_cast<size_t>(node)]) {
          first = std::min(first, grid.split(node)[i]);
          last = std::max(last, grid.split(node)[i]);
        }
      if (!ranges_[i].has_lower && first > 1 && last >= 0)
        ranges_[i].lower = table_.axes[i][static_cast<size_t>(first - 1)], any = true;
      if (!ranges_[i].has_upper && last >= 0 && last + 2 < static_cast<int>(table_.axes[i].size()))
        ranges_[i].upper = table_.axes[i][static_cast<size_t>(last + 1)], any = true;
    }
    return any;
  }

  void measureErrors() {
    const Grid grid(table_.axes);
    for (int node = 0; node < grid.size(); ++node) {
      const std::vector<int> corners = grid.listCorners(node);
      const bool is_whole = !corners.empty() && std::all_of(corners.begin(), corners.end(), [&](int corner) {
        return table_.postures[static_cast<size_t>(corner)].has_value();
      });
      if (!is_whole) continue;
      VectorXd from = q_[static_cast<size_t>(node)];
      const auto middle = evaluator_.evaluate((grid.get(corners.front()) + grid.get(corners.back())) / 2, from);
      if (!middle) continue;
      MatrixXd ratio = -middle->ratio, inertia = -middle->inertia;
      for (int corner : corners) {
        ratio += table_.postures[static_cast<size_t>(corner)]->ratio / static_cast<double>(corners.size());
        inertia += table_.postures[static_cast<size_t>(corner)]->inertia / static_cast<double>(corners.size());
      }
      table_.ratio_error = std::max(table_.ratio_error, ratio.cwiseAbs().maxCoeff());
      table_.inertia_error = std::max(table_.inertia_error, inertia.cwiseAbs().maxCoeff());
    }
  }

  VectorXd start_, reference_;  // configuration; joints
  LinkageEvaluator evaluator_;
  std::vector<Range> ranges_;
  LinkageTable table_;
  std::vector<VectorXd> q_;  // closed configurations of its postures
};

}  // namespace

SerialTables makeSerialTables(const Model& closed, ConstVectorRef q_reference) {
  SerialModelOptions options;
  options.armature_kind = SerialModelOptions::Armature::Reflected;
  SerialTables out{makeSerialModel(removeFrozenForces(closed, q_reference), q_reference, options), {}, 0};
  for (size_t i = 0; i < out.serial.replacements.size(); ++i)
    out.linkages.push_back(TableMaker(closed, out.serial, i).make());
  for (const std::string& joint : out.serial.frozen_joints)
    out.frozen_mass += closed.bodies()[static_cast<size_t>(closed.findJoint(joint))].inertia.mass;
  return out;
}

}  // namespace bielle
