// Rows of the dynamics: forces, steps, closures, energy.
#include <algorithm>
#include <cmath>

#include "check_rows.h"
#include "math/largest.h"

namespace bielle::validation {
namespace {

// Adds the largest entry of x, named.
void addLargest(Worst& worst, const VectorXd& x, double scale, int node, const std::vector<std::string>& names) {
  if (x.size() == 0) return;
  Eigen::Index i;
  const double largest = calcLargest(x, &i);
  worst.add(largest / scale, node, names[i]);
}

// Forces are relative to the weight of the robot or, if it has none, to the largest force of the motion.
double calcForceScale(const CheckedMotion& motion) {
  const double weight = motion.model.mass() * motion.model.gravity().norm();
  if (weight > 0) return weight;
  double largest = 1e-12;
  for (const RowMatrixXd* table : {&motion.record.u, &motion.record.closure_wrenches, &motion.record.contact_wrenches})
    largest = getLarger(largest, calcLargest(*table));
  return largest;
}

// Accelerations are relative to that of free fall, in the norm sqrt(a' M a), or to the largest of the motion if
// greater.
double calcAccelerationScale(const CheckContext& context) {
  double scale = std::sqrt(context.model().mass()) * context.model().gravity().norm();
  for (const StageTrace& stage : context.trace.stages) scale = getLarger(scale, stage.acceleration);
  return getLarger(scale, 1e-12);
}

// The largest distance that a loop is open by: what is recorded of it, with the rods that the robot had, against Simbody's with those of
// its files.
void addGapRow(CheckContext& context) {
  Worst gap(CheckRow::Kind::AtMost, CheckRow::Kind::Note);
  for (int k = 0; k <= context.motion.numStages(); ++k) {
    double largest = 0;
    for (const Vector6d& each : context.trace.nodes[k].closures.gaps)
      largest = getLarger(largest, each.head<3>().norm());
    gap.add(std::abs(context.motion.record.gap(k, 0) - largest), k);
  }
  context.add(gap, "loops: gap, as recorded", "m", context.bounds.com);
}

void addClosureRows(CheckContext& context) {
  const Model& model = context.model();
  const bool reduced = context.motion.summary.formulation == Formulation::Reduced;
  // In worlds loops may be soft, have play, or rods that are not those of the model.
  const Worst none(CheckRow::Kind::AtMost, context.motion.has_happened ? CheckRow::Kind::Note : CheckRow::Kind::AtMost);
  Worst position = none, angle = none, velocity = none;
  for (size_t k = 0; k < context.trace.nodes.size(); ++k)
    for (size_t c = 0; c < model.closures().size(); ++c) {
      const int n = static_cast<int>(k);
      const auto add = [&](const ClosureTrace& closures) {
        position.add(closures.gaps[c].head<3>().norm(), n, model.closures()[c].name);
        angle.add(closures.gaps[c].tail<3>().norm(), n, model.closures()[c].name);
        velocity.add(calcLargest(closures.gap_rates[c]), n, model.closures()[c].name);
      };
      add(context.trace.nodes[k].closures);
      if (k < context.trace.stages.size() && context.trace.stages[k].midpoint) add(*context.trace.stages[k].midpoint);
    }
  const double gap = reduced ? context.bounds.closed : context.bounds.drift;
  context.add(position, "loops: gap", "m", gap, "the robot has no loop");
  context.add(angle, "loops: gap, angle", "rad", gap, "the robot has no loop");
  context.add(velocity, "loops: opening velocity", "m/s, rad/s",
              reduced ? context.bounds.closed_velocity : context.bounds.drift_velocity, "the robot has no loop");
}

// Of a motion that repeats. The first six velocities are those of the base in its own frame, which a displacement does not change.
void addCycleRow(CheckContext& context) {
  const MotionRecord& record = context.motion.record;
  if (record.cycle.size() == 0) return;
  const Model& model = context.model();
  const int last = context.motion.numStages();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(record.cycle[3], Vector3d::UnitZ()));
  VectorXd wanted = record.q.row(0).transpose();
  const Eigen::Quaterniond base(Eigen::Vector4d(wanted.segment<4>(3)));
  wanted.head<3>() = turn * Vector3d(wanted.head<3>()) + Vector3d(record.cycle[1], record.cycle[2], 0);
  wanted.segment<4>(3) = (turn * base).coeffs();
  Worst cycle;
  addLargest(cycle, model.difference(wanted, record.q.row(last).transpose()), 1, last, record.v_names);
  addLargest(cycle, (record.v.row(last) - record.v.row(0)).transpose(), 1, last, record.v_names);
  Worst period;
  period.add(std::abs(record.time[last] - record.time[0] - record.cycle[0]), last);
  context.add(cycle, "cycle: end from beginning", "SI", context.bounds.cycle);
  context.add(period, "cycle: period", "s", context.bounds.time);
}

}  // namespace

void addDynamicsRows(CheckContext& context) {
  const MotionRecord& record = context.motion.record;
  const CheckBounds& bounds = context.bounds;
  const double force = calcForceScale(context.motion), acceleration = calcAccelerationScale(context);
  Worst time, balance, accelerations, velocity, position, differences;
  for (int k = 0; k < context.motion.numStages(); ++k) {
    const StageTrace& stage = context.trace.stages[k];
    time.add(std::abs(record.time[k + 1] - record.time[k] - context.motion.getTimeStep(k)), k);
    addLargest(balance, stage.balance, force, k, record.v_names);
    accelerations.add(stage.acceleration_error / acceleration, k);
    addLargest(velocity, stage.velocity_rest, 1, k, record.v_names);
    addLargest(position, stage.position_rest, 1, k, record.v_names);
    addLargest(position, stage.midpoint_rest, 1, k, record.v_names);
    differences.add(stage.finite_difference / acceleration, k);
  }
  context.add(time, "time between nodes", "s", bounds.time);
  context.add(balance, "equations of motion", "of weight", bounds.motion_equations);
  context.add(accelerations, "accelerations, against Simbody's", "of largest", bounds.accelerations);
  context.add(velocity, "steps of the velocity", "m/s, rad/s", bounds.velocity_steps);
  context.add(position, "steps of the configuration", "m, rad", bounds.position_steps);
  context.add(differences, "finite differences of the velocity", "of largest", bounds.finite_differences);
  addCycleRow(context);
}

void addStateRows(CheckContext& context) {
  Worst com;
  for (int k = 0; k <= context.motion.numStages(); ++k)
    com.add((context.motion.record.com.row(k).transpose() - context.trace.nodes[k].com).norm(), k);
  context.add(com, "centre of mass, as recorded", "m", context.bounds.com);
  if (context.motion.has_happened) addGapRow(context);
  addClosureRows(context);
}

// Of a motion carried out, between any two of its nodes. Torques are those recorded, all along a stage.
void addWorkRow(CheckContext& context) {
  const Model& model = context.model();
  const MotionRecord& record = context.motion.record;
  double rest = 0, least = 0;  // energy less the work of the motors
  Worst gained(CheckRow::Kind::Note);
  for (int k = 0; k < context.motion.numStages(); ++k) {
    const NodeTrace &here = context.trace.nodes[k], &next = context.trace.nodes[k + 1];
    rest += next.kinetic + next.potential - here.kinetic - here.potential;
    const VectorXd moved = model.difference(record.q.row(k).transpose(), record.q.row(k + 1).transpose());
    for (int m = 0; m < model.nu(); ++m) rest -= record.u(k, m) * moved[model.motors()[m].dof];
    gained.add(rest - least, k + 1);
    least = getSmaller(least, rest);
  }
  context.add(gained, "energy, beyond the motors' work", "J", 0);
}

// The energy missing in the balance, Eq. (7) or (10), over what steps may lose or gain, Eq. (8) or (12).
void addEnergyRows(CheckContext& context) {
  const std::vector<NodeTrace>& nodes = context.trace.nodes;
  // A robot that stands still exchanges no energy: rounding must not fail.
  const double rounding = 1e-9 * context.model().mass() * context.model().gravity().norm();
  const auto describe = [](double rest, double scale) {
    return formatNumber(rest) + " of " + formatNumber(scale) + " J";
  };
  const bool midpoint = context.motion.record.has_midpoints;
  Worst interval;
  double total = 0, allowed = rounding, exchanged = 0, h_before = 0;
  // Terms of higher order remain where those of the scale vanish: a mean interval's scale is added.
  double mean = rounding;
  for (const StageTrace& stage : context.trace.stages) mean += stage.energy_scale / context.trace.stages.size();
  for (size_t k = 0; k < context.trace.stages.size(); ++k) {
    const StageTrace& stage = context.trace.stages[k];
    const double h = context.motion.getTimeStep(static_cast<int>(k));
    const double rest =
        nodes[k + 1].kinetic - nodes[k].kinetic - stage.motor_work - stage.contact_work - stage.closure_work;
    const double missing = rest - stage.passive_work;
    const double scale = stage.energy_scale + mean;
    interval.add(std::abs(missing) / scale, static_cast<int>(k), describe(std::abs(missing), scale));
    const double raised = nodes[k + 1].potential - nodes[k].potential;
    total += rest + raised - stage.dissipative_work;
    // With the mean velocity an Euler step falls by h^2/2 m g a less than with its final one: h/2 m g times the change
    // of velocity, which cancels in a motion from rest to rest with one step size.
    allowed += stage.energy_scale;
    if (!midpoint) allowed += std::abs(h - h_before) / 2 * std::abs(nodes[k].passive_power);
    h_before = h;
    exchanged += stage.exchanged + std::abs(raised);
  }
  if (!midpoint) allowed += h_before / 2 * std::abs(nodes.back().passive_power);
  context.add(interval, "energy, one interval", "of scale", context.bounds.interval_energy);
  CheckRow row{"energy, whole motion",
               CheckRow::Kind::AtMost,
               std::abs(total) / allowed,
               context.bounds.total_energy,
               "of scale",
               ""};
  row.note = describe(std::abs(total), allowed) + ", " + formatNumber(exchanged) + " J were exchanged";
  context.rows.push_back(row);

  const int last = context.motion.numStages();
  Worst rest(CheckRow::Kind::Note);
  addLargest(rest, context.motion.record.v.row(last).transpose(), 1, last, context.motion.record.v_names);
  context.add(rest, "velocity at the end", "m/s, rad/s", 0);
}

}  // namespace bielle::validation
