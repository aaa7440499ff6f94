// bielle-batch-speed: steps per second of processor time of a robot that stands, walks or falls: many worlds at once, one after the
// other, and MuJoCo on the file that we export, in turn: the one that is linked and, where $BIELLE_NODE_MODULES has it, npm's.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/batch_speed.h"
#include "bielle/dynamics/assembly.h"
#include "bielle/robots/fourbar_chain.h"
#include "bielle/robots/robot_loader.h"
#include "bielle/worlds/batch.h"
#include "formats/mjcf.h"
#include "loops/process_world.h"
#include "math/lane_registers.h"
#include "precision.h"
#include "worlds/mujoco_model.h"

namespace {

using namespace bielle;
using namespace bielle::worlds;

constexpr double kTick = BatchTask::kTick;

struct Arguments {
  std::string robot = "bipetto";
  std::vector<double> time_steps = {1e-3, 2.5e-4};
  int worlds = 32, rounds = 5, four_bars = 0;
  double seconds = 0.2;
  bool walks = false, falls = false, precision = false;

  // Those that walk are at different instants of it, so that all of them are needed for a fair comparison.
  int countSingle() const { return walks ? worlds : std::max(1, worlds / 16); }
};

struct Speed {
  double rate = 0;  // steps per second of processor time
  double gap = 0;   // largest of the closures at the end, m
  double least_height = 0, rounds = 0, deviation = 0;
};

Speed runBatch(BatchTask& task, const Arguments& arguments, double h) {
  const BatchSpeed speed = measureBatch(task, arguments.worlds, arguments.seconds, h, 1);
  if (speed.broken > 0) std::cerr << speed.broken << " worlds broke off\n";
  return {speed.steps / speed.processor, speed.gap, speed.least_height, speed.rounds, speed.deviation};
}

Speed runSingle(const Model& model, BatchTask& task, const Arguments& arguments, double h) {
  BielleWorldOptions options;
  options.world.time_step = h;
  const auto world = makeBielleWorld(model, options);
  const int ticks = static_cast<int>(arguments.seconds / kTick), n = arguments.countSingle();
  Speed out{0, 0, 1, 0, 0};
  double spent = 0;
  for (int i = 0; i < n; ++i) {
    world->reset(task.makeConfiguration(i), task.makeVelocity(i));
    for (int t = 0; t < ticks; ++t) {
      world->setTorques(task.calcTorques(t, i, world->configuration(), world->velocity()));
      world->setPush(Vector3d(task.calcPush(t, i), 0, 0));
      const double start = readProcessorClock();
      world->advance(kTick);
      spent += readProcessorClock() - start;
    }
    out.gap = std::max(out.gap, world->gap());
    out.least_height = std::min(out.least_height, world->configuration()[2]);
    out.deviation = std::max(out.deviation, task.calcDeviation(ticks, i, world->configuration()));
  }
  out.rate = std::round(kTick / h) * ticks * n / spent;
  return out;
}

// Nothing but mj_step().
Speed runMujoco(const Model& model, BatchTask& task, const Arguments& arguments, double h) {
  MjcfOptions options;
  options.time_step = h;
  MujocoModel mujoco(model, findClosedConfiguration(model).q, options);
  const auto data = mujoco.makeData();
  const int ticks = static_cast<int>(arguments.seconds / kTick), n = arguments.countSingle();
  const int steps = static_cast<int>(std::round(kTick / h));
  Speed out{0, 0, 1, 0, 0};
  double spent = 0;
  for (int i = 0; i < n; ++i) {
    VectorXd q = task.makeConfiguration(i), v = task.makeVelocity(i);
    mj_resetData(mujoco.get(), data.get());
    mujoco.setState(q, v, *data);
    for (int t = 0; t < ticks; ++t) {
      const VectorXd u = task.calcTorques(t, i, q, v);
      for (int m = 0; m < model.nu(); ++m)
        data->ctrl[m] = model.motors()[m].clampEffort(u[m], v[model.motors()[m].dof]);
      data->xfrc_applied[6 * mujoco.getBody(1)] = task.calcPush(t, i);
      const double start = readProcessorClock();
      for (int k = 0; k < steps; ++k) mj_step(mujoco.get(), data.get());
      spent += readProcessorClock() - start;
      mujoco.getState(*data, q, v);
    }
    out.gap = std::max(out.gap, calcLargestGap(model, q));
    out.least_height = std::min(out.least_height, q[2]);
    out.deviation = std::max(out.deviation, task.calcDeviation(ticks, i, q));
  }
  out.rate = static_cast<double>(steps) * ticks * n / spent;
  return out;
}

// The newest one, by npm, with the same coordinates.
Speed runMujoco3(const Model& model, BatchTask& task, const Arguments& arguments, double h) {
  MjcfOptions options;
  options.time_step = h;
  const VectorXd closed = findClosedConfiguration(model).q;
  const MujocoModel mujoco(model, closed, options);
  const auto data = mujoco.makeData();
  loops::Mujoco3 newest(formatMjcf(model, closed, options).xml, loops::Mujoco3Integrator::Euler);
  Eigen::Map<VectorXd> qpos(data->qpos, mujoco.get()->nq), qvel(data->qvel, mujoco.get()->nv);
  const int ticks = static_cast<int>(arguments.seconds / kTick), n = arguments.countSingle();
  const int steps = static_cast<int>(std::round(kTick / h));
  Speed out{0, 0, 1, 0, 0};
  double spent = 0;
  for (int i = 0; i < n; ++i) {
    VectorXd q = task.makeConfiguration(i), v = task.makeVelocity(i), forces = VectorXd::Zero(qvel.size());
    mujoco.setState(q, v, *data);
    newest.start(qpos, qvel);
    for (int t = 0; t < ticks; ++t) {
      const VectorXd u = task.calcTorques(t, i, q, v);
      for (int m = 0; m < model.nu(); ++m) {
        const Motor& motor = model.motors()[m];
        forces[mujoco.getDof(motor.joint)] = motor.clampEffort(u[m], v[motor.dof]);
      }
      newest.apply(forces, mujoco.getBody(1), Vector3d(task.calcPush(t, i), 0, 0));
      newest.step(h, steps);
      qpos = newest.qpos();
      qvel = newest.qvel();
      mujoco.getState(*data, q, v);
    }
    spent += newest.cpu();
    out.gap = std::max(out.gap, calcLargestGap(model, q));
    out.least_height = std::min(out.least_height, q[2]);
    out.deviation = std::max(out.deviation, task.calcDeviation(ticks, i, q));
  }
  out.rate = static_cast<double>(steps) * ticks * n / spent;
  return out;
}

// Resident memory of the program, kB.
double readMemory() {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("VmRSS:", 0) == 0) return std::stod(line.substr(6));
  return 0;
}

double measureMemory(const Model& model) {
  constexpr int kMany = 4096;
  const double before = readMemory();
  WorldBatchOptions options;
  options.threads = 1;
  const WorldBatch batch(model, kMany, options);
  return (readMemory() - before) / kMany;
}

Model loadModel(const Arguments& arguments) {
  if (arguments.four_bars == 0) return loadRobot(arguments.robot).model;
  FourBarChainOptions options;
  options.count = arguments.four_bars;
  return makeFourBarChain(options).model;
}

void printPrecision(const Model& model, const Arguments& arguments) {
  PrecisionOptions options;
  options.time_steps = arguments.time_steps;
  options.seconds = arguments.seconds;
  options.worlds = arguments.worlds;
  nlohmann::ordered_json out = {{"register", kRegister}, {"seconds", options.seconds}, {"push [N]", options.push}};
  for (const Precision& row : measurePrecision(model, options))
    out["runs"].push_back({{"world", row.world},
                           {"time step [s]", row.time_step},
                           {"error", row.error},
                           {"gap [m]", row.gap},
                           {"moves", row.moves},
                           {"apart", row.apart},
                           {"rate", row.rate}});
  std::cout << out.dump(2) << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Steps per second of processor time: many worlds at once, one after the other, and MuJoCo, in turn.");
  app.add_option("--robot", arguments.robot);
  app.add_option("--four-bars", arguments.four_bars, "instead of a robot: links of a chain that hangs in the world")
      ->check(CLI::PositiveNumber);
  app.add_option("--time-step", arguments.time_steps, "s");
  app.add_option("--worlds", arguments.worlds)->check(CLI::PositiveNumber);
  app.add_option("--rounds", arguments.rounds, "runs of each, in turn")->check(CLI::PositiveNumber);
  app.add_option("--seconds", arguments.seconds, "simulated, of a run")->check(CLI::PositiveNumber);
  CLI::Option* walks = app.add_flag("--walks", arguments.walks, "at 0.4 m/s, by the gains of a plan");
  app.add_flag("--falls", arguments.falls, "limp robots that are dropped")->excludes(walks);
  app.add_flag("--precision", arguments.precision, "errors by time step, of a second of a robot that is pushed");
  CLI11_PARSE(app, argc, argv);
  const Model model = loadModel(arguments);
  if (arguments.precision) {
    printPrecision(model, arguments);
    return 0;
  }
  BatchTask task(model, arguments.walks ? BatchMotion::Walk : arguments.falls ? BatchMotion::Fall : BatchMotion::Stand);
  using Run = std::function<Speed(double)>;
  std::map<std::string, Run> runs = {{"many", [&](double h) { return runBatch(task, arguments, h); }},
                                     {"single", [&](double h) { return runSingle(model, task, arguments, h); }},
                                     {"mujoco", [&](double h) { return runMujoco(model, task, arguments, h); }}};
  if (loops::hasMujoco3()) runs["mujoco3"] = [&](double h) { return runMujoco3(model, task, arguments, h); };
  nlohmann::ordered_json out = {{"register", kRegister}, {"memory [kB]", measureMemory(model)}};
  for (const double h : arguments.time_steps) {
    std::map<std::string, std::vector<Speed>> speeds;
    for (int round = 0; round < arguments.rounds; ++round)
      for (const auto& [name, run] : runs) speeds[name].push_back(run(h));
    for (auto& [name, all] : speeds) {
      std::sort(all.begin(), all.end(), [](const Speed& a, const Speed& b) { return a.rate < b.rate; });
      out["runs"].push_back({{"time step [s]", h},
                             {"world", name},
                             {"least", all.front().rate},
                             {"median", all[all.size() / 2].rate},
                             {"most", all.back().rate},
                             {"gap [m]", all.front().gap},
                             {"height [m]", all.front().least_height},
                             {"deviation", all.front().deviation},
                             {"rounds", all.front().rounds}});
    }
  }
  // Two threads over one, by the wall clock, in turn.
  for (const double h : arguments.time_steps) {
    std::vector<double> ratios;
    for (int round = 0; round < arguments.rounds; ++round) {
      const int worlds = 2 * arguments.worlds;  // full registers for both
      const double one = measureBatch(task, worlds, arguments.seconds, h, 1).wall;
      ratios.push_back(one / measureBatch(task, worlds, arguments.seconds, h, 2).wall);
    }
    std::sort(ratios.begin(), ratios.end());
    out["threads"].push_back({{"time step [s]", h},
                              {"least", ratios.front()},
                              {"median", ratios[ratios.size() / 2]},
                              {"most", ratios.back()}});
  }
  std::cout << out.dump(2) << "\n";
  return 0;
}
