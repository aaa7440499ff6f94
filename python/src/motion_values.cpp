#include "bielle/motion/described_options.h"
#include "bielle/results/result.h"
#include "bind.h"
#include "residual.h"

namespace bielle::python {
namespace {

void bindProblemOptions(py::module_& module) {
  py::enum_<Objective>(module, "Objective")
      .value("EFFORT", Objective::Effort)
      .value("ENERGY", Objective::Energy)
      .value("PEAK_TORQUE", Objective::PeakTorque);
  Value<LimitOptions>(module, "LimitOptions", "Limits of motors and joints.")
      .field("enforced", &LimitOptions::enforced, "False: all limits, including torque, are ignored")
      .field("efforts", &LimitOptions::efforts, "by motor, N m or N, instead of the model's")
      .field("velocities", &LimitOptions::velocities, "by motor, rad/s or m/s, instead of the model's")
      .field("powers", &LimitOptions::powers, "by motor, W; driving or braking")
      .field("dead_point_margins", &LimitOptions::dead_point_margins, "by linkage, where larger than dead_point_margin")
      .described();
  Value<TimingBounds>(module, "TimingBounds", "Bounds of a duration relative to the nominal one.")
      .field("lower", &TimingBounds::lower, "1")
      .field("upper", &TimingBounds::upper, "1");
  Value<TimingOptions>(module, "TimingOptions", "Phases whose durations the solver chooses.")
      .field("phases", &TimingOptions::phases, "TimingBounds by name of the phase; \"all\": those with contacts")
      .field("time_weight", &TimingOptions::time_weight, "cost per second of these phases");
  Value<ObjectiveOptions>(module, "ObjectiveOptions", "What a motion minimizes besides the costs that define it.")
      .field("objective", &ObjectiveOptions::objective, "Objective")
      .described()
      .field("regularization", &ObjectiveOptions::regularization, "weight of the other costs; None: the default")
      .field("scale", &ObjectiveOptions::scale, "cost of a joule, or of the peak; None: of the motion of least effort");
  Value<ProblemOptions>(module, "ProblemOptions", "Options of a problem besides those of the motion.")
      .field("formulation", &ProblemOptions::formulation, "Formulation")
      .field("step", &ProblemOptions::step, "StepRule")
      .field("limits", &ProblemOptions::limits, "LimitOptions")
      .field("timings", &ProblemOptions::timings, "TimingOptions")
      .field("objective", &ProblemOptions::objective, "ObjectiveOptions");
}

void bindGoals(py::module_& module) {
  py::enum_<GoalKind>(module, "GoalKind")
      .value("SPEED", GoalKind::Speed)
      .value("HEIGHT", GoalKind::Height)
      .value("RISE", GoalKind::Rise)
      .value("FLIGHT_TIME", GoalKind::FlightTime)
      .value("TURN", GoalKind::Turn)
      .value("DISPLACEMENT", GoalKind::Displacement)
      .value("FOOTHOLDS", GoalKind::Footholds);
  Value<Foothold>(module, "Foothold", "Where a foot is to land.")
      .field("contact", &Foothold::contact, "name")
      .field("node", &Foothold::node, "where the foot lands")
      .field("position", &Foothold::position, "position of the origin of its contact frame (3,), m");
  Value<Goal>(module, "Goal", "A quantity that is requested, and measured on the trajectory.")
      .field("kind", &Goal::kind, "GoalKind")
      .field("name", &Goal::name, "e.g. \"speed\"")
      .field("requested", &Goal::requested, "requested value")
      .field("tolerance", &Goal::tolerance, "largest difference that still meets the goal")
      .field("first", &Goal::first, "node")
      .field("last", &Goal::last, "node")
      .field("direction", &Goal::direction, "unit (3,)")
      .field("contacts", &Goal::contacts, "names")
      .field("footholds", &Goal::footholds, "Footholds");
  Value<GoalOutcome>(module, "GoalOutcome", "Requested and achieved value of a goal.")
      .field("goal", &GoalOutcome::goal, "Goal")
      .field("achieved", &GoalOutcome::achieved, "achieved value")
      .type()
      .def_property_readonly("met", &GoalOutcome::met, "within the tolerance")
      .def("__str__", &formatOutcome);
  Value<PhaseTiming>(module, "PhaseTiming", "A phase of free duration.")
      .field("phase", &PhaseTiming::phase, "name")
      .field("start_node", &PhaseTiming::start_node, "first node")
      .field("nominal", &PhaseTiming::nominal, "s")
      .field("chosen", &PhaseTiming::chosen, "s")
      .field("lower", &PhaseTiming::lower, "bound, s")
      .field("upper", &PhaseTiming::upper, "bound, s");
}

void bindTrajectory(py::module_& module) {
  Value<ShootingTrajectory>(module, "Trajectory", "Node states (N + 1) and controls (N) of a problem.")
      .field("xs", &ShootingTrajectory::xs, "states: (q, v), and a time scale where one is free")
      .field("us", &ShootingTrajectory::us, "torques, and the time scale at the first step of a free phase");
  Value<MotionPlan>(module, "MotionPlan", "A motion before it becomes a problem.")
      .field("name", &MotionPlan::name, "e.g. \"squat\"")
      .field("schedule", &MotionPlan::schedule, "ContactSchedule; without phases, that of the stages")
      .field("ground", &MotionPlan::ground, "Ground")
      .field("stages", &MotionPlan::stages, "N running Stages and the terminal one")
      .field("guess", &MotionPlan::guess, "Trajectory to start from")
      .field("q_start", &MotionPlan::q_start, "standing posture (nq,)")
      .field("q_end", &MotionPlan::q_end, "standing posture (nq,)")
      .field("options", &MotionPlan::options, "every option of the motion by name")
      .field("goals", &MotionPlan::goals, "Goals");
}

}  // namespace

void bindMotionValues(py::module_& module) {
  bindProblemOptions(module);
  bindGoals(module);
  bindTrajectory(module);
}

}  // namespace bielle::python
