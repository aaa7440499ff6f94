#pragma once
// What the serial model of a robot (bielle/motion/serial_model.h) lacks of its linkages, over their postures: for trainers
// and controllers whose simulators have a chain.
//
// With T the speeds of the closed robot per unit speeds of the serial joints, J the joints of a linkage, M the mass matrix of
// the closed robot with its rotors and M_s that of the serial one without those of its motors, c the centres of mass and m the
// mass, the closed robot moves at rest as
//     (M_s + D) a + b_s + W g + h = R^T u                                                                           (1)
//     D = (T^T M T - M_s)_JJ,    W = m (dc_s/dq_J - (dc/dq T)_J)^T,    h = -T_J^T tau,                              (2)
// g being gravity less the acceleration of the body that carries the linkage, in its frame, b_s the bias of the serial model and
// tau the springs on joints that it freezes. All of it depends on the posture of the linkage alone. Where cranks and rods weigh
// nothing, (1) is exact, D is R^T diag(armature) R and W is zero; it is exact, too, on a carrier that is fixed. Else what is left
// out is that they pull at a carrier as they move, and feel it turn; and Coriolis forces. Dampers d and friction f of frozen
// joints are, in J,
//     B = T_J^T diag(d) T_J,    f_j = sum_k f_k |T_kj|    (of joint j moving alone).                                (3)
// Torques u within their limits u_m and speeds R v_J within theirs, w_m, are polytopes. The extremes of each joint are
//     alone: min_i u_mi / |R^-1_ji|, min_i w_mi / |R_ij|;    whatever the others do: sum_i |R_ij| u_mi, sum_i |R^-1_ji| w_mi.  (4)
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bielle/motion/serial_model.h"

namespace bielle {

struct LinkagePosture {
  VectorXd motors;                                              // m, rad or m
  MatrixXd ratio;                                               // R: row of the motor, column of the joint
  MatrixXd inertia;                                             // D
  MatrixXd weight;                                              // W, m x 3
  VectorXd held;                                                // h
  MatrixXd damping;                                             // B
  VectorXd friction;                                            // f
  VectorXd torque_alone, torque_most, speed_alone, speed_most;  // Eq. (4); infinite without limits
};

// Over the limits of the joints; sides without limits end where the linkage does, or half a turn or a metre from the
// reference.
struct LinkageTable {
  std::vector<std::string> joints, motors;
  std::string carrier;                    // body that carries the linkage
  std::vector<std::vector<double>> axes;  // values of each joint
  // The last joint changes fastest; none where the linkage cannot follow, or only just.
  std::vector<std::optional<LinkagePosture>> postures;
  // The largest errors halfway between neighbours, by linear interpolation, of entries of R and D.
  double ratio_error = 0, inertia_error = 0;
};

struct SerialTables {
  // Without the forces of frozen joints; the armature of its motors is that of the rotors at the reference.
  SerialModel serial;
  std::vector<LinkageTable> linkages;
  double frozen_mass = 0;  // kg, of bodies whose joints are frozen
};

// \param q_reference  closed configuration where linkages are frozen
// \throws InputError as makeSerialModel() does
SerialTables makeSerialTables(const Model& closed, ConstVectorRef q_reference);

// Eq. (2) to (4) at any posture.
class LinkageEvaluator {
 public:
  // \param linkage  index into SerialModel::replacements   Keeps references to both models.
  LinkageEvaluator(const Model& closed, const SerialModel& serial, size_t linkage);
  ~LinkageEvaluator();

  // Of these joints (m), followed from the closed configuration `q`, which becomes theirs. Nothing, and q stays, if they
  // cannot be reached on the branch of the reference.
  std::optional<LinkagePosture> evaluate(const VectorXd& joints, VectorXd& q);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
