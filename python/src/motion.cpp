#include "motion.h"

#include <pybind11/stl.h>

#include <algorithm>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "bind.h"

namespace bielle::python {

MotionRequest Request::make() const {
  MotionRequest request = sequence.empty() ? findMotion("", motion).request : makeSequenceRequest(sequence);
  for (const auto& [name, value] : options) request.options.set(name, value);
  for (const MotionFile& file : std::vector<MotionFile>(request.files)) {
    if (!files.count(file.name))
      throw InputError("", "file '" + file.name + "'", "motion '" + motion + "' needs it", "give a path: " + file.help);
    file.read(files.at(file.name), request);
  }
  return request;
}

FddpObserver makeObserver(const py::object& callback) {
  FddpObserver observer;
  // Copies of the observer are made without the interpreter's lock.
  observer.callback = [shared = std::make_shared<SharedObject>(callback)](const FddpIteration& iteration,
                                                                          const ShootingTrajectory&) {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const bool stop = !shared->get().is_none() && shared->get()(iteration).is(py::bool_(false));
    return stop ? FddpAction::Stop : FddpAction::Continue;
  };
  return observer;
}

SolveObserver makeSolveObserver(const py::object& callback) {
  const FddpObserver observer = makeObserver(callback);
  const auto warn = [](const std::string& line) {
    const std::string mark = "warning: ", text = line.substr(line.rfind(mark, 0) == 0 ? mark.size() : 0);
    const py::gil_scoped_acquire lock;
    if (PyErr_WarnEx(PyExc_RuntimeWarning, text.c_str(), 1) < 0) throw py::error_already_set();
  };
  return {observer, observer, {}, warn};
}

std::shared_ptr<HeldMotion> makeHeldMotion(std::shared_ptr<Model> model, const Request& request,
                                           const ProblemOptions& options) {
  auto held = std::make_shared<HeldMotion>();
  held->model = std::move(model);
  held->request = request;
  held->options = options;
  held->motion = makeMotion(*held->model, request.make(), options);
  return held;
}

namespace {

// The schedule that stages follow: a phase for each run of stages that differ in nothing that a phase tells.
ContactSchedule makeSchedule(const std::vector<StageSpec>& stages) {
  ContactSchedule schedule;
  for (size_t k = 0; k + 1 < stages.size(); ++k) {
    const StageSpec& stage = stages[k];
    if (k == 0 || stage.dt != stages[k - 1].dt || stage.timing.phase != stages[k - 1].timing.phase ||
        !same(stage.constraints, stages[k - 1].constraints)) {
      ContactPhase phase;
      phase.name = "phase " + std::to_string(schedule.phases.size() + 1);
      phase.dt = stage.dt;
      for (size_t c = stage.constraints.num_loops; c < stage.constraints.closures.size(); ++c) {
        ContactTarget target;
        target.contact = stage.constraints.getContact(static_cast<int>(c));
        target.X_WT = stage.constraints.closures[c].X_B2;
        phase.contacts.push_back(target);
      }
      schedule.phases.push_back(phase);
    }
    ++schedule.phases.back().nodes;
  }
  return schedule;
}

}  // namespace

MotionPlan completePlan(const Model& model, MotionPlan plan) {
  if (plan.stages.empty()) throw py::value_error("stages: expected some, and the terminal one");
  for (size_t k = 0; k + 1 < plan.stages.size(); ++k) requireFit(model, plan.stages[k].constraints);
  if (plan.schedule.phases.empty()) plan.schedule = makeSchedule(plan.stages);
  if (const int nodes = plan.schedule.numStages(); nodes + 1 != static_cast<int>(plan.stages.size()))
    throw py::value_error("schedule: " + std::to_string(nodes) + " stages in its phases, and " +
                          std::to_string(plan.stages.size()) + " of the plan, the terminal one among them");
  return plan;
}

namespace {

std::shared_ptr<HeldMotion> makeFromPlan(std::shared_ptr<Model> model, const MotionPlan& plan,
                                         const ProblemOptions& options) {
  auto held = std::make_shared<HeldMotion>();
  held->model = std::move(model);
  held->plan = completePlan(*held->model, plan);
  held->options = options;
  held->motion = makeMotion(*held->model, *held->plan, options);
  return held;
}

py::object makeRecipe(const py::object& model, const py::object& made_of, const py::object& options) {
  return py::module_::import("bielle.residuals").attr("Recipe")(model, made_of, options);
}

MotionPlan plan(const std::shared_ptr<Model>& model, const Request& request) {
  const py::gil_scoped_release release;
  return request.make().plan(*model, makeStandingRobot(*model));
}

std::vector<LibraryResidual> rememberStages(const HeldMotion& held, const py::object& recipe) {
  std::vector<StageSpec> stages;
  for (int node = 0; node <= held.motion.problem->numStages(); ++node)
    stages.push_back(held.motion.problem->spec(node));
  return rememberResiduals(stages, recipe);
}

StageSpec getStage(HeldMotion& held, int node) {
  if (node < 0 || node > held.motion.problem->numStages())
    throw py::index_error("node: from 0 to " + std::to_string(held.motion.problem->numStages()));
  if (!held.is_remembered)
    rememberStages(held, makeRecipe(py::cast(held.model), held.request ? py::cast(*held.request) : py::cast(*held.plan),
                                    py::cast(held.options)));
  held.is_remembered = true;
  return held.motion.problem->spec(node);
}

// The residuals that the library puts into the plan of a request, or, with options, into the motion of it or of a plan.
py::list makeResiduals(const std::shared_ptr<Model>& model, const py::object& made_of, const py::object& options) {
  const py::object recipe = makeRecipe(py::cast(model), made_of, options);
  if (options.is_none()) return py::cast(rememberResiduals(plan(model, made_of.cast<const Request&>()).stages, recipe));
  const auto problem = options.cast<ProblemOptions>();
  return py::cast(rememberStages(py::isinstance<Request>(made_of)
                                     ? *makeHeldMotion(model, made_of.cast<const Request&>(), problem)
                                     : *makeFromPlan(model, made_of.cast<const MotionPlan&>(), problem),
                                 recipe));
}

// \param name  of the argument in errors
void requireFit(const RobotProblem& problem, const ShootingTrajectory& trajectory, const std::string& name) {
  const size_t stages = problem.numStages();
  if (trajectory.xs.size() != stages + 1 || trajectory.us.size() != stages)
    throw py::value_error(name + ": expected " + std::to_string(stages + 1) + " states and " + std::to_string(stages) +
                          " controls, got " + std::to_string(trajectory.xs.size()) + " and " +
                          std::to_string(trajectory.us.size()));
  for (size_t k = 0; k <= stages; ++k)
    if (trajectory.xs[k].size() != problem.stateSize())
      throw py::value_error(name + ".xs: expected shape (" + std::to_string(problem.stateSize()) + ",), got (" +
                            std::to_string(trajectory.xs[k].size()) + ",)");
  for (size_t k = 0; k < stages; ++k)
    if (trajectory.us[k].size() != problem.controlSize(static_cast<int>(k)))
      throw py::value_error(name + ".us: expected shape (" + std::to_string(problem.controlSize(static_cast<int>(k))) +
                            ",), got (" + std::to_string(trajectory.us[k].size()) + ",)");
}

// Records are bound after motions.
StartingPoint readStart(const HeldMotion& held, const py::object& start) {
  if (py::isinstance<HeldSolution>(start)) {
    const Solution& solution = start.cast<const HeldSolution&>().solution;
    requireFit(*held.motion.problem, solution.trajectory, "warm_start");
    return {solution.trajectory, solution.multipliers};
  }
  if (!py::isinstance<ShootingTrajectory>(start))
    return makeStart(read<MotionRecord>(start, "warm_start"), held.motion);
  StartingPoint out{start.cast<const ShootingTrajectory&>()};
  requireFit(*held.motion.problem, out.trajectory, "warm_start");
  return out;
}

// The motion that a solution is of: made again, it has the options that it was made with.
std::shared_ptr<HeldMotion> findSolved(const std::shared_ptr<HeldMotion>& given, const Motion& solved) {
  if (solved.problem == given->motion.problem) return given;
  auto held = std::make_shared<HeldMotion>();
  held->model = given->model;
  held->request = given->request;
  for (const auto& [name, value] : solved.request->options.listValues()) held->request->options[name] = value;
  held->options = solved.problem_options;
  held->motion = solved;
  return held;
}

std::shared_ptr<HeldSolution> solve(const std::shared_ptr<HeldMotion>& held, const FddpOptions& solver,
                                    const py::object& callback, const py::object& start, bool refine) {
  SolveOptions options{solver, {}, refine};
  if (!start.is_none()) options.start = readStart(*held, start);
  const SolveObserver observer = makeSolveObserver(callback);
  auto out = std::make_shared<HeldSolution>();
  {
    const py::gil_scoped_release release;
    out->solution = bielle::solve(held->motion, options, observer);
  }
  out->motion = findSolved(held, out->solution.motion);
  return out;
}

py::dict getCosts(const HeldMotion& held, int node, const std::optional<ShootingTrajectory>& trajectory) {
  const RobotProblem& problem = *held.motion.problem;
  if (node < 0 || node > problem.numStages())
    throw py::index_error("node: from 0 to " + std::to_string(problem.numStages()));
  if (trajectory) requireFit(problem, *trajectory, "trajectory");
  const ShootingTrajectory& at = trajectory ? *trajectory : held.motion.guess;
  RobotEvaluator evaluator(problem);
  const VectorXd u = node == problem.numStages() ? VectorXd() : at.us[node];
  py::dict out;
  for (const CostValue& value : problem.getCosts(node, evaluator.evaluate(node, at.xs[node], u)))
    out[py::str(value.name)] = value.value;
  return out;
}

void bindRequests(py::module_& module) {
  Value<Request>(module, "Request", "A motion by name, with its options: the input of `bielle solve`.")
      .field("motion", &Request::motion, "name, one of `motions`; empty for a sequence")
      .field("options", &Request::options, "values by name: bool, int, float, or the name of a choice")
      .field("sequence", &Request::sequence, "names of motions that follow one another; options are \"NAME.option\"")
      .field("files", &Request::files, "paths by name, e.g. \"footholds\"");
  module.def(
      "motions",
      [] {
        py::dict out;
        for (const MotionEntry& entry : getMotions()) {
          const MotionRequest& request = entry.request;
          py::dict options;
          for (const Option& option : request.options) options[py::str(option.name)] = describeOption(option);
          py::dict motion;
          motion["help"] = entry.help;
          motion["options"] = options;
          motion["files"] = show(getNames(request.files), {});
          out[py::str(entry.name)] = motion;
        }
        return out;
      },
      "The motions by name: what they do, their options with defaults and units, files.");
}

using SolutionType = py::class_<HeldSolution, std::shared_ptr<HeldSolution>>;

void bindHeldMotion(py::module_& module) {
  using Type = py::class_<HeldMotion, std::shared_ptr<HeldMotion>>;
  Type type(module, "Motion",
            "A problem ready to be solved: of a plan (Motion(model, plan, options)), or of a request (Motion.make).");
  type.def(py::init(&makeFromPlan), py::arg("model"), py::arg("plan"), py::arg("options") = ProblemOptions())
      .def_static("make", &makeHeldMotion, py::arg("model"), py::arg("request"), py::arg("options") = ProblemOptions(),
                  py::call_guard<py::gil_scoped_release>(), "The motion of a request. Raises InputError.")
      .def_static(
          "plan",
          [](const std::shared_ptr<Model>& model, const Request& request) {
            MotionPlan made = plan(model, request);
            rememberResiduals(made.stages, makeRecipe(py::cast(model), py::cast(request), py::none()));
            return made;
          },
          py::arg("model"), py::arg("request"),
          "The plan of a request, e.g. to add costs and constraints to its stages.")
      .def_readonly("model", &HeldMotion::model, "Model")
      .def_readonly("problem_options", &HeldMotion::options, "ProblemOptions")
      .def_property_readonly(
          "request", [](const HeldMotion& h) { return h.request; }, "Request, or None")
      .def_property_readonly(
          "name", [](const HeldMotion& h) { return h.motion.name; }, "e.g. \"squat\"")
      .def_property_readonly(
          "num_stages", [](const HeldMotion& h) { return h.motion.problem->numStages(); }, "N")
      .def_property_readonly(
          "schedule", [](const HeldMotion& h) { return h.motion.schedule; }, "ContactSchedule")
      .def_property_readonly(
          "ground", [](const HeldMotion& h) { return h.motion.ground; }, "Ground")
      .def_property_readonly(
          "goals", [](const HeldMotion& h) { return show(h.motion.goals, py::cast(h)); }, "Goals")
      .def_property_readonly(
          "options", [](const HeldMotion& h) { return show(h.motion.options, {}); },
          "every option of the motion by name")
      .def_property_readonly(
          "guess", [](const HeldMotion& h) { return h.motion.guess; }, "Trajectory that a solve starts from")
      .def("stage", &getStage, py::arg("node"),
           "Stage of a node, 0 to N, including the constraints from the robot's limits.")
      .def("costs", &getCosts, py::arg("node"), py::arg("trajectory") = py::none(),
           "Costs of a node of a Trajectory, or of the guess, by name, before scaling by the time step.")
      .def(
          "solve", &solve, py::arg("options") = makeMotionSolverOptions(), py::arg("callback") = py::none(),
          py::arg("warm_start") = py::none(), py::arg("refine") = true,
          "Solves it as `bielle solve` does. Returns a Solution; the motion stays as it is.\n\n"
          "callback: called with each Iteration; False stops. An exception it raises, or Ctrl-C, ends the solve.\n"
          "warm_start: a Trajectory or a Solution of as many stages, or a Record of any motion of the robot; None: the "
          "guess\n"
          "refine: whether the motion of a Request may be made again, e.g. with shorter stages");
  type.def(py::pickle(
      [](const HeldMotion& h) {
        return py::make_tuple(h.model, h.request ? py::cast(*h.request) : py::none(),
                              h.plan ? py::cast(*h.plan) : py::none(), h.options);
      },
      [](const py::tuple& state) {
        const auto model = state[0].cast<std::shared_ptr<Model>>();
        const auto options = state[3].cast<ProblemOptions>();
        return state[1].is_none() ? makeFromPlan(model, state[2].cast<const MotionPlan&>(), options)
                                  : makeHeldMotion(model, state[1].cast<const Request&>(), options);
      }));
  type.def("__repr__", [](const HeldMotion& h) {
    return "<Motion '" + h.motion.name + "' of " + h.model->name() + ": " +
           std::to_string(h.motion.problem->numStages()) + " stages>";
  });
}

void bindSolution(SolutionType& type) {
  type.def_readonly("motion", &HeldSolution::motion,
                    "Motion that was solved: the given one, or that made again of its request")
      .def_property_readonly(
          "trajectory", [](const HeldSolution& h) { return h.solution.trajectory; }, "Trajectory")
      .def_property_readonly(
          "summary", [](const HeldSolution& h) { return h.solution.summary; }, "Summary")
      .def_property_readonly(
          "multipliers", [](const HeldSolution& h) { return h.solution.multipliers; }, "Multipliers of the constraints")
      .def_property_readonly(
          "gains", [](const HeldSolution& h) { return show(h.solution.gains, py::cast(h)); },
          "Gains of every stage, of the solver's last sweep; () for the least peak torque")
      .def_property_readonly(
          "converged", [](const HeldSolution& h) { return h.solution.converged(); },
          "whether the solver ended at an optimum")
      .def("__repr__",
           [](const HeldSolution& h) {
             return "<Solution of '" + h.solution.motion.name + "' of " + h.motion->model->name() + ": " +
                    getName(h.solution.summary.termination) + ">";
           })
      .def(py::pickle(
          [](const HeldSolution& h) {
            const Solution& s = h.solution;
            return py::make_tuple(h.motion, s.trajectory, s.summary, s.multipliers, show(s.gains, py::cast(h)));
          },
          [](const py::tuple& state) {
            auto held = std::make_shared<HeldSolution>();
            held->motion = state[0].cast<std::shared_ptr<HeldMotion>>();
            held->solution = {held->motion->motion, state[1].cast<ShootingTrajectory>(), state[2].cast<FddpSummary>(),
                              state[3].cast<Multipliers>(), read<std::vector<Gains>>(state[4], "gains")};
            return held;
          }));
}

}  // namespace

void bindMotions(py::module_& module) {
  bindRequests(module);
  SolutionType solution(module, "Solution", "A solved Motion.");  // before what returns it
  bindHeldMotion(module);
  bindSolution(solution);
  module.def("_make_residuals", &makeResiduals, py::arg("model"), py::arg("made_of"), py::arg("options") = py::none());
}

}  // namespace bielle::python
