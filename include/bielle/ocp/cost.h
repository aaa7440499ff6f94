#pragma once
/// \file Costs, path constraints, and the residuals r(q, v, lambda, u) of which both are made, with analytic derivatives.
///
/// A residual is a small vector with sparse partial derivatives with respect to the tangent of q, to v, to the
/// constraint forces lambda and to the motor torques u; the stage applies the chain rule through the dynamics. Frame
/// residuals are in world axes unless stated otherwise. References of velocities are those at the time scale 1 of
/// robot_problem.h Eq. (5); at s they are divided by s: the same path in another time.
/// Costs are activations of residuals, or diagonal in state and control; path constraints keep residuals within bounds.
#include <memory>
#include <string>
#include <vector>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/ground.h"
#include "bielle/dynamics/linkage.h"

namespace bielle {

struct LoopBases;
class LinkageWorkspaces;

/// Data that a residual may read: one node with up-to-date kinematics (and, at a stage, dynamics).
struct NodeView {
  const Model& model;
  /// In calc(): q, v, X_WB, V and hc, at the stage Bodies; in calcJacobian() also J, dV, h, YJ and Yc, at the stage
  /// Velocity. Functions of the library that read more throw.
  const Workspace& ws;
  const ConstraintSet& constraints;  ///< closures and contacts in force
  const VectorXd& u;                 ///< nu, empty at the terminal node
  const VectorXd& lambda;            ///< rows of the constraints, empty at the terminal node
  double time_scale = 1;
  /// nu, speeds of the motors at the instant to which the torques belong (robot_problem.h); null where no residual of the
  /// node needs them.
  const VectorXd* speeds = nullptr;
  /// Of the closed configuration of the node, where they are known; else null.
  const LoopBases* loops = nullptr;
  /// Memory of the thread for linkages; null: it is allocated.
  LinkageWorkspaces* linkages = nullptr;
};

/// Row block of the stacked residual Jacobians of a node. Entries never written stay zero.
struct ResidualRows {
  MatrixRef q, v;    ///< n x nv
  MatrixRef lambda;  ///< n x rows
  MatrixRef u;       ///< n x nu
  MatrixRef speeds;  ///< n x nu
  VectorRef s;       ///< n, by the time scale
};

class Residual {
 public:
  virtual ~Residual() = default;
  virtual int size() const = 0;
  virtual bool needsForces() const { return false; }
  /// Whether it depends on u.
  virtual bool needsControls() const { return false; }
  /// Whether it depends on the speeds of the motors; such a residual is for steps alone.
  virtual bool needsSpeeds() const { return false; }
  /// False if it depends neither on q nor on v.
  virtual bool needsMotion() const { return true; }
  virtual void calc(const NodeView& node, VectorRef r) const = 0;
  /// Writes all entries that may be non-zero at some state.
  virtual void calcJacobian(const NodeView& node, ResidualRows rows) const = 0;
};

/// A frame on a body, for frame residuals.
struct BodyFrame {
  int body = 0;
  SE3 X_BF;
};
/// The link, frame or contact of this name. \throws InputError when the robot has none
BodyFrame getBodyFrame(const Model& model, const std::string& name);

/// Centre of mass minus a reference (3), m.
std::unique_ptr<Residual> makeComPosition(const Vector3d& reference);
/// Velocity of the centre of mass minus a reference (3), m/s.
std::unique_ptr<Residual> makeComVelocity(const Vector3d& reference);
/// Log6(X_WT^{-1} X_WF) (6), m and rad, in the axes of the target.
std::unique_ptr<Residual> makeFramePlacement(const BodyFrame& frame, const SE3& X_WT);
/// Position of the frame's origin minus a reference (3), m.
std::unique_ptr<Residual> makeFrameTranslation(const BodyFrame& frame, const Vector3d& reference);
/// Log3(R_WT^T R_WF) (3), rad.
std::unique_ptr<Residual> makeFrameRotation(const BodyFrame& frame, const Matrix3d& R_WT);
/// Velocity of the frame's origin and angular velocity, in world axes, minus a reference (6), m/s and rad/s.
std::unique_ptr<Residual> makeFrameVelocity(const BodyFrame& frame, const Vector6d& reference = Vector6d::Zero());
/// A residual of vectors in the axes of the world, whose rows are three by three, in other axes A instead; itself where these are
/// those of the world. Weights and bounds of single rows are then those of a robot that faces along A.
std::shared_ptr<const Residual> makeTurned(std::shared_ptr<const Residual> vectors, const Matrix3d& R_WA);
/// Heights of the corners of a sole over the ground (4), of its origin if it has no size (1), m. Around a step the
/// ground is taken to rise to its top over `ramp` m, so that the residual is continuous, and never exceeds the true
/// height.
std::unique_ptr<Residual> makeSoleClearance(const BodyFrame& sole, double half_length, double half_width,
                                            const Ground& ground, double ramp);
/// Distance between two shapes (1), m; negative where they overlap (distance.h).
std::unique_ptr<Residual> makeShapeDistance(const Shape& a, const Shape& b);
/// The axes in which the force of a contact is expressed: its own, those of the world, or those of the ground, i.e. of the place
/// where it belongs (ContactTarget::X_WT); of a point's place, which is not level, the heading alone. Its moment is always about
/// the origin of the contact frame. A sole that rests aslant on an edge is pushed along the normal of the ground, not along its own: with a friction of 0.3 its own cone holds no force that
/// carries the robot once it leans by 0.3 rad.
enum class ForceAxes { Contact, World, Ground };
/// Entries of the force of a contact: 3 of a point, else those of a wrench.
int countForces(const ConstraintSet& set, int constraint);
/// Rows of the force of a contact minus a reference, N and N m (6 or 3). `constraint` is the index in the
/// ConstraintSet. \throws InputError unless the reference has countForces() entries
std::unique_ptr<Residual> makeContactForce(const ConstraintSet& set, int constraint, const VectorXd& reference,
                                           ForceAxes axes = ForceAxes::Contact);
/// Centre of pressure about the origin of the frame of a sole or an edge, there y = 0 (2), m. \throws InputError for a point
std::unique_ptr<Residual> makeCenterOfPressure(const ConstraintSet& set, int constraint,
                                               ForceAxes axes = ForceAxes::Contact);
/// Wrench cone of a rectangular sole, whose origin is in the middle of the sole: inside when
/// all rows are positive (17), N and N m. With f the force, n the moment, X and Y half the length and width, and four corners
/// that each bear a pyramid of friction mu (Caron, Pham, Nakamura, "Stability of surface contacts for humanoid robots", ICRA
/// 2015):
///     f_z,   mu f_z -+ f_x,   mu f_z -+ f_y,   Y f_z -+ n_x,   X f_z -+ n_y,                                        (1)
///     mu (X + Y) f_z + n_z + s (Y f_x - mu n_x) + t (X f_y - mu n_y)   and
///     mu (X + Y) f_z - n_z + s (Y f_x + mu n_x) + t (X f_y + mu n_y)   for s, t = -1, 1.                            (2)
/// A 3D contact has the first five rows: it pushes, within the friction pyramid. A 5D contact, an edge along x, bears no n_x and
/// has no width: of (1) and (2) remain eleven rows. Both may tilt on the ground: take its axes, or those of the world.
std::unique_ptr<Residual> makeWrenchCone(const ConstraintSet& set, int constraint, double half_length,
                                         double half_width, double mu, ForceAxes axes = ForceAxes::Contact);
/// Coordinates of joints with one dof (all those with finite limits if `dofs` is empty) (n), rad or m.
std::unique_ptr<Residual> makeJointPosition(const Model& model, const std::vector<int>& dofs);
/// Velocity coordinates (n), rad/s or m/s.
std::unique_ptr<Residual> makeJointVelocity(const std::vector<int>& dofs);
/// The transmission rho of a linkage, over that at its reference (1): 0 at a dead point of the output, infinite at one of the
/// motors (linkage.h, Eq. 2). Above `largest`, which is at least 1, it goes on through the latter linearly in its arctangent, with
/// the same slope: largest + (1 + largest^2) (theta - atan(largest)), where theta = atan(rho), plus pi where rho < -1, past the
/// dead point.
std::unique_ptr<Residual> makeTransmission(const Linkage& linkage, double largest);
/// Mechanical power u_m v_m of motors, given by their indices in the model (n), W.
std::unique_ptr<Residual> makeMotorPower(const Model& model, const std::vector<int>& motors);
/// Voltages of motors, given by their indices in the model, from their torques and their speeds when the torques act, with the
/// factors Motor::voltsPerEffort() and voltsPerSpeed() (n), V. \throws InputError for one without an envelope
std::unique_ptr<Residual> makeMotorVoltage(const Model& model, const std::vector<int>& motors);
/// Electrical powers P_m = u_m w_m + loss_m u_m^2 of all motors, w their speeds when the torques act, then their torques
/// (2 nu), W and N m: what Activation::makeEnergy reads. \param losses  nu, W/(N m)^2
std::unique_ptr<Residual> makeElectricalPower(const VectorXd& losses);
/// The same with the losses of the model and those of its gears, P_m = g(p) + loss_m u_m^2 h(p) with p = u_m w_m. With
/// s = p / sqrt(p^2 + e^2), which stands for the sign of p, and c_1 = 1/efficiency, c_2 = back_efficiency,
///     g = (c_1 + c_2)/2 p + (c_1 - c_2)/2 (sqrt(p^2 + e^2) - e),    h = (c_1^2 + c_2^2)/2 + (c_1^2 - c_2^2)/2 s:
/// c p and c^2 of MotorDrive Eq. (1), smoothed over e = kGearSmoothing; g is at most (c_1 - c_2)/2 e less than c p.
std::unique_ptr<Residual> makeElectricalPower(const Model& model);
inline constexpr double kGearSmoothing = 1;  ///< W

enum class ActivationKind { Quadratic, Barrier, Energy };

/// Scalar function of a residual r (n). Weights, here and below, are finite and not negative: RobotProblem refuses others.
///   Quadratic:  1/2 sum_i w_i r_i^2
///   Barrier:    1/2 sum_i w_i (max(0, lower_i - r_i)^2 + max(0, r_i - upper_i)^2)
///   Energy:     sum_i w_i (share P_i + (1 - share) (P_i + sqrt(P_i^2 + e^2)) / 2),   r = (P, u) of makeElectricalPower():
///               energy drawn by the motors, minus the reused share of the regenerated energy. It exceeds
///               max(P, 0) + share min(P, 0) by at most (1 - share) e/2 per motor, and by e^2 / (4 |P|) where |P| is
///               large. The second derivative of the term loss u^2 counts in the rows of u, whose gradient is zero;
///               that of u w does not.
struct Activation {
  ActivationKind kind = ActivationKind::Quadratic;
  VectorXd weights;       ///< n
  VectorXd lower, upper;  ///< n, barriers only
  VectorXd losses;        ///< n/2, energies only, W/(N m)^2
  double share = 0;       ///< energies only, within 0 .. 1
  double smoothing = 0;   ///< e, energies only, W

  static Activation makeQuadratic(const VectorXd& weights);
  static Activation makeBarrier(const VectorXd& weights, const VectorXd& lower, const VectorXd& upper);
  static Activation makeEnergy(const VectorXd& weights, const VectorXd& losses, double share, double smoothing);
  /// Whether weights and bounds have the sizes that a residual of `rows` rows needs.
  bool hasSize(Eigen::Index rows) const;
  double calc(ConstVectorRef r) const;
  /// Whether it is a weighted sum of squares, which grows in all directions.
  bool isSquare() const { return kind != ActivationKind::Energy; }
  /// Gradient (n) and diagonal of the Hessian (n), without negative entries, with respect to r.
  void calcDerivatives(ConstVectorRef r, VectorRef gradient, VectorRef hessian) const;
};

/// weight * activation(residual); the name is for reports.
struct Cost {
  std::string name;
  double weight = 1;
  Activation activation;
  std::shared_ptr<const Residual> residual;
  bool defines = false;  ///< it defines the motion, and keeps its weight for every objective
};

/// lower <= r <= upper, row by row; equal bounds make an equation, infinite ones leave a side open. The solver sees r and its
/// bounds over `scale`: the violation that counts as 1.
struct PathConstraint {
  std::string name;
  std::shared_ptr<const Residual> residual;
  VectorXd lower, upper;  ///< n
  VectorXd scale;         ///< n, positive, in the unit of r

  bool hasSize(Eigen::Index rows) const;
};

/// 1/2 weight sum_i w_i d_i^2 with d = (q (-) q_ref, v - v_ref) (2 nv).
struct StateCost {
  double weight = 0;
  VectorXd q_ref, v_ref;  ///< nq, nv
  VectorXd weights;       ///< 2 nv
  /// Rows: the directions in a free base along which its place, its rotation and their rates are weighted, orthonormal. With those that
  /// are upright where the robot stands, the cost does not depend on how the frame of the base is turned.
  Matrix3d axes = Matrix3d::Identity();

  /// What weights along `axes` add to those of the base's own, 3 x 3: A^T diag(w) A - diag(w), zero where they are the same.
  /// \param first  of three entries of `weights`: 0, 3, nv, nv + 3
  Matrix3d calcCoupling(Eigen::Index first) const;
};

/// 1/2 weight sum_i w_i (u_i - u_ref_i)^2.
struct ControlCost {
  double weight = 0;
  VectorXd reference;  ///< nu
  VectorXd weights;    ///< nu
};

}  // namespace bielle
