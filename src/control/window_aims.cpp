// Where feet aim, so that the windows of a solved motion keep its footholds.
//
// A window does not see that a shorter step leaves more to walk beyond its end, so feet that are free to land elsewhere land short of
// their footholds. Adding slopes s to the cost makes the planned footholds optimal within the window. With the weight w of the
// distance r from a foothold,
//     s.r + 1/2 w r.r = 1/2 w |r + s/w|^2 + constant                                                                (1)
// is the cost of the distance from a point beside it, at which the foot aims. The curvature stays w, so a foot that a push sends
// elsewhere is drawn back no more than before. The slopes are the multipliers of fixed footholds in the window that begins early in the
// swing. Later windows of the same swing would need others; so the motion is then walked through by its own predictions, and where a foot
// lands off by d, s grows by 3 w d. This is done twice.
#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "control/window_planner.h"
#include "motion/foot_tasks.h"

namespace bielle {
namespace {

constexpr int kAimIterations = 10;  // of a window with fixed footholds
constexpr double kSwingLeft = 0.9;  // of the swing that is then left
constexpr int kWalks = 2;
constexpr double kGain = 3;
// Landings that are walked through. The steps of a longer walk are alike: later ones are corrected like the same foot's before.
constexpr size_t kMostLandings = 12;

const FootTask* findAimedLanding(const StageSpec& spec) {
  for (const FootTask& foot : spec.feet)
    if (foot.role == FootRole::Landing && foot.aim) return &foot;
  return nullptr;
}

const Cost& getAim(const StageSpec& spec) {
  const FootTask& foot = *findAimedLanding(spec);
  return *std::find_if(spec.costs.begin(), spec.costs.end(),
                       [&](const Cost& cost) { return cost.residual == foot.aim; });
}

// w of Eq. (1), 1/m^2.
Eigen::Vector2d calcWeights(const StageSpec& spec) {
  const Cost& aim = getAim(spec);
  return aim.weight * (spec.kind == StageKind::Impact ? 1 : spec.dt) * aim.activation.weights.head<2>();
}

StageSpec fixFoothold(StageSpec spec) {
  const FootTask& foot = *findAimedLanding(spec);
  for (PathConstraint& constraint : spec.path_constraints)
    if (constraint.residual == foot.place) {
      constraint.lower.head<2>().setZero();
      constraint.upper.head<2>().setZero();
    }
  return spec;
}

}  // namespace

void WindowPlanner::aimFootholds() {
  std::vector<AimedLanding> landings;
  for (int stage = horizon_->begin(); stage <= horizon_->end(); ++stage) {
    const StageSpec& spec = getSpec(stage);
    const FootTask* foot = findAimedLanding(spec);
    if (!foot) continue;
    landings.push_back({stage, foot->contact, spec});
    problem_.replaceStage(horizon_->getNode(stage), fixFoothold(spec));
  }
  for (AimedLanding& landing : landings) landing.slope = findSlope(landing);
  for (const AimedLanding& landing : landings) aim(landing);
  for (int walk = 0; walk < kWalks && !landings.empty(); ++walk) {
    walkThrough(landings);
    for (size_t i = 0; i < landings.size(); ++i) {
      AimedLanding& landing = landings[i];
      if (i >= kMostLandings) landing.off = landings[i - 2].off;
      landing.slope += kGain * calcWeights(landing.free).cwiseProduct(landing.off);
      aim(landing);
    }
  }
  past_us_.clear();
  solver_ = makeSolver(options_.iterations);
}

// Slope of the cost of the window that begins early in the swing, by where the foot lands along x and y of its foothold, 1/m.
Eigen::Vector2d WindowPlanner::findSlope(const AimedLanding& landing) {
  int begin = landing.stage;
  while (begin > horizon_->begin() && !stands(begin - 1, landing.contact)) --begin;
  startFromGuess(landing.stage - static_cast<int>(kSwingLeft * (landing.stage - begin)));
  Receding solver = makeSolver(kAimIterations);
  if (solver.step(trajectory_).termination == FddpTermination::Failed) return Eigen::Vector2d::Zero();
  const std::vector<VectorXd> multipliers = solver.multipliers().values;
  const FootTask& foot = *findAimedLanding(landing.free);
  for (size_t k = 0; k < grid_.nodes().size(); ++k) {
    if (grid_.nodes()[k].begin != landing.stage) continue;
    Eigen::Index row = 0;
    for (const PathConstraint& constraint : problem_.spec(grid_.stages()[k]).path_constraints) {
      if (constraint.residual == foot.place)
        return multipliers[k].segment<2>(row).cwiseQuotient(constraint.scale.head<2>());
      row += constraint.residual->size();
    }
  }
  return Eigen::Vector2d::Zero();
}

// By Eq. (1).
void WindowPlanner::aim(const AimedLanding& landing) {
  const ContactFrame& contact = model_.contacts()[landing.contact];
  StageSpec spec = landing.free;
  SE3 X_WT = getFoothold(landing.stage, landing.contact);
  X_WT.p -= X_WT.R.leftCols<2>() * landing.slope.cwiseQuotient(calcWeights(spec));
  const std::shared_ptr<const Residual> before = getAim(spec).residual;
  for (Cost& cost : spec.costs)
    if (cost.residual == before) cost.residual = makeFramePlacement({contact.body, contact.X_BF}, X_WT);
  problem_.replaceStage(horizon_->getNode(landing.stage), std::move(spec));
}

// Follows the predictions, without measurements, until the last of these feet has landed; finds where each lands.
void WindowPlanner::walkThrough(std::vector<AimedLanding>& landings) {
  for (AimedLanding& landing : landings) landing.off.setZero();
  startFromGuess(0);
  solver_ = makeSolver(options_.iterations);
  size_t next = 0;
  const size_t end = std::min(landings.size(), kMostLandings);
  for (int stage = 0; next < end; ++stage) {
    if (stage > 0) {
      x_ = trajectory_.xs[1];
      if (!move(horizon_->getFirst(stage))) break;
    }
    if (solver_.step(trajectory_).termination == FddpTermination::Failed) break;
    AimedLanding& landing = landings[next];
    if (stage + 1 < landing.stage) continue;
    const ContactFrame& contact = model_.contacts()[landing.contact];
    updatePlacements<double>(model_, feet_, trajectory_.xs[1].head(model_.nq()));
    const SE3& X_WT = getFoothold(landing.stage, landing.contact);
    landing.off = X_WT.inverseTimes(getPlacement(feet_, contact.body, contact.X_BF)).p.head<2>();
    ++next;
  }
  grid_.clear();
}

}  // namespace bielle
