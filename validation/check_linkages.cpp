// How near linkages come to dead points, by Simbody's rows of the loops alone.
//
// Of a loop cluster with m motors and m coordinates of serial joints, N is a basis of the motions that its rows leave, by their
// singular vectors. At a dead point the volume |det N_X| of the rows of the motors, or of the joints, vanishes. From the nodes
// where the ratio of the two volumes is least or largest, and from both ends, configurations follow N in steps that are closed
// by Newton's method: with m = 1 both ways, else down the gradient of the volume, by differences. Where it reaches zero, the
// largest way of a motor or joint is the distance.
#include <algorithm>
#include <array>
#include <set>

#include "check_rows.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "model/listing.h"
#include "simbody_bridge.h"

namespace bielle::validation {
namespace {

constexpr double kReach = 0.5;  // rad or m: dead points farther away are not looked for
constexpr double kStep = 0.1;   // along N
constexpr double kDead = 1e-7;  // of a volume
constexpr double kRank = 1e-7;  // of singular values, relative

// A loop cluster with as many motors as coordinates of serial joints.
struct DrivenLoops {
  std::string joints;
  std::vector<Closure> closures;
  std::vector<int> dofs;                   // of the model
  std::array<std::vector<int>, 2> rows{};  // of motors and of joints: places among the dofs
};

std::vector<DrivenLoops> listDrivenLoops(const Model& model) {
  std::vector<DrivenLoops> out;
  for (const LoopCluster& cluster : model.clusters()) {
    DrivenLoops loops;
    for (int c : cluster.closures) loops.closures.push_back(model.closures()[c]);
    loops.dofs = cluster.dofs;
    std::vector<std::string> names;
    for (size_t k = 0; k < cluster.dofs.size(); ++k) {
      const int dof = cluster.dofs[k], joint = model.dofs()[dof].joint;
      if (std::any_of(model.motors().begin(), model.motors().end(), [dof](const Motor& m) { return m.dof == dof; }))
        loops.rows[0].push_back(static_cast<int>(k));
      if (!contains(model.serialJoints(), joint)) continue;
      loops.rows[1].push_back(static_cast<int>(k));
      names.push_back(model.joints()[joint].name);
    }
    loops.joints = listItems(names);
    if (!loops.rows[0].empty() && loops.rows[0].size() == loops.rows[1].size()) out.push_back(std::move(loops));
  }
  return out;
}

// One cluster at one configuration after the other.
class LoopWalker {
 public:
  LoopWalker(const Model& model, const DrivenLoops& loops)
      : model_(model),
        loops_(loops),
        simbody_(model, loops.closures),
        m_(static_cast<Eigen::Index>(loops.rows[0].size())) {}

  // False where the rows leave another mobility than m.
  bool update(const VectorXd& q) {
    const VectorXd rest = VectorXd::Zero(model_.nv());
    simbody_.setState(q, rest, rest);
    const ClosureRows rows = simbody_.calcClosureRows();
    q_ = q;
    residual_ = rows.residual;
    const MatrixXd J = rows.J(Eigen::all, loops_.dofs);
    if (!J.allFinite() || !residual_.allFinite()) return false;
    svd_.compute(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
    svd_.setThreshold(kRank);
    if (J.cols() - svd_.rank() != m_) return false;
    N_ = svd_.matrixV().rightCols(m_);
    return true;
  }
  // Closes from a displacement of the dofs of the cluster.
  bool move(const VectorXd& q, const VectorXd& d) {
    constexpr int kMost = 8;
    VectorXd displacement = d, from = q;
    for (int i = 0; i < kMost; ++i) {
      if (!update(displace(from, displacement))) return false;
      displacement = svd_.solve(residual_);
      from = q_;
      if (displacement.norm() < 1e-10) return true;
    }
    return false;
  }

  const VectorXd& q() const { return q_; }
  const MatrixXd& N() const { return N_; }
  MatrixXd getRows(int side) const { return N_(loops_.rows[side], Eigen::all); }
  double calcVolume(int side) const { return std::abs(getRows(side).determinant()); }

  // The largest way of a motor or joint from another configuration.
  double calcWay(const VectorXd& from) const {
    const VectorXd way = model_.difference(from, q_);
    double largest = 0;
    for (const std::vector<int>& side : loops_.rows)
      for (int k : side) largest = getLarger(largest, std::abs(way[loops_.dofs[k]]));
    return largest;
  }

  // Down the volume of one side; kReach if it does not vanish before.
  double follow(const VectorXd& start, int side, double sign) {
    constexpr int kMost = 60;
    constexpr double kDifference = 1e-5;
    if (!update(start)) return kReach;
    VectorXd before;
    bool near = m_ > 1;
    for (int i = 0; i < kMost; ++i) {
      const VectorXd q = q_;
      const MatrixXd N = N_;
      const double volume = calcVolume(side);
      if (volume < kDead || calcWay(start) >= kReach) return getSmaller(calcWay(start), kReach);
      VectorXd gradient(m_);
      for (Eigen::Index j = 0; j < m_; ++j) {
        if (!move(q, kDifference * N.col(j))) return kReach;
        gradient[j] = (calcVolume(side) - volume) / kDifference;
      }
      VectorXd way = near ? VectorXd(N * -gradient.normalized()) : VectorXd(sign * N.col(0));
      if (!near && before.size() > 0 && way.dot(before) < 0) way = -way;
      const double rate = way.dot(N * gradient), root = rate < 0 ? volume / -rate : kReach;
      near |= root < kStep;
      if (near && !(rate < 0)) return kReach;
      if (!move(q, getSmaller(root, kStep) * way)) return kReach;
      before = way;
    }
    return kReach;
  }

 private:
  VectorXd displace(const VectorXd& q, const VectorXd& d) const {
    VectorXd whole = VectorXd::Zero(model_.nv());
    for (size_t k = 0; k < loops_.dofs.size(); ++k) whole[loops_.dofs[k]] = d[static_cast<Eigen::Index>(k)];
    return model_.integrate(q, whole);
  }

  const Model& model_;
  const DrivenLoops& loops_;
  SimbodyBridge simbody_;
  const Eigen::Index m_;
  Eigen::JacobiSVD<MatrixXd> svd_;
  VectorXd q_, residual_;
  MatrixXd N_;
};

// Both ends, and where joints move least and most for their motors.
std::set<int> chooseNodes(const MotionRecord& record, LoopWalker& walker) {
  std::set<int> nodes = {0, static_cast<int>(record.q.rows()) - 1};
  Worst least(CheckRow::Kind::AtLeast), largest;
  for (int k = 0; k < static_cast<int>(record.q.rows()); ++k) {
    if (!walker.update(record.q.row(k).transpose())) continue;
    const double joints = walker.calcVolume(1), motors = walker.calcVolume(0);
    least.add(joints / getLarger(motors, kDead), k);
    largest.add(joints / getLarger(motors, kDead), k);
  }
  for (const Worst& extreme : {least, largest})
    if (!extreme.empty()) nodes.insert(extreme.node());
  return nodes;
}

}  // namespace

// It informs: near a dead point a motion is possible, but its motors turn far for little motion of the joint.
void addLinkageRows(CheckContext& context) {
  const Model& model = context.model();
  const MotionRecord& record = context.motion.record;
  const std::vector<DrivenLoops> all = listDrivenLoops(model);
  Worst nearest(CheckRow::Kind::AtLeast, CheckRow::Kind::Note);
  for (const DrivenLoops& loops : all) {
    LoopWalker walker(model, loops);
    for (int k : chooseNodes(record, walker))
      for (int side : {0, 1})
        for (double sign : {-1.0, 1.0}) {
          if (sign > 0 && loops.rows[0].size() > 1) continue;
          const double distance = walker.follow(record.q.row(k).transpose(), side, sign);
          if (distance < kReach) nearest.add(distance, k, loops.joints);
        }
  }
  context.add(nearest, "linkages: from dead points", "rad, m", 0,
              all.empty() ? "no linkage with serial joints" : "none within 0.5");
}

}  // namespace bielle::validation
