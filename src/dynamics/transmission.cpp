#include "bielle/dynamics/transmission.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/loop_bases.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr int kMostMobility = 6;

bool contains(const std::vector<int>& list, int value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

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

}  // namespace

class TransmissionMap {
 public:
  // `joints` are those of the output, or none, if it is bodies.
  TransmissionMap(ReducedCluster cluster, int index, std::vector<int> motors, std::vector<int> joints,
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
    reference_volume_ = 1;
    const double volume = calcVolume(scratch.Q);
    constexpr double kSingular = 1e-9;
    regular_ = std::abs(volume) > kSingular && std::abs(volume) < 1 / kSingular;
    if (!regular_ && !joints_.empty())
      throw ModelError(model.name(), describe(model), "the given posture is a dead point", "give another posture");
    reference_volume_ = volume;
  }

  // False where bodies stand still while motors move, at the reference: they are not the output.
  bool isRegular() const { return regular_; }

  double calc(const Model& model, ConstVectorRef q, const LoopBases* bases) const {
    if (bases && !joints_.empty()) {  // needs no kinematics
      const MatrixXd& N = bases->getBasis(index_).N;
      Small N_M(countMotors(), countMotors()), N_O(N_M);
      selectRows(N, motors_, N_M);
      selectRows(N, joints_, N_O);
      return N_O.determinant() / N_M.determinant() / reference_volume_;
    }
    const Lease scratch(*this);
    gatherConfiguration(model, cluster_, q, scratch->q);
    return updateTangent(*scratch, getCluster(bases), getBasis(bases)) ? calcVolume(scratch->Q) : 0;
  }

  void calcJacobian(const Model& model, ConstVectorRef q, MatrixRef row, const LoopBases* bases) const {
    const Lease lease(*this);
    gatherConfiguration(model, cluster_, q, lease->q);
    for (int dof : cluster_.dofs) row(0, dof) = 0;
    if (!updateTangent(*lease, getCluster(bases), getBasis(bases))) return;
    updateDerivative(*lease, getCluster(bases));
    for (size_t k = 0; k < cluster_.dofs.size(); ++k) row(0, cluster_.dofs[k]) = lease->derivative[k];
  }

  double calcByMotors(const Model& model, ConstVectorRef q, VectorRef gradient) const {
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
    return calcVolume(s.Q);
  }

  DeadPoint find(const Model& model, ConstVectorRef q) const {
    VectorXd start(cluster_.model.nq());
    gatherConfiguration(model, cluster_, q, start);
    DeadPoint nearest{DeadPoint::Kind::None, std::numeric_limits<double>::infinity()};
    for (DeadPoint::Kind kind : {DeadPoint::Kind::Output, DeadPoint::Kind::Motors})
      for (int side : {-1, 1}) {
        if (side > 0 && countMotors() > 1) continue;
        const double distance = follow(start, kind, side);
        if (distance < nearest.distance) nearest = {kind, distance};
      }
    return nearest;
  }

 private:
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostMobility, kMostMobility>;

  struct Scratch {
    explicit Scratch(const TransmissionMap& of)
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
    ClusterPoint point;
    const ClusterBasis* basis = nullptr;  // that of the point, or a given one
    VectorXd q;
    MatrixXd T, z, y, drift, O, turn, Q, Q_inverse;
    VectorXd derivative;
    Small N_M, inverse;
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

  int countMotors() const { return static_cast<int>(motors_.size()); }
  const ReducedCluster& getCluster(const LoopBases* bases) const {
    return bases ? bases->getCluster(index_) : cluster_;
  }
  const ClusterBasis* getBasis(const LoopBases* bases) const { return bases ? &bases->getBasis(index_) : nullptr; }

  template <typename Out>
  static void selectRows(const MatrixXd& all, const std::vector<int>& rows, Out& out) {
    for (size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = all.row(rows[i]);
  }

  // The output bodies as closures to the root, whose velocity rows are their twists.
  void addOutputs(const std::vector<int>& bodies, const Model& model, ConstVectorRef q_reference) {
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

  // Where the coordinates are whose ways are distances.
  void addWays() {
    std::vector<int> dofs = motors_;
    dofs.insert(dofs.end(), joints_.begin(), joints_.end());
    for (size_t i = 0; i < cluster_.joints.size(); ++i) {
      const Joint& joint = cluster_.model.joints()[i + 1];
      if (joint.nv == 1 && (joints_.empty() || contains(dofs, joint.idx_v))) ways_.push_back(joint.idx_q);
    }
  }

  void scaleLengths(MatrixXd& rows) const {
    for (size_t i = 0; i < outputs_.size(); ++i)
      rows.middleRows<3>(6 * static_cast<Eigen::Index>(i)) /= length_;
  }

  // O at the positions of the workspace; no rows for joints.
  void updateOutputs(const Workspace& ws, MatrixXd& O) const {
    for (size_t i = 0; i < outputs_.size(); ++i)
      calcClosureJacobian<double>(ws, outputs_[i], O.middleRows(6 * static_cast<Eigen::Index>(i), 6));
    scaleLengths(O);
  }

  // T and Q of Eq. (2) at s.q, from the given basis of the cluster or a new one.
  bool updateTangent(Scratch& s, const ReducedCluster& cluster, const ClusterBasis* given) const {
    if (given) {
      s.basis = given;
      updatePositions(cluster.model, s.point.workspace(), s.q);
    } else {
      if (!s.point.update(cluster, s.q)) return false;
      s.basis = &s.point.basis();
    }
    selectRows(s.basis->N, motors_, s.N_M);
    s.inverse = s.N_M.inverse();
    s.T.noalias() = s.basis->N * s.inverse;
    if (joints_.empty()) {
      updateOutputs(s.point.workspace(), s.O);
      s.Q.noalias() = s.O * s.T;
    } else {
      selectRows(s.T, joints_, s.Q);
    }
    return s.Q.allFinite();
  }

  // rho.
  double calcVolume(const MatrixXd& Q) const {
    const int m = countMotors();
    Small square(m, m);
    if (Q.rows() == m) {
      square = Q;
      return square.determinant() / reference_volume_;
    }
    square.noalias() = reference_.transpose() * Q;
    const bool reversed = square.determinant() < 0;
    square.noalias() = Q.transpose() * Q;
    const double volume = std::sqrt(std::max(0.0, square.determinant())) / reference_volume_;
    return reversed ? -volume : volume;
  }

  // Eq. (3) at the configuration of the last updateTangent(), by the dofs of the cluster.
  void updateDerivative(Scratch& s, const ReducedCluster& cluster) const {
    const int m = countMotors();
    const double rho = calcVolume(s.Q);
    s.inverse.noalias() = s.Q.transpose() * s.Q;
    if (s.Q.rows() == m) s.inverse = s.Q;
    s.inverse = Small(s.inverse.inverse());
    if (s.Q.rows() == m)
      s.Q_inverse = s.inverse;
    else
      s.Q_inverse.noalias() = s.inverse * s.Q.transpose();
    // z = (Q^+ O - P_M)^T: by columns the y_j before J^+.
    if (joints_.empty()) {
      s.z.noalias() = s.O.transpose() * s.Q_inverse.transpose();
    } else {
      s.z.setZero();
      for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j) s.z(joints_[i], j) += s.Q_inverse(j, i);
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

  // J' and O' times the velocity v, by the dofs: derivatives of the velocity rows at fixed v.
  void updateDrift(Scratch& s, ConstVectorRef v) const {
    Workspace& ws = s.point.workspace();
    updateVelocities(cluster_.model, ws, v);
    s.drift.setZero();
    for (size_t c = 0; c < cluster_.closures.closures.size(); ++c) {
      const Closure& closure = cluster_.closures.closures[c];
      calcClosureVelocityDerivative(ws, closure,
                                    s.drift.middleRows(cluster_.closures.offsets[c], getRows(closure.kind)));
    }
    for (size_t i = 0; i < outputs_.size(); ++i)
      calcClosureVelocityDerivative(ws, outputs_[i], s.turn.middleRows(6 * static_cast<Eigen::Index>(i), 6));
    scaleLengths(s.turn);
  }

  // A volume (1) at the configuration of the point, and its gradient by the coordinates of N (m).
  double calcVolume(Scratch& s, DeadPoint::Kind kind, VectorXd& gradient) const {
    const ClusterBasis& basis = s.point.basis();
    const int m = countMotors();
    const bool twists = kind == DeadPoint::Kind::Output && joints_.empty();
    const std::vector<int>& rows = kind == DeadPoint::Kind::Output ? joints_ : motors_;
    MatrixXd X;
    if (twists) {
      updateOutputs(s.point.workspace(), s.O);
      X = s.O;
    } else {
      X.setZero(m, basis.N.rows());
      for (int i = 0; i < m; ++i) X(i, rows[i]) = 1;
    }
    const Eigen::JacobiSVD<MatrixXd> svd(X * basis.N, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const VectorXd& sigma = svd.singularValues();
    VectorXd others = VectorXd::Ones(m);  // products of all singular values but one: finite where the volume vanishes
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k)
        if (k != i) others[i] *= sigma[k];
    const MatrixXd C = svd.matrixV() * others.asDiagonal() * svd.matrixU().transpose();  // s (X N)^+
    MatrixXd y = basis.J * (X.transpose() * C.transpose());                              // metric of ones
    s.point.solveGram(y);
    gradient.setZero(m);
    for (int j = 0; j < m; ++j) {
      updateDrift(s, basis.N.col(j));
      Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(basis.N.rows());
      for (int i = 0; i < cluster_.rank; ++i) along -= y(i, j) * s.drift.row(basis.rows[i]);
      if (twists) along += C.row(j) * s.turn;
      gradient += (along * basis.N).transpose();
    }
    return sigma.prod();
  }

  // The way from a configuration to where a volume vanishes; infinite if that is not within kFarthestDeadPoint.
  double follow(const VectorXd& start, DeadPoint::Kind kind, int side) const {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    constexpr double kLongestStep = 0.1, kDead = 1e-9;  // in all coordinates of the cluster; of a volume
    constexpr int kMostSteps = 100;
    Scratch here(*this), there(*this);
    if (!here.point.update(cluster_, start)) return kNone;
    VectorXd gradient, way, before;
    bool near = false;  // within the reach of Newton's method, whichever the side
    for (int step = 0; step < kMostSteps; ++step) {
      const double volume = calcVolume(here, kind, gradient);
      const MatrixXd& N = here.point.basis().N;
      if (volume < kDead) {
        const double distance = calcWay(start, here.point.basis().q);
        return distance <= kFarthestDeadPoint ? distance : kNone;
      }
      const double slope = gradient.norm();
      if (countMotors() > 1 || near) {
        if (!(slope > 1e-6 * volume)) return kNone;
        way = N * (-gradient / slope);
      } else {
        way = side * N.col(0);
        if (step > 0 && way.dot(before) < 0) way = -way;
      }
      const double rate = (N.transpose() * way).dot(gradient);
      const double root = rate < 0 ? volume / -rate : kNone;
      if (root < kLongestStep) near = true;
      const VectorXd d = std::min(root, kLongestStep) * way;
      if (!there.point.close(cluster_, here.point.basis(), d, VectorXd())) return kNone;
      before = way;
      std::swap(here.point, there.point);
      if (!(calcWay(start, here.point.basis().q) < kFarthestDeadPoint + kLongestStep)) return kNone;
    }
    return kNone;
  }

  double calcWay(const VectorXd& from, const VectorXd& to) const {
    double largest = 0;
    for (int i : ways_) largest = std::max(largest, std::abs(to[i] - from[i]));
    return largest;
  }

  std::string describe(const Model& model) const {
    return "linkage of joint '" + model.joints()[cluster_.joints.front()].name + "'";
  }

  ReducedCluster cluster_;            // with a metric of ones
  int index_;                         // among the clusters of the robot
  std::vector<int> motors_, joints_;  // dofs of the cluster
  std::vector<Closure> outputs_;      // of the cluster's model
  std::vector<int> ways_;             // of the cluster's q
  int output_rows_ = 0;
  bool regular_ = true;
  double length_ = 1;            // m, the size of the linkage
  MatrixXd reference_;           // Q_0
  double reference_volume_ = 1;  // +-sqrt(det Q_0^T Q_0)
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Scratch>> free_;
};

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
    if (motors.size() != mobility || mobility > kMostMobility) continue;
    std::vector<int> bodies;
    std::string names;
    const auto add = [&names](const std::string& name) {
      if (names.find(name) == std::string::npos) names += (names.empty() ? "" : ", ") + name;
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
    if (map->isRegular()) out.push_back({names, map});
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

DeadPoint findDeadPoint(const Transmission& transmission, const Model& model, ConstVectorRef q) {
  return transmission.data->find(model, q);
}

}  // namespace bielle
