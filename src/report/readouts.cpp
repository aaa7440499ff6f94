#include "report/readouts.h"

#include <algorithm>
#include <limits>

#include "bielle/model/error.h"
#include "dynamics/linkage_ratio.h"
#include "dynamics/reduction.h"

namespace bielle {
namespace {

constexpr int kMostRatioMotors = 2;  // more would be a table of nine or more numbers

// None where the start is a dead point, so that nothing is relative to it.
std::optional<Linkage> findLinkage(const Model& model, const std::vector<int>& motors, ConstVectorRef start) {
  try {
    for (Linkage& linkage : listLinkages(model, start)) {
      std::vector<int> its = linkage.motors;
      std::sort(its.begin(), its.end());
      if (its == motors && !linkage.isDirect()) return std::move(linkage);
    }
  } catch (const InputError&) {
  }
  return std::nullopt;
}

bool hasRatios(const Linkage& linkage) {
  return !linkage.joints.empty() && linkage.cluster->size == linkage.size() && linkage.size() <= kMostRatioMotors;
}

}  // namespace

Readouts::Readouts(const Model& model, const std::vector<int>& motors, const std::vector<int>& joints,
                   ConstVectorRef start)
    : model_(model), linkage_(findLinkage(model, motors, start)) {
  for (const int i : joints)
    if (model.joints()[static_cast<size_t>(i)].nq == 1 &&
        model.findMotor(model.joints()[static_cast<size_t>(i)].name) < 0)
      passive_.push_back(i);
}

Json Readouts::describe() const {
  Json out = Json::array();
  for (const int i : passive_) {
    const Joint& joint = model_.joints()[static_cast<size_t>(i)];
    out.push_back({{"name", joint.name}, {"unit", joint.kind == JointKind::Prismatic ? "m" : "rad"}});
  }
  if (!linkage_) return out;
  for (int m = 0; m < linkage_->size() && hasRatios(*linkage_); ++m)
    for (int j = 0; j < linkage_->size(); ++j)
      out.push_back({{"name", "ratio " + linkage_->motor_names[static_cast<size_t>(m)] + " : " +
                                  linkage_->joint_names[static_cast<size_t>(j)]},
                     {"unit", ""}});
  out.push_back({{"name", "distance from dead points"}, {"unit", "rad"}, {"most", kFarthestDeadPoint}});
  return out;
}

Eigen::RowVectorXd Readouts::calc(ConstVectorRef q) const {
  std::vector<double> out;
  for (const int i : passive_) out.push_back(q[model_.joints()[static_cast<size_t>(i)].idx_q]);
  if (linkage_ && hasRatios(*linkage_)) {
    ClusterPoint point(*linkage_->cluster);
    VectorXd q_cluster(linkage_->cluster->model.nq());
    gatherConfiguration(model_, *linkage_->cluster, q, q_cluster);
    LinkageRatio ratio;
    const bool there = point.update(*linkage_->cluster, q_cluster) && calcLinkageRatio(*linkage_, point, ratio);
    for (int m = 0; m < linkage_->size(); ++m)
      for (int j = 0; j < linkage_->size(); ++j)
        out.push_back(there ? ratio.R(m, j) : std::numeric_limits<double>::quiet_NaN());
  }
  if (linkage_) out.push_back(std::min(findDeadPoint(*linkage_, model_, q).distance, kFarthestDeadPoint));
  return Eigen::RowVectorXd::Map(out.data(), static_cast<Eigen::Index>(out.size()));
}

}  // namespace bielle
