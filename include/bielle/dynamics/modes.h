#pragma once
/// \file Linear modes: how a robot oscillates about a posture at which it rests.
///
/// At a closed posture at rest, let N be a basis of the motions that the constraints allow (J N = 0), orthonormal in the
/// mass matrix, N^T M N = 1. A small motion is q = q_0 (+) N y. With the derivatives of the constrained dynamics
/// (constrained.h), which hold springs, gravity and the turning of all closure forces,
///
///     y'' + C y' + K y = 0,    K = -N^T M da/dq N,    C = -N^T M da/dv N                                            (1)
///
/// whose solutions are the modes e^{s t} with s an eigenvalue of [0, 1; -K, -C]. A pair of complex s is a mode of the
/// frequency |Im s| / 2 pi and the damping ratio -Re s / |s|; a real s > 0 falls over, and with s = 0
/// nothing holds the mode. Where the robot does not rest, a != 0, Eq. (1) tells how neighbouring motions part from the one
/// that begins.
#include <complex>
#include <vector>

#include "bielle/dynamics/constrained.h"

namespace bielle {

struct Mode {
  std::complex<double> eigenvalue;  ///< s, 1/s, with an imaginary part of 0 or more
  double frequency = 0;             ///< Hz, 0 if s is real
  double damping = 0;               ///< ratio: 0 undamped, 1 at least critically damped, negative if it grows
  Eigen::VectorXcd shape;           ///< nv, the largest entry is 1
};

struct Modes {
  NumericalStatus status = NumericalStatus::Ok;
  double acceleration = 0;  ///< largest |a| at the posture, rad/s^2 or m/s^2: 0 where the robot rests
  VectorXd lambda;          ///< rows, forces of the constraints
  MatrixXd N;               ///< nv x r
  MatrixXd stiffness;       ///< K, r x r, 1/s^2; symmetric at rest
  MatrixXd damping;         ///< C, r x r, 1/s
  std::vector<Mode> modes;  ///< by |s|; r if all oscillate, up to 2 r
};

/// \param constraints  closures and contacts; also locks
/// \param tau  generalized forces (nv) that stay as they are
/// \param rank_tolerance  of singular values of J L^{-T}, M = L L^T, relative to the largest
Modes calcModes(const Model& model, const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef tau,
                double rank_tolerance = 1e-6);
/// The modes of Eq. (1) alone.
std::vector<Mode> calcModes(const MatrixXd& N, const MatrixXd& stiffness, const MatrixXd& damping);

/// Adds a row that holds a dof of a joint with one coordinate where it is.
void addLock(const Model& model, ConstVectorRef q, int joint, ConstraintSet& constraints);

/// The model with springs in place of the contacts of `constraints`, which hold the same loads at q: at every corner of a
/// sole three long ones along the axes of the world.
/// \param lambda  forces of the constraints at rest   \param stiffness  of a contact in every direction, N/m
Model makeCompliantContacts(const Model& model, const ConstraintSet& constraints, ConstVectorRef q,
                            ConstVectorRef lambda, double stiffness);

}  // namespace bielle
