#pragma once
// A step of the full formulation, robot_problem.h Eqs. (1) to (3), with its derivatives. Of a midpoint step, with q_m and
// v_m the point half way, a_0 the acceleration at (q_m, v) and a that at (q_m, v_m),
//
//     dq_m = J_q dq + h/2 J_d dv,    dv_m = dv + h/2 da_0,                                                        (1)
//     da_0 = A0_q dq_m + A0_v dv + A0_u du.                                                                       (2)
//
// With r the sources dID and dc of constrained.h for a, by (q_m, v_m, u), and c the stabilisation of the state,
//
//     dr = (r_q + h/2 r_v A0_q) dq_m + (r_v + h/2 r_v A0_v) dv + (r_u + h/2 r_v A0_u) du,    dc += c_q dq + c_v dv  (3)
//
// By the time scale s, with h = s dt, v+ = v + h a and p the length of the last drift (h, or h/2 of a midpoint step),
//
//     r_s = (r_q + h/2 r_v A0_q) q_m,s + h/(2 s) r_v a_0 for a midpoint step, or else 0,    v+_s = h/s a + h a_s    (4)
//     q+_s = J_q q_m,s + J_d (p/s v+ + p v+_s),    q_m,s = J_d h/(2 s) v for a midpoint step, or else 0             (5)
#include "bielle/dynamics/impact.h"
#include "ocp/transcription.h"

namespace bielle {

struct FullEvaluation : RobotEvaluation {
  explicit FullEvaluation(const Model& model) : ws(model) {}

  Workspace ws;  // at the node's state
  /// The acceleration and the forces of the step; once linearized, their derivatives by the node's state and u.
  ConstrainedWorkspace cws;

  struct Midpoint {
    explicit Midpoint(const Model& model) : ws(model) {}
    Workspace ws;                 // at q_m; velocities and accelerations are those of the last solution
    VectorXd a_0, lambda_0;       // nv, constraint rows: of (q_m, v)
    VectorXd stabilization;       // constraint rows, at the state
    MatrixXd A0_q, A0_v, A0_u;    // nv x nv, nv x nv, nv x nu
    VectorXd q_s, a_s, lambda_s;  // nv, nv, constraint rows, of Eqs. (4) and (5); where the time scale is free
    MatrixXd speeds_q, speeds_v, speeds_u;  // nu x nv, nu x nv, nu x nu: motor rows of dv_m, Eq. (1), by (q, v, u)
    VectorXd speeds_s;                      // nu, by s
  };
  std::unique_ptr<Midpoint> midpoint;       // of a midpoint step alone
  std::unique_ptr<ImpactWorkspace> impact;  // of an impact alone
};

struct FullStepScratch {
  explicit FullStepScratch(const Model& model, int most_constraint_rows);
  VectorXd tau, displacement;  // nv
  VectorXd by_scale;           // 2 nv, (q+_s, v+_s) of Eqs. (4) and (5)
  MatrixXd by_velocity;        // the larger of nv and the constraint rows x nv, h/2 r_v of Eq. (3)
};

/// Positions, velocities and mass matrix at a state, for residuals.
void updateNode(const Model& model, const VectorXd& x, Workspace& ws);

/// The step of at.x under at.u: fills a, lambda, x_next and, of a midpoint step, q_mid and v_mid.
NumericalStatus updateFullStep(const Model& model, const StageSpec& spec, FullStepScratch& scratch, FullEvaluation& at);

/// The derivatives of `at.cws`, after updateFullStep; with `free`, those of a midpoint step by s too.
NumericalStatus updateFullStepDerivatives(const Model& model, const StageSpec& spec, bool free,
                                          FullStepScratch& scratch, FullEvaluation& at);

/// The derivatives of the speeds of the motors of a midpoint step, after updateFullStepDerivatives.
void updateSpeedDerivatives(const Model& model, bool free, FullStepScratch& scratch, FullEvaluation& at);

/// The robot's part of F of the step and, with `free`, its column of s, with the Jacobian of the difference to the
/// node's state where the gap is open. \param gap  2 nv, the robot's part of out.gap
void setFullStep(const Model& model, const StageSpec& spec, bool free, const FullEvaluation& at, ConstVectorRef gap,
                 FullStepScratch& scratch, StageModel& out);

}  // namespace bielle
