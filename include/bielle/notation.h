#pragma once
/// \file
/// Frames, orders, signs and units of the whole project. (Documentation only.)
///
/// ## Units and world
/// SI units and radians. The world frame W has z up; gravity is (0, 0, -9.81) m/s^2.
///
/// ## Placements and spatial vectors
/// `X_AB` is the placement of frame B in frame A: `p_A = X_AB.R * p_B + X_AB.p`. `p_AB_C` is the vector from the origin
/// of A to that of B, in the coordinates of C. Body 0 of a model is the world, body i > 0 is carried by joint i.
/// Spatial vectors put the linear part first: a twist is (v, w), a wrench (f, n). A twist *in frame A* has the velocity
/// of the material point at the origin of A as its linear part, in the coordinates of A.
/// Cross products: `crossMotion(v, m)` is [v x] m, `crossForce(v, f)` is [v x*] f = -[v x]^T f.
///
/// ## Configurations q and velocities v, joint after joint in the order of the model
/// | joint      | q (nq)                                        | v (nv)                                             |
/// |------------|-----------------------------------------------|----------------------------------------------------|
/// | revolute   | angle (1)                                     | its rate (1)                                       |
/// | continuous | angle, not wrapped (1)                        | its rate (1)                                       |
/// | prismatic  | length (1)                                    | its rate (1)                                       |
/// | spherical  | quaternion x y z w (4)                        | angular velocity in the child frame (3)            |
/// | universal  | angle about axis 1, then about axis 2 (2)     | their rates (2)                                    |
/// | planar     | x, y in the plane, angle about its normal (3) | v_x, v_y, rate, all in the child frame (3)         |
/// | free-flyer | position, quaternion x y z w (7)              | twist of the child in its own frame (6)            |
/// | fixed      | - (0): its body is merged into the parent     | - (0)                                              |
///
/// Free-flyer and spherical joints follow Pinocchio, so trajectories can be exchanged by joint name. A continuous joint
/// is one angle here where Pinocchio stores (cos, sin); a planar joint is an angle here, (cos, sin) there.
/// The tangent vector of a configuration has the size and frames of v: `integrate(q, dq)` is q (+) dq, and
/// `difference(q0, q1)` is the dq with q0 (+) dq = q1. Both go along constant velocities dq (the
/// exponential); those of planar joints, whose angles are not wrapped, up to half a turn (`src/model/joint.cpp`).
///
/// ## Dynamics
///     M(q) a + b(q, v) = B u + J(q)^T lambda            (1)
/// a is the time derivative of v, b holds Coriolis, centrifugal and gravity terms, u the motor torques (or forces).
///
/// ## Closures and contacts
/// A closure ties frame 1 (on body 1) to frame 2 (on body 2). With the placement X_12 of frame 2 in frame 1:
/// - residual  6D: Log6(X_12);  3D: the origin p_12;  5D: p_12 and the angle vector between the two hinge axes, in the
///   plane normal to the axis;  slider: R_12^T p_12 in the plane normal to the axis, and log(R_12);
///   distance of length L: (|p_12|^2 - L^2) / (2 L);
/// - velocity  nu_c = V_1 - X_12 V_2, both body twists carried to frame 1 (the paper's eq. 8), of which a 3D closure
///   keeps the linear rows, a 5D closure the linear rows and the two angular rows normal to its axis, a slider the two
///   linear rows normal to its axis and the angular rows, and a distance the linear part along p_12 / L;
/// - acceleration  a_c = A_1 - X_12 A_2 + [V_1 x] X_12 V_2 (the paper's eq. 9), the derivative of nu_c in frame 1;
/// - lambda is the wrench, in frame 1, that acts **on body 1**; body 2 gets the opposite one. So J = d nu_c / d v
///   enters (1) with a plus sign and positive power of lambda is power given to the mechanism. Of a distance, lambda is
///   the tension of the rod, N: it pulls both points towards each other.
/// A coupler ties coordinates instead of frames, sum p_i(q_i) = c_0 with polynomials p_i, mostly c_i q_i: residual
/// c_0 - sum p_i, velocity sum p_i' v_i, acceleration sum p_i' a_i + p_i'' v_i^2, and lambda adds p_i' lambda to the
/// generalized force of coordinate i.
///
/// A foot contact is a closure whose frame 1 is the contact frame and whose body 2 is the world: its lambda is the
/// wrench of the ground on the foot, in the foot's frame. Contact frames have z along the outward normal of the ground
/// and x forward when the sole rests on flat ground.
///
/// ## Clusters and reduced coordinates
/// A *closure* ties bodies of the robot to each other and closes a loop, or ties coordinates of joints; a *contact* ties
/// a foot to the ground. A *cluster* is a set of joints tied together by closures: the joints on a loop, and those of
/// other loops that share some of them. A *reduced joint* is either a joint outside all clusters or a whole cluster, seen as one joint of
/// several freedoms; reduced joints form a tree.
///
/// | symbol            | cluster with n dofs, closures of rank m, r = n - m freedoms           | defined in       |
/// |-------------------|-----------------------------------------------------------------------|------------------|
/// | J, W              | independent closure rows (m x n); metric (n x n, diagonal)            | reduction.h      |
/// | N, J^+            | basis of closed motions: J N = 0, N^T W N = 1 (n x r); pseudo-inverse | reduction.h      |
/// | dy, dy_v, y'      | tangent coordinates of position, velocity; reduced accelerations (r)  | reduced_kernel.h |
/// | Z, d_y, d_v       | effect of dy on velocities, of dy and dy_v on accelerations (n x r)   | cluster_motion.h |
/// | J~, dV~, dA~, dW~ | sums of J, dV, dA, dJ + dV of rnea.h along the path to a dof (6 x r)  | cluster_motion.h |
/// | K                 | geometric stiffness d(J^T f)/dq of constant closure forces f (n x n)  | cluster_motion.h |
/// | zeta, mu          | multipliers of closing a step and of projecting its velocity (m)      | reduced_kernel.h |
/// | E, P, S, X        | matrices of the derivative of a step                                  | reduced_kernel.h |
/// | M^                | mass matrix in reduced coordinates, N^T M N over the tree             | reduced_tree.h   |
///
/// A prime marks quantities at the end of a step (N', J', q+, v+). Subscript c stands for contacts, l for closures. The
/// solver has its own letters: Q and V for its quadratic models, k and K for control and gains (lq_sweep.h).
///
/// ## Errata of the paper ("Optimal Control of Walkers with Parallel Actuation", 2024)
/// Each correction was derived and confirmed by finite differences (tests/test_errata.cpp, docs/signs.md). Equation
/// numbers are the paper's; eqs. 11 to 15 are right as printed.
/// - eqs. 2, 4, 6: the force enters eq. 2 as +J^T lambda on the right; the KKT matrix of eq. 4 and ID in eq. 6 write it
///   on the left with the same sign, so that their lambda has the opposite sign. Here (1) holds everywhere:
///   ID = M a + b - J^T lambda.
/// - eq. 5: the derivative needs a minus, dy/dz = -K^{-1} [d a_c/dz; d ID/dz], both taken at fixed acceleration and
///   fixed lambda; a_0 there stands for the whole constraint acceleration a_c, not only for its velocity part.
/// - eqs. 7, 8: d/dt Log6(X_12) = -nu_c at a closed configuration. A stabilised closure obeys
///   a_c + k_d nu_c - k_p r = 0.
/// - eq. 9: gamma_1 is A_1 in frame 1 (the second line prints the index of body 2).
/// - eq. 19: with phi_2 = -X* lambda (eq. 18), d phi_2/dq = -[X* lambda]* (J_2 - X J_1); the printed sign is the
///   opposite. The Jacobians there are in the frames of the joints, F_j1 and F_j2, not in F_1 and F_2 as the text below
///   it says.
/// - eq. 21: the target velocity is v_s*^{k+1}, at the end of the step; the printed index is k.
