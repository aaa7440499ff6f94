// Single functions of the dynamics at one state of Bipetto, repeated with warm caches, in CPU time of the thread, for
// developers of these functions. `bielle bench` measures what users experience (nodes, iterations, whole solves).
//
// Times are in seconds and, as the counter `units`, relative to one 108 x 108 product of doubles by Eigen (unit), a
// ratio that depends little on the machine and its load.
#include <benchmark/benchmark.h>

#include <ctime>
#include <functional>
#include <limits>
#include <random>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/reader.h"

namespace {

using namespace bielle;

// Seconds of this thread alone, excluding other load on the processor.
double getThreadTime() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

void multiply() {
  static const MatrixXd a = MatrixXd::Random(108, 108), b = MatrixXd::Random(108, 108);
  static MatrixXd c(108, 108);
  c.noalias() = a * b;
  benchmark::DoNotOptimize(c.data());
  benchmark::ClobberMemory();
}

// The least of several times, s.
double calcUnit() {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 200; ++i) {
    const double start = getThreadTime();
    for (int product = 0; product < 10; ++product) multiply();
    least = std::min(least, (getThreadTime() - start) / 10);
  }
  return least;
}

void measure(benchmark::State& state, const std::function<void()>& function) {
  static const double unit = calcUnit();
  const double start = getThreadTime();
  for (auto _ : state) function();
  state.counters["units"] = (getThreadTime() - start) / unit / static_cast<double>(state.iterations());
}

// Half sitting, with a small velocity that keeps the loops closed.
struct Robot {
  Robot()
      : model(loadRobot("bipetto").model),
        q(assembleReference(model, "half_sitting").q),
        loops(makeConstraintSet(model)),
        ws(model) {
    std::mt19937 rng(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto makeRandom = [&](int size, double scale) -> VectorXd {
      return VectorXd::NullaryExpr(size, [&](Eigen::Index) { return scale * uniform(rng); });
    };
    v = projectVelocity(model, ws, loops, q, makeRandom(model.nv(), 0.1));
    a = makeRandom(model.nv(), 1);
    tau = calcMotorForces(model, makeRandom(model.nu(), 1));
    updateConstrainedDynamics(model, ws, cws, loops, q, v, tau);
  }
  Model model;
  VectorXd q, v, a, tau;
  ConstraintSet loops;
  Workspace ws;
  ConstrainedWorkspace cws;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  Robot r;
  const auto add = [](const char* name, const std::function<void()>& function) {
    benchmark::RegisterBenchmark(name, [function](benchmark::State& state) {
      measure(state, function);
    })->Unit(benchmark::kMicrosecond);
  };
  add("unit: product 108 x 108", multiply);
  add("kinematics", [&r] {
    updatePositions(r.model, r.ws, r.q);
    updateVelocities(r.model, r.ws, r.v);
  });
  add("mass matrix", [&r] { updateMassMatrix(r.model, r.ws); });
  add("inverse dynamics", [&r] { benchmark::DoNotOptimize(calcInverseDynamics(r.model, r.ws, r.q, r.v, r.a)); });
  add("constrained dynamics", [&r] { updateConstrainedDynamics(r.model, r.ws, r.cws, r.loops, r.q, r.v, r.tau); });
  add("constrained dynamics and derivatives", [&r] {
    updateConstrainedDynamics(r.model, r.ws, r.cws, r.loops, r.q, r.v, r.tau);
    updateConstrainedDerivatives(r.model, r.ws, r.cws, r.loops);
  });
  add("closing a configuration", [&r] { benchmark::DoNotOptimize(closeConfiguration(r.model, r.q)); });
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
