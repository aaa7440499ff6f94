#include "bielle/results/result.h"

#include <pybind11/stl.h>

#include "bielle/report/report.h"
#include "bielle/results/happened.h"
#include "bind.h"
#include "motion.h"

namespace bielle::python {
namespace {

void bindRecord(py::module_& module) {
  Value<MotionRecord>(module, "Record",
                      "A motion as numbers: one row per node, or per stage, from its node to the next.")
      .field("q_names", &MotionRecord::q_names, "names of the columns of q")
      .field("v_names", &MotionRecord::v_names, "names of the columns of v and a")
      .field("u_names", &MotionRecord::u_names, "names of the motors")
      .field("closure_names", &MotionRecord::closure_names, "in their order")
      .field("contact_names", &MotionRecord::contact_names, "in their order")
      .field("time", &MotionRecord::time, "(N + 1,), s")
      .field("q", &MotionRecord::q, "(N + 1, nq)")
      .field("v", &MotionRecord::v, "(N + 1, nv)")
      .field("a", &MotionRecord::a, "(N, nv)")
      .field("u", &MotionRecord::u, "(N, nu), N m or N")
      .field("closure_wrenches", &MotionRecord::closure_wrenches, "(N, 6 per closure), on body 1, in frame 1")
      .field("contact_wrenches", &MotionRecord::contact_wrenches, "(N, 6 per contact), of the ground on the foot")
      .field("has_midpoints", &MotionRecord::has_midpoints, "midpoint steps; else the next two are empty")
      .field("q_mid", &MotionRecord::q_mid, "(N, nq), where a, u and wrenches belong")
      .field("v_mid", &MotionRecord::v_mid, "(N, nv)")
      .field("com", &MotionRecord::com, "(N + 1, 3), m")
      .field("gap", &MotionRecord::gap, "(N + 1, 2), largest closing error, m and rad")
      .field("footholds", &MotionRecord::footholds,
             "(N + 1, 8 per contact), predicted: when, s; where, m, and quaternion x y z w; (0, 0) if not known")
      .field("multipliers", &MotionRecord::multipliers,
             "multipliers of the constraints, for warm starts; penalty 0 if not known");
  module.def("read_record", &readRecord, py::arg("path"), py::call_guard<py::gil_scoped_release>(),
             "Reads trajectory.npz.");
  module.def("read_result_record", &readResultRecord, py::arg("directory"), py::call_guard<py::gil_scoped_release>(),
             "The Record in a directory of a result.");
}

std::string makeResultPage(const std::vector<std::string>& directories) {
  const py::gil_scoped_release release;
  return makeReport(directories);
}

void bindResult(py::module_& module) {
  Value<ElectricalEnergy>(module, "ElectricalEnergy", "What the motors take from their supply.")
      .field("by_motor", &ElectricalEnergy::by_motor, "(nu,), J")
      .field("total", &ElectricalEnergy::total, "J")
      .field("regeneration", &ElectricalEnergy::regeneration, "share of the regenerated energy that is subtracted")
      .field("num_assumed", &ElectricalEnergy::num_assumed, "motors whose loss is not known")
      .field("distance", &ElectricalEnergy::distance, "horizontal distance of the centre of mass, m")
      .field("cost_of_transport", &ElectricalEnergy::cost_of_transport, "total divided by weight and distance");
  Value<DeadPoint>(module, "DeadPoint", "The nearest dead point of a linkage.")
      .field("kind", &DeadPoint::kind, "DeadPointKind: whether the output or the motors stand still there")
      .field("distance", &DeadPoint::distance, "largest way of a motor or joint to there, rad or m; inf beyond 0.5");
  Value<DeadPointTrace>(module, "DeadPointTrace", "Dead points next to a linkage along a motion.")
      .field("output", &DeadPointTrace::output, "names of the joints or bodies that the linkage moves")
      .field("nodes", &DeadPointTrace::nodes, "where they were looked for, in increasing order")
      .field("points", &DeadPointTrace::points, "DeadPoints of these nodes")
      .field("nearest", &DeadPointTrace::nearest, "index of the least distance");
  Value<RunInfo>(module, "RunInfo", "The request that led to a motion.")
      .field("robot", &RunInfo::robot, "name or path, as given")
      .field("robot_file", &RunInfo::robot_file, "its .urdf, absolute")
      .field("command", &RunInfo::command, "the command line, or empty")
      .field("model", &RunInfo::model, "\"closed\" or \"serial\"")
      .field("serial_armature", &RunInfo::serial_armature, "armature of the serial model");
  Value<MotionResult>(module, "Result", "A solved motion.")
      .field("run", &MotionResult::run, "RunInfo")
      .field("motion", &MotionResult::motion, "name")
      .field("formulation", &MotionResult::formulation, "Formulation")
      .field("step", &MotionResult::step, "StepRule")
      .field("options", &MotionResult::options, "every option of the motion by name")
      .field("goals", &MotionResult::goals, "GoalOutcomes: requested and achieved values")
      .field("schedule", &MotionResult::schedule, "ContactSchedule, with the final time steps")
      .field("timings", &MotionResult::timings, "PhaseTimings of the phases of free duration")
      .field("ground", &MotionResult::ground, "Ground")
      .field("solver", &MotionResult::solver, "Summary")
      .field("record", &MotionResult::record, "Record: all numbers, node by node")
      .field("peak_torques", &MotionResult::peak_torques, "largest |u| by motor, largest first, N m or N")
      .field("rms_torques", &MotionResult::rms_torques, "root mean square torque by motor, N m or N")
      .field("continuous_torques", &MotionResult::continuous_torques,
             "torques that motors can sustain indefinitely, where known, N m or N")
      .field("objective", &MotionResult::objective, "ObjectiveOptions")
      .field("energy", &MotionResult::energy, "ElectricalEnergy")
      .field("gap_position", &MotionResult::gap_position, "largest closing error, m")
      .field("gap_angle", &MotionResult::gap_angle, "rad")
      .field("slip_position", &MotionResult::slip_position, "largest displacement of a foot from its touchdown, m")
      .field("slip_angle", &MotionResult::slip_angle, "rad")
      .field("com_start", &MotionResult::com_start, "height of the centre of mass, m")
      .field("com_lowest", &MotionResult::com_lowest, "m")
      .field("dead_points", &MotionResult::dead_points, "DeadPointTraces: how near each linkage comes to one")
      .type()
      .def_property_readonly("converged", &MotionResult::converged, "whether the solver ended at an optimum")
      .def_property_readonly("interrupted", &MotionResult::interrupted,
                             "whether a callback ended it; the record is that of the last iterate")
      .def(
          "write", [](const MotionResult& self, const std::string& directory) { return writeResult(directory, self); },
          py::arg("directory"), py::call_guard<py::gil_scoped_release>(),
          "Writes trajectory.csv, trajectory.npz and summary.json, as the command does. Returns their paths.");
  module.def("make_report", &makeResultPage, py::arg("directories"),
             "The page that shows results, from their directories: 3D replay and plots, offline. HTML.");
  module.def("write_report", &writeReport, py::arg("path"), py::arg("directories"),
             py::call_guard<py::gil_scoped_release>(), "Writes that page to a file.");
}

MotionResult solveRequest(const Robot& robot, const Request& request, const ProblemOptions& problem,
                          const FddpOptions& options, const std::optional<MotionRecord>& warm_start,
                          const py::object& callback) {
  const SolveObserver observer = makeSolveObserver(callback);
  const py::gil_scoped_release release;
  const Motion motion = makeMotion(robot.get(), request.make(), problem);
  SolveOptions how;
  how.solver = options;
  if (warm_start) how.start = makeStart(*warm_start, motion);
  return makeResult(makeRunInfo(robot.name, toLoaded(robot)), solve(motion, how, observer));
}

}  // namespace

void bindResults(py::module_& module) {
  bindRecord(module);
  bindResult(module);
  module.def("solve", &solveRequest, py::arg("robot"), py::arg("request"), py::arg("problem") = ProblemOptions(),
             py::arg("solver") = makeMotionSolverOptions(), py::arg("warm_start") = py::none(),
             py::arg("callback") = py::none(),
             "Solves a Request as `bielle solve` does. Returns a Result.\n\n"
             "callback: called with each Iteration; False stops. An exception it raises, or Ctrl-C, ends the solve.");
  module.def(
      "write_happened",
      [](const std::string& directory, const Robot& robot, const py::object& time, const py::object& q,
         const py::object& v, const py::object& u, const py::object& contact_wrenches, const std::string& motion,
         const Ground& ground, const std::string& facts) {
        for (const py::object& table : {time, q, v, u})
          if (table.is_none()) throw py::type_error("time, q, v, u: expected arrays, got None");
        HappenedMotion happened{motion, ground, read<VectorXd>(time, "time"), {}, {}, {}, {}, facts};
        happened.q = read<RowMatrixXd>(q, "q");
        happened.v = read<RowMatrixXd>(v, "v");
        happened.u = read<RowMatrixXd>(u, "u");
        if (!contact_wrenches.is_none())
          happened.contact_wrenches = read<RowMatrixXd>(contact_wrenches, "contact_wrenches");
        const py::gil_scoped_release release;
        return writeHappened(directory, robot.name, toLoaded(robot), happened);
      },
      py::arg("directory"), py::arg("robot"), py::arg("time"), py::arg("q"), py::arg("v"), py::arg("u"),
      py::arg("contact_wrenches") = py::none(), py::arg("motion") = "recorded motion", py::arg("ground") = Ground(),
      py::arg("facts") = "{}",
      "Writes what happened to a robot as a result that `bielle report` and `bielle export` read, whatever moved it; "
      "Recorder collects it.\n\n"
      "time: (N + 1,), s; q: (N + 1, nq); v: (N + 1, nv); u: (N, nu), torques from each node to the next; "
      "contact_wrenches: (N, 6 per contact), of the ground on the feet, in their frames; facts: what its summary tells "
      "beside, a JSON object. Returns the paths. Raises ValueError for a wrong shape.");
  module.def(
      "make_result",
      [](const HeldSolution& held, const Robot& robot) {
        const py::gil_scoped_release release;
        return makeResult(makeRunInfo(robot.name, toLoaded(robot)), held.solution);
      },
      py::arg("solution"), py::arg("robot"), "The Result of a Solution.");
}

}  // namespace bielle::python
