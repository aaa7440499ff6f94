#include <pybind11/stl.h>

#include "bielle/control/policy.h"
#include "bielle/control/predictive_controller.h"
#include "bind.h"
#include "controller.h"

namespace bielle::python {
namespace {

std::shared_ptr<HeldController> makeHeldPolicy(const HeldSolution& solved, bool gains) {
  const Solution& solution = solved.solution;
  if (gains && solution.gains.empty()) throw std::runtime_error("the least peak torque has no gains: give gains=False");
  auto held = std::make_shared<HeldController>();
  held->model = solved.motion->model;
  auto policy =
      std::make_unique<Policy>(gains ? makePolicy(solution) : makePolicy(solution.motion, solution.trajectory));
  held->policy = policy.get();
  held->controller = std::move(policy);
  return held;
}

std::shared_ptr<HeldController> makePredictive(const std::shared_ptr<Model>& model, const MotionPlan& plan,
                                               const ShootingTrajectory& solved, const ProblemOptions& problem,
                                               const PredictiveOptions& options) {
  const MotionPlan whole = completePlan(*model, plan);
  std::unique_ptr<PredictiveController> predictive;
  {
    const py::gil_scoped_release release;
    predictive =
        std::make_unique<PredictiveController>(makePredictiveMotion(*model, whole, problem, options), solved, options);
  }
  auto held = std::make_shared<HeldController>();
  held->model = model;
  held->predictive = predictive.get();
  held->controller = std::move(predictive);
  return held;
}

py::array update(HeldController& self, double time, const py::object& q, const py::object& v, double delay) {
  Measurement measured{time, readVector(q, self.model->nq(), "q"), readVector(v, self.model->nv(), "v")};
  measured.delay = delay;
  VectorXd u(self.model->nu());
  {
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(self.mutex);
    self.controller->update(measured, u);
  }
  return makeArray(u);
}

py::object getReference(const HeldController& self, double time) {
  if (!self.policy) throw std::runtime_error("only the policy of a solved motion has a reference");
  VectorXd q(self.model->nq()), v(self.model->nv());
  self.policy->getReference(time, q, v);
  return py::make_tuple(makeArray(q), makeArray(v));
}

std::vector<PredictedFoothold> getFootholds(HeldController& self) {
  const py::gil_scoped_release release;
  const std::lock_guard<std::mutex> lock(self.mutex);
  return self.controller->footholds();
}

}  // namespace

void bindControllers(py::module_& module) {
  Value<PredictiveOptions>(module, "PredictiveOptions", "Options of predictive control.").described();
  Value<PredictedFoothold>(module, "PredictedFoothold", "The predicted next foothold of a foot.")
      .field("contact", &PredictedFoothold::contact, "index into the model's contacts")
      .field("time", &PredictedFoothold::time, "time of its landing, s")
      .field("X_WF", &PredictedFoothold::X_WF, "placement of the contact's frame in the world");
  py::class_<HeldController, std::shared_ptr<HeldController>>(
      module, "Controller",
      "A feedback law: from measured states to torques. Controller.policy and .predictive make them.")
      .def_static("policy", &makeHeldPolicy, py::arg("solution"), py::arg("gains").none(false) = true,
                  "Torques of a Solution, and feedback with its gains.")
      .def_static("predictive", &makePredictive, py::arg("model"), py::arg("plan"), py::arg("solved"),
                  py::arg("problem") = ProblemOptions(), py::arg("options") = PredictiveOptions(),
                  "Solves the next second again at every stage. plan: a MotionPlan; solved: Trajectory of its Motion.")
      .def("update", &update, py::arg("time"), py::arg("q"), py::arg("v"), py::arg("delay") = 0,
           "Motor torques (nu,) at a time (s) and a measured state (nq,), (nv,); delay until they act, s.\n\n"
           "Call it in order of time.")
      .def("reference", &getReference, py::arg("time"), "q (nq,) and v (nv,) that a policy follows at a time, s.")
      .def_property_readonly(
          "duration",
          [](const HeldController& self) {
            if (!self.policy) throw std::runtime_error("only the policy of a solved motion has a duration");
            return self.policy->duration();
          },
          "duration of a policy, s")
      .def_property_readonly(
          "counts",
          [](const HeldController& self) {
            py::dict out;
            if (!self.predictive) return out;
            const PredictiveCounts& counts = self.predictive->counts();
            out["stages"] = counts.stages;
            out["solves"] = counts.solves;
            out["failed"] = counts.failed;
            out["early"] = counts.early;
            out["late"] = counts.late;
            out["missed"] = counts.missed;
            return out;
          },
          "counts of predictive control: stages, solves, failed solves, early and late landings, solves longer than a "
          "stage")
      .def_property_readonly(
          "footholds", &getFootholds,
          "predictive control only: a PredictedFoothold for each contact that lands within the window");
}

}  // namespace bielle::python
