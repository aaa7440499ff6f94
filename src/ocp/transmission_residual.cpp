#include <algorithm>
#include <mutex>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/ocp/residual.h"
#include "dynamics/reduction.h"

namespace bielle {

// With N a basis of the velocities that keep the cluster closed, N_M and N_J its rows of the motors and of the joints,
//     T = N N_M^{-1},    Q = T_J = N_J N_M^{-1},    rho = det Q / det Q_0.                                         (1)
// J T = 0 and T_M = 1 hold everywhere, so that with J' the change of the closure Jacobian
//     dT = -(I - T P_M) J^+ J' T,    drho = rho tr(Q^{-1} dQ) = -rho sum_j y_j^T J' t_j,
//     y_j^T = e_j^T Q^{-1} P_J (I - T P_M) J^+,                                                                    (2)
// t_j being the columns of T, and P_M, P_J the selections of rows.
class TransmissionMap {
 public:
  TransmissionMap(ReducedCluster cluster, std::vector<int> motors, std::vector<int> joints, const Model& model,
                  ConstVectorRef q_reference)
      : cluster_(std::move(cluster)), motors_(std::move(motors)), joints_(std::move(joints)) {
    Scratch scratch(*this);
    gatherConfiguration(model, cluster_, q_reference, scratch.q);
    if (!updateTangent(scratch)) throw ModelError(model.name(), describe(model), "its closures lose rank", "");
    reference_ = scratch.Q.determinant();
    constexpr double kSingular = 1e-9;
    if (!(std::abs(reference_) > kSingular && std::abs(reference_) < 1 / kSingular))
      throw ModelError(model.name(), describe(model), "the given posture is a dead point", "give another posture");
  }

  // rho at q (nq of the whole model); 0 where the closures have no tangent, which no solver may choose.
  double calc(const Model& model, ConstVectorRef q) const {
    const Lease scratch(*this);
    gatherConfiguration(model, cluster_, q, scratch->q);
    return updateTangent(*scratch) ? scratch->Q.determinant() / reference_ : 0;
  }

  // Its derivative, to the dofs of the cluster in a row of nv.
  void calcJacobian(const Model& model, ConstVectorRef q, MatrixRef row) const {
    const Lease lease(*this);
    gatherConfiguration(model, cluster_, q, lease->q);
    for (int dof : cluster_.dofs) row(0, dof) = 0;
    if (!updateTangent(*lease)) return;
    updateDerivative(*lease);
    for (size_t k = 0; k < cluster_.dofs.size(); ++k) row(0, cluster_.dofs[k]) = lease->derivative[k];
  }

  // rho, and its derivative by the motors of the model (nu).
  double calcByMotors(const Model& model, ConstVectorRef q, VectorRef gradient) const {
    const Lease lease(*this);
    Scratch& s = *lease;
    gatherConfiguration(model, cluster_, q, s.q);
    gradient.setZero();
    if (!updateTangent(s)) return 0;
    updateDerivative(s);
    for (size_t j = 0; j < motors_.size(); ++j) {
      const int dof = cluster_.dofs[motors_[j]];
      for (int m = 0; m < model.nu(); ++m)
        if (model.motors()[m].dof == dof) gradient[m] = s.derivative.dot(s.T.col(j));
    }
    return s.Q.determinant() / reference_;
  }

 private:
  struct Scratch {
    explicit Scratch(const TransmissionMap& of)
        : point(of.cluster_),
          q(of.cluster_.model.nq()),
          T(of.cluster_.dofs.size(), of.motors_.size()),
          z(T),
          y(of.cluster_.rank, of.motors_.size()),
          drift(of.cluster_.closures.rows, of.cluster_.dofs.size()),
          derivative(of.cluster_.dofs.size()),
          of_motors(of.motors_.size(), of.motors_.size()),
          Q(of_motors),
          inverse(of_motors) {}
    using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;  // no allocation
    ClusterPoint point;
    VectorXd q;
    MatrixXd T, z, y, drift;
    VectorXd derivative;
    Small of_motors, Q, inverse;
  };

  // Scratch memory for as long as it lives; there is one per thread at a time.
  class Lease {
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
    Scratch* operator->() const { return scratch_.get(); }

   private:
    const TransmissionMap& of_;
    std::unique_ptr<Scratch> scratch_;
  };

  // Eq. (1) at q.
  bool updateTangent(Scratch& s) const {
    if (!s.point.update(cluster_, s.q)) return false;
    const MatrixXd& N = s.point.basis().N;
    const int m = static_cast<int>(motors_.size());
    for (int i = 0; i < m; ++i) s.of_motors.row(i) = N.row(motors_[i]);
    s.inverse = s.of_motors.inverse();
    s.T.noalias() = N * s.inverse;
    for (int i = 0; i < m; ++i) s.Q.row(i) = s.T.row(joints_[i]);
    return s.Q.allFinite();
  }

  // d rho/d v at the configuration of the last updateTangent(), dofs of the cluster.
  void updateDerivative(Scratch& s) const {
    const int m = static_cast<int>(motors_.size());
    const double rho = s.Q.determinant() / reference_;
    // z = (P_J - Q P_M)^T Q^{-T}: by columns the y_j of Eq. (2) before J^+.
    s.inverse = s.Q.inverse();
    s.z.setZero();
    s.derivative.setZero();
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < m; ++j) s.z(joints_[i], j) += s.inverse(j, i);
    for (int j = 0; j < m; ++j) s.z(motors_[j], j) -= 1;
    const ClusterBasis& basis = s.point.basis();
    s.z.array().colwise() *= cluster_.inverse_metric.array();
    s.y.noalias() = basis.J * s.z;
    s.point.solveGram(s.y);
    Workspace& ws = s.point.workspace();
    for (int j = 0; j < m; ++j) {
      updateVelocities(cluster_.model, ws, s.T.col(j));
      s.drift.setZero();
      for (size_t c = 0; c < cluster_.closures.closures.size(); ++c) {
        const Closure& closure = cluster_.closures.closures[c];
        calcClosureVelocityDerivative(ws, closure,
                                      s.drift.middleRows(cluster_.closures.offsets[c], getRows(closure.kind)));
      }
      for (int i = 0; i < cluster_.rank; ++i)
        for (size_t k = 0; k < cluster_.dofs.size(); ++k)
          s.derivative[k] -= rho * s.y(i, j) * s.drift(basis.rows[i], k);
    }
  }

  std::string describe(const Model& model) const {
    return "linkage of joint '" + model.joints()[cluster_.joints.front()].name + "'";
  }

  ReducedCluster cluster_;
  std::vector<int> motors_, joints_;  // dofs of the cluster
  double reference_ = 1;              // det Q_0
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Scratch>> free_;
};

namespace {

class TransmissionResidual : public Residual {
 public:
  explicit TransmissionResidual(std::shared_ptr<const TransmissionMap> map) : map_(std::move(map)) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override { r[0] = map_->calc(node.model, node.ws.q); }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    map_->calcJacobian(node.model, node.ws.q, rows.q);
  }

 private:
  std::shared_ptr<const TransmissionMap> map_;
};

// The dofs of the cluster that belong to these joints of the whole model.
std::vector<int> findDofs(const Model& model, const ReducedCluster& cluster, const std::vector<int>& joints) {
  std::vector<int> dofs;
  for (int joint : joints)
    for (size_t k = 0; k < cluster.dofs.size(); ++k)
      if (model.dofs()[cluster.dofs[k]].joint == joint) dofs.push_back(static_cast<int>(k));
  return dofs;
}

}  // namespace

std::vector<Transmission> listTransmissions(const Model& model, ConstVectorRef q_reference) {
  std::vector<Transmission> out;
  if (model.closures().empty()) return out;
  std::vector<int> driven;
  for (const Motor& motor : model.motors()) driven.push_back(motor.joint);
  for (ReducedCluster& cluster : makeReduction(model, q_reference).clusters) {
    std::vector<int> motors = findDofs(model, cluster, driven), joints = findDofs(model, cluster, model.serialJoints());
    const size_t mobility = cluster.size;
    if (motors.size() != mobility || joints.size() != mobility || mobility > 6) continue;
    std::string names;
    for (int k : joints) {
      const Joint& joint = model.joints()[model.dofs()[cluster.dofs[k]].joint];
      if (names.find(joint.name) == std::string::npos) names += (names.empty() ? "" : ", ") + joint.name;
    }
    out.push_back({names, std::make_shared<TransmissionMap>(std::move(cluster), std::move(motors), std::move(joints),
                                                            model, q_reference)});
  }
  return out;
}

double calcTransmission(const Transmission& transmission, const Model& model, ConstVectorRef q, VectorRef gradient) {
  return transmission.data->calcByMotors(model, q, gradient);
}

std::unique_ptr<Residual> makeTransmission(const Transmission& transmission) {
  return std::make_unique<TransmissionResidual>(transmission.data);
}

}  // namespace bielle
