// References for learning: MuJoCo, set to each frame, has the bodies, velocities and closed loops that the file has.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/model/names.h"
#include "bielle/robots/robot_loader.h"
#include "load_mujoco.h"
#include "mechanisms.h"
#include "results/npz.h"
#include "results/reference_motion.h"
#include "robot_directory.h"
#include "worlds/mujoco_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kFrameTolerance = 1e-9;

// Closed states of a robot that swings about a posture, at uneven times, with an impact in the middle.
MotionRecord makeSwing(const Model& model, ConstVectorRef q_ref, int nodes) {
  std::mt19937 rng(4);
  VectorXd way = randomVector(rng, model.nv(), 0.2);
  MotionRecord record;
  record.time.resize(nodes);
  record.q.resize(nodes, model.nq());
  record.v.resize(nodes, model.nv());
  record.u = RowMatrixXd::Random(nodes - 1, model.nu());
  Workspace ws(model);
  const ConstraintSet loops = makeConstraintSet(model);
  const auto close = [&](double t) {
    const AssemblyResult closed = closeConfiguration(model, model.integrate(q_ref, std::sin(3 * t) * way));
    REQUIRE(closed.status == NumericalStatus::Ok);
    return closed.q;
  };
  double time = 0;
  for (int k = 0; k < nodes; ++k) {
    constexpr double kStep = 1e-5;
    record.time[k] = time;
    record.q.row(k) = close(time).transpose();
    const VectorXd v = model.difference(close(time - kStep), close(time + kStep)) / (2 * kStep);
    record.v.row(k) = projectVelocity(model, ws, loops, record.q.row(k).transpose(), v).transpose();
    if (k != nodes / 2) time += k % 2 == 0 ? 0.011 : 0.017;
  }
  return record;
}

// As trainers do: the first body from its place and twist in the world, the other coordinates from the joints.
void setFrame(const ReferenceMotion& motion, Eigen::Index k, bool is_free, const mjModel& mj, mjData& data) {
  VectorXd qpos(mj.nq), qvel(mj.nv);
  if (is_free) {
    const Eigen::Vector4d wxyz = motion.body_quat.row(k).head<4>().transpose();
    const Matrix3d R = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).toRotationMatrix();
    qpos << motion.body_pos.row(k).head<3>().transpose(), wxyz, motion.joint_pos.row(k).transpose();
    qvel << motion.body_lin_vel.row(k).head<3>().transpose(),
        R.transpose() * motion.body_ang_vel.row(k).head<3>().transpose(), motion.joint_vel.row(k).transpose();
  } else {
    qpos = motion.joint_pos.row(k).transpose();
    qvel = motion.joint_vel.row(k).transpose();
  }
  VectorXd::Map(data.qpos, mj.nq) = qpos;
  VectorXd::Map(data.qvel, mj.nv) = qvel;
  mj_fwdPosition(&mj, &data);
  mj_fwdVelocity(&mj, &data);
}

// The largest difference of a frame from what MuJoCo has; m, rad, and their rates.
double calcFrameError(const ReferenceMotion& motion, Eigen::Index k, const mjModel& mj, mjData& data) {
  double error = 0;
  for (int i = 1; i < mj.nbody; ++i) {
    const Eigen::Index b = i - 1;
    Vector6d twist;  // angular first
    mj_objectVelocity(&mj, &data, mjOBJ_XBODY, i, twist.data(), 0);
    const Eigen::Vector4d quat = VectorXd::Map(data.xquat + 4 * i, 4),
                          ours = motion.body_quat.row(k).segment<4>(4 * b).transpose();
    error = std::max({error,
                      (Vector3d::Map(data.xpos + 3 * i) - motion.body_pos.row(k).segment<3>(3 * b).transpose()).norm(),
                      std::min((quat - ours).norm(), (quat + ours).norm()),
                      (twist.tail<3>() - motion.body_lin_vel.row(k).segment<3>(3 * b).transpose()).norm(),
                      (twist.head<3>() - motion.body_ang_vel.row(k).segment<3>(3 * b).transpose()).norm()});
    mj_objectVelocity(&mj, &data, mjOBJ_BODY, i, twist.data(), 0);  // at the centre of mass
    error = std::max(error, (twist.tail<3>() - motion.body_com_vel.row(k).segment<3>(3 * b).transpose()).norm());
  }
  // Rows of loops: how far they are open, and how fast they open.
  const VectorXd rates = VectorXd::Map(data.efc_vel, data.nefc);
  for (int i = 0; i < data.ne; ++i) error = std::max({error, std::abs(data.efc_pos[i]), std::abs(rates[i])});
  return error;
}

}  // namespace

TEST_CASE("MuJoCo has the bodies of a reference where the file has them, and its loops are closed") {
  for (const char* name : {"bipetto", "kangaroo", "rsu_biped", "cleobot", "belt_biped", "fourbar", "delta"}) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    const VectorXd q_ref = findClosedConfiguration(model).q;
    const MotionRecord record = makeSwing(model, q_ref, 13);
    ReferenceMotion motion = makeReferenceMotion(model, q_ref, record, 60);
    const MjModel mj = loadHinges(model, q_ref);
    const MjData data(mj_makeData(mj.get()), mj_deleteData);
    const bool is_free = model.hasFreeFlyer();
    REQUIRE(motion.joint_names.size() + is_free == static_cast<size_t>(mj->njnt));
    for (int i = is_free; i < mj->njnt; ++i)
      CHECK(motion.joint_names[i - is_free] == mj_id2name(mj.get(), mjOBJ_JOINT, i));
    for (int i = 1; i < mj->nbody; ++i) CHECK(motion.body_names[i - 1] == mj_id2name(mj.get(), mjOBJ_BODY, i));
    REQUIRE(motion.joint_pos.rows() == 10);  // 0.157 s
    for (Eigen::Index k = 0; k < motion.joint_pos.rows(); ++k) {
      setFrame(motion, k, is_free, *mj, *data);
      CHECK(calcFrameError(motion, k, *mj, *data) < kFrameTolerance);
    }
    // Another number is noticed.
    for (RowMatrixXd* table : {&motion.joint_pos, &motion.joint_vel, &motion.body_pos, &motion.body_quat,
                               &motion.body_lin_vel, &motion.body_ang_vel, &motion.body_com_vel}) {
      double& entry = (*table)(3, table->cols() - 1);
      entry += 1e-3;
      setFrame(motion, 3, is_free, *mj, *data);
      CHECK(calcFrameError(motion, 3, *mj, *data) > kFrameTolerance);
      entry -= 1e-3;
    }
  }
}

TEST_CASE("Frames of a reference are the nodes where they meet, and velocities are the rates of positions") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q_ref = findClosedConfiguration(model).q;
  const MotionRecord record = makeSwing(model, q_ref, 13);
  const ReferenceMotion motion = makeReferenceMotion(model, q_ref, record, 1000);
  REQUIRE(motion.joint_pos.rows() == 158);  // 0.157 s
  const Eigen::Index joints = motion.joint_pos.cols();
  for (Eigen::Index k = 0; k < record.time.size(); ++k) {
    const Eigen::Index frame = std::lround(1000 * record.time[k]);
    const VectorXd qpos = calcMjcfQpos(model, q_ref, record.q.row(k).transpose(), MjcfRotations::Hinges).tail(joints);
    CHECK((motion.joint_pos.row(frame).transpose() - qpos).norm() < 1e-10);
    // The torques of the stage that begins there: of the one behind an impact.
    const Eigen::Index stage = k == 6 ? 7 : std::min(k, record.u.rows() - 1);
    CHECK(motion.motor_torque.row(frame) == record.u.row(stage));
  }
  // The cubic and the straight line differ by the square of the step.
  const RowMatrixXd rates = (motion.joint_pos.bottomRows(156) - motion.joint_pos.topRows(156)) * 500;
  const double largest = motion.joint_vel.cwiseAbs().maxCoeff();
  CHECK((rates - motion.joint_vel.middleRows(1, 156)).cwiseAbs().maxCoeff() < 0.02 * largest);
}

TEST_CASE("Velocities of a format are the rates of the point that it declares, and quaternions have its order") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q_ref = findClosedConfiguration(model).q;
  const ReferenceMotion motion = makeReferenceMotion(model, q_ref, makeSwing(model, q_ref, 13), 1000);
  const RobotDirectory directory;
  struct Format {
    ReferenceFormat format;
    int isaac_lab;
    std::string position, quaternion, linear, angular;
    bool of_com, scalar_last;
  };
  const std::vector<std::string> of_amp = {"body_positions", "body_rotations", "body_linear_velocities",
                                           "body_angular_velocities"},
                                 of_mjlab = {"body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w"};
  const auto make = [](ReferenceFormat format, int version, const std::vector<std::string>& names) {
    const bool is_isaac = format != ReferenceFormat::Mjlab;
    return Format{format, version, names[0], names[1], names[2], names[3], is_isaac, is_isaac && version == 3};
  };
  for (const Format& f : {make(ReferenceFormat::Mjlab, 2, of_mjlab), make(ReferenceFormat::Amp, 2, of_amp),
                          make(ReferenceFormat::Amp, 3, of_amp), make(ReferenceFormat::BeyondMimic, 2, of_mjlab),
                          make(ReferenceFormat::BeyondMimic, 3, of_mjlab)}) {
    CAPTURE(f.linear, f.isaac_lab, f.of_com);
    NpyArrays arrays =
        readArchive(directory.write("reference.npz", formatReferenceMotion(motion, f.format, f.isaac_lab)));
    CHECK(arrays.count("isaac_lab") == f.of_com);
    if (f.of_com) CHECK(arrays["isaac_lab"].numbers == std::vector<double>{static_cast<double>(f.isaac_lab)});
    const size_t bodies = motion.body_names.size();
    const auto get = [&](const std::string& name, size_t frame, size_t body) {
      return Vector3d(Vector3d::Map(arrays[name].numbers.data() + 3 * (frame * bodies + body)));
    };
    // \param as_com, scalar_last  how a reader takes the file
    const auto calcError = [&](bool as_com, bool scalar_last) {
      const auto getRotation = [&](size_t frame, size_t body) {
        const double* x = arrays[f.quaternion].numbers.data() + 4 * (frame * bodies + body);
        return (scalar_last ? Eigen::Quaterniond(x[3], x[0], x[1], x[2]) : Eigen::Quaterniond(x[0], x[1], x[2], x[3]))
            .toRotationMatrix();
      };
      const std::vector<int> order = listMjcfBodies(model);
      double error = 0;
      for (size_t k = 1; k + 1 < arrays[f.position].shape[0]; ++k)
        for (size_t b = 0; b < bodies; ++b) {
          const Vector3d point = as_com ? model.bodies()[order[b]].inertia.com : Vector3d::Zero();
          const auto place = [&](size_t frame) -> Vector3d {
            return get(f.position, frame, b) + getRotation(frame, b) * point;
          };
          const Eigen::AngleAxisd turn(getRotation(k + 1, b) * getRotation(k - 1, b).transpose());
          error = std::max({error, ((place(k + 1) - place(k - 1)) * 500 - get(f.linear, k, b)).norm(),
                            (turn.angle() * turn.axis() * 500 - get(f.angular, k, b)).norm()});
        }
      return error;
    };
    const double right = calcError(f.of_com, f.scalar_last);
    CHECK(right < 0.03);  // m/s, rad/s: the cubic and the straight line differ by the square of the step
    CHECK(calcError(!f.of_com, f.scalar_last) > 2 * right);
    CHECK(calcError(f.of_com, !f.scalar_last) > 2 * right);
  }
}

TEST_CASE("References are archives with the names and shapes of their readers") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q_ref = findClosedConfiguration(model).q;
  const ReferenceMotion motion = makeReferenceMotion(model, q_ref, makeSwing(model, q_ref, 5), 50);
  const size_t frames = 3, joints = motion.joint_names.size(), bodies = motion.body_names.size();
  const RobotDirectory directory;
  for (const auto& [format, names] :
       {std::pair(ReferenceFormat::Mjlab,
                  std::vector<std::string>{"joint_names", "joint_pos", "joint_vel", "body_pos_w", "body_quat_w",
                                           "body_lin_vel_w", "body_ang_vel_w"}),
        std::pair(ReferenceFormat::Amp,
                  std::vector<std::string>{"dof_names", "dof_positions", "dof_velocities", "body_positions",
                                           "body_rotations", "body_linear_velocities", "body_angular_velocities"})}) {
    NpyArrays arrays = readArchive(directory.write("reference.npz", formatReferenceMotion(motion, format)));
    CHECK(arrays.size() == (format == ReferenceFormat::Amp ? 12 : 11));
    CHECK(arrays["fps"].numbers == std::vector<double>{50});
    CHECK(arrays["fps"].shape == (format == ReferenceFormat::Amp ? std::vector<size_t>{} : std::vector<size_t>{1}));
    CHECK(arrays[names[0]].texts == motion.joint_names);
    CHECK(arrays["body_names"].texts == motion.body_names);
    CHECK(arrays["motor_names"].texts == getNames(model.motors()));
    for (size_t i : {1, 2}) CHECK(arrays[names[i]].shape == std::vector<size_t>{frames, joints});
    for (size_t i : {3, 5, 6}) CHECK(arrays[names[i]].shape == std::vector<size_t>{frames, bodies, 3});
    CHECK(arrays[names[4]].shape == std::vector<size_t>{frames, bodies, 4});
    CHECK(arrays["motor_torque"].shape == std::vector<size_t>{frames, static_cast<size_t>(model.nu())});
    CHECK(arrays[names[3]].numbers[3 * bodies + 1] == motion.body_pos(1, 1));
  }
  MotionRecord still = makeSwing(model, q_ref, 5);
  still.time.setZero();
  CHECK_THROWS_WITH(makeReferenceMotion(model, q_ref, still, 50), Catch::Contains("it takes no time"));
}

TEST_CASE("A reference of a cycle has its period in whole frames, and what it takes to repeat it") {
  const Model model = loadRobot("bipetto").model;
  const VectorXd q_ref = findClosedConfiguration(model).q;
  MotionRecord record = makeSwing(model, q_ref, 21);
  const double period = record.time.tail(1)[0];
  record.cycle = Eigen::Vector4d(period, 0.4, -0.1, 0.2);
  const ReferenceMotion motion = makeReferenceMotion(model, q_ref, record, 50);
  const double frames = std::round(50 * period);
  REQUIRE(std::abs(frames - 50 * period) > 0.01);  // so that there is something to do
  CHECK(motion.rate == Approx(frames / period));
  CHECK(motion.joint_pos.rows() == static_cast<Eigen::Index>(frames) + 1);
  REQUIRE(motion.warnings.size() >= 1);
  CHECK_THAT(motion.warnings.front(), Catch::Contains("frames per second"));
  const RobotDirectory directory;
  NpyArrays arrays = readArchive(directory.write("cycle.npz", formatReferenceMotion(motion, ReferenceFormat::Amp)));
  CHECK(arrays["loop_mode"].texts == std::vector<std::string>{"wrap"});
  CHECK(arrays["period"].numbers == std::vector<double>{period});
  CHECK(arrays["cycle_offset"].numbers == std::vector<double>{0.4, -0.1, 0.2});
}
