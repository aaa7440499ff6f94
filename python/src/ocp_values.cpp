#include "bielle/ocp/contact_schedule.h"
#include "bielle/ocp/robot_problem.h"
#include "bind.h"
#include "residual.h"

namespace bielle::python {
namespace {

void bindGround(py::module_& module) {
  Value<GroundStep>(module, "GroundStep",
                    "A box on the ground, e.g. a stair. Its axes are those of Rz(yaw) Ry(pitch) Rx(roll).")
      .field("top", &GroundStep::top, "centre of its top in the world (3,), m")
      .field("length", &GroundStep::length, "along its own x, m")
      .field("width", &GroundStep::width, "along its own y, m")
      .field("yaw", &GroundStep::yaw, "rad")
      .field("pitch", &GroundStep::pitch, "rad; positive: its x goes down")
      .field("roll", &GroundStep::roll, "rad");
  Value<Ground>(module, "Ground", "A plane with boxes on it; the highest one counts.")
      .field("height", &Ground::height, "height of the plane, m")
      .field("friction", &Ground::friction, "coefficient, 1")
      .field("steps", &Ground::steps, "GroundSteps")
      .type()
      .def("calc_height", &Ground::calcHeight, py::arg("x"), py::arg("y"), "Height of the ground under a point, m.");
  Value<ContactPhase>(module, "ContactPhase", "A period with constant contacts.")
      .field("name", &ContactPhase::name, "e.g. \"double support\"")
      .field("nodes", &ContactPhase::nodes, "number of stages")
      .field("dt", &ContactPhase::dt, "length of a stage, s; 0: a rigid impact")
      .field("contacts", &ContactPhase::contacts, "ContactTargets of the feet on the ground");
  Value<ContactSchedule>(module, "ContactSchedule", "Which feet stand where and when.")
      .field("phases", &ContactSchedule::phases, "in their order");
}

void bindCosts(py::module_& module) {
  py::enum_<ActivationKind>(module, "ActivationKind")
      .value("QUADRATIC", ActivationKind::Quadratic)
      .value("BARRIER", ActivationKind::Barrier)
      .value("ENERGY", ActivationKind::Energy);
  Value<Activation>(module, "Activation",
                    "Scalar function of a residual r: 1/2 sum w r^2 (QUADRATIC), the same of what is outside of bounds "
                    "(BARRIER), or the electrical energy of makeElectricalPower (ENERGY).")
      .field("kind", &Activation::kind, "ActivationKind")
      .field("weights", &Activation::weights, "(n,)")
      .field("lower", &Activation::lower, "(n,), barriers only")
      .field("upper", &Activation::upper, "(n,), barriers only")
      .field("losses", &Activation::losses, "(n/2,), energies only, W/(N m)^2")
      .field("share", &Activation::share, "energies only, 0 to 1")
      .field("smoothing", &Activation::smoothing, "energies only, W")
      .type()
      .def_static(
          "quadratic",
          [](py::handle weights) { return Activation::makeQuadratic(readMatrix<VectorXd>(weights, "weights")); },
          py::arg("weights"), "1/2 sum w r^2, with weights (n,).")
      .def_static(
          "barrier",
          [](py::handle weights, py::handle lower, py::handle upper) {
            return Activation::makeBarrier(readMatrix<VectorXd>(weights, "weights"),
                                           readMatrix<VectorXd>(lower, "lower"), readMatrix<VectorXd>(upper, "upper"));
          },
          py::arg("weights"), py::arg("lower"), py::arg("upper"),
          "1/2 sum w d^2, where d is how far r is outside of its bounds; all (n,), in the unit of r.");
  Value<Cost>(module, "Cost", "weight * activation(residual).")
      .field("name", &Cost::name,
             "for reports; far nodes of predictive control join stages whose terms have the same names")
      .field("weight", &Cost::weight, "finite, not negative")
      .field("activation", &Cost::activation, "Activation")
      .field("residual", &Cost::residual, "residual of the library (bielle.residuals), or a Residual written in Python")
      .field("defines", &Cost::defines, "it defines the motion, and keeps its weight for every objective");
  Value<PathConstraint>(module, "PathConstraint", "lower <= r <= upper; equal bounds make an equation.")
      .field("name", &PathConstraint::name, "for messages, and likewise")
      .field("residual", &PathConstraint::residual, "residual of the library (bielle.residuals), or written in Python")
      .field("lower", &PathConstraint::lower, "(n,), -inf: open")
      .field("upper", &PathConstraint::upper, "(n,), inf: open")
      .field("scale", &PathConstraint::scale, "(n,), the violation that counts as 1, in the unit of r");
  Value<StateCost>(module, "StateCost", "1/2 weight sum w_i d_i^2 with d = (q (-) q_ref, v - v_ref).")
      .field("weight", &StateCost::weight, "0: none")
      .field("q_ref", &StateCost::q_ref, "(nq,)")
      .field("v_ref", &StateCost::v_ref, "(nv,)")
      .field("weights", &StateCost::weights, "(2 nv,)")
      .field("axes", &StateCost::axes,
             "(3, 3), rows: directions in a free base along which its place and rotation are weighted");
  Value<ControlCost>(module, "ControlCost", "1/2 weight sum w_i (u_i - reference_i)^2.")
      .field("weight", &ControlCost::weight, "0: none")
      .field("reference", &ControlCost::reference, "(nu,)")
      .field("weights", &ControlCost::weights, "(nu,)");
}

void bindStages(py::module_& module) {
  py::enum_<StageKind>(module, "StageKind").value("DYNAMICS", StageKind::Dynamics).value("IMPACT", StageKind::Impact);
  py::enum_<StepRule>(module, "StepRule").value("EULER", StepRule::Euler).value("MIDPOINT", StepRule::Midpoint);
  py::enum_<Formulation>(module, "Formulation").value("FULL", Formulation::Full).value("REDUCED", Formulation::Reduced);
  Value<FreeTiming>(module, "FreeTiming", "Membership of a step in a phase whose duration is a variable.")
      .field("phase", &FreeTiming::phase, "the same for all steps of the phase; -1: the duration is fixed")
      .field("lower", &FreeTiming::lower, "bound of the time scale")
      .field("upper", &FreeTiming::upper, "bound of the time scale");
  py::enum_<FootRole>(module, "FootRole").value("SWING", FootRole::Swing).value("LANDING", FootRole::Landing);
  Value<FootTask>(module, "FootTask", "A foot that moves in a stage, and the residuals made of it.")
      .field("contact", &FootTask::contact, "index of the contact")
      .field("role", &FootTask::role, "FootRole")
      .field("room", &FootTask::room, "of a landing: largest distance from its place along x and y of that, m")
      .field("place", &FootTask::place,
             "residual in the costs of a swing or the path constraints of a landing, or None")
      .field("velocity", &FootTask::velocity, "likewise")
      .field("clearance", &FootTask::clearance, "over the ground, or None");
  Value<StageSpec>(module, "Stage",
                   "One stage of the horizon, or the terminal node, which has neither dt nor constraints.")
      .field("kind", &StageSpec::kind, "StageKind")
      .field("step", &StageSpec::step, "StepRule")
      .field("dt", &StageSpec::dt, "s; 0 for an impact")
      .field("timing", &StageSpec::timing, "FreeTiming")
      .field("time_weight", &StageSpec::time_weight, "cost of a second")
      .field("constraints", &StageSpec::constraints, "closures and contacts in force (Model.constraints)")
      .field("state", &StageSpec::state, "StateCost")
      .field("control", &StageSpec::control, "ControlCost")
      .field("costs", &StageSpec::costs, "Costs")
      .field("path_constraints", &StageSpec::path_constraints, "PathConstraints")
      .field("effort_limits", &StageSpec::effort_limits, "bounds of |u| (nu,); empty: those of the motors")
      .field("armature", &StageSpec::armature, "of a step, added to the model's (nv,), kg m^2 or kg; empty: none")
      .field("feet", &StageSpec::feet, "FootTasks of the feet that move, for predictive control");
}

}  // namespace

void bindOcpValues(py::module_& module) {
  bindGround(module);
  bindCosts(module);
  bindStages(module);
}

}  // namespace bielle::python
