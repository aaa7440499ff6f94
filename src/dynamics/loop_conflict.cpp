#include "dynamics/loop_conflict.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <set>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "dynamics/loop_problem.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/frame_name.h"
#include "model/joint.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kCloses = 1e-9;     // m, of a residual
constexpr double kSupport = 1e-6;    // of the largest part of a self-stress: a part that matters
constexpr size_t kMostTried = 8;     // changes whose size is found exactly
constexpr size_t kMostRemedies = 3;  // offered

// Starts of searches, the first of them the given one; the same at every call.
std::vector<VectorXd> makeStarts(const Model& model, const VectorXd& q) {
  std::vector<VectorXd> starts = {q, model.makeNeutral()};
  std::mt19937 rng(1);
  for (const double spread : {0.2, 0.6}) {
    std::uniform_real_distribution<double> uniform(-spread, spread);
    starts.push_back(model.integrate(q, VectorXd::NullaryExpr(model.nv(), [&](Eigen::Index) { return uniform(rng); })));
  }
  return starts;
}

// Closures of a model (those of a cluster, or fewer) where their residual is smallest.
struct LeastGap {
  std::vector<int> closures;
  VectorXd q, r;  // nq; m

  bool closes() const { return r.cwiseAbs().maxCoeff() < kCloses; }
};

LeastGap findLeastGap(const Model& model, const std::vector<int>& closures, double length,
                      const std::vector<VectorXd>& starts) {
  const Model part = selectClosures(model, closures);
  LoopProblem problem(part, length);
  LeastGap best{closures, {}, {}};
  for (const VectorXd& start : starts) {
    LoopPoint z{start, {}, 0};
    problem.minimise(z);
    const VectorXd r = problem.calcResidual(z);
    if (!r.allFinite() || (best.r.size() && r.squaredNorm() >= best.r.squaredNorm())) continue;
    best.q = z.q, best.r = r;
    if (best.closes()) break;
  }
  return best;
}

// Norm of the part of r (rows of these closures) of each closure.
VectorXd calcParts(const Model& model, const LeastGap& gap) {
  VectorXd out(gap.closures.size());
  Eigen::Index row = 0;
  for (size_t i = 0; i < gap.closures.size(); ++i) {
    const int rows = getRows(model.closures()[gap.closures[i]].kind);
    out[static_cast<Eigen::Index>(i)] = gap.r.segment(row, rows).norm();
    row += rows;
  }
  return out;
}

// The deletion filter. `gap` is of all closures of the cluster, and does not close.
LeastGap findSmallestConflict(const Model& model, const LeastGap& gap, double length, std::vector<VectorXd> starts) {
  const VectorXd parts = calcParts(model, gap);
  std::vector<std::pair<double, int>> order;  // small parts first: they are the likelier to go
  for (size_t i = 0; i < gap.closures.size(); ++i)
    order.emplace_back(parts[static_cast<Eigen::Index>(i)], gap.closures[i]);
  std::sort(order.begin(), order.end());
  LeastGap conflict = gap;
  const auto leaveOut = [&](const auto& isLeftOut) {
    std::vector<int> rest;
    for (int c : conflict.closures)
      if (!isLeftOut(c)) rest.push_back(c);
    if (rest.empty() || rest.size() == conflict.closures.size()) return;
    starts.front() = conflict.q;
    LeastGap smaller = findLeastGap(model, rest, length, starts);
    if (smaller.r.size() && !smaller.closes()) conflict = std::move(smaller);
  };
  std::set<int> idle;
  for (const auto& [part, c] : order)
    if (part < kSupport * parts.maxCoeff()) idle.insert(c);
  leaveOut([&](int c) { return idle.count(c) > 0; });
  for (const auto& [part, c] : order) leaveOut([c = c](int other) { return other == c; });
  return conflict;
}

// Places on the loops of closures, closures first, and what may change there.
struct Candidate {
  ModelPlace place;
  Change change;
  double least = 0;  // Eq. (2), m
};

std::vector<Candidate> listCandidates(const Model& model, const std::vector<int>& closures, bool turns) {
  std::vector<Candidate> out;
  const auto add = [&](ModelPlace::Kind kind, int index) {
    out.push_back({{kind, index}, Change::Translation});
    if (turns) out.push_back({{kind, index}, Change::Rotation});
  };
  std::set<int> joints;
  for (int c : closures) {
    const Closure& closure = model.closures()[c];
    for (int k : closure.dofs) joints.insert(model.dofs()[k].joint);
    if (closure.kind == ClosureKind::Coupler || closure.kind == ClosureKind::Distance)
      out.push_back({{ModelPlace::Kind::Offset, c}, Change::Offset});
    if (closure.kind != ClosureKind::Coupler) add(ModelPlace::Kind::Frame1, c), add(ModelPlace::Kind::Frame2, c);
  }
  for (int j : joints) add(ModelPlace::Kind::Joint, j);
  return out;
}

// Whether angles have a part in a self-stress.
bool hasTurn(const Model& model, const LeastGap& gap) {
  Eigen::Index row = 0;
  double turn = 0;
  for (int c : gap.closures) {
    const Closure& closure = model.closures()[c];
    const int rows = getRows(closure.kind), lengths = getLengthRows(closure.kind);
    turn = std::max(turn, gap.r.segment(row + lengths, rows - lengths).norm());
    row += rows;
  }
  return turn > 1e-3 * gap.r.norm();
}

// Whether the changed model closes with these closures, from q.
bool isVerified(const Model& model, const LoopRemedy& remedy, const std::vector<int>& closures, const VectorXd& q) {
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  options.tolerance = 0.1 * kCloses;
  options.max_iterations = 50;
  options.continuation_steps = 0;
  return closeConfiguration(selectClosures(applyRemedy(model, remedy), closures), q, options).gap < kCloses;
}

// Changes on the loops of `conflict` that close all closures of `gap`, smallest first.
std::vector<LoopRemedy> findRemedies(const Model& model, const LeastGap& gap, const std::vector<int>& conflict,
                                     double length) {
  const Model part = selectClosures(model, gap.closures);
  std::vector<int> indices;  // of the conflict, in the part
  for (int c : conflict)
    indices.push_back(static_cast<int>(std::find(gap.closures.begin(), gap.closures.end(), c) - gap.closures.begin()));
  const LoopPoint start{gap.q, {}, 0};
  std::vector<Candidate> candidates;
  for (Candidate candidate : listCandidates(part, indices, hasTurn(model, gap))) {
    LoopProblem problem(part, length, candidate.change, candidate.place);
    const MatrixXd H = problem.calcJacobian(start);
    const Eigen::Index directions = candidate.change == Change::Offset ? 1 : 3;
    const double work = (H.rightCols(directions).transpose() * gap.r).norm();
    if (!(work > kSupport * gap.r.norm())) continue;
    candidate.least = gap.r.squaredNorm() / work;
    candidates.push_back(candidate);
  }
  // The order of rounding must not decide.
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.least < (1 - 1e-6) * b.least; });
  if (candidates.size() > kMostTried) candidates.resize(kMostTried);
  std::vector<LoopRemedy> out;
  for (const Candidate& candidate : candidates) {
    LoopProblem problem(part, length, candidate.change, candidate.place);
    LoopPoint z = start;
    if (!problem.findLeastChange(z)) continue;
    LoopRemedy remedy{candidate.place, z.change, z.offset, problem.calcChange(z).norm()};
    if (remedy.place.kind != ModelPlace::Kind::Joint) remedy.place.index = gap.closures[remedy.place.index];
    if (isVerified(model, remedy, gap.closures, z.q)) out.push_back(remedy);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const LoopRemedy& a, const LoopRemedy& b) { return a.size < (1 - 1e-6) * b.size; });
  if (out.size() > kMostRemedies) out.resize(kMostRemedies);
  return out;
}

// "(0.6, 0, -0.8)"
std::string formatDirection(const Vector3d& v) {
  std::string out;
  for (const double x : Vector3d(v.normalized()))
    out += (out.empty() ? "(" : ", ") + formatNumber(std::abs(x) < 5e-4 ? 0 : x, "%.3g");
  return out + ")";
}

// "joint 'knee' on 'thigh'", with the placement in that body.
std::pair<std::string, SE3> describePlace(const Model& model, const ModelPlace& place) {
  const auto onBody = [&](int body) { return " on '" + model.bodies()[body].name + "'"; };
  if (place.kind == ModelPlace::Kind::Joint) {
    const Joint& joint = model.joints()[place.index];
    return {"joint '" + joint.name + "'" + onBody(joint.parent), joint.X_PJ};
  }
  const Closure& closure = model.closures()[place.index];
  if (place.kind == ModelPlace::Kind::Offset) return {getName(closure.kind) + (" '" + closure.name + "'"), {}};
  const bool first = place.kind == ModelPlace::Kind::Frame1;
  const int body = first ? closure.body1 : closure.body2;
  const SE3& X = first ? closure.X_B1 : closure.X_B2;
  return {"frame '" + findFrameName(model, body, X) + "'" + onBody(body), X};
}

std::string describe(const Model& model, const LoopRemedy& remedy) {
  const auto [place, X] = describePlace(model, remedy.place);
  if (remedy.place.kind == ModelPlace::Kind::Offset)
    return model.closures()[remedy.place.index].kind == ClosureKind::Distance
               ? "the length of " + place + " by " + formatNumber(1e3 * remedy.offset, "%.4g") + " mm"
               : "the offset of " + place + " by " + formatNumber(remedy.offset, "%.4g");
  const Vector3d move = X.R * remedy.change.p, turn = X.R * log3(remedy.change.R);
  if (move.norm() > 0)
    return place + " by " + formatNumber(1e3 * move.norm(), "%.4g") + " mm along " + formatDirection(move);
  return place + " turned by " + formatNumber(turn.norm(), "%.4g") + " rad about " + formatDirection(turn);
}

}  // namespace

std::vector<LoopConflict> findLoopConflicts(const Model& model, ConstVectorRef q) {
  std::vector<LoopConflict> out;
  for (const LoopCluster& cluster : model.clusters()) {
    const double length = calcTypicalLength(model, cluster.closures);
    const std::vector<VectorXd> starts = makeStarts(model, q);
    const LeastGap gap = findLeastGap(model, cluster.closures, length, starts);
    if (gap.r.size() == 0 || gap.closes()) continue;
    const LeastGap smallest = findSmallestConflict(model, gap, length, starts);
    LoopConflict conflict;
    conflict.closures = smallest.closures;
    conflict.q = gap.q;
    Workspace ws(model);
    updatePositions(model, ws, gap.q);
    for (int c : cluster.closures)
      conflict.gap = std::max(conflict.gap, calcClosureResidual(ws, model.closures()[c]).cwiseAbs().maxCoeff());
    const auto size = [&](int c) { return calcClosureResidual(ws, model.closures()[c]).cwiseAbs().maxCoeff(); };
    conflict.worst = *std::max_element(conflict.closures.begin(), conflict.closures.end(),
                                       [&](int a, int b) { return size(a) < size(b); });
    conflict.remedies = findRemedies(model, gap, conflict.closures, length);
    // Where there are several conflicts, no one change closes all.
    if (conflict.remedies.empty() && smallest.closures != gap.closures)
      conflict.remedies = findRemedies(model, smallest, conflict.closures, length);
    out.push_back(std::move(conflict));
  }
  std::stable_sort(out.begin(), out.end(), [](const LoopConflict& a, const LoopConflict& b) { return a.gap > b.gap; });
  return out;
}

Model applyRemedy(const Model& model, const LoopRemedy& remedy) {
  ModelParts parts = takeParts(model);
  const int i = remedy.place.index;
  switch (remedy.place.kind) {
    case ModelPlace::Kind::Joint:
      parts.joints[i].X_PJ = parts.joints[i].X_PJ * remedy.change;
      break;
    case ModelPlace::Kind::Frame1:
      parts.closures[i].X_B1 = parts.closures[i].X_B1 * remedy.change;
      break;
    case ModelPlace::Kind::Frame2:
      parts.closures[i].X_B2 = parts.closures[i].X_B2 * remedy.change;
      break;
    case ModelPlace::Kind::Offset:
      (parts.closures[i].kind == ClosureKind::Distance ? parts.closures[i].length : parts.closures[i].offset) +=
          remedy.offset;
      break;
  }
  return ModelBuilder::restore(std::move(parts));
}

std::string describeConflict(const Model& model, const LoopConflict& conflict) {
  std::string names;
  const size_t n = conflict.closures.size();
  for (size_t i = 0; i < n; ++i)
    names += (i == 0 ? "'" : i + 1 < n ? ", '" : " and '") + model.closures()[conflict.closures[i]].name + "'";
  if (n == 1)
    return "loop " + names + " cannot close" + (model.closures().size() > 1 ? ", whatever the other loops do" : "");
  if (n == 2) return "loops " + names + " cannot close together, although each can alone";
  return "loops " + names + " cannot close together, although without any one of them the others can";
}

std::string describeRemedies(const Model& model, const LoopConflict& conflict) {
  std::string out;
  for (const LoopRemedy& remedy : conflict.remedies) out += (out.empty() ? "" : ", or ") + describe(model, remedy);
  return out.empty() ? out
                     : "the smallest change that closes " + std::string(conflict.closures.size() == 1 ? "it" : "them") +
                           " is one of: " + out;
}

namespace {

// The turn by pi of frame 2 of a hinge that closes all loops of its cluster, where the axes of the hinge are opposite at q.
std::optional<LoopRemedy> findOppositeHinge(const Model& model, const std::vector<int>& closures, ConstVectorRef q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  for (int c : closures) {
    const Closure& closure = model.closures()[c];
    if (closure.kind != ClosureKind::Hinge5D || !(calcClosureGap(ws, closure).angle > kPi / 2)) continue;
    const Matrix3d turn = makeAxisRotation<double>(makePlaneBasis(closure.axis).col(0), kPi);
    const LoopRemedy remedy{{ModelPlace::Kind::Frame2, c}, {turn, Vector3d::Zero()}, 0, 0};
    const Model part = selectClosures(applyRemedy(model, remedy), closures);
    if (closeConfiguration(part, q).status == NumericalStatus::Ok ||
        findClosedConfiguration(part).status == NumericalStatus::Ok)
      return remedy;
  }
  return {};
}

}  // namespace

InputError makeClosingError(const Model& model, const std::string& source, const AssemblyResult& open) {
  std::string element = open.worst;
  std::string problem = "its loop cannot be closed: from every start it stays open by at least " +
                        formatNumber(open.gap, "%.6g") + " (m or rad)";
  std::string remedy = "check the lengths and frames along the loop, or give a reference posture close to a closed one";
  for (const LoopCluster& cluster : model.clusters())
    if (const auto opposite = findOppositeHinge(model, cluster.closures, open.q)) {
      const Closure& closure = model.closures()[opposite->place.index];
      return {
          source, "closure '" + closure.name + "'",
          "its hinge stays open by " + formatNumber(kPi, "%.6g") + " rad: its axes point in opposite directions",
          "turn frame '" + findFrameName(model, closure.body2, closure.X_B2) + "' by pi, about a normal of its axis"};
    }
  const std::vector<LoopConflict> conflicts = findLoopConflicts(model, open.q);
  if (conflicts.empty()) return {source, element, problem, remedy};
  const LoopConflict& conflict = conflicts.front();
  element = "closure '" + model.closures()[conflict.worst].name + "'";
  if (model.closures().size() > 1)
    for (const LoopConflict& each : conflicts) problem += "; " + describeConflict(model, each);
  const std::string changes = describeRemedies(model, conflict);
  if (!changes.empty()) remedy = changes + " (directions in the axes of these bodies)";
  return {source, element, problem, remedy};
}

}  // namespace bielle
