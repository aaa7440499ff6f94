#include "bielle/dynamics/assembly.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
  HardConditions(const Model& model, const AssemblyProblem& problem)
      : model_(model), problem_(problem), set_(makeConstraintSet(model)), ws_(model) {
    rows_ = set_.rows;
    for (const FrameTarget& target : problem.frames) rows_ += static_cast<int>(target.mask.count());
    H.setZero(rows_, model.nv());
    h.setZero(rows_);
  }

  int rows() const { return rows_; }

  void update(const VectorXd& q) {
    updatePositions(model_, ws_, q);
    for (size_t c = 0; c < set_.closures.size(); ++c) {
      const Closure& closure = set_.closures[c];
      const int row = set_.offsets[c], n = getRows(closure.kind);
      h.segment(row, n) = calcClosureResidual(ws_, closure);
      calcClosureResidualJacobian(ws_, closure, H.middleRows(row, n));
    }
    int row = set_.rows;
    for (const FrameTarget& target : problem_.frames) row = updateTarget(target, row);
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
  int updateTarget(const FrameTarget& target, int row) {
    const SE3 X = getPlacement(ws_, target.body, target.X_BF);
    Vector6d error;
    error.head<3>() = X.p - target.X_WT.p;
    error.tail<3>() = log3(target.X_WT.R.transpose() * X.R);
    const Matrix3d dlog = calcRightJacobianInverse3(error.tail<3>());
    Matrix6Xd J = calcFrameJacobian(model_, ws_, target.body, target.X_BF);
    J.topRows<3>() = (X.R * J.topRows<3>()).eval();
    J.bottomRows<3>() = (dlog * J.bottomRows<3>()).eval();
    for (int i = 0; i < 6; ++i) {
      if (!target.mask[i]) continue;
      h[row] = error[i];
      H.row(row++) = J.row(i);
    }
    return row;
  }

  const Model& model_;
  const AssemblyProblem& problem_;
  ConstraintSet set_;
  Workspace ws_;
  int rows_ = 0;
};

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

// The first term of Eq. (1) alone.
VectorXd calcShortestStep(const MatrixXd& H, const VectorXd& h, double damping, double rank_tolerance) {
  if (h.size() == 0) return VectorXd::Zero(H.cols());
  if (damping > 0) {
    MatrixXd gram = H * H.transpose();
    gram.diagonal().array() += damping * damping;
    return -H.transpose() * gram.llt().solve(h);
  }
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
  factors.setThreshold(rank_tolerance);
  return -factors.compute(H).solve(h);
}

// Newton iterations towards h(q) = offset; true when met.
bool iterate(const Model& model, const AssemblyProblem& problem, const AssemblyOptions& options, const VectorXd& offset,
             HardConditions& conditions, AssemblyResult& result) {
  const VectorXd weights = problem.weights.size() ? problem.weights : VectorXd::Ones(model.nv());
  conditions.update(result.q);
  double error = (conditions.h - offset).norm();
  for (int i = 0; i < options.max_iterations; ++i, ++result.iterations) {
    const VectorXd wish = model.difference(result.q, problem.q_ref);
    const double damping = std::min(0.1, error);
    // A preference far from the feasible set (e.g. an overstretched leg) can make the iterates cycle: it fades.
    const double wish_gain = std::pow(0.8, std::max(0, i - kFullWishIterations));
    const double shrink = error < 1e-3 ? 0.0 : 0.3 * damping;
    VectorXd step =
        options.step == AssemblyStep::Shortest
            ? calcShortestStep(conditions.H, conditions.h - offset, shrink, options.rank_tolerance)
            : calcStep(conditions.H, conditions.h - offset, wish, wish_gain, weights, shrink, options.rank_tolerance);
    const double largest = calcLargest(step);
    if (!std::isfinite(largest)) return false;
    const bool met = conditions.rows() == 0 || calcLargest(conditions.h - offset) <= options.tolerance;
    if (met && largest < 1e-9) return true;
    if (largest > options.step_limit) step *= options.step_limit / largest;
    // Halve while the conditions get much worse; slightly worse is allowed, as the preference bends the path.
    VectorXd q_new;
    for (int halving = 0; halving < 8; ++halving, step *= 0.5) {
      q_new = model.integrate(result.q, step);
      conditions.update(q_new);
      if ((conditions.h - offset).norm() <= 1.5 * error + 1e-3) break;
    }
    result.q = q_new;
    error = (conditions.h - offset).norm();
  }
  return conditions.rows() == 0 || calcLargest(conditions.h - offset) <= options.tolerance;
}

}  // namespace

AssemblyResult assemble(const Model& model, const AssemblyProblem& given, const AssemblyOptions& options) {
  AssemblyProblem problem = given;
  problem.q_ref = leaveOutTurns(model, given.q_ref);
  HardConditions conditions(model, problem);
  AssemblyResult result;
  result.q = problem.q_ref;
  model.normalize(result.q);
  std::tie(result.worst, result.message) = findTargetsApart(model, problem.frames);
  if (!result.message.empty()) {
    conditions.update(result.q);
    result.gap = conditions.calcLoopGap();
    return result;
  }
  bool closed = iterate(model, problem, options, VectorXd::Zero(conditions.rows()), conditions, result);
  if (!closed) {
    AssemblyResult best = result;
    conditions.update(problem.q_ref);
    const VectorXd start = conditions.h;
    result.q = problem.q_ref;
    for (int step = 1; step <= options.continuation_steps; ++step) {
      const double t = static_cast<double>(step) / options.continuation_steps;
      closed = iterate(model, problem, options, (1 - t) * start, conditions, result);
      if (!closed) break;
    }
    if (!closed) {  // report the closer of the two attempts
      conditions.update(result.q);
      const double error = conditions.h.norm();
      conditions.update(best.q);
      if (conditions.h.norm() < error || !std::isfinite(error)) result.q = best.q;
    }
  }
  conditions.update(result.q);
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
    conditions.update(result.q);
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
  conditions.update(result.q);
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

namespace {

const ContactFrame& getFoot(const Model& model, const Reference& reference, const std::string& name) {
  const int index = model.findContact(name);
  if (index < 0)
    throw InputError(model.name(), "reference '" + reference.name + "'", "there is no contact '" + name + "'",
                     "name one of the contacts of the file");
  return model.contacts()[index];
}

// Zero for what is only rounding, so that robots that face x do so exactly.
double dropRounding(double angle) { return std::abs(angle) < 1e-9 ? 0 : angle; }

// Angle about the vertical by which points turn to lie as others do, about the middle of each, in the least-squares sense; 0 for
// fewer than two.
double calcTurn(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to) {
  Vector3d middle_from = Vector3d::Zero(), middle_to = Vector3d::Zero();
  for (size_t i = 0; i < from.size(); ++i) {
    middle_from += from[i] / static_cast<double>(from.size());
    middle_to += to[i] / static_cast<double>(to.size());
  }
  double sine = 0, cosine = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    const Vector3d a = from[i] - middle_from, b = to[i] - middle_to;
    sine += a.x() * b.y() - a.y() * b.x();
    cosine += a.x() * b.x() + a.y() * b.y();
  }
  return dropRounding(std::atan2(sine, cosine));
}

// Where the feet of a reference are, and which way those without a yaw of their own face.
class ReferenceFeet {
 public:
  // \param q_ref  preferred configuration, with a base that is not given at the origin
  ReferenceFeet(const Model& model, const Reference& reference, const VectorXd& q_ref)
      : model_(model), reference_(reference), ws_(model) {
    is_placed_ = !model.hasFreeFlyer() || reference.joints.count(model.joints()[1].name) > 0;
    if (reference.feet.empty()) return;
    unbent_ = model.makeNeutral();
    if (model.hasFreeFlyer() && is_placed_) unbent_.head<7>() = q_ref.head<7>();
    lowest_ = std::numeric_limits<double>::infinity();
    for (const auto& [name, place] : reference.feet) {
      middle_ += place / static_cast<double>(reference.feet.size());
      lowest_ = std::min(lowest_, place.z());
    }
    heading_ = is_placed_ ? findHeadingOfBase() : findHeadingOfFeet(q_ref);
  }

  // Whether the base is where the file puts it, or the reference.
  bool is_placed() const { return is_placed_; }
  double lowest() const { return lowest_; }

  double getYaw(const std::string& name) const {
    const auto yaw = reference_.yaws.find(name);
    return yaw == reference_.yaws.end() ? heading_ : yaw->second;
  }

  // Over the middle of the feet, and facing as they do in the mean.
  SE3 findBase() const {
    double sine = 0, cosine = 0;
    for (const auto& [name, place] : reference_.feet) {
      sine += std::sin(getYaw(name));
      cosine += std::cos(getYaw(name));
    }
    return {makeAxisRotation(Vector3d::UnitZ(), reference_.feet.empty() ? 0 : std::atan2(sine, cosine)),
            {middle_.x(), middle_.y(), lowest_}};
  }

  // The contact flat at its place. It turns freely about the vertical where the reference gives a joint that turns it so, and no
  // yaw.
  FrameTarget makeTarget(const std::string& name, const Vector3d& place) {
    const ContactFrame& contact = getFoot(model_, reference_, name);
    FrameTarget target = makeFrameTarget(contact, {makeAxisRotation(Vector3d::UnitZ(), getYaw(name)), place});
    if (!reference_.yaws.count(name) && isTurned(contact)) target.mask[5] = false;
    return target;
  }

 private:
  // That of soles on unbent legs: their axes across stay level as legs bend.
  double findHeadingOfBase() {
    updatePositions(model_, ws_, unbent_);
    Vector3d across = Vector3d::Zero();
    for (const auto& [name, place] : reference_.feet) {
      const ContactFrame& contact = getFoot(model_, reference_, name);
      if (contact.kind != ContactKind::Point3D) across += getPlacement(ws_, contact.body, contact.X_BF).R.col(1);
    }
    const bool is_level = across.head<2>().norm() > 0.5 * across.norm();
    return is_level ? dropRounding(std::atan2(-across.x(), across.y())) : 0;
  }

  // That of a base which brings the feet nearest to their places. Two feet stand across or along the robot: by the line between
  // them, so that small differences of legs turn nothing.
  double findHeadingOfFeet(const VectorXd& q_ref) {
    updatePositions(model_, ws_, q_ref);
    std::vector<Vector3d> from, to;
    for (const auto& [name, place] : reference_.feet) {
      const ContactFrame& contact = getFoot(model_, reference_, name);
      from.push_back(getPlacement(ws_, contact.body, contact.X_BF).p);
      to.push_back(place);
    }
    if (from.size() != 2) return calcTurn(from, to);
    constexpr double kQuarter = 1.57079632679489662;  // turn
    const Vector3d a = from[1] - from[0], b = to[1] - to[0];
    const double along = kQuarter * std::round(std::atan2(a.y(), a.x()) / kQuarter);
    return dropRounding(std::remainder(std::atan2(b.y(), b.x()) - along, 4 * kQuarter));
  }

  // Whether an angle is given of a joint between base and foot that turns about the vertical while the legs are not bent. None turns
  // the foot: it faces ahead.
  bool isTurned(const ContactFrame& contact) {
    constexpr double kUpright = 0.9;  // least cosine between its axis and the vertical
    constexpr double kTurned = 1e-3;  // rad
    updatePositions(model_, ws_, unbent_);
    for (int i = contact.body; i > (model_.hasFreeFlyer() ? 1 : 0); i = model_.joints()[i].parent) {
      const Joint& joint = model_.joints()[i];
      const auto given = reference_.joints.find(joint.name);
      if (given == reference_.joints.end()) continue;
      const std::vector<double>& q = given->second;
      const auto turns = [&](const Vector3d& axis, double angle) {
        return std::abs((ws_.X_WB[i].R * axis).z()) > kUpright && std::abs(angle) > kTurned;
      };
      const bool is_hinge = joint.kind == JointKind::Revolute || joint.kind == JointKind::Continuous;
      if ((is_hinge || joint.kind == JointKind::Universal) && turns(joint.axis, q[0])) return true;
      if (joint.kind == JointKind::Universal && turns(joint.axis2, q[1])) return true;
      if (joint.kind == JointKind::Spherical && std::abs(2 * std::atan2(q[2], q[3])) > kTurned) return true;
    }
    return false;
  }

  const Model& model_;
  const Reference& reference_;
  Workspace ws_;
  bool is_placed_ = false;
  VectorXd unbent_;  // neutral but for a base that is given
  Vector3d middle_ = Vector3d::Zero();
  double lowest_ = 0, heading_ = 0;
};

}  // namespace

AssemblyProblem makeReferenceProblem(const Model& model, const Reference& reference) {
  AssemblyProblem problem;
  problem.q_ref = model.makeNeutral();
  // Listed joints are preferences; the others follow from the closures, with a weight that only settles ties.
  problem.weights = VectorXd::Constant(model.nv(), 1e-3);
  for (const auto& [name, values] : reference.joints) {
    const int index = model.findJoint(name);
    const std::string element = "reference '" + reference.name + "'";
    if (index < 0) throw InputError(model.name(), element, "there is no joint '" + name + "'", "name a moving joint");
    const Joint& joint = model.joints()[index];
    if (static_cast<int>(values.size()) != joint.nq)
      throw InputError(
          model.name(), element,
          "joint '" + name + "' has " + std::to_string(joint.nq) + " values, not " + std::to_string(values.size()),
          "give its q in the order of notation.h");
    problem.q_ref.segment(joint.idx_q, joint.nq) = Eigen::Map<const VectorXd>(values.data(), joint.nq);
    problem.weights.segment(joint.idx_v, joint.nv).setOnes();
  }
  if (model.hasFreeFlyer()) problem.weights.head<6>().setOnes();
  ReferenceFeet feet(model, reference, problem.q_ref);
  if (!feet.is_placed()) {
    const SE3 base = feet.findBase();
    problem.q_ref.head<7>() << base.p, Eigen::Quaterniond(base.R).coeffs();
  }
  for (const auto& [name, place] : reference.feet) problem.frames.push_back(feet.makeTarget(name, place));
  if (!reference.height_frame.empty()) {
    const int index = model.findFrame(reference.height_frame);
    if (index < 0)
      throw InputError(model.name(), "reference '" + reference.name + "'",
                       "there is no frame '" + reference.height_frame + "'", "name a link or frame");
    FrameTarget target;
    target.name = "height of " + reference.height_frame;
    target.body = model.frames()[index].body;
    target.X_BF = model.frames()[index].X_BF;
    target.X_WT.p.z() = feet.lowest() + reference.height;
    target.mask << false, false, true, false, false, false;
    problem.frames.push_back(target);
    if (model.hasFreeFlyer()) problem.q_ref[2] = target.X_WT.p.z() - target.X_BF.p.z();
  }
  return problem;
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
