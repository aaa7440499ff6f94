#pragma once
// The curve of ratio.h, step by step.
#include <functional>
#include <string>

#include "dynamics/linkage_ratio.h"

namespace bielle {

struct CurvePoint {
  VectorXd q;        // of the cluster, closed
  VectorXd tangent;  // n, of unit length in the metric of the cluster
  double s = 0;
  double joint_rate = 0, motor_volume = 0;  // Eq. (5)
  double side = 1;                          // of N: +-1, such that it is oriented as at the start
};

class LinkageCurve {
 public:
  // Starts from the configuration of the cluster, along increasing angles of the joint.
  LinkageCurve(const Linkage& linkage, int joint, ConstVectorRef q_cluster);

  // False if the rank is not the cluster's, or the held joints cannot be held; why() states which.
  bool start(CurvePoint& point);
  // The point at a distance h (of either sign) along the tangent of `from`.
  bool advance(const CurvePoint& from, double h, CurvePoint& to);
  // The step in [0, h] from `from` where f is zero; f changes its sign there.
  double findRoot(const CurvePoint& from, double h, double tolerance,
                  const std::function<double(const CurvePoint&)>& f);

  // Whether the loops lose rank within the step h from `from`, which advance() may have skipped: another curve crosses
  // there. Then `h` becomes the step up to that point.
  bool findRankLoss(const CurvePoint& from, const CurvePoint& to, double& h);

  RatioSample makeSample(const CurvePoint& point, DeadPointKind dead = DeadPointKind::None);
  const std::string& why() const { return why_; }
  const ReducedCluster& cluster() const { return *linkage_.cluster; }

 private:
  static constexpr double kLostRank = 1e-4;  // of calcRankMargin()
  bool finishPoint(const VectorXd& direction, CurvePoint& point);
  MatrixXd heldRows() const;
  MatrixXd calcJacobian(const VectorXd& q);
  double calcRankMargin(const VectorXd& q);  // the least singular value of J, over the largest
  bool hasRank(const VectorXd& q) { return calcRankMargin(q) > kLostRank; }
  bool findRankMinimum(const CurvePoint& from, const CurvePoint& to, double& h);

  const Linkage& linkage_;
  int joint_;
  std::vector<int> held_;  // of the linkage's joints
  VectorXd q_start_, held_angles_;
  ClusterPoint from_, point_;
  std::string why_;
};

}  // namespace bielle
