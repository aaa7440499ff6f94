// Closures of a model: their checks, their dofs and the clusters that they make; and the dofs of its point springs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "bielle/model/builder.h"
#include "model/joint.h"

namespace bielle {
namespace {

constexpr double kDefaultLength = std::numeric_limits<double>::quiet_NaN();  // until the model is built

// Dofs that move one of the bodies of a closure or spring but not the other, and their signs.
template <typename Tie>
void findRelativeDofs(const Model& model, Tie& tie) {
  const std::vector<int>&s1 = model.supportDofs(tie.body1), &s2 = model.supportDofs(tie.body2);
  for (int k = 0; k < model.nv(); ++k) {
    const bool in1 = std::binary_search(s1.begin(), s1.end(), k), in2 = std::binary_search(s2.begin(), s2.end(), k);
    if (in1 == in2) continue;
    tie.dofs.push_back(k);
    tie.signs.push_back(in1 ? 1 : -1);
  }
}

// Of the origins of the frames of a closure, where all coordinates are neutral.
double calcNeutralDistance(const Model& model, const Closure& closure) {
  const VectorXd q = model.makeNeutral();
  const auto locate = [&](int body, Vector3d p) {
    for (; body > 0; body = model.joints()[body].parent) {
      const Joint& joint = model.joints()[body];
      p = joint.X_PJ.act(calcJointPlacement(joint, q.segment(joint.idx_q, joint.nq)).act(p));
    }
    return p;
  };
  return (locate(closure.body2, closure.X_B2.p) - locate(closure.body1, closure.X_B1.p)).norm();
}

}  // namespace

void ModelBuilder::addClosure(const std::string& name, ClosureKind kind, const std::string& frame1,
                              const std::string& frame2, const Vector3d& axis, double kp, double kd) {
  Closure closure;
  closure.name = name;
  closure.kind = kind;
  closure.axis = axis;
  closure.length = kDefaultLength;
  closure.kp = kp;
  closure.kd = kd;
  addClosure(frame1, frame2, std::move(closure));
}

void ModelBuilder::addDistance(const std::string& name, const std::string& frame1, const std::string& frame2,
                               std::optional<double> length, double kp, double kd) {
  Closure closure;
  closure.name = name;
  closure.kind = ClosureKind::Distance;
  closure.length = !length ? kDefaultLength : std::isnan(*length) ? 0 : *length;
  closure.kp = kp;
  closure.kd = kd;
  addClosure(frame1, frame2, std::move(closure));
}

void ModelBuilder::addClosure(const std::string& frame1, const std::string& frame2, Closure closure) {
  const std::string element = "closure '" + closure.name + "'";
  const FramePlace f1 = getFrame(frame1, element), f2 = getFrame(frame2, element);
  if (frame1 == frame2) fail(element, "it closes frame '" + frame1 + "' with itself", "name two frames on two bodies");
  if (f1.body == f2.body)
    fail(element, "frames '" + frame1 + "' and '" + frame2 + "' are on the same rigid body",
         "a closure needs a joint between its frames");
  Vector3d& axis = closure.axis;
  if (!(axis.norm() > 1e-12) || !axis.allFinite())
    fail(element, "its axis is not a direction", "give a non-zero vector");
  if (std::abs(axis.squaredNorm() - 1) > 1e-15) axis.normalize();  // as it is read back
  double& length = closure.length;
  if (closure.kind != ClosureKind::Distance) length = 0;
  if (closure.kind == ClosureKind::Distance && (length <= 0 || std::isinf(length)))
    fail(element, "its length is not a finite number above 0", "correct it; points that coincide are a ball (3d)");
  closure.body1 = f1.body;
  closure.body2 = f2.body;
  closure.X_B1 = f1.X_BF;
  closure.X_B2 = f2.X_BF;
  closure.dofs.clear(), closure.signs.clear();
  addChecked(std::move(closure));
}

void ModelBuilder::addCoupler(const std::string& name, const std::map<std::string, double>& coefficients, double offset,
                              double kp, double kd, const std::map<std::string, std::vector<double>>& higher) {
  const std::string element = "closure '" + name + "'";
  for (const auto& [joint, values] : higher)
    if (coefficients.count(joint) == 0)
      fail(element, "joint '" + joint + "' has coefficients of powers but is not coupled",
           "give it a coefficient, or 0");
  Closure closure;
  closure.name = name;
  closure.kind = ClosureKind::Coupler;
  for (const auto& [joint, coefficient] : coefficients) {
    const int index = model_.findJoint(joint);
    if (index < 0) fail(element, "there is no moving joint '" + joint + "'", "name joints that are not fixed");
    const Joint& j = model_.joints()[index];
    if (j.nv != 1)
      fail(element,
           "it couples '" + joint + "', a " + getName(j.kind) + " joint of " + std::to_string(j.nv) + " coordinates",
           "couple revolute, continuous or prismatic joints");
    CouplerTerm term{index, coefficient, j.idx_q, j.idx_v};
    if (const auto powers = higher.find(joint); powers != higher.end()) term.higher = powers->second;
    while (!term.higher.empty() && term.higher.back() == 0) term.higher.pop_back();
    const bool is_finite =
        std::all_of(term.higher.begin(), term.higher.end(), [](double c) { return std::isfinite(c); });
    if (!std::isfinite(coefficient) || !is_finite || (coefficient == 0 && term.isLinear()))
      fail(element, "the coefficient of joint '" + joint + "' is zero or not finite", "correct it, or omit the joint");
    closure.terms.push_back(std::move(term));
  }
  if (closure.terms.size() < 2)
    fail(element, "it couples fewer than two joints", "name at least two, or make the joint fixed");
  if (!std::isfinite(offset)) fail(element, "its offset is not finite", "correct it");
  std::sort(closure.terms.begin(), closure.terms.end(),
            [](const CouplerTerm& a, const CouplerTerm& b) { return a.dof < b.dof; });
  closure.offset = offset;
  closure.kp = kp;
  closure.kd = kd;
  addChecked(std::move(closure));
}

void ModelBuilder::addChecked(Closure closure) {
  const std::string element = "closure '" + closure.name + "'";
  for (const Closure& other : model_.closures())
    if (other.name == closure.name) fail(element, "two closures have this name", "rename one of them");
  if (!(closure.kp >= 0) || !(closure.kd >= 0) || std::isinf(closure.kp) || std::isinf(closure.kd))
    fail(element, "a stabilisation gain is not a finite number of 0 or more", "correct kp and kd");
  model_.data_->closures.push_back(std::move(closure));
}

void ModelBuilder::copyClosure(const Model& from, const Closure& closure) {
  if (closure.kind == ClosureKind::Coupler) {
    std::map<std::string, double> coefficients;
    std::map<std::string, std::vector<double>> higher;
    for (const CouplerTerm& term : closure.terms) {
      const std::string& joint = from.joints()[term.joint].name;
      coefficients[joint] = term.coefficient;
      higher[joint] = term.higher;
    }
    addCoupler(closure.name, coefficients, closure.offset, closure.kp, closure.kd, higher);
    return;
  }
  const auto place = [&](const char* suffix, int body, const SE3& X_BF) {
    addFrame(closure.name + suffix, body == 0 ? "world" : from.bodies()[body].name, X_BF);
    return closure.name + suffix;
  };
  const std::string frame1 = place("/frame1", closure.body1, closure.X_B1);
  addClosure(frame1, place("/frame2", closure.body2, closure.X_B2), closure);
}

// Bodies of a coupler, dofs and signs of any closure.
void ModelBuilder::finishClosure(const Model& model, Closure& closure) const {
  if (closure.kind == ClosureKind::Coupler) {
    int carrier = model.joints()[closure.terms.front().joint].parent;
    const auto carriesAll = [&] {
      return std::all_of(closure.terms.begin(), closure.terms.end(), [&](const CouplerTerm& term) {
        return model.isAncestorOrSelf(carrier, model.joints()[term.joint].parent);
      });
    };
    while (!carriesAll()) carrier = model.joints()[carrier].parent;
    closure.body1 = closure.body2 = carrier;
    std::set<int> dofs;
    for (const CouplerTerm& term : closure.terms)
      dofs.insert(model.data_->support[term.joint].begin() + model.data_->support[carrier].size(),
                  model.data_->support[term.joint].end());
    closure.dofs.assign(dofs.begin(), dofs.end());
    closure.signs.assign(dofs.size(), 1);
    return;
  }
  findRelativeDofs(model, closure);
  if (closure.kind != ClosureKind::Distance || !std::isnan(closure.length)) return;
  closure.length = calcNeutralDistance(model, closure);
  if (closure.length <= 1e-12)
    fail("closure '" + closure.name + "'", "its points coincide where all coordinates are neutral",
         "give its length, or make it a ball (3d)");
}

void ModelBuilder::finishPointSprings(Model& model) const {
  for (PointSpring& spring : model.data_->point_springs) findRelativeDofs(model, spring);
}

void ModelBuilder::finishClosures(Model& model) const {
  std::vector<int> owner(model.nv());  // union-find over dofs
  std::iota(owner.begin(), owner.end(), 0);
  const auto find = [&owner](int k) {
    while (owner[k] != k) k = owner[k] = owner[owner[k]];
    return k;
  };
  for (Closure& closure : model.data_->closures) {
    finishClosure(model, closure);
    for (int k : closure.dofs) owner[find(k)] = find(closure.dofs.front());
    model.data_->closure_rows += getRows(closure.kind);
  }
  std::map<int, LoopCluster> clusters;  // by representative dof
  for (int c = 0; c < static_cast<int>(model.data_->closures.size()); ++c) {
    LoopCluster& cluster = clusters[find(model.data_->closures[c].dofs.front())];
    cluster.closures.push_back(c);
    cluster.rows += getRows(model.data_->closures[c].kind);
    cluster.dofs.insert(cluster.dofs.end(), model.data_->closures[c].dofs.begin(), model.data_->closures[c].dofs.end());
  }
  for (auto& [root, cluster] : clusters) {
    std::sort(cluster.dofs.begin(), cluster.dofs.end());
    cluster.dofs.erase(std::unique(cluster.dofs.begin(), cluster.dofs.end()), cluster.dofs.end());
    model.data_->clusters.push_back(std::move(cluster));
  }
}

}  // namespace bielle
