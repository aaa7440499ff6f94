#pragma once
/// \file Measures speed on this machine: the parts of the benchmark walk (benchmark_walk.h), whole solves, a receding
/// horizon, and the growth of times with the size of a chain and the length of the horizon.
///
/// All times are wall clock, s. They are also given in a machine-independent unit: one product of two 108 x 108
/// matrices of doubles by Eigen, on one thread, measured before and after everything else; the least is taken. Other
/// load on the machine inflates every time. Repeated measurements are therefore reported by their least time, unless
/// stated otherwise.
#include <functional>
#include <string>
#include <vector>

#include "bench/batch_speed.h"
#include "bielle/motion/motion.h"

namespace bielle {

enum class BenchExtent {
  Whole,  ///< some minutes
  Quick   ///< few repetitions and small sizes, for tests
};

struct BenchOptions {
  int threads = 2;     ///< compared with one thread
  int shifts = 10000;  ///< of the receding horizon; the full formulation makes a thirtieth of them
  BenchExtent extent = BenchExtent::Whole;
  std::function<void(const std::string&)> progress;  ///< called with the name of the next measurement, if set
};

/// The benchmark walk on one thread, s per node, along the third iterate from the standing guess. Each time includes
/// those above it, except for sweep and rollout. (In an iteration the rollout has already computed the dynamics that
/// the linearization needs.)
struct NodeTimes {
  Formulation formulation = Formulation::Reduced;
  int tangent_size = 0;    ///< of a state
  double dynamics = 0;     ///< one step: accelerations, forces, next state
  double derivatives = 0;  ///< plus its linearization
  double linearize = 0;    ///< plus costs with their gradients and Hessians
  double sweep = 0;        ///< backward pass
  double rollout = 0;      ///< one rollout, with cost values
};

/// Ten FDDP iterations from the standing guess of the walk.
struct IterationTimes {
  Formulation formulation = Formulation::Reduced;
  int threads = 1;
  double seconds = 0;                            ///< one iteration per node
  double rollouts = 0;                           ///< number per iteration
  double linearize = 0, sweep = 0, rollout = 0;  ///< shares of the time of all threads, 1; the rest is the solver's own
};

/// From the command to the converged motion: making the problem and the guess, and solving. One run.
struct SolveTime {
  std::string motion;
  Formulation formulation = Formulation::Reduced;
  int threads = 1, iterations = 0;
  double seconds = 0;
  bool converged = false;
};

/// Times of some shifts of a receding horizon, s; zero if there are none.
struct ShiftTimes {
  int shifts = 0;
  double median = 0, percentile_99 = 0, worst = 0;
};

/// The walk on a horizon of 100 nodes that shifts by one stage before each single FDDP iteration: the plan is shifted,
/// and its new last stage holds still. The first plan has no time limit. The next state is that of the step, disturbed
/// by noise of 1e-4 rad and m, 1e-3 rad/s and m/s, on closed loops and with a velocity consistent with loops and stance
/// feet. With cones their multipliers move on with the plan. When the horizon reaches the end of the walk, it starts again with other noise.
struct RecedingHorizon {
  Formulation formulation = Formulation::Reduced;
  bool cones = false;  ///< soles keep their wrench cones
  int threads = 1;
  ShiftTimes all;          ///< a shift and its iteration, wall clock
  ShiftTimes undisturbed;  ///< of the shifts that were not preempted by another program
  double violation =
      0;  ///< of the cones in the steps that are taken, largest, over the weight (and the soles for torques)
  double least_height = 0;  ///< of the first body over its initial height, 1
  double largest_tilt = 0;  ///< of the first body from where it was upright, rad
  bool up = false;          ///< all solves succeeded, height over 0.8, tilt below 0.5 rad
};

/// Time per node as a function of size.
struct SizeTime {
  Formulation formulation = Formulation::Reduced;
  int size = 0;  ///< four-bars in the chain, or nodes of the horizon
  double seconds = 0;
};

/// Many worlds at once, the run of the least wall clock of several, in turn.
struct BatchTime {
  BatchMotion motion = BatchMotion::Stand;
  double time_step = 0;  ///< s
  int threads = 1;
  double rate = 0;       ///< steps of all worlds per second
  int broken = 0;        ///< worlds that broke off
  double rounds = 0;     ///< of Newton's method, of a register per step
  double deviation = 0;  ///< BatchTask::calcDeviation() at the end, the largest
};
inline constexpr int kBatchWorlds = 64;

struct BenchReport {
  std::string robot, processor, compiler, flags;
  double unit = 0;  ///< s
  std::vector<NodeTimes> nodes;
  std::vector<IterationTimes> iterations;
  std::vector<SolveTime> solves;
  std::vector<RecedingHorizon> receding;
  std::vector<SizeTime> chains;  ///< dynamics with derivatives of fourbar_chain.h, all with motors, no costs
  std::vector<BatchTime> batch;
  std::vector<SizeTime> horizons;  ///< linearization, sweep and one rollout of a walk of this many nodes
};

/// \throws InputError when the robot has no feet
BenchReport runBench(const Model& model, const BenchOptions& options = {});
/// Fills `batch` alone. \throws InputError when the robot has no feet
BenchReport runBatchBench(const Model& model, const BenchOptions& options = {});

}  // namespace bielle
