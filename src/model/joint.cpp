#include "model/joint.h"

#include <cmath>

#include "math/constants.h"
#include "math/so3.h"

namespace bielle {
namespace {

using VectorUpTo7 = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 7, 1>;
using ConstQuaternionMap = Eigen::Map<const Eigen::Quaterniond>;

// The exponential of SE(2) goes along an arc: a translation rho and a turn t move by f(t) R(t/2) rho, the chord, with
// f = sin(t/2) / (t/2). It vanishes after a whole turn, whatever rho; for it to have an inverse at every angle, the chord keeps the
// length of the diameter, f = 2 / |t|, from half a turn on, where it turns on smoothly.
struct Chord {
  explicit Chord(double t) : half(0.5 * t) {
    constexpr double kSmall = 0.1;  // below it the truncated terms of the series are below rounding
    const double t2 = t * t;
    if (std::abs(t) >= kPi) {
      f = 2 / std::abs(t);
      df = -f / t;
    } else if (std::abs(t) >= kSmall) {
      f = std::sin(0.5 * t) / (0.5 * t);
      df = (std::cos(0.5 * t) - f) / t;
    } else {
      f = 1 - t2 / 24 * (1 - t2 / 80 * (1 - t2 / 168 * (1 - t2 / 288)));
      df = -t / 12 * (1 - t2 / 40 * (1 - t2 / 112 * (1 - t2 / 216)));
    }
  }
  Eigen::Rotation2Dd half;
  double f, df;  // df = f'(t)
};

Eigen::Vector2d turnLeft(const Eigen::Vector2d& x) { return {-x.y(), x.x()}; }

}  // namespace

const char* getName(JointKind kind) {
  switch (kind) {
    case JointKind::Fixed:
      return "fixed";
    case JointKind::Revolute:
      return "revolute";
    case JointKind::Continuous:
      return "continuous";
    case JointKind::Prismatic:
      return "prismatic";
    case JointKind::Spherical:
      return "spherical";
    case JointKind::Universal:
      return "universal";
    case JointKind::Planar:
      return "planar";
    case JointKind::FreeFlyer:
      return "free-flyer";
  }
  return "?";
}

int getNq(JointKind kind) {
  switch (kind) {
    case JointKind::Fixed:
      return 0;
    case JointKind::Spherical:
      return 4;
    case JointKind::Universal:
      return 2;
    case JointKind::Planar:
      return 3;
    case JointKind::FreeFlyer:
      return 7;
    default:
      return 1;
  }
}

int getNv(JointKind kind) {
  switch (kind) {
    case JointKind::Fixed:
      return 0;
    case JointKind::Spherical:
      return 3;
    case JointKind::Universal:
      return 2;
    case JointKind::Planar:
      return 3;
    case JointKind::FreeFlyer:
      return 6;
    default:
      return 1;
  }
}

Matrix3d makePlaneBasis(const Vector3d& normal) {
  Matrix3d B;
  B.col(2) = normal;
  const Vector3d seed = std::abs(normal.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  B.col(0) = (seed - seed.dot(normal) * normal).normalized();
  B.col(1) = normal.cross(B.col(0));
  return B;
}

SE3 calcJointPlacement(const Joint& joint, ConstVectorRef q) {
  switch (joint.kind) {
    case JointKind::Fixed:
      return {};
    case JointKind::Revolute:
    case JointKind::Continuous:
      return {makeAxisRotation(joint.axis, q[0]), Vector3d::Zero()};
    case JointKind::Prismatic:
      return {Matrix3d::Identity(), joint.axis * q[0]};
    case JointKind::Spherical:
      return {ConstQuaternionMap(q.data()).toRotationMatrix(), Vector3d::Zero()};
    case JointKind::Universal:
      return {makeAxisRotation(joint.axis, q[0]) * makeAxisRotation(joint.axis2, q[1]), Vector3d::Zero()};
    case JointKind::Planar: {
      const Matrix3d B = makePlaneBasis(joint.axis);
      return {makeAxisRotation(joint.axis, q[2]), B.leftCols<2>() * q.head<2>()};
    }
    case JointKind::FreeFlyer:
      return {ConstQuaternionMap(q.data() + 3).toRotationMatrix(), q.head<3>()};
  }
  return {};
}

template <>
SE3 calcJointPlacement<double>(const Joint& joint, ConstVectorRef q) {
  return calcJointPlacement(joint, q);
}

// Kinds common in loops; others are computed lane by lane.
template <>
SE3Of<Lanes> calcJointPlacement<Lanes>(const Joint& joint, ArgumentsOf<Lanes>::ConstVector q) {
  switch (joint.kind) {
    case JointKind::Revolute:
    case JointKind::Continuous:
      return {makeAxisRotation(joint.axis, q[0]), Vector3<Lanes>::Zero()};
    case JointKind::Spherical:
      return {Eigen::Map<const Eigen::Quaternion<Lanes>>(q.data()).toRotationMatrix(), Vector3<Lanes>::Zero()};
    case JointKind::Universal:
      return {makeAxisRotation(joint.axis, q[0]) * makeAxisRotation(joint.axis2, q[1]), Vector3<Lanes>::Zero()};
    default:
      break;
  }
  SE3Of<Lanes> out;
  VectorUpTo7 one(joint.nq);
  for (Eigen::Index l = 0; l < kLane; ++l) {
    unpackLane(q.data(), l, joint.nq, one.data());
    const SE3 X = calcJointPlacement(joint, one);
    for (int k = 0; k < 9; ++k) out.R(k).set(l, X.R(k));
    for (int k = 0; k < 3; ++k) out.p[k].set(l, X.p[k]);
  }
  return out;
}

void calcJointSubspace(const Joint& joint, ConstVectorRef q, Eigen::Ref<Matrix6Xd> S) {
  S.setZero();
  switch (joint.kind) {
    case JointKind::Fixed:
      break;
    case JointKind::Revolute:
    case JointKind::Continuous:
      S.col(0).tail<3>() = joint.axis;
      break;
    case JointKind::Prismatic:
      S.col(0).head<3>() = joint.axis;
      break;
    case JointKind::Spherical:
      S.bottomLeftCorner<3, 3>().setIdentity();
      break;
    case JointKind::Universal:
      S.col(0).tail<3>() = makeAxisRotation(joint.axis2, -q[1]) * joint.axis;
      S.col(1).tail<3>() = joint.axis2;
      break;
    case JointKind::Planar: {
      const Matrix3d B = makePlaneBasis(joint.axis);
      S.topLeftCorner<3, 2>() = B.leftCols<2>();
      S.col(2).tail<3>() = B.col(2);
      break;
    }
    case JointKind::FreeFlyer:
      S.topLeftCorner<6, 6>().setIdentity();
      break;
  }
}

void integrateJoint(const Joint& joint, ConstVectorRef q, ConstVectorRef dv, VectorRef q_out) {
  switch (joint.kind) {
    case JointKind::Spherical: {
      const Eigen::Quaterniond product = ConstQuaternionMap(q.data()) * exp3AsQuaternion(dv);
      q_out = product.normalized().coeffs();
      break;
    }
    case JointKind::Planar: {
      const Chord chord(dv[2]);
      const Eigen::Rotation2Dd half_way = Eigen::Rotation2Dd(q[2]) * chord.half;
      q_out << q.head<2>() + half_way * Eigen::Vector2d(chord.f * dv.head<2>()), q[2] + dv[2];
      break;
    }
    case JointKind::FreeFlyer: {
      const SE3 step = exp6(dv);
      const ConstQuaternionMap quat(q.data() + 3);
      const Vector3d p = q.head<3>() + quat.toRotationMatrix() * step.p;
      const Eigen::Quaterniond product = quat * Eigen::Quaterniond(step.R);
      q_out.head<3>() = p;
      q_out.tail<4>() = product.normalized().coeffs();
      break;
    }
    default:
      q_out = q + dv;
  }
}

template <>
void integrateJoint<double>(const Joint& joint, ConstVectorRef q, ConstVectorRef dv, VectorRef q_out) {
  integrateJoint(joint, q, dv, q_out);
}

template <>
void integrateJoint<Lanes>(const Joint& joint, ArgumentsOf<Lanes>::ConstVector q, ArgumentsOf<Lanes>::ConstVector dv,
                           ArgumentsOf<Lanes>::Vector q_out) {
  if (joint.kind == JointKind::Spherical) {
    using Quaternion = Eigen::Quaternion<Lanes>;
    const Quaternion product = Eigen::Map<const Quaternion>(q.data()) * exp3AsQuaternion(Vector3<Lanes>(dv.head<3>()));
    q_out = product.coeffs() * (1 / sqrt(product.coeffs().squaredNorm()));
  } else if (joint.kind == JointKind::Planar || joint.kind == JointKind::FreeFlyer) {
    VectorUpTo7 q_one(joint.nq), dv_one(joint.nv), out(joint.nq);
    for (Eigen::Index l = 0; l < kLane; ++l) {
      unpackLane(q.data(), l, joint.nq, q_one.data());
      unpackLane(dv.data(), l, joint.nv, dv_one.data());
      integrateJoint(joint, q_one, dv_one, out);
      for (int k = 0; k < joint.nq; ++k) q_out[k].set(l, out[k]);
    }
  } else {
    q_out = q + dv;
  }
}

void calcJointDifference(const Joint& joint, ConstVectorRef q0, ConstVectorRef q1, VectorRef dv) {
  switch (joint.kind) {
    case JointKind::Spherical: {
      const Matrix3d R0 = ConstQuaternionMap(q0.data()).toRotationMatrix();
      dv.head<3>() = log3(R0.transpose() * ConstQuaternionMap(q1.data()).toRotationMatrix());
      break;
    }
    case JointKind::Planar: {
      const double angle = q1[2] - q0[2];
      const Chord chord(angle);
      const Eigen::Rotation2Dd half_way = Eigen::Rotation2Dd(q0[2]) * chord.half;
      dv << half_way.inverse() * Eigen::Vector2d((q1 - q0).head<2>() / chord.f), angle;
      break;
    }
    case JointKind::FreeFlyer:
      dv.head<6>() = log6(calcJointPlacement(joint, q0).inverseTimes(calcJointPlacement(joint, q1)));
      break;
    default:
      dv = q1 - q0;
  }
}

void calcJointDifference(const Joint& joint, ArgumentsOf<Lanes>::ConstVector q0, ArgumentsOf<Lanes>::ConstVector q1,
                         ArgumentsOf<Lanes>::Vector dv) {
  using QuaternionMap = Eigen::Map<const Eigen::Quaternion<Lanes>>;
  switch (joint.kind) {
    case JointKind::Spherical: {
      const Matrix3<Lanes> R0 = QuaternionMap(q0.data()).toRotationMatrix();
      dv = log3<Lanes>(R0.transpose() * QuaternionMap(q1.data()).toRotationMatrix());
      break;
    }
    case JointKind::FreeFlyer: {
      const SE3Of<Lanes> X0(QuaternionMap(q0.data() + 3).toRotationMatrix(), q0.head<3>());
      dv = log6(X0.inverseTimes({QuaternionMap(q1.data() + 3).toRotationMatrix(), q1.head<3>()}));
      break;
    }
    case JointKind::Planar: {
      Vector3d from, to, one;
      for (Eigen::Index l = 0; l < kLane; ++l) {
        unpackLane(q0.data(), l, 3, from.data());
        unpackLane(q1.data(), l, 3, to.data());
        calcJointDifference(joint, from, to, one);
        for (int k = 0; k < 3; ++k) dv[k].set(l, one[k]);
      }
      break;
    }
    default:
      dv = q1 - q0;
  }
}

void calcJointIntegrateJacobians(const Joint& joint, ConstVectorRef dv, MatrixRef J_q, MatrixRef J_dv) {
  switch (joint.kind) {
    case JointKind::Spherical:
      J_q = exp3(dv).transpose();
      J_dv = calcRightJacobian3(dv);
      break;
    case JointKind::Planar: {
      const Chord chord(dv[2]);
      const Eigen::Vector2d rho = dv.head<2>();
      const Eigen::Matrix2d back = chord.half.inverse().toRotationMatrix();
      J_q << back * back, back * (chord.f * turnLeft(rho)), 0, 0, 1;
      J_dv << chord.f * back, back * (chord.df * rho + 0.5 * chord.f * turnLeft(rho)), 0, 0, 1;
      break;
    }
    case JointKind::FreeFlyer:
      J_q = exp6(dv).inverse().toActionMatrix();
      J_dv = calcRightJacobian6(dv);
      break;
    default:
      J_q.setIdentity();
      J_dv.setIdentity();
  }
}

void calcJointDifferenceJacobian(const Joint& joint, ConstVectorRef dv, MatrixRef J_q1) {
  switch (joint.kind) {
    case JointKind::Spherical:
      J_q1 = calcRightJacobianInverse3(dv);
      break;
    case JointKind::Planar: {
      const Chord chord(dv[2]);
      const Eigen::Vector2d rho = dv.head<2>();
      J_q1 << 1 / chord.f * chord.half.toRotationMatrix(), -(chord.df / chord.f * rho + 0.5 * turnLeft(rho)), 0, 0, 1;
      break;
    }
    case JointKind::FreeFlyer:
      J_q1 = calcRightJacobianInverse6<double>(dv);
      break;
    default:
      J_q1.setIdentity();
  }
}

void calcJointDifferenceJacobian(const Joint& joint, ArgumentsOf<Lanes>::ConstVector dv,
                                 ArgumentsOf<Lanes>::Matrix J_q1) {
  switch (joint.kind) {
    case JointKind::Spherical:
      J_q1 = calcRightJacobianInverse3<Lanes>(dv);
      break;
    case JointKind::Planar: {
      Vector3d one;
      Matrix3d J;
      for (Eigen::Index l = 0; l < kLane; ++l) {
        unpackLane(dv.data(), l, 3, one.data());
        calcJointDifferenceJacobian(joint, one, J);
        for (int c = 0; c < 3; ++c)
          for (int r = 0; r < 3; ++r) J_q1(r, c).set(l, J(r, c));
      }
      break;
    }
    case JointKind::FreeFlyer:
      J_q1 = calcRightJacobianInverse6<Lanes>(dv);
      break;
    default:
      J_q1.setIdentity();
  }
}

void setNeutral(JointKind kind, VectorRef q) {
  q.setZero();
  if (kind == JointKind::Spherical) q[3] = 1;
  if (kind == JointKind::FreeFlyer) q[6] = 1;
}

}  // namespace bielle
