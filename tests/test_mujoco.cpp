// A robot written for MuJoCo is the same robot there: mass matrix, bias and closures agree, and wrong numbers show.
#include <catch2/catch.hpp>
#include <filesystem>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/robots/robot_loader.h"
#include "load_mujoco.h"
#include "mechanisms.h"
#include "published_robots.h"
#include "robot_directory.h"
#include "worlds/mujoco_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kTolerance = 1e-10;

// Largest relative differences over random states near q_ref.
struct Difference {
  double mass_matrix = 0, bias = 0;
};

Difference compare(const Model& model, const MujocoModel& mujoco, ConstVectorRef q_ref) {
  std::mt19937 rng(3);
  const auto data = mujoco.makeData();
  Workspace ws(model);
  Difference worst;
  for (int i = 0; i < 5; ++i) {
    const VectorXd q = model.integrate(q_ref, randomVector(rng, model.nv(), 0.5)), v = randomVector(rng, model.nv());
    mujoco.setState(q, v, *data);
    mj_fwdPosition(mujoco.get(), data.get());
    mj_fwdVelocity(mujoco.get(), data.get());
    updatePositions(model, ws, q);
    updateVelocities(model, ws, v);
    updateMassMatrix(model, ws);
    updateBias(model, ws);
    worst.mass_matrix = std::max(worst.mass_matrix, calcRelativeError(mujoco.calcMassMatrix(*data), ws.M));
    worst.bias = std::max(worst.bias, calcRelativeError(mujoco.calcBias(*data), ws.b));
  }
  return worst;
}

// Largest residual of MuJoCo's equality constraints at q, m or rad.
double calcGap(const Model& model, const MujocoModel& mujoco, mjData& data, ConstVectorRef q) {
  mujoco.setState(q, VectorXd::Zero(model.nv()), data);
  mj_fwdPosition(mujoco.get(), &data);
  double gap = 0;
  for (int i = 0; i < data.ne; ++i) gap = std::max(gap, std::abs(data.efc_pos[i]));
  return gap;
}

Mechanism makeMechanism(JointKind joint, ClosureKind closure, MechanismBase base, unsigned seed) {
  std::mt19937 rng(seed);
  return makeRandomMechanism(rng, joint, closure, base);
}

}  // namespace

TEST_CASE("MuJoCo has the mass matrix and the bias of every robot") {
  for (const char* published : {"battobot_6d", "digit_like_2legs"}) findPublished(published);  // warns without them
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    const AssemblyResult closed = findClosedConfiguration(model);
    const Difference worst = compare(model, MujocoModel(model, closed.q), closed.q);
    CHECK(worst.mass_matrix < kTolerance);
    CHECK(worst.bias < kTolerance);
  }
}

TEST_CASE("MuJoCo has the mass matrix, the bias and the closures of every joint and closure kind") {
  unsigned seed = 0;
  for (const MechanismKind& kind : listMechanismKinds()) {
    if (kind.closure == ClosureKind::Slider) continue;  // which MuJoCo does not have
    const Mechanism mechanism = makeMechanism(kind.joint, kind.closure, kind.base, ++seed);
    const Model& model = mechanism.model;
    CAPTURE(kind);
    const MujocoModel mujoco(model, mechanism.q_closed);
    const Difference worst = compare(model, mujoco, mechanism.q_closed);
    CHECK(worst.mass_matrix < kTolerance);
    CHECK(worst.bias < kTolerance);
    // Elsewhere on the closed manifold MuJoCo's loops are closed too, and beside it they are open.
    std::mt19937 rng(seed);
    const auto data = mujoco.makeData();
    const VectorXd apart = model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.2));
    const AssemblyResult closed = closeConfiguration(model, apart);
    REQUIRE(closed.status == NumericalStatus::Ok);
    CHECK(model.difference(mechanism.q_closed, closed.q).norm() > 0.01);
    CHECK(calcGap(model, mujoco, *data, closed.q) < 1e-10);
    CHECK(calcGap(model, mujoco, *data, apart) > 1e-3);
  }
}

TEST_CASE("MuJoCo starts at the closed configuration, and the references are its keyframes") {
  for (const char* name : {"bipetto", "cleobot", "rsu_biped", "belt_biped"}) {
    const Model model = loadRobot(name).model;
    const VectorXd q_ref = findClosedConfiguration(model).q;
    const MujocoModel mujoco(model, q_ref);
    const mjModel& mj = *mujoco.get();
    const auto data = mujoco.makeData();
    VectorXd q(model.nq()), v(model.nv());
    mujoco.getState(*data, q, v);
    CHECK(model.difference(q_ref, q).norm() < 1e-14);
    REQUIRE(mj.nkey == static_cast<int>(model.references().size()));
    for (const Reference& reference : model.references()) {
      CAPTURE(name, reference.name);
      mj_resetDataKeyframe(&mj, data.get(), mj_name2id(&mj, mjOBJ_KEY, reference.name.c_str()));
      mujoco.getState(*data, q, v);
      CHECK(model.difference(assembleReference(model, reference.name).q, q).norm() < 1e-14);
      CHECK(calcGap(model, mujoco, *data, q) < 1e-10);
    }
  }
}

TEST_CASE("a robot that nobody drives falls with its loops closed") {
  for (const char* name :
       {"bipetto", "cleobot", "rsu_biped", "belt_biped", "spring_leg", "spring_biped", "delta", "fourbar_chain"}) {
    const Model model = loadRobot(name).model;
    const MujocoModel mujoco(model, findClosedConfiguration(model).q);
    const auto data = mujoco.makeData();
    double gap = 0;
    while (data->time < 0.5) {
      mj_step(mujoco.get(), data.get());
      for (int i = 0; i < data->ne; ++i) gap = std::max(gap, std::abs(data->efc_pos[i]));
    }
    CAPTURE(name, gap);
    CHECK(data->warning[mjWARN_BADQACC].number == 0);
    CHECK(gap < 2e-4);
    CHECK(Eigen::Map<const VectorXd>(data->qvel, model.nv()).norm() > 0.1);
  }
}

TEST_CASE("a state comes back from MuJoCo as it was set, at the neutral configuration as well") {
  unsigned seed = 100;
  std::mt19937 rng(5);
  for (JointKind joint : kJointKinds) {
    const Mechanism mechanism = makeMechanism(joint, ClosureKind::Ball3D, MechanismBase::FreeFlyer, ++seed);
    const Model& model = mechanism.model;
    const MujocoModel mujoco(model, mechanism.q_closed);
    const auto data = mujoco.makeData();
    for (const VectorXd& q :
         {model.makeNeutral(), model.integrate(mechanism.q_closed, randomVector(rng, model.nv()))}) {
      const VectorXd v = randomVector(rng, model.nv());
      VectorXd q_back(model.nq()), v_back(model.nv());
      mujoco.setState(q, v, *data);
      mujoco.getState(*data, q_back, v_back);
      CHECK(model.difference(q, q_back).norm() < 1e-14);
      CHECK((v_back - v).norm() < 1e-14);
    }
  }
}

TEST_CASE("a mass, a moment, an armature, an axis or a gravity that is wrong by a thousandth shows") {
  const Mechanism mechanism = makeMechanism(JointKind::Planar, ClosureKind::Weld6D, MechanismBase::FreeFlyer, 7);
  const auto change = [&](const std::function<void(mjModel&)>& poison) {
    MujocoModel mujoco(mechanism.model, mechanism.q_closed);
    poison(*mujoco.get());
    return compare(mechanism.model, mujoco, mechanism.q_closed);
  };
  CHECK(change([](mjModel&) {}).bias < kTolerance);
  CHECK(change([](mjModel& m) { m.body_mass[4] *= 1.001; }).mass_matrix > 1e-6);
  CHECK(change([](mjModel& m) { m.body_inertia[3 * 4] *= 1.001; }).mass_matrix > 1e-7);
  CHECK(change([](mjModel& m) { m.body_ipos[3 * 4] *= 1.001; }).bias > 1e-7);
  CHECK(change([](mjModel& m) {
          for (int k = 0; k < m.nv; ++k) m.dof_armature[k] *= 1.001;
        }).mass_matrix > 1e-7);
  CHECK(change([](mjModel& m) { m.jnt_axis[3 * 5] += 0.001; }).mass_matrix > 1e-6);
  CHECK(change([](mjModel& m) { m.opt.gravity[2] *= 1.001; }).bias > 1e-6);
}

TEST_CASE("MuJoCo takes motors in their order, with their limits, joints with their ranges") {
  ModelBuilder builder("arm");
  Inertia inertia;
  inertia.mass = 1;
  inertia.I_com = 0.01 * Matrix3d::Identity();
  JointLimits limits;
  limits.lower.setConstant(1, -0.5);
  limits.upper.setConstant(1, 1.5);
  std::string parent = "world";
  for (const char* name : {"a & b", "c", "d"}) {
    Joint joint;
    joint.name = std::string("joint ") + name;
    joint.kind = JointKind::Revolute;
    joint.X_PJ.p = {0, 0, 0.3};
    builder.addLink(name, parent, joint, inertia, limits);
    parent = name;
  }
  builder.addMotor("joint d", 0.2, 7);
  builder.addMotor("joint a & b", 0.1);
  const Model model = builder.build();
  const MujocoModel mujoco(model, model.makeNeutral());
  const mjModel& mj = *mujoco.get();
  REQUIRE(mj.nu == 2);
  CHECK(mj_name2id(&mj, mjOBJ_ACTUATOR, "joint d") == 0);
  CHECK(mj.actuator_trnid[0] == mj_name2id(&mj, mjOBJ_JOINT, "joint d"));
  CHECK(mj.actuator_ctrlrange[0] == -7);
  CHECK(mj.actuator_ctrlrange[1] == 7);
  CHECK(mj.actuator_ctrllimited[1] == 0);
  CHECK(mj.jnt_range[0] == -0.5);
  CHECK(mj.jnt_range[1] == 1.5);
  CHECK(mujoco.getBody(1) == mj_name2id(&mj, mjOBJ_BODY, "a & b"));
}

namespace {

// A file of MuJoCo's language in most of what the reader reads (not fullinertia, whose principal axes MuJoCo finds to 2e-9): classes, angles in degrees, all orientations, bodies of
// several joints and of none, inertias by shapes, weld and connect.
const char* const kHandWritten = R"(<mujoco model="hand">
  <compiler eulerseq="zYx" autolimits="true"/>
  <option gravity="0.3 -0.2 -9.5"/>
  <default>
    <joint damping="0.3" armature="0.02"/>
    <geom density="700"/>
    <default class="leg">
      <joint armature="0.05" axis="0 1 0"/>
      <default class="foot"><geom type="box" size="0.1 0.05 0.02" mass="0.4"/></default>
    </default>
  </default>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="trunk" pos="0.1 0.2 0.7" euler="20 -30 40">
      <freejoint name="root"/>
      <inertial pos="0.01 0.02 0.1" mass="5" diaginertia="0.2 0.3 0.25"/>
      <site name="imu" pos="0 0 0.1" zaxis="1 2 3"/>
      <body name="hip" pos="0 0.1 -0.1" axisangle="1 1 0 25" childclass="leg">
        <joint name="roll" axis="1 0 0" pos="0.01 0.02 0.03" ref="10"/>
        <joint name="pitch" pos="0 0.01 0" range="-90 45" springref="15" stiffness="3"/>
        <joint name="stretch" type="slide" axis="0 0 -1" ref="0.05" armature="0.3"/>
        <geom type="capsule" fromto="0 0 0 0.02 0.01 -0.3" size="0.04"/>
        <geom type="ellipsoid" size="0.05 0.04 0.03" pos="0 0.03 -0.1" quat="0.7 0.1 0.3 -0.2"/>
        <body name="shin" pos="0.02 0.01 -0.3" xyaxes="1 0.1 0 0 1 0.2">
          <joint name="knee" pos="0.005 0 0.01" ref="-20"/>
          <geom type="cylinder" size="0.03 0.15" pos="0 0 -0.15" mass="1.1"/>
          <body name="plate" pos="0 0 -0.3" zaxis="0.1 0 1"><geom class="foot"/>
            <body name="toe" pos="0.1 0 0">
              <joint name="toe_ball" type="ball" pos="0 0.01 0" damping="0"/><geom size="0.03" type="sphere"/>
            </body>
          </body>
        </body>
      </body>
      <body name="rod" pos="0.1 0 -0.1">
        <joint name="rod_x" axis="1 0 0.5"/><joint name="rod_y" axis="0 1 0"/>
        <inertial pos="0 0 -0.2" mass="0.3" diaginertia="0.003 0.003 0.0005" euler="0 30 10"/>
        <body name="slider" pos="0 0 -0.3"><joint type="slide" name="slider"/>
          <inertial pos="0 0 0" mass="0.2" diaginertia="0.001 0.001 0.001"/></body>
      </body>
    </body>
  </worldbody>
  <equality>
    <connect name="tie" body1="slider" body2="shin" anchor="0.01 0.02 0.05"/>
    <weld name="glue" body1="plate" body2="rod" relpose="0.1 0.2 0.3 0.8 0.1 0.2 0.3" anchor="0.01 0.03 -0.02"/>
    <joint name="belt" joint1="knee" joint2="pitch" polycoef="0.1 -0.5 0 0 0"/>
    <joint name="cam" joint1="stretch" joint2="knee" polycoef="0.02 0.3 -0.5 0.2 0.7"/>
    <tendon name="pull" tendon1="both" tendon2="one" polycoef="0.05 0 0.4 -0.3 0.1"/>
  </equality>
  <tendon>
    <fixed name="both"><joint joint="roll" coef="1.5"/><joint joint="rod_x" coef="-0.7"/></fixed>
    <fixed name="one"><joint joint="stretch" coef="2"/></fixed>
  </tendon>
  <actuator><motor name="m" joint="knee" gear="5" ctrlrange="-3 3"/></actuator>
</mujoco>)";

}  // namespace

TEST_CASE("MuJoCo and the reader of its files read the same mechanism") {
  const RobotDirectory directory;
  const std::string path = directory.write("hand.xml", kHandWritten);
  const LoadedRobot robot = loadRobot(path);
  const Model& model = robot.model;
  const MjModel mj = loadMujoco(path);
  const MjData data(mj_makeData(mj.get()), mj_deleteData);
  REQUIRE(mj->nv == model.nv());
  REQUIRE(mj->nq == model.nq());
  REQUIRE(mj->njnt == model.numBodies() - 1);

  // Ours has the same joints with the same q, but for the order of quaternions and the frame of the free velocity.
  std::mt19937 rng(17);
  Workspace ws(model);
  double mass = 0, bias = 0, gap = 0, place = 0;
  for (int sample = 0; sample < 5; ++sample) {
    const VectorXd v = randomVector(rng, model.nv());
    const VectorXd q = model.integrate(model.makeNeutral(), randomVector(rng, model.nv(), 0.7));
    MatrixXd T = MatrixXd::Zero(model.nv(), model.nv());  // qvel = T v
    VectorXd rate = VectorXd::Zero(model.nv());           // dT/dt v
    for (int j = 0; j < mj->njnt; ++j) {
      const Joint& joint = model.joints()[model.findJoint(mj_id2name(mj.get(), mjOBJ_JOINT, j))];
      const VectorXd own = q.segment(joint.idx_q, joint.nq);
      VectorXd qpos = own;
      Eigen::Block<MatrixXd> block = T.block(mj->jnt_dofadr[j], joint.idx_v, joint.nv, joint.nv);
      block.setIdentity();
      if (joint.nq >= 4) qpos.tail<4>() << own[joint.nq - 1], own.segment<3>(joint.nq - 4);
      if (joint.nq == 7) {
        const Matrix3d R = Eigen::Quaterniond(Eigen::Vector4d(own.tail<4>())).toRotationMatrix();
        block.topLeftCorner<3, 3>() = R;
        const VectorXd w = v.segment(joint.idx_v, 6);
        rate.segment<3>(mj->jnt_dofadr[j]) = R * Vector3d(w.tail<3>()).cross(Vector3d(w.head<3>()));
      }
      Eigen::Map<VectorXd>(data->qpos + mj->jnt_qposadr[j], joint.nq) = qpos;
    }
    Eigen::Map<VectorXd>(data->qvel, mj->nv) = T * v;
    mj_forward(mj.get(), data.get());
    RowMatrixXd full(mj->nv, mj->nv);
    mj_fullM(mj.get(), full.data(), data->qM);
    updatePositions(model, ws, q);
    updateVelocities(model, ws, v);
    updateMassMatrix(model, ws);
    updateBias(model, ws);
    mass = std::max(mass, calcRelativeError(T.transpose() * full * T, ws.M));
    const Eigen::Map<VectorXd> force(data->qfrc_bias, mj->nv), passive(data->qfrc_passive, mj->nv),
        armature(mj->dof_armature, mj->nv);
    bias = std::max(
        bias, calcRelativeError(T.transpose() * (force - passive + full * rate - armature.cwiseProduct(rate)), ws.b));
    const int imu = model.findFrame("imu");
    const Vector3d site = getPlacement(ws, model.frames()[imu].body, model.frames()[imu].X_BF).p;
    place = std::max(place, (site - Eigen::Map<Vector3d>(data->site_xpos)).norm());
    // Rows of connect and weld hold the differences of positions; the next are rotations, in another measure.
    const auto tie = [&](const char* name) {
      const Closure& c = model.closures()[model.findClosure(name)];
      return Vector3d(getPlacement(ws, c.body1, c.X_B1).p - getPlacement(ws, c.body2, c.X_B2).p);
    };
    gap = std::max(gap, (tie("tie") - Eigen::Map<Vector3d>(data->efc_pos)).norm());
    gap = std::max(gap, (tie("glue") - Eigen::Map<Vector3d>(data->efc_pos + 3)).norm());
    int row = 9;
    for (const char* coupler : {"belt", "cam", "pull"}) {
      const double residual = -calcClosureResidual(ws, model.closures()[model.findClosure(coupler)])[0];
      gap = std::max(gap, std::abs(residual - data->efc_pos[row++]));
      CHECK(std::abs(residual) > 1e-3);
    }
  }
  CHECK(mass < kTolerance);
  CHECK(bias < kTolerance);
  CHECK(gap < kTolerance);
  CHECK(place < kTolerance);

  REQUIRE(model.nu() == 1);
  CHECK(model.motors()[0].effort_limit == 15);
  CHECK(model.lowerLimits()[model.joints()[model.findJoint("pitch")].idx_v] == Approx(-EIGEN_PI / 2).epsilon(1e-15));
  REQUIRE(robot.warnings.size() >= 2);
  const auto warns = [&](const std::string& text) {
    return std::any_of(robot.warnings.begin(), robot.warnings.end(),
                       [&](const std::string& w) { return w.find(text) != std::string::npos; });
  };
  CHECK(warns("what changes no mechanism is left out ("));
  CHECK(warns("<motor> (line 53): its input becomes the torque or force at its joint"));
}

TEST_CASE("MuJoCo's constraints give the ratio of an ankle whose rods spin on balls") {
  const RobotDirectory directory;
  const std::string path = directory.write("ankle.xml", R"(<mujoco model="ankle">
  <compiler angle="radian"/>
  <default><geom type="sphere" size="0.01" density="2000"/></default>
  <worldbody>
    <body name="c1" pos="-0.01 0.05 -0.1"><joint name="m1" axis="0 1 0"/><geom/>
      <body name="r1" pos="-0.05 0.006 0"><joint name="r1" type="ball"/><geom pos="0.01 0.02 -0.1"/></body></body>
    <body name="c2" pos="-0.01 -0.05 -0.15"><joint name="m2" axis="0 1 0"/><geom/>
      <body name="r2" pos="-0.05 -0.006 0"><joint name="r2" type="ball"/><geom pos="0 0.01 -0.1"/></body></body>
    <body name="cross" pos="0 0 -0.32"><joint name="pitch" axis="0 1 0"/><geom/>
      <body name="foot" pos="0 0 -0.01"><joint name="roll" axis="1 0 0"/><geom/></body></body>
  </worldbody>
  <equality>
    <connect body1="r1" body2="foot" anchor="-0.002 -0.004 -0.2"/>
    <connect body1="r2" body2="foot" anchor="-0.002 0.004 -0.15"/>
  </equality>
  <actuator><motor joint="m1"/><motor joint="m2"/></actuator>
</mujoco>)");
  const Model model = loadRobot(path).model;
  const MjModel mj = loadMujoco(path);
  const MjData data(mj_makeData(mj.get()), mj_deleteData);
  REQUIRE(mj->nv == model.nv());
  const auto getDof = [&](const char* joint) { return mj->jnt_dofadr[mj_name2id(mj.get(), mjOBJ_JOINT, joint)]; };
  const auto find = [&](const char* joint) -> const Joint& { return model.joints()[model.findJoint(joint)]; };
  for (const double pitch : {0.0, 0.25, -0.3})
    for (const double roll : {0.0, -0.2}) {
      CAPTURE(pitch, roll);
      VectorXd q = model.makeNeutral();
      q[find("pitch").idx_q] = pitch;
      q[find("roll").idx_q] = roll;
      const AssemblyResult closed = closeConfiguration(model, q, {"pitch", "roll"});
      REQUIRE(closed.status == NumericalStatus::Ok);
      for (int j = 0; j < mj->njnt; ++j) {
        const Joint& joint = find(mj_id2name(mj.get(), mjOBJ_JOINT, j));
        VectorXd qpos = closed.q.segment(joint.idx_q, joint.nq);
        if (joint.nq == 4) qpos << closed.q[joint.idx_q + 3], closed.q.segment<3>(joint.idx_q);
        Eigen::Map<VectorXd>(data->qpos + mj->jnt_qposadr[j], joint.nq) = qpos;
      }
      mj_forward(mj.get(), data.get());
      REQUIRE(data->ne == 6);
      REQUIRE_FALSE(mj_isSparse(mj.get()));
      MatrixXd J = MatrixXd::Zero(8, mj->nv);
      J.topRows(6) = Eigen::Map<RowMatrixXd>(data->efc_J, data->ne, mj->nv);
      J(6, getDof("pitch")) = J(7, getDof("roll")) = 1;
      const MatrixXd T = J.completeOrthogonalDecomposition().pseudoInverse().rightCols(2);
      const SweepOptions at_start{0.02, 1e-6};
      const RatioSweep sweep =
          sweepRatio(model, makeLinkage(model, closed.q, {"pitch", "roll"}), closed.q, 0, at_start);
      const auto start = std::find_if(sweep.samples.begin(), sweep.samples.end(),
                                      [](const RatioSample& sample) { return sample.s == 0; });
      REQUIRE(start != sweep.samples.end());
      for (int j = 0; j < 2; ++j) {
        CHECK(start->ratio.R(0, j) == Approx(T(getDof("m1"), j)).epsilon(1e-9).margin(1e-9));
        CHECK(start->ratio.R(1, j) == Approx(T(getDof("m2"), j)).epsilon(1e-9).margin(1e-9));
      }
    }
}
