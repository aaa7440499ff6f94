// The world of MuJoCo: the trials of all worlds, and what is particular to it.
#include <catch2/catch.hpp>
#include <filesystem>
#include <iomanip>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "bielle/worlds/bielle_world.h"
#include "count_allocations.h"
#include "edge_trials.h"
#include "load_mujoco.h"
#include "robot_directory.h"
#include "selection.h"
#include "world_trials.h"
#include "worlds/made_ground.h"
#include "worlds/mujoco_model.h"
#include "worlds/mujoco_world.h"

namespace bielle::worlds {
namespace {

// Measured: 1.4e-3 (half a step of free fall is missing from the work of gravity), 6e-8 and 9e-8 m.
constexpr testing::TrialTolerances kMujocoTolerances{0.005, 1e-6, 1e-6};

Inertia makeBob() {
  Inertia inertia;
  inertia.mass = 1;
  inertia.I_com = 0.5 * Matrix3d::Identity();
  return inertia;
}

// As stiff as its steps allow.
std::unique_ptr<World> makeFineWorld(const Model& model, double time_step) {
  MujocoWorldOptions options;
  options.world.time_step = time_step;
  options.robot.closure_time = 2 * time_step;
  return makeMujocoWorld(model, options);
}

}  // namespace

TEST_CASE("mujoco world: a robot stands") {
  const Model model = loadRobot("bipetto").model;
  testing::checkStanding(*makeMujocoWorld(model), model, kMujocoTolerances);
}

TEST_CASE("mujoco world: a robot is dropped, and the books balance") {
  const Model model = loadRobot("bipetto").model;
  testing::checkDropped(*makeMujocoWorld(model), model, kMujocoTolerances);
}

TEST_CASE("mujoco world: a robot is pushed, and the work of the push is booked") {
  const Model model = loadRobot("bipetto").model;
  testing::checkPushed(*makeMujocoWorld(model), model, kMujocoTolerances);
}

TEST_CASE("mujoco world: springs and dampers between points move a linkage, and are booked") {
  const Model model = testing::makeSprungFivebar();
  const double coarse = testing::checkSprung(*makeFineWorld(model, 5e-5), model, 5e-3),
               fine = testing::checkSprung(*makeFineWorld(model, 1.25e-5), model, 5e-3);
  CAPTURE(coarse, fine);
  CHECK(fine < 5e-4);
  CHECK(fine < 0.35 * coarse);  // first order: a quarter
}

TEST_CASE("mujoco world: a robot stands on a box that is turned and inclined, one of hundreds") {
  const Model model = loadRobot("bipetto").model;
  const PostureHold posture(model);
  MujocoWorldOptions options;
  options.world.ground.height = -0.2;
  for (int i = 0; i < 300; ++i) options.world.ground.steps.push_back({{2 + 0.1 * i, 0, 1}, 0.1, 0.1, 0, 0, 0});
  options.world.ground.steps.push_back({{0.02, 0, 0.15}, 1, 1, 0.4, 0.02, -0.01});
  VectorXd q = posture.posture();
  q[2] += 0.17;
  const auto world = makeMujocoWorld(model, options);
  world->reset(q, VectorXd::Zero(model.nv()));
  REQUIRE(testing::hold(*world, posture, 1));
  double load = 0;
  Workspace ws(model);
  updatePositions(model, ws, world->configuration());
  for (size_t c = 0; c < model.contacts().size(); ++c) {
    const ContactFrame& contact = model.contacts()[c];
    const SE3 X_WF = getPlacement(ws, contact.body, contact.X_BF);
    CHECK(X_WF.p.z() == Approx(options.world.ground.calcHeight(X_WF.p.x(), X_WF.p.y())).margin(2e-3));
    load += (X_WF.R * world->feet()[c].wrench.head<3>()).z();
  }
  CHECK(load == Approx(model.mass() * model.gravity().norm()).epsilon(0.02));
}

TEST_CASE("mujoco world: soles and edges rest on the side of a step", "[sweep]") {
  testing::checkOverhangs([](const Model& model, const WorldOptions& options) {
    return makeMujocoWorld(model, {options, {}});
  });
}

TEST_CASE("mujoco world: in a scene of one's own, soles and edges of an exported file rest on the side of a step",
          "[sweep]") {
  bielle::testing::Selection selection(9);
  for (const testing::EdgeTrial& trial : testing::makeEdgeTrials(300)) {
    if (selection.isLeftOut()) continue;
    const ContactFrame& foot = trial.model.contacts()[0];
    CAPTURE(trial.step.top.transpose(), trial.step.length, trial.step.width, trial.step.yaw, trial.q.transpose(),
            foot.half_length, foot.half_width);
    MjcfOptions options;
    options.ground_height = trial.step.top.z() - 0.3;
    std::string xml = formatMjcf(trial.model, trial.model.makeNeutral(), options).xml;
    std::ostringstream box;
    box << std::setprecision(17) << "<geom type=\"box\" pos=\"" << trial.step.top.x() << ' ' << trial.step.top.y()
        << ' ' << trial.step.top.z() - 0.5 << "\" euler=\"0 0 " << trial.step.yaw << "\" size=\""
        << trial.step.length / 2 << ' ' << trial.step.width / 2 << " 0.5\"/>";
    xml.insert(xml.find("</worldbody>"), box.str());
    const bielle::testing::RobotDirectory directory;
    const auto mj = bielle::testing::loadMujoco(directory.write("scene.xml", xml));
    const bielle::testing::MjData data(mj_makeData(mj.get()), mj_deleteData);
    // MuJoCo's quaternions begin with their real part.
    const VectorXd start = (VectorXd(7) << trial.q.head<3>(), trial.q[6], trial.q.segment<3>(3)).finished();
    VectorXd::Map(data->qpos, 7) = start;
    // Counted, since MuJoCo begins anew, at 0, where a state is not finite.
    for (int steps = int(0.3 / mj->opt.timestep); steps > 0; --steps) mj_step(mj.get(), data.get());
    const VectorXd end = VectorXd::Map(data->qpos, 7);
    CHECK((end - start).head<3>().norm() < 1e-3);
    CHECK(2 * (end - start).tail<4>().norm() < 0.01);
    CHECK(data->ncon > 0);
  }
}

TEST_CASE("mujoco world: a sole bears the same moment about its normal on level ground and on steps") {
  testing::checkTwists([](const Model& model, const WorldOptions& options) {
    return makeMujocoWorld(model, {options, {}});
  });
}

TEST_CASE("mujoco world: a sole stops at the side of a step") {
  testing::checkRisers([](const Model& model, const WorldOptions& options) {
    return makeMujocoWorld(model, {options, {}});
  });
}

TEST_CASE("mujoco world: a ground of more boxes under the soles than it can have is refused") {
  const Model model = loadRobot("bipetto").model;
  MujocoWorldOptions options;
  options.world.ground = makeTiles({0.001, 0.01, -0.5, 1, 1, 1});
  const auto world = makeMujocoWorld(model, options);
  world->reset(makeStandingPosture(model), VectorXd::Zero(model.nv()));
  CHECK(!world->advance(1e-3));
  CHECK(world->message().find("boxes") != std::string::npos);
}

TEST_CASE("mujoco world: it advances without allocation") {
  const Model model = loadRobot("bipetto").model;
  const PostureHold posture(model);
  MujocoWorldOptions options;
  options.world.ground = makeTiles({0.001, 0.25, -1, 2, 2, 1});
  const auto world = makeMujocoWorld(model, options);
  VectorXd q = posture.posture();
  q[2] += 0.002;
  world->reset(q, VectorXd::Zero(model.nv()));
  const VectorXd u = posture.calcTorques(*world);
  const long before = num_allocations;
  bool advanced = true;
  for (int i = 0; i < 50; ++i) {
    world->setTorques(u);
    world->setPush(Vector3d(5, 0, 0));
    advanced = advanced && world->advance(1e-3);
  }
  const long allocations = num_allocations - before;
  CHECK(advanced);
  CHECK(world->feet()[0].touches);
  CHECK(allocations == 0);
}

TEST_CASE("mujoco world: a four-bar that falls conserves its energy the better, the shorter the steps") {
  const Model model = loadRobot("fourbar").model;
  const VectorXd q = findClosedConfiguration(model).q;
  const auto calcErrors = [&](double time_step) {
    const auto world = makeFineWorld(model, time_step);
    world->reset(q, VectorXd::Zero(model.nv()));
    const Books start = world->books();
    double energy = 0, kinetic = 0, gap = 0;
    for (int i = 0; i < 100; ++i) {
      REQUIRE(world->advance(0.01));
      const Books books = world->books();
      energy = std::max(energy, std::abs(books.energy() - start.energy()));
      kinetic = std::max(kinetic, books.kinetic);
      gap = std::max(gap, world->gap());
    }
    return Eigen::Array3d(energy / kinetic, kinetic, gap);
  };
  const Eigen::Array3d coarse = calcErrors(2e-4), fine = calcErrors(5e-5);
  CAPTURE(coarse.transpose(), fine.transpose());
  CHECK(fine[0] < 5e-4);
  CHECK(fine[0] < 0.35 * coarse[0]);  // first order: a quarter
  CHECK(fine[1] == Approx(coarse[1]).epsilon(0.01));
  CHECK(fine[2] < 2e-6);
}

TEST_CASE("mujoco world: linkages without contact move as in the world of Bielle, the closer the shorter the steps") {
  for (const char* name : {"delta", "fivebar", "fourbar_chain"}) {
    const Model model = loadRobot(name).model;
    const VectorXd q = findClosedConfiguration(model).q, u = VectorXd::Constant(model.nu(), 0.05);
    const auto run = [&](World& world) {
      world.reset(q, VectorXd::Zero(model.nv()));
      world.setTorques(u);
      REQUIRE(world.advance(0.2));
      CHECK(world.gap() < 1e-6);
      return VectorXd(world.configuration());
    };
    BielleWorldOptions options;
    options.world.time_step = 2e-5;
    const VectorXd expected = run(*makeBielleWorld(model, options));
    const auto calcError = [&](double time_step) {
      return model.difference(expected, run(*makeFineWorld(model, time_step))).cwiseAbs().maxCoeff();
    };
    const double moved = model.difference(q, expected).cwiseAbs().maxCoeff();
    const double coarse = calcError(1e-4), fine = calcError(2.5e-5);
    CAPTURE(name, moved, coarse, fine);
    CHECK(moved > 0.1);
    CHECK(coarse < 2e-3 * moved);
    CHECK(fine < 0.4 * coarse);  // first order: a quarter
  }
}

TEST_CASE("mujoco world: a stop of a joint takes the energy that runs into it") {
  Joint joint;
  joint.name = "swing";
  joint.kind = JointKind::Revolute;
  joint.axis = Vector3d::UnitZ();
  JointLimits limits;
  limits.lower.setConstant(1, -1);
  limits.upper.setConstant(1, 0.2);
  ModelBuilder builder("pendulum");
  builder.addLink("bob", "world", joint, makeBob(), limits);
  const Model model = builder.build();
  const auto world = makeMujocoWorld(model);
  world->reset(VectorXd::Zero(1), VectorXd::Constant(1, 2));
  const Books start = world->books();
  REQUIRE(world->advance(0.09));
  CHECK(world->configuration()[0] == Approx(0.18));
  CHECK(world->books().stop_loss == 0);
  REQUIRE(world->advance(0.2));
  const Books end = world->books();
  CHECK(world->configuration()[0] < 0.2 + 1e-3);
  CHECK(end.kinetic < 0.01 * start.kinetic);
  CHECK(end.stop_loss == Approx(start.kinetic - end.kinetic).epsilon(1e-6));
}

TEST_CASE("mujoco world: a push in the air gives the robot its impulse and its work") {
  const Model model = loadRobot("bipetto").model;
  VectorXd q = makeStandingPosture(model);
  q[2] += 5;
  const auto world = makeFineWorld(model, 2e-5);
  world->reset(q, VectorXd::Zero(model.nv()));
  const Books start = world->books();
  const Vector3d push(100, -60, 30);
  world->setPush(push);
  REQUIRE(world->advance(0.2));
  world->setPush(Vector3d::Zero());
  REQUIRE(world->advance(0.1));
  Workspace ws(model);
  updatePositions(model, ws, world->configuration());
  updateVelocities(model, ws, world->velocity());
  const Vector3d expected = push * 0.2 + model.mass() * model.gravity() * 0.3;
  CHECK((model.mass() * calcComVelocity(model, ws) - expected).norm() < 0.01 * expected.norm());
  const Books books = world->books();
  CHECK(books.push_work > 1);
  CHECK(books.contact_loss == 0);
  CHECK(testing::calcBalanceError(start, books) < 0.01);
  for (const FootReport& foot : world->feet()) {
    CHECK(!foot.touches);
    CHECK(foot.wrench.isZero(0));
  }
}

TEST_CASE("mujoco world: reset takes a state as it is, and the same torques make the same motion") {
  const Model model = loadRobot("cleobot").model;
  const VectorXd q = makeStandingPosture(model);
  const auto world = makeMujocoWorld(model);
  VectorXd ends[2];
  for (VectorXd& end : ends) {
    world->reset(q, VectorXd::Zero(model.nv()));
    CHECK(world->time() == 0);
    CHECK(world->configuration() == q);
    CHECK(world->books().motor_work == 0);
    REQUIRE(testing::hold(*world, PostureHold(model), 0.2));
    end = world->configuration();
  }
  CHECK(ends[0] == ends[1]);
}

TEST_CASE("mujoco world: torques are cut at the limits of the motors") {
  Joint joint;
  joint.name = "swing";
  joint.kind = JointKind::Revolute;
  joint.axis = Vector3d::UnitZ();  // gravity does nothing
  ModelBuilder builder("pendulum");
  builder.addLink("bob", "world", joint, makeBob());
  builder.addMotor("swing", 0, 2);
  const Model model = builder.build();
  const auto world = makeMujocoWorld(model);
  world->reset(VectorXd::Zero(1), VectorXd::Zero(1));
  world->setTorques(VectorXd::Constant(1, -10));
  CHECK(world->torques()[0] == -2);
  REQUIRE(world->advance(0.1));
  CHECK(world->velocity()[0] == Approx(-2 * 0.1 / 0.5).epsilon(1e-9));
  CHECK(world->books().motor_work == Approx(world->books().kinetic).epsilon(1e-9));
}

TEST_CASE("mujoco world: a world that breaks off says so, keeps its last state and leaves no file behind") {
  const Model model = loadRobot("fourbar").model;
  const VectorXd q = findClosedConfiguration(model).q;
  const auto world = makeMujocoWorld(model);
  world->reset(q, VectorXd::Zero(model.nv()));
  world->setTorques(VectorXd::Constant(model.nu(), std::numeric_limits<double>::quiet_NaN()));
  CHECK(!world->advance(0.01));
  CHECK(world->message().find("torques") != std::string::npos);
  CHECK(world->configuration() == q);
  CHECK(!world->advance(0.01));
  world->reset(q, VectorXd::Zero(model.nv()));
  CHECK(world->message().empty());
  CHECK(world->advance(0.01));
  CHECK_THROWS_AS(mju_error("an error of the engine"), std::runtime_error);
  CHECK(!std::filesystem::exists("MUJOCO_LOG.TXT"));
}

}  // namespace bielle::worlds
