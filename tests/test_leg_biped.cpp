// The composed biped: its eighteen combinations of parts, and its hips in closed form.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "leg_biped.h"
#include "math/so3.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("leg biped: eighteen combinations stand, move in 18 ways, and weigh what their parts add") {
  // Per leg. Knee: a pulley, a wheel of twice its radius and two strands of belt; or crank and rod with their balls, the arm.
  // Ankle: two pulleys; or two chains, and a heel of 0.3 of the foot's mass either way. Rods are as long as what they are
  // parallel to.
  const double chain = 0.5 * 0.05 + 0.03 + 0.02,
               of_knee[] = {0, 0.1 + 4 * 0.1 + 2 * 0.07 * 0.22, chain + 0.5 * (0.22 + 0.05)};
  const double of_ankle[] = {0, 0.2, 2 * (chain + 0.5 * 0.17)};
  const int rows_of_knee[] = {0, 1, 3}, rows_of_ankle[] = {0, 2, 6};
  const char *const knees[] = {"serial", "belt", "four_bar"}, *const ankles[] = {"serial", "differential", "rsu"},
                    *const hips[] = {"serial", "three_rrs"};
  const double bare = makeLegBiped({{"knee", "serial"}, {"ankle", "serial"}}).mass();
  for (int knee = 0; knee < 3; ++knee)
    for (int ankle = 0; ankle < 3; ++ankle)
      for (int hip = 0; hip < 2; ++hip) {
        CAPTURE(knee, ankle, hip);
        const Model model = makeLegBiped({{"knee", knees[knee]}, {"ankle", ankles[ankle]}, {"hip", hips[hip]}});
        CHECK(model.mass() - bare == Approx(2 * (of_knee[knee] + of_ankle[ankle])).margin(1e-12));
        CHECK(model.nu() == 12);
        const AssemblyResult standing = assembleReference(model, "half_sitting");
        REQUIRE(standing.status == NumericalStatus::Ok);
        const Mobility mobility = calcMobility(model, standing.q);
        const int others = rows_of_knee[knee] + rows_of_ankle[ankle];
        CHECK(mobility.rows == 2 * (others + 9 * hip));
        CHECK(mobility.rank == 2 * (others + 6 * hip));
        CHECK(mobility.mobility == 18);
      }
  // The four-bar as it is meant: square at the middle angle, where it gears by arm over crank; a parallelogram turns with the knee.
  const auto close = [](double crank, double angle) {  // to knee, motor
    const Model model = makeLegBiped({{"knee_crank", crank}});
    const int knee = model.joints()[model.findJoint("knee_left")].idx_q;
    const int motor = model.joints()[model.findJoint("motor_knee_left")].idx_q;
    VectorXd q = model.makeNeutral();
    q[knee] = q[motor] = angle;
    q[model.joints()[model.findJoint("elbow_knee_left")].idx_q] = -angle;  // the rod stays upright
    const AssemblyResult closed = closeConfiguration(model, q);
    REQUIRE(closed.status == NumericalStatus::Ok);
    return Eigen::Vector2d(closed.q[knee], closed.q[motor]);
  };
  const Eigen::Vector2d parallel = close(0.05, 1.7), square = close(0.04, 1.2);
  CHECK(parallel[0] == Approx(1.7).epsilon(1e-9));
  CHECK(parallel[1] == Approx(parallel[0]).epsilon(1e-9));
  CHECK(square.isApproxToConstant(1.2, 1e-9));
  const Eigen::Vector2d change = close(0.04, 1.2 + 1e-3) - close(0.04, 1.2 - 1e-3);
  CHECK(change[1] / change[0] == Approx(0.05 / 0.04).epsilon(0.01));

  OptionSet parameters = findGenerator("leg_biped").parameters;
  parameters.set("ankle", "rsu");
  CHECK(parameters.get<std::string>("ankle") == "rsu");
  CHECK_THROWS_WITH(parameters.set("ankle", "belt"), Catch::Contains("rsu, serial, spu"));
  CHECK_THROWS_WITH(parameters.set("knee", 1), Catch::Contains("parameter 'knee'") && Catch::Contains("four_bar"));
}

TEST_CASE("leg biped: motors of a 3-RRS hip by spherical trigonometry, one to one in its middle posture") {
  const Model model = makeLegBiped({{"hip", "three_rrs"}, {"knee", "serial"}, {"ankle", "serial"}});
  const double middle = -0.6;  // hip_middle
  const auto getIndex = [&](const std::string& joint) { return model.joints()[model.findJoint(joint)].idx_q; };
  const char* const hinges[] = {"hipz", "hipx", "hipy"};
  // Near yaw, roll and pitch, along the way from straight legs.
  const auto close = [&](const Vector3d& hip, const std::string& side) {
    VectorXd q = model.makeNeutral();
    for (int step = 1; step <= 40; ++step) {
      for (int i = 0; i < 3; ++i) q[getIndex(hinges[i] + side)] = step * hip[i] / 40;
      const AssemblyResult result = closeConfiguration(model, q);
      REQUIRE(result.status == NumericalStatus::Ok);
      q = result.q;
    }
    return q;
  };
  for (const double s : {1.0, -1.0}) {
    const std::string side = s > 0 ? "_left" : "_right";
    const Vector3d u[] = {{-1, 0, 0}, {0, -s, 0}, {0, 0, 1}}, w[] = {{0, 0, 1}, {1, 0, 0}, {0, -s, 0}};
    const Vector3d v[] = {{0, s, 0}, {0, 0, -1}, {std::cos(middle), 0, std::sin(middle)}};
    // The axis of the hinge, turned about that of the motor, stays square to the ball: (w cos a + u x w sin a) . R v = 0.
    const auto calcMotor = [&](int i, const Vector3d& hip) {
      const Matrix3d R = (Eigen::AngleAxisd(hip[0], Vector3d::UnitZ()) * Eigen::AngleAxisd(hip[1], Vector3d::UnitX()) *
                          Eigen::AngleAxisd(hip[2], Vector3d::UnitY()))
                             .toRotationMatrix();
      return std::atan(-w[i].dot(R * v[i]) / u[i].cross(w[i]).dot(R * v[i]));
    };
    for (const Vector3d& hip :
         {Vector3d(0, 0, 0), {0, 0, -0.6}, {0.4, 0, -0.6}, {0, 0.3, -0.2}, {-0.3, 0.25, -1.2}, {0.2, -0.4, 0.3}}) {
      CAPTURE(side, hip.transpose());
      const VectorXd q = close(hip, side);
      Vector3d closed;
      for (int i = 0; i < 3; ++i) closed[i] = q[getIndex(hinges[i] + side)];
      CHECK((closed - hip).norm() < 0.2);
      for (int i = 0; i < 3; ++i)
        CHECK(q[getIndex("motor_hip" + std::to_string(i + 1) + side)] == Approx(calcMotor(i, closed)).margin(1e-9));
    }
    // Turns of the motors per turn of roll, pitch and yaw.
    const auto calcRatios = [&](double pitch) {
      Matrix3d ratios;
      const int axes[] = {1, 2, 0};
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          const Vector3d step = 1e-5 * Vector3d::Unit(axes[k]), hip(0, 0, pitch);
          ratios(i, k) = (calcMotor(i, hip + step) - calcMotor(i, hip - step)) / 2e-5;
        }
      return ratios;
    };
    CHECK((calcRatios(middle).cwiseAbs() - Matrix3d::Identity()).norm() < 1e-8);
    CHECK(calcRatios(middle + 1.5).cwiseAbs().maxCoeff() > 10);
  }
}
