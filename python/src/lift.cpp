#include <pybind11/stl.h>

#include "bielle/motion/described_options.h"
#include "bielle/results/result.h"
#include "bind.h"
#include "motion.h"

namespace bielle::python {
namespace {

// A serial model whose model is shared with the motions made of it.
struct NamedSerial {
  std::shared_ptr<Model> model;
  VectorXd q_reference;
  std::vector<std::string> frozen_joints, dropped_closures;
  std::vector<SerialModel::Replacement> replacements;
  std::vector<std::string> dropped_targets;
};

NamedSerial makeSerial(const Model& closed, const py::object& q, const std::string& armature) {
  const VectorXd reference = readVector(q, closed.nq(), "q");
  const py::gil_scoped_release release;
  SerialModel serial = makeSerialModel(closed, reference, parseSerialArmature(armature));
  return {std::make_shared<Model>(std::move(serial.model)),
          serial.q_reference,
          serial.frozen_joints,
          serial.dropped_closures,
          serial.replacements,
          serial.dropped_targets};
}

struct Lift {
  bool lifted = false;
  std::vector<LiftNode> nodes;
  std::optional<MotionResult> result;
};

Lift liftMotion(const Robot& robot, const NamedSerial& named, const HeldSolution& solution,
                const LiftOptions& options) {
  const HeldMotion& motion = *solution.motion;
  if (!same(motion.model, named.model)) throw py::value_error("solution: expected a motion of the serial model");
  if (motion.options.step != StepRule::Euler)
    throw py::value_error(
        "solution: only motions with Euler steps, which have accelerations at their nodes, can be lifted");
  const py::gil_scoped_release release;
  const SerialModel serial = {*named.model,           named.q_reference,  named.frozen_joints,
                              named.dropped_closures, named.replacements, named.dropped_targets};
  const MotionRecord record = makeRecord(motion.motion, solution.solution.trajectory);
  const LiftResult lifted = lift(robot.get(), serial, makeSerialTrajectory(motion.motion, record), options);
  Lift out = {lifted.lifted(), lifted.nodes, {}};
  if (!lifted.trajectory.us.empty())
    out.result =
        makeLiftedResult({robot.name, robot.file, {}, Belief::Closed, ""}, robot.get(), motion.motion, lifted, 0);
  return out;
}

void bindSerial(py::module_& module) {
  Value<SerialModel::Replacement>(module, "Replacement",
                                  "Motors of one linkage, replaced by motors on its serial joints.")
      .field("motors", &SerialModel::Replacement::motors, "names, of the closed model")
      .field("joints", &SerialModel::Replacement::joints, "names, which the new motors have too")
      .field("R", &SerialModel::Replacement::R, "ratio at the reference, (motors, joints)");
  Value<NamedSerial>(module, "SerialModel",
                     "The Approximate Serial model of the paper: linkages frozen, motors on the serial joints.")
      .field("model", &NamedSerial::model, "Model")
      .field("q_reference", &NamedSerial::q_reference, "(nq,) of the closed model, where the linkages are frozen")
      .field("frozen_joints", &NamedSerial::frozen_joints, "names")
      .field("dropped_closures", &NamedSerial::dropped_closures, "names")
      .field("replacements", &NamedSerial::replacements, "Replacements")
      .field("dropped_targets", &NamedSerial::dropped_targets, "targets of references that named frozen joints");
  module.def("make_serial_model", &makeSerial, py::arg("model"), py::arg("q"), py::arg("armature") = "",
             "The SerialModel of a robot, frozen at the closed configuration q (nq,).\n\n"
             "armature: of the new motors in kg m^2, or 'reflected'. Raises InputError when there is no equivalent.");
}

void bindOutcome(py::module_& module) {
  py::enum_<LiftMethod>(module, "LiftMethod")
      .value("NEWTON", LiftMethod::Newton, "each node separately, torques from inverse dynamics")
      .value("NLOPT", LiftMethod::Nlopt, "one step of the closed dynamics after the other, torques by SLSQP");
  Value<LiftOptions>(module, "LiftOptions", "How a motion is lifted.")
      .field("method", &LiftOptions::method, "LiftMethod")
      .described();
  Value<LiftNode>(module, "LiftNode", "How one node was lifted; errors are the largest of the serial coordinates.")
      .field("status", &LiftNode::status, "NumericalStatus")
      .field("message", &LiftNode::message, "why not lifted")
      .field("joint", &LiftNode::joint, "at which the lift ended, or empty")
      .field("position_error", &LiftNode::position_error, "rad or m")
      .field("velocity_error", &LiftNode::velocity_error, "rad/s or m/s")
      .field("acceleration_error", &LiftNode::acceleration_error, "error of the closed dynamics, rad/s^2 or m/s^2")
      .field("margin", &LiftNode::margin, "smallest over the linkages; 0: dead point")
      .field("evaluations", &LiftNode::evaluations, "by NLopt");
  Value<Lift>(module, "Lift", "A serial motion lifted to the closed robot.")
      .field("lifted", &Lift::lifted, "all of it")
      .field("nodes", &Lift::nodes, "LiftNodes up to the first failure")
      .field("result", &Lift::result, "Result, as far as it was lifted, or None");
  module.def("lift", &liftMotion, py::arg("robot"), py::arg("serial"), py::arg("solution"),
             py::arg("options") = LiftOptions(),
             "Lifts the Solution of a motion of serial.model to the closed robot: the same serial joints, and the "
             "motor torques "
             "that follow from them.\n\nThe motion must have Euler steps.");
}

}  // namespace

void bindLift(py::module_& module) {
  bindSerial(module);
  bindOutcome(module);
}

}  // namespace bielle::python
