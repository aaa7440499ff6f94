#pragma once
// The text of the generated files around their formulas. Keys: NAME_ (prefix), REAL, SIZE, FN (suffix of functions), and @..@.

namespace bielle::firmware {

inline constexpr const char* kHeaderText = R"(/* @title@

@about@
*/
#ifndef @guard@
#define @guard@

@open@
@sizes@

typedef REAL NAME_real;

typedef enum {
  NAME_OK,
  NAME_CLAMPED,         /* to the range; the posture is that of the values it holds */
  NAME_NEAR_DEAD_POINT, /* nearer than 0.1: NAME_dead_point_distance() */
  NAME_NOT_REACHED      /* the posture is one of the range, for other values */
} NAME_status;

/* Coordinates of a closed posture; all others follow from those of the joints, or of the motors. */
typedef struct {
  REAL joint[SIZE];
  REAL motor[SIZE];@passive@
} NAME_posture;

/* Speeds of motors for those of joints, R, and back, R^-1. */
typedef struct {
  REAL motor_per_joint[SIZE][SIZE];
  REAL joint_per_motor[SIZE][SIZE];
} NAME_ratio;

/* The posture of the robot's file: of the branch that all functions keep to. */
void NAME_reference(NAME_posture *at);

/* From joints to motors, and back. What is given may be anything, also no number. From `guess`, the posture a short time ago, or,
   where it is null, from anywhere in the range; it may be `at`. @guess@ */
NAME_status NAME_joint_to_motor(const REAL joint[SIZE], const NAME_posture *guess, NAME_posture *at);
NAME_status NAME_motor_to_joint(const REAL motor[SIZE], const NAME_posture *guess, NAME_posture *at);

/* 1 where the posture is on the branch of the reference, else 0. */
int NAME_on_branch(const NAME_posture *at);

void NAME_update_ratio(const NAME_posture *at, NAME_ratio *ratio);
/* Their time derivatives. */
void NAME_update_ratio_rate(const NAME_posture *at, const NAME_ratio *ratio, const REAL joint_velocity[SIZE],
                            NAME_ratio *rate);

/* To the next dead point, or where loops can go on in several ways: the way of a motor or joint, rad or m, by a step of Newton's
   method on a determinant. */
REAL NAME_dead_point_distance(const NAME_posture *at);

/* Speeds, rad/s or m/s, and accelerations. */
void NAME_motor_velocity(const NAME_ratio *ratio, const REAL joint[SIZE], REAL motor[SIZE]);
void NAME_joint_velocity(const NAME_ratio *ratio, const REAL motor[SIZE], REAL joint[SIZE]);
void NAME_motor_acceleration(const NAME_ratio *ratio, const NAME_ratio *rate, const REAL joint_velocity[SIZE],
                             const REAL joint_acceleration[SIZE], REAL motor[SIZE]);

/* What springs, and the weight of cranks and rods, ask of the joints in a posture, N m or N. @held@
   gravity: m/s^2, in the frame of @base@. */
void NAME_held_torque(const NAME_posture *at, const NAME_ratio *ratio, const REAL gravity[3], REAL held[SIZE]);

/* Torques, N m or N, by virtual work: R^T motor = joint + held, of NAME_held_torque(); held may be null. */
void NAME_joint_torque(const NAME_ratio *ratio, const REAL motor[SIZE], const REAL *held, REAL joint[SIZE]);
void NAME_motor_torque(const NAME_ratio *ratio, const REAL joint[SIZE], const REAL *held, REAL motor[SIZE]);
/* What accelerates the motors' own rotors, to be added to that; and their inertia as the joints have it. */
void NAME_rotor_torque(const REAL motor_acceleration[SIZE], REAL motor[SIZE]);
void NAME_reflected_inertia(const NAME_ratio *ratio, REAL inertia[SIZE][SIZE]);

/* Gains kp or kd: of motors, one each, as the joints have them, R^T K R. */
void NAME_joint_gain(const NAME_ratio *ratio, const REAL motor[SIZE], REAL joint[SIZE][SIZE]);
/* Of joints, one each, as the motors need them; what remains at the joints if motors only have the diagonal of that. */
void NAME_motor_gain(const NAME_ratio *ratio, const REAL joint[SIZE], REAL motor[SIZE][SIZE], REAL left[SIZE][SIZE]);

/* The largest s with which the motors can give the torque s direction at the joints, by their limits and, at these speeds, their
   windings; held may be null. Negative if they cannot even hold the linkage; infinite without limits. */
REAL NAME_torque_limit(const NAME_ratio *ratio, const REAL *held, const REAL motor_velocity[SIZE],
                       const REAL direction[SIZE]);
/* The largest s with which the joints can move at s direction. */
REAL NAME_speed_limit(const NAME_ratio *ratio, const REAL direction[SIZE]);
/* The most that each joint can give, and its fastest, with whatever the others do. */
void NAME_joint_limits(const NAME_ratio *ratio, REAL torque[SIZE], REAL speed[SIZE]);

@close@
#endif
)";

// Before all else in `float`. GCC fuses with every standard of C++ and does not know the pragma of the standards; Clang
// fuses with every standard (findings/standards-that-fuse.sh).
inline constexpr const char* kUnfusedText =
    R"(/* The same bits on every processor: no multiplication is fused with an addition. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("fp-contract=off")
#else
#pragma STDC FP_CONTRACT OFF
#endif
)";

inline constexpr const char* kSourceText = R"(/* @title@ See the header. */
@include@

#include <math.h>
#include <stddef.h>

@open_source@static const REAL lower[SIZE] = {@lower@}, upper[SIZE] = {@upper@};
static const REAL motor_lower[SIZE] = {@motor_lower@}, motor_upper[SIZE] = {@motor_upper@};
static const REAL rotor[SIZE] = {@rotor@};
static const REAL effort[SIZE] = {@effort@}, speed[SIZE] = {@speed@};
@winding@
@helpers@static REAL limit(REAL x, REAL low, REAL high) { /* low if x is not a number */
  return x >= low ? (x <= high ? x : high) : low;
}

void NAME_reference(NAME_posture *at) {
@reference@}

/* Whether the motors, and all else, can be found for the joints. */
static int solve_motors(const NAME_posture *guess, NAME_posture *at) {
@solve_motors@}

static int solve_joints(const NAME_posture *guess, NAME_posture *at) {
@solve_joints@}

NAME_status NAME_joint_to_motor(const REAL joint[SIZE], const NAME_posture *guess, NAME_posture *at) {
  NAME_status status = NAME_OK;
  int i;
  for (i = 0; i < SIZE; ++i) {
    at->joint[i] = limit(joint[i], lower[i], upper[i]);
    if (!(joint[i] >= lower[i] && joint[i] <= upper[i])) status = NAME_CLAMPED;
  }
  if (!solve_motors(guess, at)) return NAME_NOT_REACHED;
@near@  return status;
}

NAME_status NAME_motor_to_joint(const REAL motor[SIZE], const NAME_posture *guess, NAME_posture *at) {
  NAME_status status = NAME_OK;
  int i, is_reached, is_outside = 0;
  for (i = 0; i < SIZE; ++i) {
    at->motor[i] = limit(motor[i], motor_lower[i] - @slack@, motor_upper[i] + @slack@);
    if (!(motor[i] >= motor_lower[i] - @slack@ && motor[i] <= motor_upper[i] + @slack@)) status = NAME_CLAMPED;
  }
  is_reached = solve_joints(guess, at);
@check@  for (i = 0; i < SIZE; ++i)
    if (!(at->joint[i] >= lower[i] - @slack@ && at->joint[i] <= upper[i] + @slack@)) is_outside = 1;
  if (!is_reached || is_outside) {
    for (i = 0; i < SIZE; ++i) at->joint[i] = limit(at->joint[i], lower[i], upper[i]);
    if (!solve_motors(NULL, at) || !is_reached) return NAME_NOT_REACHED;
    status = NAME_CLAMPED;
  }
@near@  return status;
}

/* Its result has the sign of the determinant of R, + on the branch of the reference. */
static REAL calc_ratio(const NAME_posture *at, NAME_ratio *ratio) {
@ratio@}

void NAME_update_ratio(const NAME_posture *at, NAME_ratio *ratio) {
  (void)calc_ratio(at, ratio);
}

int NAME_on_branch(const NAME_posture *at) {
  NAME_ratio ratio;
@branch@  return calc_ratio(at, &ratio) > 0;
}

/* The rate of R, and of the logarithm of the determinant that vanishes at dead points of the output. */
static REAL calc_rate(const NAME_posture *at, const NAME_ratio *ratio, const REAL v[SIZE], NAME_ratio *rate) {
  REAL log_rate;
@rate@  return log_rate;
}

void NAME_update_ratio_rate(const NAME_posture *at, const NAME_ratio *ratio, const REAL joint_velocity[SIZE],
                            NAME_ratio *rate) {
  int i, j, k, l;
  (void)calc_rate(at, ratio, joint_velocity, rate);
  for (i = 0; i < SIZE; ++i)
    for (j = 0; j < SIZE; ++j) {
      REAL sum = 0;
      for (k = 0; k < SIZE; ++k)
        for (l = 0; l < SIZE; ++l)
          sum -= ratio->joint_per_motor[i][k] * rate->motor_per_joint[k][l] * ratio->joint_per_motor[l][j];
      rate->joint_per_motor[i][j] = sum;
    }
}

REAL NAME_dead_point_distance(const NAME_posture *at) {
  NAME_ratio ratio, rate;
  REAL way[2][SIZE], nearest = HUGE_VAL@cast_huge@;
  int i, j, k;
  NAME_update_ratio(at, &ratio);
  for (k = 0; k < SIZE; ++k) {
    REAL unit[SIZE];
    for (i = 0; i < SIZE; ++i) unit[i] = i == k ? @one@ : @zero@;
    way[0][k] = way[1][k] = calc_rate(at, &ratio, unit, &rate);
    for (i = 0; i < SIZE; ++i)
      for (j = 0; j < SIZE; ++j) way[1][k] += ratio.joint_per_motor[j][i] * rate.motor_per_joint[i][j];
  }
  for (k = 0; k < 2; ++k) {
    REAL of_joints = 0, of_motors = 0, steepest;
    for (i = 0; i < SIZE; ++i) {
      REAL sum = 0;
      for (j = 0; j < SIZE; ++j) sum += ratio.joint_per_motor[j][i] * way[k][j];
      of_joints += way[k][i] * way[k][i];
      of_motors += sum * sum;
    }
    steepest = sqrtFN(of_joints < of_motors ? of_joints : of_motors);
    if (steepest > 0 && 1 / steepest < nearest) nearest = 1 / steepest;
  }
  return nearest;
}

static void multiply(const REAL A[SIZE][SIZE], const REAL x[SIZE], REAL y[SIZE]) {
  REAL sums[SIZE];
  int i, j;
  for (i = 0; i < SIZE; ++i) {
    sums[i] = 0;
    for (j = 0; j < SIZE; ++j) sums[i] += A[i][j] * x[j];
  }
  for (i = 0; i < SIZE; ++i) y[i] = sums[i];
}

static void multiply_transposed(const REAL A[SIZE][SIZE], const REAL x[SIZE], REAL y[SIZE]) {
  REAL sums[SIZE];
  int i, j;
  for (i = 0; i < SIZE; ++i) {
    sums[i] = 0;
    for (j = 0; j < SIZE; ++j) sums[i] += A[j][i] * x[j];
  }
  for (i = 0; i < SIZE; ++i) y[i] = sums[i];
}

/* A^T diag(x) A */
static void carry(const REAL A[SIZE][SIZE], const REAL x[SIZE], REAL out[SIZE][SIZE]) {
  int i, j, k;
  for (i = 0; i < SIZE; ++i)
    for (j = 0; j < SIZE; ++j) {
      out[i][j] = 0;
      for (k = 0; k < SIZE; ++k) out[i][j] += A[k][i] * x[k] * A[k][j];
    }
}

void NAME_motor_velocity(const NAME_ratio *ratio, const REAL joint[SIZE], REAL motor[SIZE]) {
  multiply(ratio->motor_per_joint, joint, motor);
}

void NAME_joint_velocity(const NAME_ratio *ratio, const REAL motor[SIZE], REAL joint[SIZE]) {
  multiply(ratio->joint_per_motor, motor, joint);
}

void NAME_motor_acceleration(const NAME_ratio *ratio, const NAME_ratio *rate, const REAL joint_velocity[SIZE],
                             const REAL joint_acceleration[SIZE], REAL motor[SIZE]) {
  REAL drift[SIZE];
  int i;
  multiply(rate->motor_per_joint, joint_velocity, drift);
  multiply(ratio->motor_per_joint, joint_acceleration, motor);
  for (i = 0; i < SIZE; ++i) motor[i] += drift[i];
}

void NAME_held_torque(const NAME_posture *at, const NAME_ratio *ratio, const REAL gravity[3], REAL held[SIZE]) {
@held_torque@}

void NAME_joint_torque(const NAME_ratio *ratio, const REAL motor[SIZE], const REAL *held, REAL joint[SIZE]) {
  int i;
  multiply_transposed(ratio->motor_per_joint, motor, joint);
  for (i = 0; i < SIZE && held; ++i) joint[i] -= held[i];
}

void NAME_motor_torque(const NAME_ratio *ratio, const REAL joint[SIZE], const REAL *held, REAL motor[SIZE]) {
  REAL all[SIZE];
  int i;
  for (i = 0; i < SIZE; ++i) all[i] = joint[i] + (held ? held[i] : 0);
  multiply_transposed(ratio->joint_per_motor, all, motor);
}

void NAME_rotor_torque(const REAL motor_acceleration[SIZE], REAL motor[SIZE]) {
  int i;
  for (i = 0; i < SIZE; ++i) motor[i] = rotor[i] * motor_acceleration[i];
}

void NAME_reflected_inertia(const NAME_ratio *ratio, REAL inertia[SIZE][SIZE]) {
  carry(ratio->motor_per_joint, rotor, inertia);
}

void NAME_joint_gain(const NAME_ratio *ratio, const REAL motor[SIZE], REAL joint[SIZE][SIZE]) {
  carry(ratio->motor_per_joint, motor, joint);
}

void NAME_motor_gain(const NAME_ratio *ratio, const REAL joint[SIZE], REAL motor[SIZE][SIZE], REAL left[SIZE][SIZE]) {
  REAL diagonal[SIZE];
  int i;
  carry(ratio->joint_per_motor, joint, motor);
  for (i = 0; i < SIZE; ++i) diagonal[i] = motor[i][i];
  carry(ratio->motor_per_joint, diagonal, left);
  for (i = 0; i < SIZE; ++i) left[i][i] -= joint[i];
}

REAL NAME_torque_limit(const NAME_ratio *ratio, const REAL *held, const REAL motor_velocity[SIZE],
                       const REAL direction[SIZE]) {
  REAL along[SIZE], rest[SIZE], most = HUGE_VAL@cast_huge@;
  int i;
  for (i = 0; i < SIZE; ++i) rest[i] = 0;
  if (held) multiply_transposed(ratio->joint_per_motor, held, rest);
  multiply_transposed(ratio->joint_per_motor, direction, along);
@no_winding@  for (i = 0; i < SIZE; ++i) {
    REAL low = -effort[i], high = effort[i], s;
@with_winding@    if (along[i] > 0)
      s = (high - rest[i]) / along[i];
    else if (along[i] < 0)
      s = (low - rest[i]) / along[i];
    else
      continue;
    if (s < most) most = s;
  }
  return most;
}

REAL NAME_speed_limit(const NAME_ratio *ratio, const REAL direction[SIZE]) {
  REAL along[SIZE], most = HUGE_VAL@cast_huge@;
  int i;
  multiply(ratio->motor_per_joint, direction, along);
  for (i = 0; i < SIZE; ++i) {
    const REAL rate = along[i] < 0 ? -along[i] : along[i];
    if (rate > 0 && speed[i] / rate < most) most = speed[i] / rate;
  }
  return most;
}

void NAME_joint_limits(const NAME_ratio *ratio, REAL torque[SIZE], REAL fastest[SIZE]) {
  int i, j;
  for (j = 0; j < SIZE; ++j) {
    torque[j] = fastest[j] = 0;
    for (i = 0; i < SIZE; ++i) {
      const REAL R = fabsFN(ratio->motor_per_joint[i][j]), S = fabsFN(ratio->joint_per_motor[j][i]);
      if (R > 0) torque[j] += R * effort[i];
      if (S > 0) fastest[j] += S * speed[i];
    }
  }
}
@close_source@)";

inline constexpr const char* kTestText =
    R"(/* Test of NAMEbare: postures of the mechanism with all its bodies and closures. @build@ */
@include@

#include <math.h>
#include <stdio.h>

@using@static const REAL vectors[@count@][@columns@] = { /* joints, motors, R by rows */
@vectors@};

static REAL largest(REAL a, REAL b) { return b <= a ? a : b; } /* b if it is not a number */

int main(void) {
  REAL motors = 0, joints = 0, ratios = 0, powers = 0, scale = 0@rates@;
  int n, i, j, is_ok;
  for (n = 0; n < @count@; ++n) {
    const REAL *joint = vectors[n], *motor = joint + SIZE, *R = motor + SIZE;
    NAME_posture at, back;
    NAME_ratio ratio;
    REAL torque[SIZE], u[SIZE], w[SIZE], step[SIZE], given = 0, taken = 0;
    if (NAME_joint_to_motor(joint, NULL, &at) == NAME_NOT_REACHED) return 1;
    if (NAME_motor_to_joint(motor, NULL, &back) == NAME_NOT_REACHED) return 1;
    if (!NAME_on_branch(&at)) return 1;
    NAME_update_ratio(&at, &ratio);
    for (i = 0; i < SIZE; ++i) {
      motors = largest(motors, fabsFN(at.motor[i] - motor[i]));
      joints = largest(joints, fabsFN(back.joint[i] - joint[i]));
      for (j = 0; j < SIZE; ++j) {
        scale = largest(scale, fabsFN(R[i * SIZE + j]));
        ratios = largest(ratios, fabsFN(ratio.motor_per_joint[i][j] - R[i * SIZE + j]));
      }
    }
    /* Power: what the motors give is what the joints get. */
    for (i = 0; i < SIZE; ++i) torque[i] = (REAL)(1 + i), step[i] = (REAL)(1 - 2 * i);
    NAME_motor_torque(&ratio, torque, NULL, u);
    NAME_motor_velocity(&ratio, step, w);
    for (i = 0; i < SIZE; ++i) given += u[i] * w[i], taken += torque[i] * step[i];
    powers = largest(powers, fabsFN(given - taken));
@rate_check@  }
  {
    REAL none[SIZE];
    NAME_posture at;
    for (i = 0; i < SIZE; ++i) none[i] = NAN;
    if (NAME_joint_to_motor(none, NULL, &at) != NAME_CLAMPED || at.motor[0] != at.motor[0]) return 1;
    if (NAME_motor_to_joint(none, NULL, &at) == NAME_OK || at.joint[0] != at.joint[0]) return 1;
  }
  is_ok = motors <= @motor_tolerance@ && joints <= @joint_tolerance@ && ratios <= @ratio_tolerance@ * scale && powers <= @power_tolerance@@rate_condition@;
  printf("%s: motors to %.1e, joints to %.1e, R to %.1e, power to %.1e: %s\n", "NAMEbare", (double)motors,
         (double)joints, (double)ratios, (double)powers, is_ok ? "ok" : "FAILED");
  return is_ok ? 0 : 1;
}
)";

// In double: the rate of R against a central difference.
inline constexpr const char* kRateTest = R"(    {
      NAME_posture next, last;
      NAME_ratio rate, later, earlier;
      REAL back_step[SIZE];
      for (i = 0; i < SIZE; ++i) {
        back_step[i] = at.joint[i] - 1e-5 * step[i];
        torque[i] = at.joint[i] + 1e-5 * step[i];
      }
      if (NAME_joint_to_motor(torque, &at, &next) == NAME_CLAMPED || NAME_joint_to_motor(back_step, &at, &last) == NAME_CLAMPED) continue;
      NAME_update_ratio(&next, &later);
      NAME_update_ratio(&last, &earlier);
      NAME_update_ratio_rate(&at, &ratio, step, &rate);
      for (i = 0; i < SIZE; ++i)
        for (j = 0; j < SIZE; ++j) {
          const REAL found = (later.motor_per_joint[i][j] - earlier.motor_per_joint[i][j]) / 2e-5;
          rates = largest(rates, fabs(found - rate.motor_per_joint[i][j]) / (1 + fabs(found)));
        }
    }
)";

}  // namespace bielle::firmware
