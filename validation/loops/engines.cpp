#include "loops/engines.h"

#include <algorithm>

#include "bielle/model/error.h"
#include "bielle/worlds/bielle_world.h"
#include "loops/process_world.h"
#ifdef BIELLE_WITH_MUJOCO
#include "worlds/mujoco_world.h"
#endif
#include "worlds/simbody_world.h"

namespace bielle::loops {
namespace {

using worlds::SimbodyIntegrator;
using worlds::World;

std::unique_ptr<World> makeSimbody(const Model& model, double accuracy, SimbodyIntegrator integrator) {
  worlds::SimbodyWorldOptions options;
  options.accuracy = accuracy;
  options.gap = 0.1 * accuracy;  // as Simbody itself has it
  options.integrator = integrator;
  return makeSimbodyWorld(model, options);
}

#ifdef BIELLE_WITH_MUJOCO
// Its closures as stiff as its steps allow.
std::unique_ptr<World> makeMujoco(const Model& model, double step, bool runge_kutta) {
  worlds::MujocoWorldOptions options;
  options.world.time_step = step;
  options.robot.closure_time = 2 * step;
  options.runge_kutta = runge_kutta;
  return makeMujocoWorld(model, options);
}
#endif

template <Mujoco3Integrator integrator>
std::unique_ptr<World> makeMujoco3(const Model& model, double step) {
  return makeMujoco3World(model, step, integrator);
}

std::vector<Engine> listEngines() {
  const std::vector<double> steps = {4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6};
  const std::vector<double> accuracies = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12};
  std::vector<Engine> engines = {
      {"manifold", "Bielle, order 8", "tolerance", accuracies, false,
       [](const Model& model, double tolerance) {
         worlds::ManifoldWorldOptions options;
         options.tolerance = tolerance;
         return makeManifoldWorld(model, options);
       }},
      {"bielle", "Bielle, leapfrog", "time step [s]", steps, true,
       [](const Model& model, double step) {
         worlds::BielleWorldOptions options;
         options.world.time_step = step;
         return makeBielleWorld(model, options);
       }},
      {"simbody", "Simbody, Runge-Kutta-Merson", "accuracy", accuracies, false,
       [](const Model& model, double accuracy) {
         return makeSimbody(model, accuracy, SimbodyIntegrator::RungeKuttaMerson);
       }},
      {"simbody3", "Simbody, third order", "accuracy", accuracies, false,
       [](const Model& model, double accuracy) {
         return makeSimbody(model, accuracy, SimbodyIntegrator::RungeKutta3);
       }},
#ifdef BIELLE_WITH_MUJOCO
      {"mujoco", "MuJoCo, RK4", "time step [s]", steps, true,
       [](const Model& model, double step) { return makeMujoco(model, step, true); }},
      {"mujoco_euler", "MuJoCo, Euler", "time step [s]", steps, true,
       [](const Model& model, double step) { return makeMujoco(model, step, false); }},
#endif
#ifdef BIELLE_LOOPS_DART
      {"dart", "DART", "time step [s]", steps, true,
       [](const Model& model, double step) -> std::unique_ptr<World> { return makeDartWorld(model, step); }},
#endif
#ifdef BIELLE_LOOPS_ODE
      {"ode", "ODE", "time step [s]", steps, true,
       [](const Model& model, double step) -> std::unique_ptr<World> { return makeOdeWorld(model, step); }},
#endif
  };
  if (hasMujoco3()) {
    engines.push_back({"mujoco3", "MuJoCo 3 (WebAssembly), RK4", "time step [s]", steps, true,
                       makeMujoco3<Mujoco3Integrator::RungeKutta>});
    engines.push_back({"mujoco3_discrete", "MuJoCo 3 (WebAssembly), discrete", "time step [s]", steps, true,
                       makeMujoco3<Mujoco3Integrator::Discrete>});
  }
  return engines;
}

}  // namespace

const std::vector<Engine>& getEngines() {
  static const std::vector<Engine> engines = listEngines();
  return engines;
}

const Engine& getEngine(const std::string& name) {
  std::string known;
  for (const Engine& engine : getEngines()) {
    if (engine.name == name) return engine;
    known += (known.empty() ? "" : ", ") + std::string(engine.name);
  }
  throw InputError("", "engine '" + name + "'", "there is no such engine", "choose one of: " + known);
}

}  // namespace bielle::loops
