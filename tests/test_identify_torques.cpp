// Masses, armatures and friction from logged torques. Oracles: inverse dynamics of changed robots and central differences of what is
// left of them, closures of the whole robot, polynomials.
#include <catch2/catch.hpp>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "bielle/model/names.h"
#include "check_derivative.h"
#include "dynamics/linkage_workspace.h"
#include "get_error.h"
#include "identify/loaded_states.h"
#include "identify/log.h"
#include "model/listing.h"
#include "own_robots.h"
#include "results/npz.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// States of a robot near readings that do not quite fit: all loops, and whatever is outside them.
struct LoadTrial {
  explicit LoadTrial(const std::string& name) : model(loadOwn(name).model), q(findClosedConfiguration(model).q) {
    std::mt19937 random(5);
    const auto measure = [&](const VectorXd& at) {
      Smoothed motion;
      motion.value.resize(kInstants, at.size());
      for (Eigen::Index k = 0; k < kInstants; ++k) {
        const VectorXd there = at + randomVector(random, at.size(), 0.05);
        motion.value.row(k) = there;
      }
      const auto draw = [&](double size) {
        MatrixXd values(kInstants, at.size());
        for (Eigen::Index c = 0; c < at.size(); ++c) values.col(c) = randomVector(random, kInstants, size);
        return values;
      };
      motion.rate = draw(3), motion.acceleration = draw(20);
      return motion;
    };
    std::vector<bool> is_looped(static_cast<size_t>(model.numBodies()), false);
    std::vector<MeasuredLinkage> linkages;
    for (const Linkage& linkage : selectLinkages(model, makeReduction(model, q))) {
      MeasuredLinkage measured{linkage.cluster, {}, VectorXd(linkage.cluster->model.nq()), {}};
      gatherConfiguration(model, *linkage.cluster, q, measured.q_start);
      std::vector<double> at;
      for (size_t i = 0; i < linkage.cluster->joints.size(); ++i) {
        const int index = linkage.cluster->joints[i];
        is_looped[static_cast<size_t>(index)] = true;
        const Joint& own = linkage.cluster->model.joints()[i + 1];
        if (own.nq != 1) continue;
        measured.sensors.push_back({own.name, own.idx_q, own.idx_v});
        at.push_back(measured.q_start[own.idx_q]);
      }
      measured.motion = measure(VectorXd::Map(at.data(), static_cast<Eigen::Index>(at.size())));
      linkages.push_back(std::move(measured));
    }
    std::vector<MeasuredCoordinate> coordinates;
    for (int i = 1; i < model.numBodies(); ++i)
      if (const Joint& joint = model.joints()[static_cast<size_t>(i)]; !is_looped[static_cast<size_t>(i)])
        coordinates.push_back({joint.idx_q, joint.idx_v, measure(q.segment(joint.idx_q, 1))});
    MatrixXd torques(kInstants, model.nu());
    for (int m = 0; m < model.nu(); ++m) torques.col(m) = randomVector(random, kInstants, 5);
    motion = findLoadedStates(model, q, linkages, coordinates, torques, {}, std::atomic<bool>(false));
  }

  static constexpr Eigen::Index kInstants = 5;
  Model model;
  VectorXd q;
  LoadedMotion motion;
};

// Rows of the balance by inverse dynamics, of one reduced joint after the other.
std::vector<VectorXd> balance(const Model& model, const LoadedMotion& motion, double share_of_torques) {
  Workspace ws(model);
  std::vector<VectorXd> rows;
  for (const LoadedState& state : motion.states)
    rows.push_back(state.N.transpose() * (calcInverseDynamics(model, ws, state.q, state.v, state.a) -
                                          share_of_torques * calcMotorForces(model, state.u)));
  return rows;
}

const char* const kTrialRobots[] = {"fourbar", "fivebar", "delta"};

}  // namespace

TEST_CASE("identify: states from readings keep loops closed") {
  for (const char* name : kTrialRobots) {
    const LoadTrial trial(name);
    CAPTURE(name);
    REQUIRE(trial.motion.states.size() == LoadTrial::kInstants);
    Workspace ws(trial.model);
    for (const LoadedState& state : trial.motion.states) {
      updatePositions(trial.model, ws, state.q);
      updateVelocities<double>(trial.model, ws, state.v);
      updateAccelerations<double>(trial.model, ws, state.a);
      CHECK(state.v.norm() > 0.01);
      for (const Closure& closure : trial.model.closures()) {
        const ClosureGap gap = calcClosureGap(ws, closure);
        CHECK(gap.position + gap.angle < 1e-9);
        CHECK(calcClosureVelocity(ws, closure).norm() < 1e-8 * state.v.norm());
        CHECK(calcClosureAcceleration<double>(ws, closure).norm() < 1e-8 * (state.a.norm() + state.v.squaredNorm()));
        MatrixXd J = MatrixXd::Zero(getRows(closure.kind), trial.model.nv());
        calcClosureJacobian<double>(ws, closure, J);
        CHECK((J * state.N).norm() < 1e-8 * J.norm());
      }
    }
  }
}

TEST_CASE("identify: what is left of torques is that of inverse dynamics, and derivatives are those of differences") {
  for (const char* name : kTrialRobots) {
    const LoadTrial trial(name);
    CAPTURE(name);
    const std::vector<LoadNumber> numbers = listLoads(trial.model);
    const TorqueFit fit(trial.model, numbers, trial.motion.states, trial.motion.groups);
    // Each reduced joint counts by its own root mean square.
    const std::vector<VectorXd> typical = balance(trial.model, trial.motion, 0);
    VectorXd weights(typical.front().size());
    for (Eigen::Index first = 0, g = 0; first < weights.size(); first += trial.motion.groups[g++]) {
      const Eigen::Index count = trial.motion.groups[static_cast<size_t>(g)];
      double squares = 0;
      for (const VectorXd& row : typical) squares += row.segment(first, count).squaredNorm();
      const double mean = squares / static_cast<double>(count * LoadTrial::kInstants);
      weights.segment(first, count).setConstant(1 / (kTorqueNoise * std::sqrt(mean)));
    }
    const auto calcSquares = [&](const VectorXd& x) {
      double sum = 0;
      for (const VectorXd& row : balance(changeLoads(trial.model, numbers, x), trial.motion, 1))
        sum += weights.cwiseProduct(row).squaredNorm();
      return VectorXd(VectorXd::Constant(1, 0.5 * sum));
    };
    VectorXd x(numbers.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const LoadNumber& number = numbers[static_cast<size_t>(i)];
      x[i] = number.kind == LoadKind::Mass  ? (i % 2 ? -0.2 : 0.3) * number.value
             : number.kind == LoadKind::Com ? (i % 2 ? -0.02 : 0.03)
                                            : 0.1 + 0.01 * static_cast<double>(i);
    }
    for (const VectorXd& at : {VectorXd(VectorXd::Zero(x.size())), x}) {
      VectorXd r;
      MatrixXd J;
      fit.evaluate(at, r, &J);
      CHECK(0.5 * r.squaredNorm() == Approx(calcSquares(at)[0]).epsilon(1e-9));
    }
    VectorXd r;
    MatrixXd J;
    fit.evaluate(x, r, &J);
    checkDerivative(r.transpose() * J, differentiate(x, 1e-4, calcSquares));
    CHECK(fit.numRows() == static_cast<long>(LoadTrial::kInstants * weights.size()));
    // What is left of a robot with these numbers has a root mean square of one with these weights.
    const Model changed = changeLoads(trial.model, numbers, x);
    const VectorXd own = calcRowWeights(changed, trial.motion.states, trial.motion.groups, 1);
    double squares = 0;
    for (const VectorXd& row : balance(changed, trial.motion, 1)) squares += own.cwiseProduct(row).squaredNorm();
    CHECK(squares == Approx(LoadTrial::kInstants * weights.size()));
    const TorqueFit weighted(trial.model, numbers, trial.motion.states, trial.motion.groups, own);
    weighted.evaluate(x, r, nullptr);
    CHECK(r.squaredNorm() == Approx(squares).epsilon(1e-9));
  }
}

TEST_CASE("identify: numbers of the dynamics, and robots that have them changed") {
  const Model model = loadOwn("fourbar").model;
  const std::vector<LoadNumber> numbers = listLoads(model);
  const auto find = [&](const std::string& name) {
    for (size_t i = 0; i < numbers.size(); ++i)
      if (numbers[i].name == name) return static_cast<Eigen::Index>(i);
    FAIL("there is no '" << name << "'");
    return Eigen::Index(-1);
  };
  CHECK(numbers[static_cast<size_t>(find("coupler.mass"))].value == Approx(0.7));  // both halves of the rod
  CHECK(numbers[static_cast<size_t>(find("crank.com.x"))].value == Approx(0.075));
  CHECK_FALSE(contains(getNames(numbers), std::string("coupler_far.mass")));
  VectorXd x = VectorXd::Zero(static_cast<Eigen::Index>(numbers.size()));
  x[find("coupler.mass")] = 0.07, x[find("crank.com.z")] = 0.01, x[find("crank_joint.armature")] = 2e-3;
  x[find("crank_joint.friction")] = 0.3, x[find("crank_joint.damping")] = -1;
  const Model changed = changeLoads(model, numbers, x);
  const auto getInertia = [&](const Model& of, const char* body) {
    return of.bodies()[static_cast<size_t>(of.findJoint(body))].inertia;
  };
  for (const char* joint : {"crank_coupler", "rocker_coupler"}) {
    CHECK(getInertia(changed, joint).mass == Approx(0.385));
    CHECK(getInertia(changed, joint).I_com.isApprox(1.1 * getInertia(model, joint).I_com));
  }
  CHECK(getInertia(changed, "crank_joint").com.isApprox(Vector3d(0.075, 0, 0.01)));
  CHECK(changed.motors().front().armature == 2e-3);
  CHECK(changed.armature()[changed.motors().front().dof] == 2e-3);
  CHECK(getJointForce(changed, changed.motors().front().joint).friction == 0.3);
  CHECK(getJointForce(changed, changed.motors().front().joint).damping == 0);  // none is below zero
}

TEST_CASE("identify: polynomials through windows are exact for theirs, whatever the spacing of samples") {
  VectorXd time(200);
  for (Eigen::Index k = 0; k < time.size(); ++k)
    time[k] = 0.01 * (static_cast<double>(k) + 0.3 * std::sin(7.0 * static_cast<double>(k)));
  const auto f = [](double t) {
    return Eigen::Vector3d(1 + t - 2 * t * t + t * t * t * t, 1 - 4 * t + 4 * t * t * t, -4 + 12 * t * t);
  };
  MatrixXd samples(time.size(), 1);
  for (Eigen::Index k = 0; k < time.size(); ++k) samples(k, 0) = f(time[k])[0];
  double window = 0.2;
  const std::vector<double> centres = listCentres(time, window);
  CHECK(window == 0.2);
  REQUIRE(centres.size() >= 17);
  CHECK(centres[1] - centres[0] == Approx(0.1));
  const Smoothed smoothed = smooth(time, samples, centres, window);
  for (size_t i = 0; i < centres.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d found(smoothed.value(row, 0), smoothed.rate(row, 0), smoothed.acceleration(row, 0));
    CHECK((found - f(centres[i])).norm() < 1e-9);
  }
  window = 1e-3;  // too short for seven samples
  listCentres(time, window);
  CHECK(window == Approx(0.07).epsilon(0.1));
  // Nothing is told of a gap.
  VectorXd gap(time.size());
  for (Eigen::Index k = 0; k < time.size(); ++k) gap[k] = time[k] + (k < 100 ? 0 : 3);
  window = 0.2;
  for (const double centre : listCentres(gap, window)) CHECK((centre < 1.1 || centre > 3.9));
}

TEST_CASE("identify: torques in logs, which the last row may lack") {
  const RobotDirectory directory;
  const std::vector<std::string> wanted = {"crank", "v.crank", "u.crank"};
  const MotionLog log =
      readLog(directory.write("log.csv", "time,q.crank,v.crank,u.crank\n0,1,2,3\n1,4,5,\n\n"), wanted);
  CHECK(log.names == wanted);
  CHECK(log.isHeld(2));
  CHECK_FALSE(log.isHeld(1));
  CHECK(log.values.leftCols(2) == MatrixXd(Eigen::Matrix2d{{1, 2}, {4, 5}}));
  CHECK(log.values(0, 2) == 3);
  const auto refuse = [&](const std::string& text, const std::string& message) {
    CAPTURE(text);
    CHECK_THAT(getError([&] { readLog(directory.write("bad.csv", text), wanted); }), Catch::Contains(message));
  };
  refuse("time,u.crank\n0,\n1,2\n", "line 2, column 'u.crank': '' is no finite number");
  refuse("time,u.crank\n0,1\n1,nan\n", "line 3, column 'u.crank': 'nan' is no finite number");
  refuse("time,v.crank\n0,1\n1,\n", "line 3, column 'v.crank': '' is no finite number");

  NpyArrays arrays;
  arrays["time"] = {{3}, {0, 1, 2}, {}, false};
  arrays["q"] = arrays["v"] = {{3, 1}, {4, 5, 6}, {}, false};
  arrays["u"] = {{2, 1}, {7, 8}, {}, false};
  for (const char* names : {"q_names", "v_names", "u_names"}) arrays[names] = {{1}, {}, {"crank"}, true};
  const MotionLog archive = readLog(directory.write("log.npz", formatArchive(arrays)), wanted);
  CHECK(archive.isHeld(archive.find("u.crank")));
  CHECK(archive.values(1, archive.find("u.crank")) == 8);
  CHECK(archive.values(2, archive.find("v.crank")) == 6);
  arrays["v"].shape = {1, 3};
  CHECK_THAT(getError([&] { readLog(directory.write("bad.npz", formatArchive(arrays)), wanted); }),
             Catch::Contains("array 'v': its shape does not match"));
}
