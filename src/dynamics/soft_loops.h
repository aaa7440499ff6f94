#pragma once
/// \file Loops as MuJoCo closes them, which is softly: how far they open, and what that does to the mechanism.
///
/// After MuJoCo's documentation, "Computation", sections "Constraint model" and "Parameters". A row of an equality is open by r,
/// J = dr/dq; the force f of the row and the acceleration a of the mechanism satisfy
///     M a = tau - b + J^T f,    R f = a_ref - J a,    a_ref = -B J v - K d r,    R = (1 - d)/d A                    (1)
/// with an estimate A of the row's inverse inertia that is computed once, where the file stands, the impedance d(r) of
/// `solimp` and the damping B and stiffness K of `solref` (calcSoftRow). It is as if the row were held by a mass, a damper and a spring:
///     f = -(m J a + c J v + s r),    m = d / ((1 - d) A),    c = B m,    s = K d m                                   (2)
/// At rest the spring alone acts, and the row stands open by
///     r = -f / s = -(1 - d) A f / (K d^2)                                                                           (3)
/// About a rest, with the stiffness K_0 of everything but the springs of the rows, small motions x follow
///     M' x'' + C x' + K' x = 0,   M' = M + J^T m J,  C = D + J^T c J,  K' = K_0 + J^T ds/dr J.                      (4)
/// In a motion that opens the loops slowly beside their time constants, J a = -dJ/dt v, and the row stands open by
///     r = -f / s + (dJ/dt v) / (K d)                                                                               (5)
/// but where MuJoCo has -dJ/dt v in a_ref as well: there Eq. (3) holds.
#include <array>
#include <string>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "bielle/model/error.h"

namespace bielle {

struct SoftSettings {
  std::array<double, 2> solref{0.02, 1};
  std::array<double, 5> solimp{0.9, 0.95, 0.001, 0.5, 2};
};

/// How MuJoCo integrates: semi-implicit Euler with the damping of joints taken at the end of the step; with that of tendons as well;
/// Runge-Kutta of order 4.
enum class SoftIntegrator { Euler, Implicit, RungeKutta };

struct SoftStep {
  double duration = 0.002;  ///< s
  bool is_safe = true;      ///< `refsafe`: a time constant is at least two steps
  SoftIntegrator integrator = SoftIntegrator::Euler;
};

/// Eq. (2) of a row with A = 1.
struct SoftRow {
  double mass = 0, damping = 0, stiffness = 0;
  double hardening = 0;  ///< ds/dr, 1/m
};
/// \param gap  by which the equality stands open, all its rows together
SoftRow calcSoftRow(const SoftSettings& settings, double gap, const SoftStep& step);

/// An equality of MuJoCo.
struct SoftEquality {
  std::string name;
  Closure closure;  ///< its rows; a hinge is two equalities, each a ball
  VectorXd weight;  ///< A by row, 1/kg or 1/(kg m^2)
  VectorXd
      scale;  ///< of MuJoCo's rows over ours: rotations of a weld are vector parts of quaternions, half of the angle
  SoftSettings settings;
  bool has_bias = true;  ///< MuJoCo has -dJ/dt v in a_ref
};

/// A mechanism that rests under generalized forces, with its loops open as Eq. (3) says.
struct SoftRest {
  /// Ok; NotClosed: there is none next to the closed configuration, the loops give way
  NumericalStatus status = NumericalStatus::Ok;
  VectorXd q;                   ///< nq
  VectorXd displacement;        ///< nv, from the closed configuration
  VectorXd load, rigid_load;    ///< nv, b - J^T f: what else must act on each coordinate, there and with rigid loops
  std::vector<VectorXd> force;  ///< by equality, f; of connects and welds in frame 1, N and N m
  std::vector<ClosureGap> gap;  ///< by equality, m and rad
  /// By equality, |A f| of the rigid loops, m/s^2 and rad/s^2: the gap is that times (1 - d) (time constant, damping ratio)^2, whatever
  /// the mass
  std::vector<double> pull;
  /// By equality, |dJ/dt v| where Eq. (5) holds, m/s^2 and rad/s^2: at most, it adds (time constant, damping ratio)^2 times that
  std::vector<double> bias;
};

/// Small motions about a rest, as MuJoCo's steps make them.
struct SoftMotion {
  double frequency_error = 0;  ///< largest, over that with rigid loops; of a motion that falls over, of its rate
  double energy_loss = 0;  ///< 1/s: the share of its energy that the motion loses a second more than with rigid loops
  double frequency = 0;    ///< Hz, of that motion with rigid loops; 0: it has none
  bool falls = false;      ///< a motion grows faster than with rigid loops, however short the step
  bool diverges = false;   ///< steps of this duration make one grow that would not
  double stable_step = 0;  ///< s, the longest below which no step makes motions grow, at most kLongestStep
};
inline constexpr double kLongestStep = 1;

class SoftLoops {
 public:
  /// \param equalities  other closures of the model are rigid
  SoftLoops(const Model& model, std::vector<SoftEquality> equalities, const SoftStep& step);

  const std::vector<SoftEquality>& equalities() const { return equalities_; }
  const SoftStep& step() const { return step_; }

  /// Directions (nv x n) in which the dofs move while all others stand and rigid closures stay closed.
  MatrixXd makeDirections(ConstVectorRef q, const std::vector<int>& dofs) const;
  /// Those of them (nv x m) that keep the equalities closed, orthonormal in the mass matrix.
  MatrixXd makeClosedMotions(ConstVectorRef q, const MatrixXd& directions) const;

  /// \param q  closed (nq)   \param tau  generalized forces (nv)
  /// \param directions  motions along which the equalities do not open are held
  SoftRest findRest(ConstVectorRef q, const MatrixXd& directions, ConstVectorRef tau) const;
  /// The same in a motion with the velocities v and accelerations a (nv), Eq. (5): loads are those of inverse dynamics.
  SoftRest findRest(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a, const MatrixXd& directions,
                    ConstVectorRef tau) const;
  /// About a rest under the forces that it needs, which stay as they are. \param q  closed (nq), where rigid loops stand
  SoftMotion calcMotion(ConstVectorRef q, const SoftRest& rest, const MatrixXd& directions) const;

 private:
  struct State;
  State evaluate(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a) const;
  State evaluate(ConstVectorRef q) const;
  VectorXd calcBias(const SoftEquality& equality, ConstVectorRef q, ConstVectorRef v) const;
  VectorXd calcLoad(ConstVectorRef q, const VectorXd& force) const;
  MatrixXd calcStiffness(ConstVectorRef q, const VectorXd& force, const MatrixXd& directions) const;
  MatrixXd calcDamping(ConstVectorRef q, const MatrixXd& directions) const;

  const Model model_;
  const std::vector<SoftEquality> equalities_;
  const SoftStep step_;
  std::vector<Closure> rigid_;
  int rows_ = 0;
};

}  // namespace bielle
