#pragma once
/// \file Coordinates of a joint in MuJoCo, as mjcf.h writes it.
///
/// q_ref is the joint's part of the configuration at which bodies stand in the file (MuJoCo's qpos0). R is the rotation
/// of the joint at q, R2 that by the angle of a planar joint; MuJoCo's quaternions are w x y z. A joint becomes one or
/// several elements of one body, in this order:
///
/// | joint                   | elements                                | qpos                 | qvel                |
/// |-------------------------|-----------------------------------------|----------------------|---------------------|
/// | revolute, continuous    | hinge NAME                              | q                    | v                   |
/// | prismatic               | slide NAME                              | q                    | v                   |
/// | spherical               | ball NAME                               | q_ref^-1 q           | v                   |
/// | universal               | hinges NAME.angle1, NAME.angle2         | q                    | v                   |
/// | planar                  | slides NAME.x, NAME.y, hinge NAME.angle | q                    | R2 (v_x, v_y), rate |
/// | free-flyer of a root    | free NAME                               | position, quaternion | R v_lin, w          |
/// | free-flyer of any other | slides NAME.x, .y, .z, ball NAME        | position, q_ref^-1 q | R v_lin, w          |
///
/// MjcfRotations::Hinges writes the elements `ball NAME` above as hinges NAME.rx, NAME.ry, NAME.rz about x, y, z of the body, each
/// carried by those before it. Their angles (a, b, c) and rates, of the rotation R = q_ref^-1 q and the rate w of the joint:
///     R = Rx(a) Ry(b) Rz(c),   -pi/2 <= b <= pi/2                                                                    (1)
///     w = E(b, c) (a', b', c')                                                                                       (2)
/// E is singular where b is a right angle.
///
/// A root is a body on the world with the identity as placement of its joint: MuJoCo has no other free joints.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// As what rotations about three axes are written; hinges are for programs that have no balls.
enum class MjcfRotations { Balls, Hinges };

bool isMjcfFree(const Joint& joint);
/// Name of the first element.
std::string getMjcfName(const Joint& joint);

// Sizes of all arguments below: nq or nv of the joint.

void calcMjcfPosition(const Joint& joint, ConstVectorRef q_ref, ConstVectorRef q, VectorRef qpos);
/// Its inverse; quaternions are normalised.
void calcPositionFromMjcf(const Joint& joint, ConstVectorRef q_ref, ConstVectorRef qpos, VectorRef q);

/// qvel = T(q) v, T orthogonal; generalized forces are mapped in the same way.
void calcMjcfVelocity(const Joint& joint, ConstVectorRef q, ConstVectorRef v, VectorRef qvel);
/// v = T(q)^T qvel.
void calcVelocityFromMjcf(const Joint& joint, ConstVectorRef q, ConstVectorRef qvel, VectorRef v);
/// dT/dt v: MuJoCo's acceleration is T a + dT/dt v.
void calcMjcfVelocityRate(const Joint& joint, ConstVectorRef q, ConstVectorRef v, VectorRef rate);

// The whole robot.

/// Bodies 1, 2, ... in the order of the file: depth first, children in the order of the model.
std::vector<int> listMjcfBodies(const Model& model);
/// Names of the elements in the order of the file. Slides and hinges have one coordinate each.
std::vector<std::string> listMjcfJoints(const Model& model, MjcfRotations rotations);
/// qpos and qvel of a configuration q and velocity v; q_ref as above, of all joints (nq).
VectorXd calcMjcfQpos(const Model& model, ConstVectorRef q_ref, ConstVectorRef q, MjcfRotations rotations);
VectorXd calcMjcfQvel(const Model& model, ConstVectorRef q_ref, ConstVectorRef q, ConstVectorRef v,
                      MjcfRotations rotations);
/// |cos b| of Eq. (1) of each joint that is written as three hinges, by body; 1 of other joints.
VectorXd calcHingeMargins(const Model& model, ConstVectorRef q_ref, ConstVectorRef q);
inline constexpr double kLeastHingeMargin = 0.1;  ///< below it, hinges turn ten times as fast as the joint

}  // namespace bielle
