#pragma once
// A linkage of transmission.h: the equations are those of that header.
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bielle/dynamics/transmission.h"
#include "dynamics/loop_bases.h"

namespace bielle {

inline constexpr int kMostLinkageMobility = 6;

class TransmissionMap {
 public:
  // `joints` are those of the output, or none, if it is `bodies`.
  // \throws ModelError when the reference is a dead point of joints, or its closures lose rank
  TransmissionMap(ReducedCluster cluster, int index, std::vector<int> motors, std::vector<int> joints,
                  const std::vector<int>& bodies, const Model& model, ConstVectorRef q_reference);

  // False where bodies stand still while motors move, at the reference: they are not the output.
  bool isRegular() const { return regular_; }

  double calc(const Model& model, ConstVectorRef q, const LoopBases* bases) const;
  double calcByMotors(const Model& model, ConstVectorRef q, VectorRef gradient) const;
  void calcJacobian(const Model& model, ConstVectorRef q, MatrixRef row, const LoopBases* bases) const;
  DeadPoint findDeadPoint(const Model& model, ConstVectorRef q) const;

 private:
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostLinkageMobility, kMostLinkageMobility>;

  struct Scratch {
    explicit Scratch(const TransmissionMap& of);
    ClusterPoint point;
    const ClusterBasis* basis = nullptr;  // that of the point, or a given one
    VectorXd q;
    MatrixXd T, z, y, drift, O, turn, Q, Q_inverse;
    VectorXd derivative;
    Small N_M, inverse;
  };
  class Lease;

  int countMotors() const { return static_cast<int>(motors_.size()); }
  const ReducedCluster& getCluster(const LoopBases* bases) const {
    return bases ? bases->getCluster(index_) : cluster_;
  }
  const ClusterBasis* getBasis(const LoopBases* bases) const { return bases ? &bases->getBasis(index_) : nullptr; }
  std::string describe(const Model& model) const;

  void addOutputs(const std::vector<int>& bodies, const Model& model, ConstVectorRef q_reference);
  void addWays();
  void scaleLengths(MatrixXd& rows) const;
  // O at the positions of the workspace; no rows for joints.
  void updateOutputs(const Workspace& ws, MatrixXd& O) const;
  // T and Q of Eq. (2) at s.q, from the given basis of the cluster or a new one.
  bool updateTangent(Scratch& s, const ReducedCluster& cluster, const ClusterBasis* given) const;
  // rho of Eq. (2).
  double evaluate(const MatrixXd& Q) const;
  // Eq. (3) at the configuration of the last updateTangent(), by the dofs of the cluster.
  void updateDerivative(Scratch& s, const ReducedCluster& cluster) const;
  // J' and O' times the velocity v, by the dofs: derivatives of the velocity rows at fixed v.
  void updateDrift(Scratch& s, ConstVectorRef v) const;

  // dead_points.cpp
  double calcVolume(Scratch& s, DeadPoint::Kind kind, VectorXd& gradient) const;
  double follow(const VectorXd& start, DeadPoint::Kind kind, int side) const;
  double calcWay(const VectorXd& from, const VectorXd& to) const;

  ReducedCluster cluster_;            // with a metric of ones
  int index_;                         // among the clusters of the robot
  std::vector<int> motors_, joints_;  // dofs of the cluster
  std::vector<Closure> outputs_;      // bodies as closures to the root, whose velocity rows are their twists
  std::vector<int> ways_;             // of the cluster's q: coordinates whose ways are distances
  int output_rows_ = 0;
  bool regular_ = true;
  double length_ = 1;            // m, the size of the linkage
  MatrixXd reference_;           // Q_0
  double reference_volume_ = 1;  // +-sqrt(det Q_0^T Q_0)
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Scratch>> free_;
};

}  // namespace bielle
