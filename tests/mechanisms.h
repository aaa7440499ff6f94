#pragma once
// Random closed-chain mechanisms and central differences, shared by the tests and the validation against Simbody.
#include <functional>
#include <iosfwd>
#include <random>

#include "bielle/model/builder.h"

namespace bielle::testing {

/// Every joint that moves, every closure.
inline constexpr JointKind kJointKinds[] = {JointKind::Revolute,  JointKind::Continuous, JointKind::Prismatic,
                                            JointKind::Spherical, JointKind::Universal,  JointKind::Planar,
                                            JointKind::FreeFlyer};
inline constexpr ClosureKind kClosureKinds[] = {ClosureKind::Weld6D,  ClosureKind::Ball3D,   ClosureKind::Hinge5D,
                                                ClosureKind::Coupler, ClosureKind::Distance, ClosureKind::Slider};

VectorXd randomVector(std::mt19937& rng, int n, double scale = 1);
SE3 randomPlacement(std::mt19937& rng);
Inertia randomInertia(std::mt19937& rng);

struct Mechanism {
  Model model;
  VectorXd q_closed;  ///< a configuration on the closure
};

/// Two branches from a common body, every other joint of the given kind (revolutes between), their tips tied by a
/// closure of the given kind that holds at q_closed, with mobility left; a coupler ties joints of both branches, those of
/// the given kind among them if they have one coordinate. With `base` a free-flyer, a universal and a
/// side branch come along.
enum class MechanismBase { Fixed, FreeFlyer };
Mechanism makeRandomMechanism(std::mt19937& rng, JointKind joint, ClosureKind closure, MechanismBase base,
                              double kp = 0, double kd = 0);

struct MechanismKind {
  JointKind joint;
  ClosureKind closure;
  MechanismBase base;
};
/// Every joint that moves, with every closure, on every base.
std::vector<MechanismKind> listMechanismKinds();
std::ostream& operator<<(std::ostream& out, const MechanismKind& kind);

/// The same with a coupler beside the closure, between joints of its loop; repeated: with a second coupler that says the
/// same, so that its row is redundant.
Mechanism makeBeltedMechanism(std::mt19937& rng, JointKind joint, ClosureKind closure, MechanismBase base,
                              bool repeated, double kp = 0, double kd = 0);

/// The same with a coupler beside the closure in which one joint has a polynomial of degree 4.
Mechanism makeCammedMechanism(std::mt19937& rng, JointKind joint, ClosureKind closure, MechanismBase base,
                              double kp = 0, double kd = 0);

/// The same with springs, dampers and friction on joints of its loop, and springs and dampers between points of bodies: of
/// one branch, of both, of the ground and, with a free base, of the side branch.
Mechanism makeSprungMechanism(std::mt19937& rng, JointKind joint, ClosureKind closure, MechanismBase base);

/// Couples joints of `tree`, with coefficients of 0.5 to 1.5 of either sign, so that it holds at q; is_cam: with powers up to
/// the fourth of the last one.
void addRandomCoupler(ModelBuilder& builder, std::mt19937& rng, const std::string& name,
                      const std::vector<std::string>& joints, const Model& tree, const VectorXd& q, double kp = 0,
                      double kd = 0, bool is_cam = false);

/// Planar four-bar (four parallel hinges about y) closed by a 6D weld: rank 3 of 6 rows. Lengths in metres.
Mechanism makePlanarFourBar(double ground, double crank, double coupler, double rocker, double crank_angle);

/// Central differences of f (n values) in the tangent of q, per column with Richardson extrapolation: error O(h^4).
MatrixXd differentiateTangent(const Model& model, const VectorXd& q, double h,
                              const std::function<VectorXd(const VectorXd&)>& f);
MatrixXd differentiate(const VectorXd& x, double h, const std::function<VectorXd(const VectorXd&)>& f);
/// A step for dynamics.
inline constexpr double kDynamicsStep = 1e-3;

/// Largest entry of |a - b| over the largest of |b| (or 1 when b is tiny).
double calcRelativeError(const MatrixXd& a, const MatrixXd& b);

}  // namespace bielle::testing
