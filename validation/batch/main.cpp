// bielle-batch-speed: steps per second of processor time of a robot that stands, or lies fallen: many worlds at once, one after the
// other, and MuJoCo on the file that we export, in turn.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "bielle/worlds/batch.h"
#include "math/lane_registers.h"
#include "worlds/mujoco_model.h"

namespace {

using namespace bielle;
using namespace bielle::worlds;

constexpr double kTick = 1e-3;                    // s, of control
constexpr double kStiffness = 100, kDamping = 2;  // N m/rad, N m s/rad, about the torques that hold the posture

struct Arguments {
  std::string robot = "bipetto";
  std::vector<double> time_steps = {1e-3, 2.5e-4};
  int worlds = 32, rounds = 5;
  double seconds = 0.2;
  bool falls = false;
};

// Processor time of the program, s.
double readClock() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// What a robot does: stand by springs about a posture while it is pushed for 50 ms, by up to 10 N in the first world, or fall.
class Task {
 public:
  Task(const Model& model, bool falls) : model_(model), falls_(falls), q_(makeStandingPosture(model)) {
    std::vector<int> feet;
    for (size_t c = 0; c < model.contacts().size(); ++c) feet.push_back(static_cast<int>(c));
    u_ = calcStaticTorques(model, makeConstraintSet(model, makeContactTargets(model, q_, feet, 0, 0)), q_).u;
  }
  VectorXd makeConfiguration() const {
    VectorXd q = q_;
    if (falls_) q[2] += 0.05;
    return q;
  }
  VectorXd makeVelocity(int world) const {
    VectorXd v = VectorXd::Zero(model_.nv());
    std::mt19937 generator(static_cast<unsigned>(world));
    std::uniform_real_distribution<double> any(-1, 1);
    for (int i = 0; i < 6 && falls_; ++i) v[i] = any(generator);
    return v;
  }
  VectorXd calcTorques(ConstVectorRef q, ConstVectorRef v) const {
    if (falls_) return VectorXd::Zero(model_.nu());
    VectorXd u = u_;
    for (int m = 0; m < model_.nu(); ++m) {
      const Motor& motor = model_.motors()[m];
      const int at = model_.joints()[motor.joint].idx_q;
      u[m] += kStiffness * (q_[at] - q[at]) - kDamping * v[motor.dof];
    }
    return u;
  }
  double calcPush(int tick, int world) const { return falls_ || tick >= 50 ? 0 : 10.0 / (1 + world); }

 private:
  const Model& model_;
  const bool falls_;
  VectorXd q_, u_;
};

struct Speed {
  double rate = 0;  // steps per second of processor time
  double gap = 0;   // largest of the closures at the end, m
  double least_height = 0, rounds = 0;
};

double calcGap(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePlacements<double>(model, ws, q);
  double gap = 0;
  for (const Closure& closure : model.closures()) gap = std::max(gap, calcClosureGap(ws, closure).position);
  return gap;
}

Speed runBatch(const Model& model, const Task& task, const Arguments& arguments, double h) {
  WorldBatchOptions options;
  options.world.world.time_step = h;
  options.threads = 1;
  const int n = arguments.worlds, ticks = static_cast<int>(arguments.seconds / kTick);
  WorldBatch batch(model, n, options);
  MatrixXd q = task.makeConfiguration().replicate(1, n), v(model.nv(), n), u(model.nu(), n), push(3, n);
  for (int i = 0; i < n; ++i) v.col(i) = task.makeVelocity(i);
  batch.reset(q, v);
  push.setZero();
  double spent = 0;
  for (int t = 0; t < ticks; ++t) {
    for (int i = 0; i < n; ++i) {
      u.col(i) = task.calcTorques(batch.configurations().col(i), batch.velocities().col(i));
      push(0, i) = task.calcPush(t, i);
    }
    const double start = readClock();
    batch.step(u, push, kTick);
    spent += readClock() - start;
  }
  const double steps = std::round(kTick / h) * ticks * n;
  Speed out{steps / spent, 0, 1, batch.rounds() / (steps / static_cast<double>(kLane))};
  for (int i = 0; i < n; ++i) {
    if (!batch.ok(i)) std::cerr << "world " << i << ": " << batch.message(i) << "\n";
    out.gap = std::max(out.gap, calcGap(model, batch.configurations().col(i)));
    out.least_height = std::min(out.least_height, batch.configurations()(2, i));
  }
  return out;
}

Speed runSingle(const Model& model, const Task& task, const Arguments& arguments, double h) {
  BielleWorldOptions options;
  options.world.time_step = h;
  const auto world = makeBielleWorld(model, options);
  const int ticks = static_cast<int>(arguments.seconds / kTick), n = std::max(1, arguments.worlds / 16);
  Speed out{0, 0, 1, 0};
  double spent = 0;
  for (int i = 0; i < n; ++i) {
    world->reset(task.makeConfiguration(), task.makeVelocity(i));
    for (int t = 0; t < ticks; ++t) {
      world->setTorques(task.calcTorques(world->configuration(), world->velocity()));
      world->setPush(Vector3d(task.calcPush(t, i), 0, 0));
      const double start = readClock();
      world->advance(kTick);
      spent += readClock() - start;
    }
    out.gap = std::max(out.gap, world->gap());
    out.least_height = std::min(out.least_height, world->configuration()[2]);
  }
  out.rate = std::round(kTick / h) * ticks * n / spent;
  return out;
}

// Nothing but mj_step().
Speed runMujoco(const Model& model, const Task& task, const Arguments& arguments, double h) {
  MjcfOptions options;
  options.time_step = h;
  MujocoModel mujoco(model, findClosedConfiguration(model).q, options);
  const auto data = mujoco.makeData();
  const int ticks = static_cast<int>(arguments.seconds / kTick), n = std::max(1, arguments.worlds / 16);
  const int steps = static_cast<int>(std::round(kTick / h));
  Speed out{0, 0, 1, 0};
  double spent = 0;
  for (int i = 0; i < n; ++i) {
    VectorXd q = task.makeConfiguration(), v = task.makeVelocity(i);
    mj_resetData(mujoco.get(), data.get());
    mujoco.setState(q, v, *data);
    for (int t = 0; t < ticks; ++t) {
      const VectorXd u = task.calcTorques(q, v);
      for (int m = 0; m < model.nu(); ++m)
        data->ctrl[m] = model.motors()[m].clampEffort(u[m], v[model.motors()[m].dof]);
      data->xfrc_applied[6 * mujoco.getBody(1)] = task.calcPush(t, i);
      const double start = readClock();
      for (int k = 0; k < steps; ++k) mj_step(mujoco.get(), data.get());
      spent += readClock() - start;
      mujoco.getState(*data, q, v);
    }
    out.gap = std::max(out.gap, calcGap(model, q));
    out.least_height = std::min(out.least_height, q[2]);
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

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Steps per second of processor time: many worlds at once, one after the other, and MuJoCo, in turn.");
  app.add_option("--robot", arguments.robot);
  app.add_option("--time-step", arguments.time_steps, "s");
  app.add_option("--worlds", arguments.worlds)->check(CLI::PositiveNumber);
  app.add_option("--rounds", arguments.rounds, "runs of each, in turn")->check(CLI::PositiveNumber);
  app.add_option("--seconds", arguments.seconds, "simulated, of a run")->check(CLI::PositiveNumber);
  app.add_flag("--falls", arguments.falls, "limp robots that are dropped");
  CLI11_PARSE(app, argc, argv);
  const Model model = loadRobot(arguments.robot).model;
  const Task task(model, arguments.falls);
  using Run = std::function<Speed(double)>;
  const std::map<std::string, Run> runs = {{"many", [&](double h) { return runBatch(model, task, arguments, h); }},
                                           {"single", [&](double h) { return runSingle(model, task, arguments, h); }},
                                           {"mujoco", [&](double h) { return runMujoco(model, task, arguments, h); }}};
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
                             {"rounds", all.front().rounds}});
    }
  }
  std::cout << out.dump(2) << "\n";
  return 0;
}
