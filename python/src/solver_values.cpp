#include "bielle/motion/described_options.h"
#include "bind.h"
#include "value.h"

namespace bielle::python {
namespace {

void bindOptions(py::module_& module) {
  Value<ConstraintOptions>(module, "ConstraintOptions", "How constraints are enforced.").described();
  Value<FddpOptions>(module, "SolverOptions", "Options of FDDP.")
      .described()
      .field("constraints", &FddpOptions::constraints, "ConstraintOptions");
}

void bindSummary(py::module_& module) {
  py::enum_<FddpTermination>(module, "Termination")
      .value("CONVERGED", FddpTermination::Converged)
      .value("MAX_ITERATIONS", FddpTermination::MaxIterations)
      .value("REGULARIZATION_MAX", FddpTermination::RegularizationMax)
      .value("INFEASIBLE", FddpTermination::Infeasible)
      .value("INTERRUPTED", FddpTermination::Interrupted)
      .value("FAILED", FddpTermination::Failed);
  Value<FddpIteration>(module, "Iteration", "One line of the log: the iterate it started from and the step it took.")
      .field("iteration", &FddpIteration::iteration, "from 1")
      .field("cost", &FddpIteration::cost, "before the step")
      .field("violation", &FddpIteration::violation, "largest of the constraints before the step")
      .field("gap", &FddpIteration::gap, "largest entry before the step")
      .field("gradient", &FddpIteration::gradient, "squared norm of the projected one")
      .field("step", &FddpIteration::step, "step length; 0: no step was taken")
      .field("regularization", &FddpIteration::regularization, "regularization of the sweep")
      .field("seconds", &FddpIteration::seconds, "since the start");
  Value<FddpSummary>(module, "Summary", "The outcome of a solve.")
      .field("termination", &FddpSummary::termination, "Termination")
      .field("message", &FddpSummary::message, "why it ended")
      .field("acceptable", &FddpSummary::acceptable, "converged by acceptable_decrease: the gradient has not vanished")
      .field("cost", &FddpSummary::cost, "cost of the returned trajectory")
      .field("gap", &FddpSummary::gap, "largest entry of its gaps")
      .field("iterations", &FddpSummary::iterations, "number")
      .field("violation", &FddpSummary::violation, "largest of the constraints")
      .field("complementarity", &FddpSummary::complementarity, "largest multiplier times slack")
      .field("multiplier", &FddpSummary::multiplier, "largest")
      .field("penalty", &FddpSummary::penalty, "penalty of violated constraints; 0: there are none")
      .field("multiplier_updates", &FddpSummary::multiplier_updates, "number")
      .field("linearizations", &FddpSummary::linearizations, "of single nodes")
      .field("sweeps", &FddpSummary::sweeps, "over the models of all nodes")
      .field("rollouts", &FddpSummary::rollouts, "of a step in segments")
      .field("searches", &FddpSummary::searches, "of steps of several lengths in one piece")
      .field("seconds", &FddpSummary::seconds, "s")
      .field("evaluate_seconds", &FddpSummary::evaluate_seconds, "summed over the threads, s")
      .field("linearize_seconds", &FddpSummary::linearize_seconds, "likewise")
      .field("sweep_seconds", &FddpSummary::sweep_seconds, "likewise")
      .field("rollout_seconds", &FddpSummary::rollout_seconds, "likewise, with searches")
      .field("search_seconds", &FddpSummary::search_seconds, "likewise")
      .field("log", &FddpSummary::log, "Iterations")
      .type()
      .def_property_readonly(
          "converged", [](const FddpSummary& s) { return s.termination == FddpTermination::Converged; },
          "whether the solver ended at an optimum");
  Value<Gains>(
      module, "Gains",
      "Feedback of a stage about a node state x_k and a control u_k: u = u_k + k + K dx, dx from x_k to x in the "
      "tangent space of the problem. K is added: it has the sign of a negative feedback.")
      .field("k", &Gains::k, "(nu,); vanishes at an optimum")
      .field("K", &Gains::K, "(nu, ndx); rows of controls at their bounds are zero")
      .field("x", &Gains::x, "x_k, of the iterate that the last sweep was about");
  Value<Multipliers>(module, "Multipliers", "Multipliers of the constraints, node by node.")
      .field("values", &Multipliers::values, "N + 1 of (constraint size,)")
      .field("penalty", &Multipliers::penalty, "penalty of violated constraints");
}

}  // namespace

void bindSolverValues(py::module_& module) {
  bindOptions(module);
  bindSummary(module);
}

}  // namespace bielle::python
