#include <pybind11/stl.h>

#include <cmath>

#include "bielle/design/cost_gradient.h"
#include "bielle/design/search.h"
#include "bind.h"
#include "model_access.h"
#include "motion.h"

namespace bielle::python {
namespace {

// A robot as a function of numbers, with what it was made of.
struct HeldParametrization {
  std::shared_ptr<Model> given;  // or
  std::string generator;         // with
  OptionValues settings;
  Parametrization robot;
};

std::shared_ptr<HeldParametrization> parametrizeGiven(const std::shared_ptr<Model>& model,
                                                      const std::vector<DesignVariable>& variables) {
  return std::make_shared<HeldParametrization>(HeldParametrization{model, "", {}, Parametrization(*model, variables)});
}

std::shared_ptr<HeldParametrization> parametrizeGenerated(const std::string& generator,
                                                          const std::vector<DesignVariable>& variables,
                                                          const OptionValues& settings) {
  return std::make_shared<HeldParametrization>(
      HeldParametrization{nullptr, generator, settings, Parametrization(generator, settings, variables)});
}

py::array costGradient(const HeldSolution& solved, const HeldParametrization& robot, const py::object& x) {
  const HeldMotion& held = *solved.motion;
  const VectorXd point = readVector(x, robot.robot.start().size(), "x");
  if (!held.request)
    throw std::runtime_error(
        "solution: a motion made from a plan cannot be made for other robots; make it from a Request");
  VectorXd gradient;
  {
    const py::gil_scoped_release release;
    const MotionRequest request = held.request->make();
    const auto make = [&](const Model& model, const StandingRobot& standing) {
      return makeMotion(model, request.plan(model, standing), held.options);
    };
    gradient = calcCostGradient(robot.robot, point, solved.solution, make);
  }
  return makeArray(gradient);
}

double requireFinite(double value) {
  if (!std::isfinite(value))
    throw py::value_error("objective: expected a finite number; return a large one for infeasible points");
  return value;
}

// What an objective returned: a number, or a number and its gradient.
SlopedValue readSloped(const py::object& returned, Eigen::Index size) {
  if (!py::isinstance<py::tuple>(returned) || py::len(returned) != 2)
    throw py::type_error("objective: slsqp and mma expect (value, gradient), got " +
                         std::string(py::repr(py::type::of(returned))));
  SlopedValue out;
  out.value = requireFinite(read<double>(returned[py::int_(0)], "objective, its value"));
  out.terms = {{VectorXd::Constant(1, out.value),
                readVector(returned[py::int_(1)], size, "objective, its gradient").transpose()}};
  return out;
}

double readValue(const py::object& returned) {
  const bool pair = py::isinstance<py::tuple>(returned) && py::len(returned) == 2;
  return requireFinite(read<double>(pair ? py::object(returned[py::int_(0)]) : returned, "objective, its value"));
}

SearchResult minimize(const py::function& objective, const py::object& start, const py::object& lower,
                      const py::object& upper, const std::vector<SearchStage>& stages, unsigned seed) {
  SearchProblem problem;
  problem.start = readMatrix<VectorXd>(start, "start");
  problem.lower = readVector(lower, problem.start.size(), "lower");
  problem.upper = readVector(upper, problem.start.size(), "upper");
  if ((problem.lower.array() > problem.start.array()).any() || (problem.start.array() > problem.upper.array()).any())
    throw py::value_error("start: expected values between lower and upper");
  const auto call = [&objective](const VectorXd& x) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return objective(makeArray(x));
  };
  problem.objective = [&call](const VectorXd& x, const SearchStage&) { return readValue(call(x)); };
  problem.sloped = [&call](const VectorXd& x, const SearchStage&) { return readSloped(call(x), x.size()); };
  return minimizeByStages(problem, stages, seed);
}

void bindVariables(py::module_& module) {
  Value<LengthChange>(module, "LengthChange", "The distance between two places of one body; the second one moves.")
      .field("rod", &LengthChange::rod, "or the name of a closure that is a distance, and nothing else")
      .field("begin", &LengthChange::from, "a joint, frame, contact or closure frame")
      .field("end", &LengthChange::to, "another one on the same body, which moves along the line between them")
      .field("across", &LengthChange::across, "unit vector (3,): only the part perpendicular to it counts; zero: all")
      .field("stretched", &LengthChange::stretched,
             "link whose mass, inertia and drawing grow with the length, or empty");
  Value<ShiftChange>(module, "ShiftChange", "A joint or frame that moves along a direction of the body it is fixed to.")
      .field("of", &ShiftChange::of, "its name")
      .field("along", &ShiftChange::along, "unit vector (3,)");
  Value<DesignVariable>(module, "DesignVariable", "A number of a robot that may change.")
      .field("name", &DesignVariable::name, "any unique name")
      .field("lower", &DesignVariable::lower, "bound")
      .field("upper", &DesignVariable::upper, "bound")
      .field("unit", &DesignVariable::unit, "\"m\" unless given")
      .field("parameter", &DesignVariable::parameter,
             "parameter of the generator, for generated robots; for given ones:")
      .field("lengths", &DesignVariable::lengths, "the first one is the value; the others change by the same amount")
      .field("shifts", &DesignVariable::shifts, "by the value");
}

void bindParametrization(py::module_& module) {
  using Type = py::class_<HeldParametrization, std::shared_ptr<HeldParametrization>>;
  Type type(module, "Parametrization",
            "A robot as a function of bounded numbers: lengths and shifts of a given one, or parameters of a "
            "generator.");
  type.def(py::init(&parametrizeGiven), py::arg("model"), py::arg("variables"),
           "Raises InputError for unknown names, places on different bodies, bounds that exclude the model.")
      .def_static("generated", &parametrizeGenerated, py::arg("generator"), py::arg("variables"),
                  py::arg("settings") = OptionValues(),
                  "Parametrizes a generator (see `generators`); settings: its other parameters by name and value.")
      .def_property_readonly(
          "variables", [](const HeldParametrization& p) { return show(p.robot.variables(), py::cast(p)); },
          "DesignVariables")
      .def_property_readonly(
          "start", [](const py::object& p) { return makeView(p.cast<HeldParametrization&>().robot.start(), p); },
          "values of the given robot (n,)")
      .def_property_readonly(
          "lower", [](const py::object& p) { return makeView(p.cast<HeldParametrization&>().robot.lower(), p); },
          "bounds (n,)")
      .def_property_readonly(
          "upper", [](const py::object& p) { return makeView(p.cast<HeldParametrization&>().robot.upper(), p); },
          "bounds (n,)")
      .def(
          "make",
          [](const HeldParametrization& p, const py::object& x) {
            const VectorXd point = readVector(x, p.robot.start().size(), "x");
            const py::gil_scoped_release release;
            return std::make_shared<Model>(p.robot.make(point));
          },
          py::arg("x"), "The Model at x (n,). Raises InputError when the numbers do not define a robot.")
      .def("__repr__",
           [](const HeldParametrization& p) {
             std::string names;
             for (const DesignVariable& variable : p.robot.variables()) names += " " + variable.name;
             return "<Parametrization of " + p.robot.startModel().name() + ":" + names + ">";
           })
      .def(py::pickle(
          [](const HeldParametrization& p) {
            return py::make_tuple(p.given, p.generator, show(p.settings, {}), show(p.robot.variables(), py::cast(p)));
          },
          [](const py::tuple& state) {
            const auto variables = read<std::vector<DesignVariable>>(state[3], "variables");
            if (!state[0].is_none()) return parametrizeGiven(state[0].cast<std::shared_ptr<Model>>(), variables);
            return parametrizeGenerated(state[1].cast<std::string>(), variables,
                                        read<OptionValues>(state[2], "settings"));
          }));
}

void bindSearch(py::module_& module) {
  py::enum_<SearchAlgorithm>(module, "SearchAlgorithm", "Algorithms of NLopt.")
      .value("CRS", SearchAlgorithm::Crs, "controlled random search; global")
      .value("ISRES", SearchAlgorithm::Isres, "evolution strategy; global")
      .value("BOBYQA", SearchAlgorithm::Bobyqa, "quadratic models; local")
      .value("SBPLX", SearchAlgorithm::Sbplx, "simplex on subspaces; local, tolerates kinks")
      .value("SLSQP", SearchAlgorithm::Slsqp, "sequential quadratic programs; local, needs gradients")
      .value("MMA", SearchAlgorithm::Mma, "moving asymptotes; local, needs gradients");
  Value<SearchStage>(module, "SearchStage", "One algorithm of a search.")
      .field("algorithm", &SearchStage::algorithm, "SearchAlgorithm")
      .field("evaluations", &SearchStage::evaluations, "at most")
      .field("tolerance", &SearchStage::tolerance, "tolerance of the steps, relative to the width of the bounds");
  Value<SearchResult>(module, "SearchResult", "The best point of a search.")
      .field("x", &SearchResult::x, "(n,)")
      .field("value", &SearchResult::value, "value of the objective")
      .field("evaluations", &SearchResult::evaluations, "number");
  module.def("minimize", &minimize, py::arg("objective"), py::arg("start"), py::arg("lower"), py::arg("upper"),
             py::arg("stages"), py::arg("seed") = 1,
             "Minimizes a function of (n,) within bounds by SearchStages, each from the best point so far.\n\n"
             "objective: returns a number, for SLSQP and MMA with its gradient, (value, (n,)). An exception it raises, "
             "or Ctrl-C, ends the search.");
}

}  // namespace

void bindDesign(py::module_& module) {
  bindVariables(module);
  bindParametrization(module);
  bindSearch(module);
  module.def("cost_gradient", &costGradient, py::arg("solution"), py::arg("robot"), py::arg("x"),
             "Derivatives (n,) of the optimal cost of a motion by every number of its robot, at x (n,).\n\n"
             "solution: of a motion made from a Request for `robot.make(x)`. The derivatives are those of motions "
             "solved again "
             "for every change, but nothing is solved: the multipliers of the optimum suffice (envelope theorem).");
}

}  // namespace bielle::python
