// The residuals of the paper's problems, against differences and by what they are made of.
#include "bielle/dynamics/assembly.h"
#include "check_residual.h"
#include "own_robots.h"
#include "paper/problem.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// At q with the velocity v.
void check(const Model& model, const BodyFrame& a, const BodyFrame& b, const VectorXd& q, const VectorXd& v) {
  const ConstraintSet set = makeConstraintSet(model);
  const VectorXd lambda = VectorXd::Zero(set.rows);
  const auto fly_high = paper::makeFlyHigh(a, 5, 0.1);
  checkResidual(model, set, *fly_high, q, v, lambda);
  checkResidual(model, set, *paper::makeFrameDistance(a, b), q, v, lambda);
  TestNode node(model, set);
  const VectorXd velocity = node.calc(*makeFrameVelocity(a), q, v, lambda);
  const double height = getPlacement(node.ws, a.body, a.X_BF).p.z() - 0.1;
  const VectorXd faded = velocity.head<2>() * std::exp(-5 * height);
  CHECK((node.calc(*fly_high, q, v, lambda) - faded).norm() < 1e-12 * std::max(1.0, faded.norm()));
}

}  // namespace

TEST_CASE("the paper's residuals against differences, on mechanisms of every joint kind") {
  std::mt19937 rng(11);
  for (JointKind kind : kJointKinds) {
    CAPTURE(getName(kind));
    const Mechanism mechanism = makeRandomMechanism(rng, kind, ClosureKind::Ball3D, MechanismBase::FreeFlyer);
    const Model& model = mechanism.model;
    const BodyFrame a{model.frames()[model.findFrame("a2k")].body, randomPlacement(rng)};
    const BodyFrame b{model.frames()[model.findFrame("b1k")].body, randomPlacement(rng)};
    check(model, a, b, model.integrate(mechanism.q_closed, randomVector(rng, model.nv(), 0.1)),
          randomVector(rng, model.nv()));
  }
}

TEST_CASE("the paper's residuals against differences, on Bipetto in motion") {
  std::mt19937 rng(12);
  const Model& model = getBipetto();
  check(model, getBodyFrame(model, "foot_left"), getBodyFrame(model, "foot_right"),
        assembleReference(model, "half_sitting").q, randomVector(rng, model.nv()));
}
