#include "bielle/dynamics/assembly.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/assembly_refinement.h"
#include "dynamics/target_reach.h"
#include "dynamics/whole_turns.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "math/so3.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// Iterations before the preference of Eq. (1) starts to fade.
constexpr int kFullWishIterations = 30;

// The hard conditions of Eq. (1): residual and Jacobian, with the name of every row's origin.
class HardConditions {
 public:
  // \param held  whether the free base stays where it is
  HardConditions(const Model& model, const AssemblyProblem& problem, bool held = false)
      : model_(model), problem_(problem), set_(makeConstraintSet(model)), ws_(model), held_(held) {
    rows_ = set_.rows;
    for (const FrameTarget& target : problem.frames) rows_ += static_cast<int>(target.mask.count());
    for (const Closure& closure : set_.closures)
      columns_.insert(columns_.end(), static_cast<size_t>(getRows(closure.kind)), &closure.dofs);
    for (const FrameTarget& target : problem.frames)
      columns_.insert(columns_.end(), static_cast<size_t>(target.mask.count()), &model.supportDofs(target.body));
    H.setZero(rows_, model.nv());
    h.setZero(rows_);
  }

  HardConditions(const HardConditions&) = delete;  // columns are those of its closures

  int rows() const { return rows_; }
  // Of each row of H: where it may have entries.
  const std::vector<const std::vector<int>*>& columns() const { return columns_; }

  // h alone: what searches along a step need.
  void updateResidual(const VectorXd& q) {
    updatePlacements(model_, ws_, q);
    for (size_t c = 0; c < set_.closures.size(); ++c)
      h.segment(set_.offsets[c], getRows(set_.closures[c].kind)) = calcClosureResidual(ws_, set_.closures[c]);
    int row = set_.rows;
    for (const FrameTarget& target : problem_.frames) {
      const Vector6d error = calcError(target);
      for (int i = 0; i < 6; ++i)
        if (target.mask[i]) h[row++] = error[i];
    }
  }

  // H where h is.
  void updateJacobian() {
    updateColumns(model_, ws_);
    for (size_t c = 0; c < set_.closures.size(); ++c) {
      const Closure& closure = set_.closures[c];
      calcClosureResidualJacobian(ws_, closure, H.middleRows(set_.offsets[c], getRows(closure.kind)));
    }
    int row = set_.rows;
    for (const FrameTarget& target : problem_.frames) row = updateTarget(target, row);
    if (held_) H.leftCols<6>().setZero();
  }

  // Name and size of the worst violated condition.
  std::pair<std::string, double> findWorst() const {
    std::pair<std::string, double> worst{"", -1};
    const auto consider = [&worst](const std::string& name, double value) {
      if (!(value <= worst.second)) worst = {name, value};
    };
    for (size_t c = 0; c < set_.closures.size(); ++c)
      consider("closure '" + set_.closures[c].name + "'",
               calcLargest(h.segment(set_.offsets[c], getRows(set_.closures[c].kind))));
    int row = set_.rows;
    for (const FrameTarget& target : problem_.frames) {
      const int n = static_cast<int>(target.mask.count());
      if (n) consider("target '" + target.name + "'", calcLargest(h.segment(row, n)));
      row += n;
    }
    return worst;
  }

  double calcLoopGap() const { return calcLargestGap(ws_, set_); }

  MatrixXd H;
  VectorXd h;

 private:
  Vector6d calcError(const FrameTarget& target) const {
    const SE3 X = getPlacement(ws_, target.body, target.X_BF);
    Vector6d error;
    error.head<3>() = X.p - target.X_WT.p;
    error.tail<3>() = log3(target.X_WT.R.transpose() * X.R);
    return error;
  }

  int updateTarget(const FrameTarget& target, int row) {
    const Matrix3d R = getPlacement(ws_, target.body, target.X_BF).R;
    const Matrix3d dlog = calcRightJacobianInverse3(Vector3d(log3(target.X_WT.R.transpose() * R)));
    Matrix6Xd J = calcFrameJacobian(model_, ws_, target.body, target.X_BF);
    J.topRows<3>() = (R * J.topRows<3>()).eval();
    J.bottomRows<3>() = (dlog * J.bottomRows<3>()).eval();
    for (int i = 0; i < 6; ++i)
      if (target.mask[i]) H.row(row++) = J.row(i);
    return row;
  }

  const Model& model_;
  const AssemblyProblem& problem_;
  ConstraintSet set_;
  Workspace ws_;
  bool held_;
  int rows_ = 0;
  std::vector<const std::vector<int>*> columns_;
};

// Rows and columns of a matrix that its entries connect, those without entries left out.
struct MatrixBlock {
  std::vector<int> rows, columns;
};

// \param columns  of each row: where it may have entries
std::vector<MatrixBlock> listBlocks(const MatrixXd& H, const std::vector<const std::vector<int>*>& columns) {
  std::vector<int> owners(static_cast<size_t>(H.cols()));  // of columns: each leads to one that stands for its block
  std::iota(owners.begin(), owners.end(), 0);
  const auto findOwner = [&](int column) {
    while (owners[static_cast<size_t>(column)] != column) column = owners[static_cast<size_t>(column)];
    return column;
  };
  std::vector<int> of_rows(static_cast<size_t>(H.rows()), -1);  // a column of the row's block
  for (int i = 0; i < H.rows(); ++i)
    for (int j : *columns[static_cast<size_t>(i)]) {
      if (H(i, j) == 0) continue;
      int& column = of_rows[static_cast<size_t>(i)];
      if (column < 0) column = j;
      owners[static_cast<size_t>(findOwner(j))] = findOwner(column);
    }
  std::vector<MatrixBlock> blocks(static_cast<size_t>(H.cols()));
  for (int i = 0; i < H.rows(); ++i)
    if (const int column = of_rows[static_cast<size_t>(i)]; column >= 0)
      blocks[static_cast<size_t>(findOwner(column))].rows.push_back(i);
  for (int j = 0; j < H.cols(); ++j) blocks[static_cast<size_t>(findOwner(j))].columns.push_back(j);
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(), [](const MatrixBlock& b) { return b.rows.empty(); }),
               blocks.end());
  return blocks;
}

// Eq. (1). `damping` shrinks the part along weak singular directions, `wish_gain` the second term.
VectorXd calcStep(const MatrixXd& H, const VectorXd& h, const VectorXd& wish, double wish_gain, const VectorXd& weights,
                  double damping, double rank_tolerance) {
  if (h.size() == 0) return wish;
  const Eigen::JacobiSVD<MatrixXd> svd(H, Eigen::ComputeThinU | Eigen::ComputeFullV);
  const VectorXd& sigma = svd.singularValues();
  const int rank = static_cast<int>((sigma.array() > rank_tolerance * std::max(sigma[0], 1e-12)).count());
  const VectorXd gains = sigma.head(rank).array() / (sigma.head(rank).array().square() + damping * damping);
  VectorXd step = svd.matrixV().leftCols(rank) * gains.cwiseProduct(svd.matrixU().leftCols(rank).transpose() * -h);
  const MatrixXd N = svd.matrixV().rightCols(H.cols() - rank);
  if (N.cols() == 0) return step;
  const MatrixXd WN = weights.asDiagonal() * N;
  step += wish_gain * (N * WN.colPivHouseholderQr().solve(VectorXd(weights.cwiseProduct(wish - step))));
  return step;
}

// The first term of Eq. (1) alone. The pseudo-inverse of H is made of those of its blocks: the legs under a base that is held.
VectorXd calcShortestStep(const HardConditions& conditions, const VectorXd& h, double damping, double rank_tolerance) {
  const MatrixXd& H = conditions.H;
  VectorXd step = VectorXd::Zero(H.cols());
  for (const MatrixBlock& block : listBlocks(H, conditions.columns())) {
    const MatrixXd A = H(block.rows, block.columns);
    const VectorXd b = h(block.rows);
    if (damping > 0) {
      MatrixXd gram = A * A.transpose();
      gram.diagonal().array() += damping * damping;
      step(block.columns) = -A.transpose() * gram.llt().solve(b);
    } else {
      Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
      factors.setThreshold(rank_tolerance);
      factors.compute(A);
      step(block.columns) = -factors.solve(b);
    }
  }
  return step;
}

// Newton iterations towards h(q) = offset; true when met.
bool iterate(const Model& model, const AssemblyProblem& problem, const AssemblyOptions& options, const VectorXd& offset,
             HardConditions& conditions, AssemblyResult& result) {
  const VectorXd weights = problem.weights.size() ? problem.weights : VectorXd::Ones(model.nv());
  conditions.updateResidual(result.q);
  double error = (conditions.h - offset).norm();
  std::vector<double> errors;  // only with patience
  for (int i = 0; i < options.max_iterations; ++i, ++result.iterations) {
    const bool met = conditions.rows() == 0 || calcLargest(conditions.h - offset) <= options.tolerance;
    if (met && options.step == AssemblyStep::Shortest) return true;  // nothing else is wished
    conditions.updateJacobian();
    const double damping = std::min(0.1, error);
    // A preference far from the feasible set (e.g. an overstretched leg) can make the iterates cycle: it fades.
    const double wish_gain = std::pow(0.8, std::max(0, i - kFullWishIterations));
    const double shrink = error < 1e-3 ? 0.0 : 0.3 * damping;
    VectorXd step = options.step == AssemblyStep::Shortest
                        ? calcShortestStep(conditions, conditions.h - offset, shrink, options.rank_tolerance)
                        : calcStep(conditions.H, conditions.h - offset, model.difference(result.q, problem.q_ref),
                                   wish_gain, weights, shrink, options.rank_tolerance);
    const double largest = calcLargest(step);
    if (!std::isfinite(largest)) return false;
    if (met && largest < 1e-9) return true;
    if (largest > options.step_limit) step *= options.step_limit / largest;
    // Halve while the conditions get much worse; slightly worse is allowed, as the preference bends the path.
    VectorXd q_new;
    for (int halving = 0; halving < 8; ++halving, step *= 0.5) {
      q_new = model.integrate(result.q, step);
      conditions.updateResidual(q_new);
      if ((conditions.h - offset).norm() <= 1.5 * error + 1e-3) break;
    }
    result.q = q_new;
    error = (conditions.h - offset).norm();
    if (options.patience == 0) continue;
    errors.push_back(error);
    if (i >= options.patience && error > 1e-6 && error > 0.7 * errors[static_cast<size_t>(i - options.patience)])
      return false;
  }
  return conditions.rows() == 0 || calcLargest(conditions.h - offset) <= options.tolerance;
}

AssemblyResult assemble(const Model& model, const AssemblyProblem& given, const AssemblyOptions& options, bool held) {
  AssemblyProblem problem = given;
  problem.q_ref = leaveOutTurns(model, given.q_ref);
  HardConditions conditions(model, problem, held);
  AssemblyResult result;
  result.q = problem.q_ref;
  model.normalize(result.q);
  std::tie(result.worst, result.message) = findTargetsApart(model, problem.frames);
  if (!result.message.empty()) {
    conditions.updateResidual(result.q);
    result.gap = conditions.calcLoopGap();
    return result;
  }
  bool closed = iterate(model, problem, options, VectorXd::Zero(conditions.rows()), conditions, result);
  if (!closed) {
    AssemblyResult best = result;
    conditions.updateResidual(problem.q_ref);
    const VectorXd start = conditions.h;
    result.q = problem.q_ref;
    for (int step = 1; step <= options.continuation_steps; ++step) {
      const double t = static_cast<double>(step) / options.continuation_steps;
      closed = iterate(model, problem, options, (1 - t) * start, conditions, result);
      if (!closed) break;
    }
    if (!closed) {  // report the closer of the two attempts
      conditions.updateResidual(result.q);
      const double error = conditions.h.norm();
      conditions.updateResidual(best.q);
      if (conditions.h.norm() < error || !std::isfinite(error)) result.q = best.q;
    }
  }
  conditions.updateResidual(result.q);
  const auto [worst, gap] = conditions.findWorst();
  result.worst = worst;
  result.gap = conditions.calcLoopGap();
  result.status = closed ? NumericalStatus::Ok : NumericalStatus::NotClosed;
  if (closed) {
    result.message = "closed";
  } else {
    TextStream text;
    text << worst << " stays open by " << gap << " (m or rad) after " << result.iterations
         << " iterations; the targets may be out of reach, or the start may be on the wrong branch of the mechanism";
    result.message = text.str();
  }
  return result;
}

}  // namespace

AssemblyResult assemble(const Model& model, const AssemblyProblem& problem, const AssemblyOptions& options) {
  return assemble(model, problem, options, false);
}

AssemblyResult assembleUnderBase(const Model& model, const AssemblyProblem& problem, const AssemblyOptions& options) {
  return assemble(model, problem, options, model.hasFreeFlyer());
}

AssemblyResult refineAssembly(const Model& model, const AssemblyProblem& problem, ConstVectorRef near) {
  constexpr int kMost = 30;
  constexpr double kShort = 1e-9;  // of steps: nothing that is solved by Newton steps stops before
  const AssemblyOptions options;
  const VectorXd weights = problem.weights.size() ? problem.weights : VectorXd::Ones(model.nv());
  HardConditions conditions(model, problem);
  AssemblyResult result;
  result.q = near;
  double last = std::numeric_limits<double>::infinity();
  for (result.iterations = 0; result.iterations < kMost; ++result.iterations) {
    conditions.updateResidual(result.q);
    conditions.updateJacobian();
    const VectorXd wish = model.difference(result.q, problem.q_ref);
    VectorXd step = wish;
    if (conditions.rows() > 0) {
      Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
      factors.setThreshold(options.rank_tolerance);
      factors.compute(conditions.H);
      step = -factors.solve(conditions.h);
      const MatrixXd Z = factors.colsPermutation() * factors.matrixZ().transpose();
      const MatrixXd N = Z.rightCols(Z.cols() - factors.rank());
      const MatrixXd WN = weights.asDiagonal() * N;
      if (N.cols() > 0) step += N * WN.colPivHouseholderQr().solve(VectorXd(weights.cwiseProduct(wish - step)));
    }
    const double size = calcLargest(step);
    if (!(size < options.step_limit)) break;
    if (last < kShort && size > 0.5 * last) break;
    result.q = model.integrate(result.q, step);
    last = size;
    if (size == 0) break;
  }
  conditions.updateResidual(result.q);
  result.gap = conditions.calcLoopGap();
  const bool met = conditions.rows() == 0 || calcLargest(conditions.h) <= options.tolerance;
  if (met && last < kShort) result.status = NumericalStatus::Ok;
  return result;
}

AssemblyResult closeConfiguration(const Model& model, ConstVectorRef q, const AssemblyOptions& options) {
  AssemblyProblem problem;
  problem.q_ref = q;
  return assemble(model, problem, options);
}

AssemblyResult findClosedConfiguration(const Model& model, const AssemblyOptions& options) {
  constexpr int kStarts = 20;
  constexpr double kSpread = 0.1;  // rad or m per start
  AssemblyResult best;
  best.gap = std::numeric_limits<double>::infinity();
  const auto closes = [&](const AssemblyResult& result) {
    if (result.status == NumericalStatus::Ok || result.gap < best.gap) best = result;
    return result.status == NumericalStatus::Ok;
  };
  for (const Reference& reference : model.references())
    if (closes(assemble(model, makeReferenceProblem(model, reference), options))) return best;
  const VectorXd neutral = model.makeNeutral();
  if (closes(closeConfiguration(model, neutral, options))) return best;
  std::mt19937 rng(1);
  for (int start = 1; start <= kStarts; ++start) {
    std::uniform_real_distribution<double> uniform(-kSpread * start, kSpread * start);
    const VectorXd step = VectorXd::NullaryExpr(model.nv(), [&](Eigen::Index) { return uniform(rng); });
    if (closes(closeConfiguration(model, model.integrate(neutral, step), options))) return best;
  }
  return best;
}

FrameTarget makeFrameTarget(const ContactFrame& contact, const SE3& X_WT) {
  FrameTarget target{contact.name, contact.body, contact.X_BF, X_WT};
  if (contact.kind == ContactKind::Point3D) target.mask.tail<3>().setConstant(false);
  if (contact.kind == ContactKind::Edge5D) target.mask[3] = false;
  return target;
}

AssemblyResult assembleReference(const Model& model, const std::string& name, const AssemblyOptions& options) {
  std::string known;
  for (const Reference& reference : model.references()) {
    if (reference.name == name) return assemble(model, makeReferenceProblem(model, reference), options);
    known += (known.empty() ? "" : ", ") + reference.name;
  }
  throw InputError(model.name(), "reference '" + name + "'", "the robot has no such reference",
                   known.empty() ? "add one under `references` in its YAML file" : "it has: " + known);
}

std::vector<ReferenceJoint> listReferenceJoints(const Model& model, const Reference& reference, ConstVectorRef q) {
  std::vector<ReferenceJoint> joints;
  const VectorXd given = leaveOutTurns(model, makeReferenceProblem(model, reference).q_ref);
  const VectorXd difference = model.difference(given, q);
  for (const auto& [name, values] : reference.joints) {
    const int index = model.findJoint(name);
    const Joint& joint = model.joints()[index];
    if (joint.kind == JointKind::FreeFlyer) continue;
    joints.push_back({index, Eigen::Map<const VectorXd>(values.data(), joint.nq), q.segment(joint.idx_q, joint.nq),
                      difference.segment(joint.idx_v, joint.nv).cwiseAbs().maxCoeff()});
  }
  return joints;
}

VectorXd projectVelocity(const Model& model, Workspace& ws, const ConstraintSet& constraints, ConstVectorRef q,
                         ConstVectorRef v) {
  updatePositions(model, ws, q);
  MatrixXd J = MatrixXd::Zero(constraints.rows, model.nv());
  for (size_t c = 0; c < constraints.closures.size(); ++c)
    calcClosureJacobian(ws, constraints.closures[c],
                        J.middleRows(constraints.offsets[c], getRows(constraints.closures[c].kind)));
  if (constraints.rows == 0) return v;
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  decomposition.setThreshold(1e-8);
  decomposition.compute(J);
  return v - decomposition.solve(VectorXd(J * v));
}

double calcLargestGap(const Workspace& ws, const ConstraintSet& constraints, std::string* worst) {
  double gap = 0;
  for (int c = 0; c < constraints.num_loops; ++c) {
    const double value = calcLargest(calcClosureResidual(ws, constraints.closures[c]));
    if (value <= gap || std::isnan(gap)) continue;  // a NaN is the largest
    if (worst) *worst = constraints.closures[c].name;
    gap = value;
  }
  return gap;
}

}  // namespace bielle
