#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "math/so3.h"
#include "ocp/residual_data.h"

namespace bielle {
namespace {

constexpr int kMostRows = 17;  // of a force residual

class ComPosition : public DescribedResidual {
 public:
  explicit ComPosition(const Vector3d& reference) : reference_(reference) {}
  int size() const override { return 3; }
  void calc(const NodeView& node, VectorRef r) const override { r = calcCom(node.model, node.ws) - reference_; }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    rows.q = node.ws.YJ.topRows<3>() / node.model.mass();
  }
  ResidualData describe() const override { return {"com_position", {{"reference", VectorXd(reference_)}}}; }

 private:
  Vector3d reference_;
};

class ComVelocity : public DescribedResidual {
 public:
  explicit ComVelocity(const Vector3d& reference) : reference_(reference) {}
  int size() const override { return 3; }
  void calc(const NodeView& node, VectorRef r) const override {
    r = calcComVelocity(node.model, node.ws) - reference_ / node.time_scale;
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    calcComVelocityDerivative(node.model, node.ws, rows.q);
    rows.v = node.ws.YJ.topRows<3>() / node.model.mass();
    rows.s = reference_ / (node.time_scale * node.time_scale);
  }
  ResidualData describe() const override { return {"com_velocity", {{"reference", VectorXd(reference_)}}}; }

 private:
  Vector3d reference_;
};

// The rotation about the vertical by which y lies where it does seen from above; none where it stands upright.
Matrix3d makeLevel(const Matrix3d& R) {
  constexpr double kRounding = 1e-9;  // rad: what faces x does so exactly
  const double heading = std::atan2(-R(0, 1), R(1, 1));
  if (std::hypot(R(0, 1), R(1, 1)) < 0.5 || std::abs(heading) < kRounding) return Matrix3d::Identity();
  return makeAxisRotation(Vector3d::UnitZ(), heading);
}

// Residuals linear or smooth in the force of one contact, F = blockdiag(R, R) E lambda with R = 1 in the axes of the
// contact, R = R_WF in those of the world and R = R_WT^T R_WF in those of the ground where the contact belongs. E expands the
// rows of an edge to a wrench, and is the identity otherwise.
class ForceResidual : public DescribedResidual {
 public:
  ForceResidual(const ConstraintSet& set, int constraint, ForceAxes axes)
      : row_(set.offsets[constraint]),
        rows_(getRows(set.closures[constraint].kind)),
        size_(countForces(set, constraint)),
        axes_(axes),
        contact_(constraint < set.num_loops ? -1 : set.getContact(constraint)),
        turns_(axes != ForceAxes::Contact),
        body_(set.closures[constraint].body1),
        R_BF_(set.closures[constraint].X_B1.R) {
    const Closure& closure = set.closures[constraint];
    if (axes == ForceAxes::Ground)
      R_AW_ = (closure.kind == ClosureKind::Ball3D ? makeLevel(closure.X_B2.R) : closure.X_B2.R).transpose();
    E_.setZero();
    for (int k = 0; k < rows_; ++k) E_.col(k) = expandRows(set.closures[constraint], Force(Force::Unit(rows_, k)));
  }
  bool needsForces() const override { return true; }
  bool needsMotion() const override { return turns_; }

 protected:
  using Force = VectorUpTo6<double>;
  // dr/dF, n x rows
  using Gradient = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostRows, 6>;

  Force getForce(const NodeView& node) const {
    Force f = node.lambda.segment(row_, rows_);
    if (size_ != rows_) f = (E_.topLeftCorner(size_, rows_) * f).eval();
    if (!turns_) return f;
    const Matrix3d R = getAxes(node);
    for (int i = 0; i < size_; i += 3) f.segment<3>(i) = (R * f.segment<3>(i)).eval();
    return f;
  }

  ResidualData describeForce(const std::string& kind, ResidualData data) const {
    if (contact_ < 0) return {};  // forces of closures are in no motion
    data.kind = kind;
    data.values.emplace_back("contact", contact_);
    data.values.emplace_back("axes", std::string(axes_ == ForceAxes::Contact ? "contact"
                                                 : axes_ == ForceAxes::World ? "world"
                                                                             : "ground"));
    return data;
  }

  // dF/dlambda = blockdiag(R, R) E, and the forces turn with the body: dF/dq_k = (R_AW J_k) x F, axis by axis.
  void addChain(const NodeView& node, const Force& f, const Gradient& gradient, ResidualRows rows) const {
    const auto E = E_.topLeftCorner(size_, rows_);
    if (!turns_) {
      if (size_ == rows_)
        rows.lambda.middleCols(row_, rows_) = gradient;
      else
        rows.lambda.middleCols(row_, rows_).noalias() = gradient * E;
      return;
    }
    const Matrix3d R = getAxes(node);
    if (size_ == rows_) {
      for (int i = 0; i < size_; i += 3) rows.lambda.middleCols<3>(row_ + i).noalias() = gradient.middleCols<3>(i) * R;
    } else {
      Gradient turned(gradient.rows(), size_);
      for (int i = 0; i < size_; i += 3) turned.middleCols<3>(i).noalias() = gradient.middleCols<3>(i) * R;
      rows.lambda.middleCols(row_, rows_).noalias() = turned * E;
    }
    for (int k : node.model.supportDofs(body_)) {
      const Vector3d w = R_AW_ * node.ws.J.col(k).tail<3>();
      rows.q.col(k).setZero();
      for (int i = 0; i < size_; i += 3)
        rows.q.col(k) += gradient.middleCols<3>(i) * w.cross(Vector3d(f.segment<3>(i)));
    }
  }

  int row_, rows_, size_;  // first row, number of rows, entries of F

 private:
  Matrix3d getAxes(const NodeView& node) const { return R_AW_ * node.ws.X_WB[body_].R * R_BF_; }

  ForceAxes axes_;
  int contact_;  // index into Model::contacts(), -1 of a closure
  bool turns_;
  int body_;
  Matrix3d R_BF_;
  Matrix6d E_;
  Matrix3d R_AW_ = Matrix3d::Identity();  // from the world to the axes of F
};

class ContactForce : public ForceResidual {
 public:
  ContactForce(const ConstraintSet& set, int constraint, const VectorXd& reference, ForceAxes axes)
      : ForceResidual(set, constraint, axes), reference_(reference) {}
  int size() const override { return size_; }
  void calc(const NodeView& node, VectorRef r) const override { r = getForce(node) - reference_; }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    addChain(node, getForce(node), Gradient::Identity(size_, size_), rows);
  }
  ResidualData describe() const override { return describeForce("contact_force", {"", {{"reference", reference_}}}); }

 private:
  VectorXd reference_;
};

class CenterOfPressure : public ForceResidual {
 public:
  using ForceResidual::ForceResidual;
  int size() const override { return 2; }
  void calc(const NodeView& node, VectorRef r) const override {
    const Force f = getForce(node);
    const double fz = limit(f[2]);
    r[0] = -f[4] / fz;
    r[1] = f[3] / fz;
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    const Force f = getForce(node);
    const double fz = limit(f[2]);
    const bool free = fz == f[2];
    Gradient gradient = Gradient::Zero(2, 6);
    gradient(0, 4) = -1 / fz;
    gradient(1, 3) = 1 / fz;
    gradient(0, 2) = free ? f[4] / (fz * fz) : 0;
    gradient(1, 2) = free ? -f[3] / (fz * fz) : 0;
    addChain(node, f, gradient, rows);
  }
  ResidualData describe() const override { return describeForce("center_of_pressure", {}); }

 private:
  // Below 1 N of load the centre of pressure is not meaningful.
  static double limit(double fz) { return std::max(fz, 1.0); }
};

// Linear in the force: r = A F.
class WrenchCone : public ForceResidual {
 public:
  WrenchCone(const ConstraintSet& set, int constraint, double X, double Y, double mu, ForceAxes axes)
      : ForceResidual(set, constraint, axes),
        A_(MatrixXd::Zero(rows_ == 6   ? 17
                          : rows_ == 5 ? 11
                                       : 5,
                          size_)) {
    A_.col(2).setConstant(mu);
    A_(0, 2) = 1;
    for (int side = 0; side < 2; ++side) {
      const double s = side == 0 ? -1 : 1;
      A_(1 + side, 0) = A_(3 + side, 1) = s;
      if (rows_ < 5) continue;
      if (rows_ == 5) {  // that of a sole without width, whose moment about the edge is zero: each row once
        A_.row(5 + side) << 0, 0, X, 0, s, 0;
        A_.row(7 + side) << 0, s * X, mu * X, 0, -s * mu, 1;
        A_.row(9 + side) << 0, s * X, mu * X, 0, s * mu, -1;
        continue;
      }
      A_.row(5 + side) << 0, 0, Y, s, 0, 0;
      A_.row(7 + side) << 0, 0, X, 0, s, 0;
      for (int other = 0; other < 2; ++other) {
        const double t = other == 0 ? -1 : 1;
        A_.row(9 + 2 * side + other) << s * Y, t * X, mu * (X + Y), -s * mu, -t * mu, 1;
        A_.row(13 + 2 * side + other) << s * Y, t * X, mu * (X + Y), s * mu, t * mu, -1;
      }
    }
  }
  int size() const override { return static_cast<int>(A_.rows()); }
  void calc(const NodeView& node, VectorRef r) const override { r.noalias() = A_ * getForce(node); }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    addChain(node, getForce(node), A_, rows);
  }
  ResidualData describe() const override { return describeForce("wrench_cone", {"", {{"matrix", A_}}}); }

 private:
  MatrixXd A_;
};

class JointPosition : public DescribedResidual {
 public:
  JointPosition(const Model& model, std::vector<int> dofs) : dofs_(std::move(dofs)) {
    if (!dofs_.empty()) return;
    for (int k = 0; k < model.nv(); ++k) {
      const bool limited = std::isfinite(model.lowerLimits()[k]) || std::isfinite(model.upperLimits()[k]);
      // Limits of a joint with several dofs bound no coordinate whose rate is a velocity coordinate.
      if (limited && model.joints()[model.dofs()[k].joint].nv == 1) dofs_.push_back(k);
    }
  }
  int size() const override { return static_cast<int>(dofs_.size()); }
  void calc(const NodeView& node, VectorRef r) const override {
    for (size_t i = 0; i < dofs_.size(); ++i) {
      const Joint& joint = node.model.joints()[node.model.dofs()[dofs_[i]].joint];
      r[i] = node.ws.q[joint.idx_q + dofs_[i] - joint.idx_v];
    }
  }
  void calcJacobian(const NodeView&, ResidualRows rows) const override {
    for (size_t i = 0; i < dofs_.size(); ++i) rows.q(i, dofs_[i]) = 1;
  }
  ResidualData describe() const override { return {"joint_position", {{"dofs", dofs_}}}; }

 private:
  std::vector<int> dofs_;
};

class JointVelocity : public DescribedResidual {
 public:
  explicit JointVelocity(std::vector<int> dofs) : dofs_(std::move(dofs)) {}
  int size() const override { return static_cast<int>(dofs_.size()); }
  void calc(const NodeView& node, VectorRef r) const override {
    for (size_t i = 0; i < dofs_.size(); ++i) r[i] = node.ws.v[dofs_[i]];
  }
  void calcJacobian(const NodeView&, ResidualRows rows) const override {
    for (size_t i = 0; i < dofs_.size(); ++i) rows.v(i, dofs_[i]) = 1;
  }
  ResidualData describe() const override { return {"joint_velocity", {{"dofs", dofs_}}}; }

 private:
  std::vector<int> dofs_;
};

class MotorPower : public DescribedResidual {
 public:
  MotorPower(const Model& model, std::vector<int> motors) : motors_(std::move(motors)) {
    for (int m : motors_) dofs_.push_back(model.motors().at(m).dof);
  }
  int size() const override { return static_cast<int>(motors_.size()); }
  bool needsControls() const override { return true; }
  void calc(const NodeView& node, VectorRef r) const override {
    for (size_t i = 0; i < motors_.size(); ++i) r[i] = node.u[motors_[i]] * node.ws.v[dofs_[i]];
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    for (size_t i = 0; i < motors_.size(); ++i) {
      rows.v(i, dofs_[i]) = node.u[motors_[i]];
      rows.u(i, motors_[i]) = node.ws.v[dofs_[i]];
    }
  }
  ResidualData describe() const override { return {"motor_power", {{"motors", motors_}}}; }

 private:
  std::vector<int> motors_, dofs_;
};

class MotorVoltage : public DescribedResidual {
 public:
  MotorVoltage(const Model& model, std::vector<int> motors) : motors_(std::move(motors)) {
    for (int m : motors_) {
      const Motor& motor = model.motors().at(m);
      if (!motor.hasEnvelope())
        throw InputError(model.name(), "motor '" + motor.name + "'", "it has no winding or no supply voltage",
                         "give its torque_constant and its voltage");
      per_effort_.push_back(motor.voltsPerEffort());
      per_speed_.push_back(motor.voltsPerSpeed());
    }
  }
  int size() const override { return static_cast<int>(motors_.size()); }
  bool needsControls() const override { return true; }
  bool needsSpeeds() const override { return true; }
  void calc(const NodeView& node, VectorRef r) const override {
    for (size_t i = 0; i < motors_.size(); ++i)
      r[i] = per_effort_[i] * node.u[motors_[i]] + per_speed_[i] * (*node.speeds)[motors_[i]];
  }
  void calcJacobian(const NodeView&, ResidualRows rows) const override {
    for (size_t i = 0; i < motors_.size(); ++i) {
      rows.u(i, motors_[i]) = per_effort_[i];
      rows.speeds(i, motors_[i]) = per_speed_[i];
    }
  }
  ResidualData describe() const override {
    return {"motor_voltage",
            {{"motors", motors_},
             {"per_effort", VectorXd(VectorXd::Map(per_effort_.data(), static_cast<Eigen::Index>(per_effort_.size())))},
             {"per_speed", VectorXd(VectorXd::Map(per_speed_.data(), static_cast<Eigen::Index>(per_speed_.size())))}}};
  }

 private:
  std::vector<int> motors_;
  std::vector<double> per_effort_, per_speed_;
};

class ElectricalPower : public DescribedResidual {
 public:
  struct Law {
    double loss, drive = 1, back = 1;  // loss, c_1, c_2
    double getMean(int power) const { return power == 1 ? (drive + back) / 2 : (drive * drive + back * back) / 2; }
    double getHalf(int power) const { return power == 1 ? (drive - back) / 2 : (drive * drive - back * back) / 2; }
  };
  explicit ElectricalPower(std::vector<Law> motors) : motors_(std::move(motors)) {}
  int size() const override { return static_cast<int>(2 * motors_.size()); }
  bool needsControls() const override { return true; }
  bool needsSpeeds() const override { return true; }
  void calc(const NodeView& node, VectorRef r) const override {
    for (size_t m = 0; m < motors_.size(); ++m) {
      const Law& law = motors_[m];
      const double u = node.u[m], p = u * (*node.speeds)[m], root = std::hypot(p, kGearSmoothing);
      r[m] = law.getMean(1) * p + law.getHalf(1) * (root - kGearSmoothing) +
             law.loss * u * u * (law.getMean(2) + law.getHalf(2) * p / root);
      r[motors_.size() + m] = u;
    }
  }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    for (size_t m = 0; m < motors_.size(); ++m) {
      const Law& law = motors_[m];
      const double u = node.u[m], w = (*node.speeds)[m], p = u * w, root = std::hypot(p, kGearSmoothing);
      const double turn = kGearSmoothing * kGearSmoothing / (root * root * root);  // ds/dp
      const double by_p = law.getMean(1) + law.getHalf(1) * p / root + law.loss * u * u * law.getHalf(2) * turn;
      rows.speeds(m, m) = u * by_p;
      rows.u(m, m) = w * by_p + 2 * law.loss * u * (law.getMean(2) + law.getHalf(2) * p / root);
      rows.u(motors_.size() + m, m) = 1;
    }
  }
  ResidualData describe() const override {
    VectorXd losses(motors_.size()), drive(losses), back(losses);
    for (size_t m = 0; m < motors_.size(); ++m) {
      const Eigen::Index i = static_cast<Eigen::Index>(m);
      losses[i] = motors_[m].loss, drive[i] = motors_[m].drive, back[i] = motors_[m].back;
    }
    return {"electrical_power",
            {{"losses", losses}, {"drive", drive}, {"back", back}, {"smoothing", double(kGearSmoothing)}}};
  }

 private:
  std::vector<Law> motors_;
};

}  // namespace

std::unique_ptr<Residual> makeComPosition(const Vector3d& reference) {
  return std::make_unique<ComPosition>(reference);
}
std::unique_ptr<Residual> makeComVelocity(const Vector3d& reference) {
  return std::make_unique<ComVelocity>(reference);
}
int countForces(const ConstraintSet& set, int constraint) {
  return set.closures[constraint].kind == ClosureKind::Ball3D ? 3 : 6;
}
std::unique_ptr<Residual> makeContactForce(const ConstraintSet& set, int constraint, const VectorXd& reference,
                                           ForceAxes axes) {
  if (const int entries = countForces(set, constraint); reference.size() != entries)
    throw InputError(
        "", "contact '" + set.closures[constraint].name + "'",
        "its reference has " + std::to_string(reference.size()) + " entries, its force " + std::to_string(entries),
        "give 3 of a point, 6 of a sole or an edge");
  return std::make_unique<ContactForce>(set, constraint, reference, axes);
}
std::unique_ptr<Residual> makeCenterOfPressure(const ConstraintSet& set, int constraint, ForceAxes axes) {
  const Closure& closure = set.closures[constraint];
  if (closure.kind != ClosureKind::Weld6D && closure.kind != ClosureKind::Hinge5D)
    throw InputError("", "contact '" + closure.name + "'", "it bears no moment, and so has no centre of pressure",
                     "ask for that of a sole (6d) or an edge (5d)");
  return std::make_unique<CenterOfPressure>(set, constraint, axes);
}
std::unique_ptr<Residual> makeWrenchCone(const ConstraintSet& set, int constraint, double half_length,
                                         double half_width, double mu, ForceAxes axes) {
  return std::make_unique<WrenchCone>(set, constraint, half_length, half_width, mu, axes);
}
std::unique_ptr<Residual> makeJointPosition(const Model& model, const std::vector<int>& dofs) {
  return std::make_unique<JointPosition>(model, dofs);
}
std::unique_ptr<Residual> makeJointVelocity(const std::vector<int>& dofs) {
  return std::make_unique<JointVelocity>(dofs);
}
std::unique_ptr<Residual> makeMotorPower(const Model& model, const std::vector<int>& motors) {
  return std::make_unique<MotorPower>(model, motors);
}
std::unique_ptr<Residual> makeMotorVoltage(const Model& model, const std::vector<int>& motors) {
  return std::make_unique<MotorVoltage>(model, motors);
}
std::unique_ptr<Residual> makeElectricalPower(const VectorXd& losses) {
  std::vector<ElectricalPower::Law> motors;
  for (double loss : losses) motors.push_back({loss});
  return std::make_unique<ElectricalPower>(std::move(motors));
}
std::unique_ptr<Residual> makeElectricalPower(const Model& model) {
  std::vector<ElectricalPower::Law> motors;
  for (const Motor& motor : model.motors())
    motors.push_back({motor.torqueLoss(), 1 / motor.drive.efficiency, motor.drive.back_efficiency});
  return std::make_unique<ElectricalPower>(std::move(motors));
}

}  // namespace bielle
