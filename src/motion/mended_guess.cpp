#include "motion/mended_guess.h"

#include <algorithm>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/linkage.h"
#include "dynamics/reduction.h"
#include "motion/applied_options.h"
#include "motion/kinematic_guess.h"

namespace bielle {
namespace {

// The joints of a linkage, on the way from one posture to another.
void moveJoints(const Model& model, const Linkage& linkage, const VectorXd& from, const VectorXd& to, double share,
                VectorXd& x) {
  const VectorXd q = model.integrate(from, share * model.difference(from, to));
  for (int i : linkage.cluster->joints) {
    const Joint& joint = model.joints()[i];
    x.segment(joint.idx_q, joint.nq) = q.segment(joint.idx_q, joint.nq);
  }
}

bool isEvaluated(RobotEvaluator& evaluator, int node, const ShootingTrajectory& nodes) {
  return evaluator.evaluate(node, nodes.xs[node], nodes.us[node]).status == NumericalStatus::Ok;
}

}  // namespace

void leadPastDeadPoints(const Motion& motion, std::vector<VectorXd>& xs) {
  const Model& model = motion.problem->model();
  const int nq = model.nq(), num_nodes = static_cast<int>(xs.size());
  const LimitOptions& limits = motion.problem_options.limits;
  if (!limits.enforced || (limits.dead_point_margin == 0 && limits.dead_point_margins.empty())) return;
  const VectorXd start = motion.problem->initialState().head(nq);
  for (const Linkage& linkage : listLinkages(model, start)) {
    const double margin = getDeadPointMargin(limits, linkage.output);
    if (linkage.isDirect() || margin == 0) continue;
    const auto isWithin = [&](int node, double least) {
      const double transmission = calcTransmission(linkage, model, xs[node].head(nq));
      return transmission >= least && transmission <= 1 / least;
    };
    const double well = std::max(margin, kEasyTransmission);
    for (int first = 0; first < num_nodes; ++first) {
      if (isWithin(first, well)) continue;
      int after = first;
      bool is_beyond = false;
      for (; after < num_nodes && !isWithin(after, well); ++after) is_beyond = is_beyond || !isWithin(after, margin);
      const VectorXd from = first > 0 ? VectorXd(xs[first - 1].head(nq)) : start,
                     to = after < num_nodes ? VectorXd(xs[after].head(nq)) : from;
      for (int k = first; k < after && is_beyond; ++k)
        moveJoints(model, linkage, from, to, (k - first + 1.0) / (after - first + 1), xs[k]);
      first = after;
    }
  }
}

void standOnFeet(const Motion& motion, std::vector<VectorXd>& xs) {
  const Model& model = motion.problem->model();
  const int nq = model.nq(), nv = model.nv();
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  options.patience = 5;
  options.continuation_steps = 0;
  Workspace ws(model);
  for (size_t k = 0; k < xs.size(); ++k) {
    const std::vector<ContactTarget>& feet = motion.schedule.getPhase(static_cast<int>(k)).contacts;
    AssemblyProblem problem;
    problem.q_ref = xs[k].head(nq);
    for (const ContactTarget& foot : feet)
      problem.frames.push_back(makeFrameTarget(model.contacts()[foot.contact], foot.X_WT));
    const AssemblyResult standing = assemble(model, problem, options);
    if (standing.status != NumericalStatus::Ok) continue;
    xs[k].head(nq) = standing.q;
    xs[k].segment(nq, nv) =
        projectVelocity(model, ws, makeConstraintSet(model, feet), standing.q, xs[k].segment(nq, nv));
  }
}

void restNodes(const RobotProblem& problem, ShootingTrajectory& nodes) {
  const Model& model = problem.model();
  const int base = model.hasFreeFlyer() ? 7 : 0, joints = model.nq() - base;
  RobotEvaluator evaluator(problem);
  for (int k = 0; k < problem.numStages(); ++k) {
    if (isEvaluated(evaluator, k, nodes)) continue;
    VectorRef v = nodes.xs[k].segment(model.nq(), model.nv());
    VectorXd& u = nodes.us[k];
    const Eigen::Index torques = std::min<Eigen::Index>(u.size(), model.nu());
    v.setZero();
    u.head(torques).setZero();
    if (isEvaluated(evaluator, k, nodes)) continue;
    nodes.xs[k].segment(base, joints) = problem.initialState().segment(base, joints);
  }
}

}  // namespace bielle
