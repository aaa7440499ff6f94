// A robot whose balls are written as hinges is the same robot in MuJoCo: bodies, velocities, mass matrix and loops.
#include <catch2/catch.hpp>

#include "bielle/dynamics/assembly.h"
#include "bielle/robots/robot_loader.h"
#include "load_mujoco.h"
#include "mechanisms.h"
#include "worlds/mujoco_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kHingeTolerance = 1e-10;

void setHinges(const Model& model, ConstVectorRef q_ref, ConstVectorRef q, ConstVectorRef v, const mjModel& mj,
               mjData& data) {
  const VectorXd qpos = calcMjcfQpos(model, q_ref, q, MjcfRotations::Hinges),
                 qvel = calcMjcfQvel(model, q_ref, q, v, MjcfRotations::Hinges);
  REQUIRE(qpos.size() == mj.nq);
  REQUIRE(qvel.size() == mj.nv);
  VectorXd::Map(data.qpos, mj.nq) = qpos;
  VectorXd::Map(data.qvel, mj.nv) = qvel;
  mj_fwdPosition(&mj, &data);
  mj_fwdVelocity(&mj, &data);
}

// Body twists of MuJoCo, angular then linear, one column each, in the world at the origins of the bodies' frames.
Matrix6Xd getTwists(const mjModel& mj, const mjData& data) {
  Matrix6Xd twists(6, mj.nbody);
  for (int i = 0; i < mj.nbody; ++i) mj_objectVelocity(&mj, &data, mjOBJ_XBODY, i, twists.col(i).data(), 0);
  return twists;
}

// The mass matrix of the hinges in v: T' M T with qvel = T v.
MatrixXd calcHingeMassMatrix(const Model& model, ConstVectorRef q_ref, ConstVectorRef q, const mjModel& mj,
                             const mjData& data) {
  MatrixXd T(mj.nv, model.nv());
  for (int k = 0; k < model.nv(); ++k)
    T.col(k) = calcMjcfQvel(model, q_ref, q, VectorXd::Unit(model.nv(), k), MjcfRotations::Hinges);
  RowMatrixXd M(mj.nv, mj.nv);
  mj_fullM(&mj, M.data(), data.qM);
  return T.transpose() * M * T;
}

double calcHingeGap(const mjData& data) {
  return data.ne > 0 ? VectorXd::Map(data.efc_pos, data.ne).cwiseAbs().maxCoeff() : 0;
}

void compareHinges(const Model& model, ConstVectorRef q_ref, unsigned seed) {
  std::mt19937 rng(seed);
  const MujocoModel balls(model, q_ref);
  const MjModel hinges = loadHinges(model, q_ref);
  const MjData data(mj_makeData(hinges.get()), mj_deleteData);
  const auto expected = balls.makeData();
  for (int i = 0; i < hinges->njnt; ++i) CHECK(hinges->jnt_type[i] != mjJNT_BALL);
  for (int trial = 0; trial < 3; ++trial) {
    const VectorXd apart = model.integrate(q_ref, randomVector(rng, model.nv(), trial == 0 ? 0 : 0.3));
    const AssemblyResult closed = closeConfiguration(model, apart);
    REQUIRE(closed.status == NumericalStatus::Ok);
    const VectorXd v = randomVector(rng, model.nv());
    balls.setState(closed.q, v, *expected);
    mj_fwdPosition(balls.get(), expected.get());
    mj_fwdVelocity(balls.get(), expected.get());
    setHinges(model, q_ref, closed.q, v, *hinges, *data);
    const int bodies = hinges->nbody;
    REQUIRE(bodies == balls.get()->nbody);
    CHECK((VectorXd::Map(data->xpos, 3 * bodies) - VectorXd::Map(expected->xpos, 3 * bodies)).norm() < kHingeTolerance);
    CHECK((VectorXd::Map(data->xmat, 9 * bodies) - VectorXd::Map(expected->xmat, 9 * bodies)).norm() < kHingeTolerance);
    CHECK(calcRelativeError(getTwists(*hinges, *data), getTwists(*balls.get(), *expected)) < kHingeTolerance);
    const MatrixXd M = balls.calcMassMatrix(*expected);
    CHECK(calcRelativeError(calcHingeMassMatrix(model, q_ref, closed.q, *hinges, *data), M) < kHingeTolerance);
    CHECK(calcHingeGap(*data) < kHingeTolerance);
    // Entries that are a thousandth off are noticed.
    MatrixXd poisoned = M;
    poisoned(0, 0) *= 1.001;
    CHECK(calcRelativeError(calcHingeMassMatrix(model, q_ref, closed.q, *hinges, *data), poisoned) > kHingeTolerance);
    data->qvel[hinges->nv - 1] += 1e-3;
    mj_fwdVelocity(hinges.get(), data.get());
    CHECK(calcRelativeError(getTwists(*hinges, *data), getTwists(*balls.get(), *expected)) > kHingeTolerance);
    data->qpos[hinges->nq - 1] += 1e-3;
    mj_fwdPosition(hinges.get(), data.get());
    CHECK((VectorXd::Map(data->xpos, 3 * bodies) - VectorXd::Map(expected->xpos, 3 * bodies)).norm() +
              (VectorXd::Map(data->xmat, 9 * bodies) - VectorXd::Map(expected->xmat, 9 * bodies)).norm() >
          kHingeTolerance);
  }
}

}  // namespace

TEST_CASE("Balls as hinges are the same robot, with its mass matrix and closed loops") {
  for (const std::string& name : listRobots()) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    compareHinges(model, findClosedConfiguration(model).q, 5);
  }
  unsigned seed = 0;
  for (JointKind joint : {JointKind::Spherical, JointKind::FreeFlyer})
    for (ClosureKind closure : kClosureKinds) {
      if (closure == ClosureKind::Slider) continue;  // which MuJoCo does not have
      std::mt19937 rng(++seed);
      const Mechanism mechanism = makeRandomMechanism(rng, joint, closure, MechanismBase::Fixed);
      CAPTURE(getName(joint), getName(closure));
      compareHinges(mechanism.model, mechanism.q_closed, seed);
    }
}

TEST_CASE("Joints of the file have the names and the order that are told; keyframes are those with balls") {
  for (const char* name : {"bipetto", "kangaroo", "rsu_biped"}) {
    CAPTURE(name);
    const Model model = loadRobot(name).model;
    const VectorXd q_ref = findClosedConfiguration(model).q;
    const MjModel hinges = loadHinges(model, q_ref);
    const std::vector<std::string> names = listMjcfJoints(model, MjcfRotations::Hinges);
    REQUIRE(static_cast<int>(names.size()) == hinges->njnt);
    for (int i = 0; i < hinges->njnt; ++i) CHECK(names[i] == mj_id2name(hinges.get(), mjOBJ_JOINT, i));
    const std::vector<int> bodies = listMjcfBodies(model);
    REQUIRE(static_cast<int>(bodies.size()) + 1 == hinges->nbody);
    for (int i = 1; i < hinges->nbody; ++i)
      CHECK(model.bodies()[bodies[i - 1]].name == mj_id2name(hinges.get(), mjOBJ_BODY, i));
    const MujocoModel balls(model, q_ref);
    const std::vector<std::string> with_balls = listMjcfJoints(model, MjcfRotations::Balls);
    REQUIRE(static_cast<int>(with_balls.size()) == balls.get()->njnt);
    for (int i = 0; i < balls.get()->njnt; ++i) CHECK(with_balls[i] == mj_id2name(balls.get(), mjOBJ_JOINT, i));
    const MjData data(mj_makeData(hinges.get()), mj_deleteData);
    const auto expected = balls.makeData();
    REQUIRE(hinges->nkey == balls.get()->nkey);
    for (int k = 0; k < hinges->nkey; ++k) {
      mj_resetDataKeyframe(hinges.get(), data.get(), k);
      mj_resetDataKeyframe(balls.get(), expected.get(), k);
      mj_kinematics(hinges.get(), data.get());
      mj_kinematics(balls.get(), expected.get());
      CHECK((VectorXd::Map(data->xmat, 9 * hinges->nbody) - VectorXd::Map(expected->xmat, 9 * hinges->nbody)).norm() <
            kHingeTolerance);
    }
  }
}
