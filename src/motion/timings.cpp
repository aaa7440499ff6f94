#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "motion/applied_options.h"

namespace bielle {
namespace {

// The name of a phase of a sequence without that of its motion.
std::string getOwnName(const ContactPhase& phase) {
  const size_t colon = phase.name.find(": ");
  return colon == std::string::npos ? phase.name : phase.name.substr(colon + 2);
}

bool isNamed(const std::string& name, const ContactSchedule& schedule) {
  return name == kAllPhases ||
         std::any_of(schedule.phases.begin(), schedule.phases.end(),
                     [&](const ContactPhase& phase) { return phase.dt > 0 && getOwnName(phase) == name; });
}

void check(const TimingOptions& options, const ContactSchedule& schedule) {
  for (const auto& [name, bounds] : options.phases) {
    const std::string element = "free timing of '" + name + "'";
    if (!(bounds.lower > 0 && bounds.lower <= bounds.upper && std::isfinite(bounds.upper)))
      throw InputError("", element, "its bounds are not positive, or in the wrong order", "give e.g. 0.6:1.6");
    if (isNamed(name, schedule)) continue;
    std::string known = kAllPhases;
    for (const ContactPhase& phase : schedule.phases)
      if (phase.dt > 0 && known.find(getOwnName(phase)) == std::string::npos) known += ", " + getOwnName(phase);
    throw InputError("", element, "the motion has no such phase", "choose one of: " + known);
  }
}

// The last bounds given for a phase by its name or, if it has contacts, for all phases; null if there are none.
const TimingBounds* findBounds(const TimingOptions& options, const ContactPhase& phase) {
  const TimingBounds *named = nullptr, *general = nullptr;
  for (const auto& [name, bounds] : options.phases) {
    if (name == getOwnName(phase)) named = &bounds;
    if (name == kAllPhases && !phase.contacts.empty()) general = &bounds;
  }
  return named ? named : general;
}

}  // namespace

void freeTimings(const TimingOptions& options, const ContactSchedule& schedule, std::vector<StageSpec>& stages) {
  check(options, schedule);
  requireOption(options.time_weight >= 0 && std::isfinite(options.time_weight), "time-weight",
                "it is negative or not finite", "give the cost per second, e.g. 0.5");
  requireOption(options.time_weight == 0 || options.areGiven(), "time-weight", "no duration is free",
                "give --free-timings as well");
  int node = 0;
  for (size_t i = 0; i < schedule.phases.size(); ++i) {
    const ContactPhase& phase = schedule.phases[i];
    const TimingBounds* bounds = phase.dt > 0 ? findBounds(options, phase) : nullptr;
    for (int k = node; bounds && k < node + phase.nodes; ++k) {
      stages[k].timing = {static_cast<int>(i), bounds->lower, bounds->upper};
      stages[k].time_weight = options.time_weight;
    }
    node += phase.nodes;
  }
}

TimingOptions selectTimings(const TimingOptions& options, const ContactSchedule& schedule) {
  TimingOptions out;
  for (const auto& entry : options.phases)
    if (isNamed(entry.first, schedule)) out.phases.push_back(entry);
  if (out.areGiven()) out.time_weight = options.time_weight;
  return out;
}

std::vector<PhaseTiming> listTimings(const RobotProblem& problem, const ContactSchedule& schedule,
                                     const ShootingTrajectory& trajectory) {
  std::vector<PhaseTiming> timings;
  int node = 0;
  for (const ContactPhase& phase : schedule.phases) {
    const FreeTiming& timing = problem.spec(node).timing;
    const double nominal = phase.nodes * phase.dt;
    if (phase.nodes > 0 && timing.phase >= 0)
      timings.push_back({phase.name, node, nominal,
                         nominal * problem.getTimeScale(node, trajectory.xs[node], trajectory.us[node]),
                         nominal * timing.lower, nominal * timing.upper});
    node += phase.nodes;
  }
  return timings;
}

void fixTimings(const std::vector<PhaseTiming>& timings, StepRule rule, ContactSchedule& schedule,
                std::vector<StageSpec>& stages) {
  int node = 0;
  for (ContactPhase& phase : schedule.phases) {
    for (const PhaseTiming& timing : timings) {
      if (timing.start_node != node || phase.dt == 0 || phase.nodes == 0) continue;
      phase.dt = timing.chosen / phase.nodes;
      for (int k = node; k < node + phase.nodes; ++k) {
        stages[k].dt = phase.dt;
        limitGains(rule, timing.upper / phase.nodes, stages[k].constraints);
      }
    }
    node += phase.nodes;
  }
}

void fitTimings(const RobotProblem& problem, ShootingTrajectory& trajectory) {
  const auto resize = [](int size, VectorXd& x) {
    const Eigen::Index before = x.size();
    x.conservativeResize(size);
    if (size > before) x.tail(size - before).setOnes();
  };
  for (VectorXd& x : trajectory.xs) resize(problem.stateSize(), x);
  for (size_t k = 0; k < trajectory.us.size(); ++k) resize(problem.controlSize(static_cast<int>(k)), trajectory.us[k]);
}

}  // namespace bielle
