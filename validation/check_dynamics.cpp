// Rows of the dynamics: forces, steps, closures, energy.
#include <algorithm>
#include <cmath>

#include "check_rows.h"

namespace bielle::validation {
namespace {

// Adds the largest entry of x, named.
void addLargest(Worst& worst, const VectorXd& x, double scale, int node, const std::vector<std::string>& names) {
  if (x.size() == 0) return;
  Eigen::Index i;
  const double largest = x.cwiseAbs().maxCoeff(&i);
  worst.add(largest / scale, node, names[i]);
}

// Forces are judged by the weight of the robot or, where there is none, by the largest force of the motion.
double calcForceScale(const CheckedMotion& motion) {
  const double weight = motion.model.mass() * motion.model.gravity().norm();
  if (weight > 0) return weight;
  double largest = 1e-12;
  for (const RowMatrixXd* table : {&motion.record.u, &motion.record.closure_wrenches, &motion.record.contact_wrenches})
    if (table->size() > 0) largest = std::max(largest, table->cwiseAbs().maxCoeff());
  return largest;
}

// Accelerations by that of free fall, in the norm sqrt(a' M a), or by the largest of the motion where that is more.
double calcAccelerationScale(const CheckContext& context) {
  double scale = std::sqrt(context.model().mass()) * context.model().gravity().norm();
  for (const StageTrace& stage : context.trace.stages) scale = std::max(scale, stage.acceleration);
  return std::max(scale, 1e-12);
}

void addClosureRows(CheckContext& context) {
  const Model& model = context.model();
  const bool reduced = context.motion.summary.formulation == Formulation::Reduced;
  Worst position, angle, velocity;
  for (size_t k = 0; k < context.trace.nodes.size(); ++k)
    for (size_t c = 0; c < model.closures().size(); ++c) {
      const NodeTrace& node = context.trace.nodes[k];
      const int n = static_cast<int>(k);
      position.add(node.gaps[c].head<3>().norm(), n, model.closures()[c].name);
      angle.add(node.gaps[c].tail<3>().norm(), n, model.closures()[c].name);
      velocity.add(node.gap_rates[c].cwiseAbs().maxCoeff(), n, model.closures()[c].name);
    }
  const double gap = reduced ? context.bounds.closed : context.bounds.drift;
  context.add(position, "loops: gap", "m", gap, "the robot has no loop");
  context.add(angle, "loops: gap, angle", "rad", gap, "the robot has no loop");
  context.add(velocity, "loops: opening velocity", "m/s, rad/s",
              reduced ? context.bounds.closed_velocity : context.bounds.drift_velocity, "the robot has no loop");
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
    differences.add(stage.finite_difference / acceleration, k);
  }
  context.add(time, "time between nodes", "s", bounds.time);
  context.add(balance, "equations of motion", "of weight", bounds.motion_equations);
  context.add(accelerations, "accelerations, against Simbody's", "of largest", bounds.accelerations);
  context.add(velocity, "steps of the velocity", "m/s, rad/s", bounds.velocity_steps);
  context.add(position, "steps of the configuration", "m, rad", bounds.position_steps);
  context.add(differences, "finite differences of the velocity", "of largest", bounds.finite_differences);
  addClosureRows(context);
}

void addEnergyRows(CheckContext& context) {
  const std::vector<NodeTrace>& nodes = context.trace.nodes;
  Worst interval;
  double total = 0, exchanged = 0, largest = 0;
  for (size_t k = 0; k < context.trace.stages.size(); ++k) {
    const StageTrace& stage = context.trace.stages[k];
    const double h = context.motion.getTimeStep(static_cast<int>(k));
    const double rest =
        nodes[k + 1].kinetic - nodes[k].kinetic - stage.motor_work - stage.contact_work - stage.closure_work;
    // Over the mean velocity, as all work: an Euler step falls along its last one, h^2/2 m g a away. That cancels over a
    // motion from rest to rest.
    const double gravity_work = h / 2 * (nodes[k].gravity_power + nodes[k + 1].gravity_power);
    const double flow = stage.exchanged + std::abs(nodes[k + 1].potential - nodes[k].potential);
    interval.add(std::abs(rest - gravity_work), static_cast<int>(k));
    total += rest + nodes[k + 1].potential - nodes[k].potential;
    exchanged += flow;
    largest = std::max(largest, flow);
  }
  // A robot that stands still exchanges nothing: rounding of its energy is no failure.
  const double rounding = 1e-9 * context.model().mass() * context.model().gravity().norm();
  context.add(interval, "energy, one interval", "J", context.bounds.interval_energy * largest + rounding);
  CheckRow row{"energy, whole motion",
               CheckRow::Kind::AtMost,
               std::abs(total),
               context.bounds.total_energy * exchanged + rounding,
               "J",
               ""};
  row.note = formatNumber(exchanged) + " J were exchanged";
  context.rows.push_back(row);

  const int last = context.motion.numStages();
  Worst rest(CheckRow::Kind::Note);
  addLargest(rest, context.motion.record.v.row(last).transpose(), 1, last, context.motion.record.v_names);
  context.add(rest, "velocity at the end", "m/s, rad/s", 0);
}

}  // namespace bielle::validation
