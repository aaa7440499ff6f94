#include "bielle/dynamics/transmission.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/transmission_map.h"
#include "model/listing.h"

namespace bielle {
namespace {

// The dofs of the cluster that belong to these joints of the whole model.
std::vector<int> findDofs(const Model& model, const ReducedCluster& cluster, const std::vector<int>& joints) {
  std::vector<int> dofs;
  for (int joint : joints)
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      if (model.dofs()[cluster.dofs[k]].joint == joint) dofs.push_back(static_cast<int>(k));
  return dofs;
}

// Bodies of the cluster that carry other joints or soles; if there are none of these, frames.
std::vector<int> findCarriers(const Model& model, const ReducedCluster& cluster) {
  std::vector<int> carriers;
  const auto add = [&](int body) {
    if (contains(cluster.joints, body) && !contains(carriers, body)) carriers.push_back(body);
  };
  for (int i = 1; i < model.numBodies(); ++i)
    if (!contains(cluster.joints, i)) add(model.joints()[i].parent);
  for (const ContactFrame& contact : model.contacts()) add(contact.body);
  if (carriers.empty())
    for (const Frame& frame : model.frames())
      if (model.findMotor(model.joints()[frame.body].name) < 0) add(frame.body);
  std::sort(carriers.begin(), carriers.end());
  return carriers;
}

template <typename Out>
void takeRows(const MatrixXd& all, const std::vector<int>& rows, Out& out) {
  for (size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = all.row(rows[i]);
}

}  // namespace

TransmissionMap::Scratch::Scratch(const TransmissionMap& of)
    : point(of.cluster_),
      q(of.cluster_.model.nq()),
      T(of.cluster_.dofs.size(), of.countMotors()),
      z(T),
      y(of.cluster_.rank, of.countMotors()),
      drift(of.cluster_.closures.rows, of.cluster_.dofs.size()),
      O(MatrixXd::Zero(of.joints_.empty() ? of.output_rows_ : 0, of.cluster_.dofs.size())),
      turn(O),
      Q(of.output_rows_, of.countMotors()),
      Q_inverse(of.countMotors(), of.output_rows_),
      derivative(of.cluster_.dofs.size()),
      N_M(of.countMotors(), of.countMotors()),
      inverse(N_M) {}

// Scratch memory for as long as it lives; there is one per thread at a time.
class TransmissionMap::Lease {
 public:
  explicit Lease(const TransmissionMap& of) : of_(of) {
    const std::lock_guard<std::mutex> lock(of_.mutex_);
    if (of_.free_.empty()) of_.free_.push_back(std::make_unique<Scratch>(of_));
    scratch_ = std::move(of_.free_.back());
    of_.free_.pop_back();
  }
  ~Lease() {
    const std::lock_guard<std::mutex> lock(of_.mutex_);
    of_.free_.push_back(std::move(scratch_));
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  Scratch& operator*() const { return *scratch_; }

 private:
  const TransmissionMap& of_;
  std::unique_ptr<Scratch> scratch_;
};

TransmissionMap::TransmissionMap(ReducedCluster cluster, int index, std::vector<int> motors, std::vector<int> joints,
                                 const std::vector<int>& bodies, const Model& model, ConstVectorRef q_reference)
    : cluster_(std::move(cluster)), index_(index), motors_(std::move(motors)), joints_(std::move(joints)) {
  cluster_.metric.setOnes();
  cluster_.inverse_metric.setOnes();
  cluster_.inverse_root.setOnes();
  if (joints_.empty()) addOutputs(bodies, model, q_reference);
  output_rows_ = joints_.empty() ? 6 * static_cast<int>(outputs_.size()) : countMotors();
  addWays();
  Scratch scratch(*this);
  gatherConfiguration(model, cluster_, q_reference, scratch.q);
  if (!updateTangent(scratch, cluster_, nullptr))
    throw ModelError(model.name(), describe(model), "its closures lose rank", "");
  reference_ = scratch.Q;
  const double volume = evaluate(scratch.Q);
  constexpr double kSingular = 1e-9;
  regular_ = std::abs(volume) > kSingular && std::abs(volume) < 1 / kSingular;
  if (!regular_ && !joints_.empty())
    throw ModelError(model.name(), describe(model), "the given posture is a dead point", "give another posture");
  reference_volume_ = volume;
}

std::string TransmissionMap::describe(const Model& model) const {
  return "linkage of joint '" + model.joints()[cluster_.joints.front()].name + "'";
}

double TransmissionMap::calc(const Model& model, ConstVectorRef q, const LoopBases* bases) const {
  if (bases && !joints_.empty()) {  // needs no kinematics
    const MatrixXd& N = bases->getBasis(index_).N;
    Small N_M(countMotors(), countMotors()), N_O(N_M);
    takeRows(N, motors_, N_M);
    takeRows(N, joints_, N_O);
    return N_O.determinant() / N_M.determinant() / reference_volume_;
  }
  const Lease lease(*this);
  Scratch& s = *lease;
  gatherConfiguration(model, cluster_, q, s.q);
  return updateTangent(s, getCluster(bases), getBasis(bases)) ? evaluate(s.Q) : 0;
}

void TransmissionMap::calcJacobian(const Model& model, ConstVectorRef q, MatrixRef row, const LoopBases* bases) const {
  const Lease lease(*this);
  Scratch& s = *lease;
  gatherConfiguration(model, cluster_, q, s.q);
  for (int dof : cluster_.dofs) row(0, dof) = 0;
  if (!updateTangent(s, getCluster(bases), getBasis(bases))) return;
  updateDerivative(s, getCluster(bases));
  for (size_t k = 0; k < cluster_.dofs.size(); ++k) row(0, cluster_.dofs[k]) = s.derivative[k];
}

double TransmissionMap::calcByMotors(const Model& model, ConstVectorRef q, VectorRef gradient) const {
  const Lease lease(*this);
  Scratch& s = *lease;
  gatherConfiguration(model, cluster_, q, s.q);
  gradient.setZero();
  if (!updateTangent(s, cluster_, nullptr)) return 0;
  updateDerivative(s, cluster_);
  for (int j = 0; j < countMotors(); ++j) {
    const int dof = cluster_.dofs[motors_[j]];
    for (int m = 0; m < model.nu(); ++m)
      if (model.motors()[m].dof == dof) gradient[m] = s.derivative.dot(s.T.col(j));
  }
  return evaluate(s.Q);
}

void TransmissionMap::addOutputs(const std::vector<int>& bodies, const Model& model, ConstVectorRef q_reference) {
  VectorXd q(cluster_.model.nq());
  gatherConfiguration(model, cluster_, q_reference, q);
  Workspace ws(cluster_.model);
  updatePositions(cluster_.model, ws, q);
  double size = 0;
  for (int body : bodies) {
    const auto found = std::find(cluster_.joints.begin(), cluster_.joints.end(), body);
    Closure twist;
    twist.kind = ClosureKind::Weld6D;
    twist.body1 = static_cast<int>(found - cluster_.joints.begin()) + 1;  // the first one is the root
    twist.dofs = cluster_.model.supportDofs(twist.body1);
    twist.signs.assign(twist.dofs.size(), 1);
    for (int b = 1; b < cluster_.model.numBodies(); ++b)
      size = std::max(size, (ws.X_WB[b].p - ws.X_WB[twist.body1].p).norm());
    outputs_.push_back(std::move(twist));
  }
  length_ = size > 0 ? size : 1;
}

void TransmissionMap::addWays() {
  for (size_t i = 0; i < cluster_.joints.size(); ++i) {
    const Joint& joint = cluster_.model.joints()[i + 1];  // the first one is the root
    if (joint.nv == 1 && (joints_.empty() || contains(motors_, joint.idx_v) || contains(joints_, joint.idx_v)))
      ways_.push_back(joint.idx_q);
  }
}

void TransmissionMap::scaleLengths(MatrixXd& rows) const {
  for (size_t i = 0; i < outputs_.size(); ++i) rows.middleRows<3>(6 * static_cast<Eigen::Index>(i)) /= length_;
}

void TransmissionMap::updateOutputs(const Workspace& ws, MatrixXd& O) const {
  for (size_t i = 0; i < outputs_.size(); ++i)
    calcClosureJacobian<double>(ws, outputs_[i], O.middleRows(6 * static_cast<Eigen::Index>(i), 6));
  scaleLengths(O);
}

bool TransmissionMap::updateTangent(Scratch& s, const ReducedCluster& cluster, const ClusterBasis* given) const {
  if (given) {
    s.basis = given;
    updatePositions(cluster.model, s.point.workspace(), s.q);
  } else {
    if (!s.point.update(cluster, s.q)) return false;
    s.basis = &s.point.basis();
  }
  takeRows(s.basis->N, motors_, s.N_M);
  s.inverse = s.N_M.inverse();
  s.T.noalias() = s.basis->N * s.inverse;
  if (joints_.empty()) {
    updateOutputs(s.point.workspace(), s.O);
    s.Q.noalias() = s.O * s.T;
  } else {
    takeRows(s.T, joints_, s.Q);
  }
  return s.Q.allFinite();
}

double TransmissionMap::evaluate(const MatrixXd& Q) const {
  Small square(countMotors(), countMotors());
  if (!joints_.empty()) {
    square = Q;
    return square.determinant() / reference_volume_;
  }
  square.noalias() = reference_.transpose() * Q;
  const double sign = square.determinant() < 0 ? -1 : 1;
  square.noalias() = Q.transpose() * Q;
  return sign * std::sqrt(std::max(0.0, square.determinant())) / reference_volume_;
}

void TransmissionMap::updateDerivative(Scratch& s, const ReducedCluster& cluster) const {
  const int m = countMotors();
  const double rho = evaluate(s.Q);
  // z = (Q^+ O - P_M)^T: by columns the y_j before J^+.
  if (joints_.empty()) {
    s.N_M.noalias() = s.Q.transpose() * s.Q;
    s.inverse = s.N_M.inverse();
    s.Q_inverse.noalias() = s.inverse * s.Q.transpose();
    s.z.noalias() = s.O.transpose() * s.Q_inverse.transpose();
  } else {
    s.N_M = s.Q;
    s.inverse = s.N_M.inverse();
    s.z.setZero();
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < m; ++j) s.z(joints_[i], j) += s.inverse(j, i);
  }
  for (int j = 0; j < m; ++j) s.z(motors_[j], j) -= 1;
  s.z.array().colwise() *= cluster.inverse_metric.array();
  s.y.noalias() = s.basis->J * s.z;
  solveGram(*s.basis, s.y);
  s.derivative.setZero();
  for (int j = 0; j < m; ++j) {
    updateDrift(s, s.T.col(j));
    for (int i = 0; i < cluster.rank; ++i)
      s.derivative.noalias() -= rho * s.y(i, j) * s.drift.row(s.basis->rows[i]).transpose();
    if (joints_.empty()) s.derivative.noalias() += rho * (s.turn.transpose() * s.Q_inverse.row(j).transpose());
  }
}

void TransmissionMap::updateDrift(Scratch& s, ConstVectorRef v) const {
  Workspace& ws = s.point.workspace();
  updateVelocities(cluster_.model, ws, v);
  s.drift.setZero();
  for (size_t c = 0; c < cluster_.closures.closures.size(); ++c) {
    const Closure& closure = cluster_.closures.closures[c];
    calcClosureVelocityDerivative(ws, closure, s.drift.middleRows(cluster_.closures.offsets[c], getRows(closure.kind)));
  }
  for (size_t i = 0; i < outputs_.size(); ++i)
    calcClosureVelocityDerivative(ws, outputs_[i], s.turn.middleRows(6 * static_cast<Eigen::Index>(i), 6));
  scaleLengths(s.turn);
}

std::vector<Transmission> listTransmissions(const Model& model, ConstVectorRef q_reference) {
  std::vector<Transmission> out;
  if (model.closures().empty()) return out;
  std::vector<int> driven;
  for (const Motor& motor : model.motors()) driven.push_back(motor.joint);
  int index = -1;
  for (ReducedCluster& cluster : makeReduction(model, q_reference).clusters) {
    ++index;
    std::vector<int> motors = findDofs(model, cluster, driven), joints = findDofs(model, cluster, model.serialJoints());
    const size_t mobility = cluster.size;
    if (motors.size() != mobility || mobility > kMostLinkageMobility) continue;
    std::vector<int> bodies;
    std::vector<std::string> names;
    const auto add = [&names](const std::string& name) {
      if (!contains(names, name)) names.push_back(name);
    };
    if (joints.size() == mobility) {
      for (int k : joints) add(model.joints()[model.dofs()[cluster.dofs[k]].joint].name);
    } else {
      joints.clear();
      bodies = findCarriers(model, cluster);
      if (bodies.empty()) continue;
      for (int body : bodies) add(model.bodies()[body].name);
    }
    const auto map = std::make_shared<TransmissionMap>(std::move(cluster), index, std::move(motors), std::move(joints),
                                                       bodies, model, q_reference);
    if (map->isRegular()) out.push_back({listItems(names), map});
  }
  return out;
}

double calcTransmission(const Transmission& transmission, const Model& model, ConstVectorRef q,
                        const LoopBases* bases) {
  return transmission.data->calc(model, q, bases);
}

double calcTransmission(const Transmission& transmission, const Model& model, ConstVectorRef q, VectorRef gradient) {
  return transmission.data->calcByMotors(model, q, gradient);
}

void calcTransmissionJacobian(const Transmission& transmission, const Model& model, ConstVectorRef q, MatrixRef row,
                              const LoopBases* bases) {
  transmission.data->calcJacobian(model, q, row, bases);
}

}  // namespace bielle
