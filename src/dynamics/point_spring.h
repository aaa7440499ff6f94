#pragma once
/// \file The force of springs and dampers between two points (model.h) and its change.
///
/// With the points p_1, p_2 and r = p_2 - p_1, e = kShortestLine, u = r / l, the force on body 1 at p_1 is f u and that on
/// body 2 at p_2 is -f u, both along one line:
///     l = sqrt(r.r + e^2),   l' = u . r',   f = preload + k (l - rest) + c l',   W = (f u, p_1 x f u)              (1)
/// e enters l and u alike, so that f dl is the differential of the energy at every length. When bodies are displaced by
/// twists D_i, and their velocities in the world change by dV_i,
///     dp_i = D_i at p_i,    dp'_i = dV_i at p_i + w_i x dp_i,    dr = dp_2 - dp_1,    dr' = dp'_2 - dp'_1
///     dl = u . dr,   du = (dr - u dl) / l,   dl' = du . r' + u . dr',   d(f u) = (k dl + c dl') u + f du           (2)
/// In the coordinates of body i, which turn with it, the force changes by
///     g_i = d(f u) - D_i,angular x f u                                                                            (3)
/// at a point that stays. Inverse dynamics with W on body 1 and -W on body 2 fixed in the bodies (rnea.h) therefore
/// lacks, for coordinates j and k and the columns J_j of the bodies,
///     dID_j/dy_k = -J_1,j . (g_1, p_1 x g_1) + J_2,j . (g_2, p_2 x g_2)                                            (4)
#include <cmath>

#include "bielle/dynamics/workspace.h"

namespace bielle {

/// l of Eq. (1), m.
template <typename T>
T calcLineLength(const Vector3<T>& r) {
  using std::sqrt;
  return sqrt(r.squaredNorm() + kShortestLine * kShortestLine);
}

/// u of Eq. (1).
template <typename T>
Vector3<T> calcLineDirection(const Vector3<T>& r) {
  return r / calcLineLength<T>(r);
}

/// Eq. (1), in the world.
template <typename T>
struct PointSpringLine {
  PointSpringLine(const WorkspaceOf<T>& ws, const PointSpring& spring)
      : spring(spring),
        V1(ws.V[spring.body1]),
        V2(ws.V[spring.body2]),
        p1(ws.X_WB[spring.body1].act(spring.point1.cast<T>())),
        p2(ws.X_WB[spring.body2].act(spring.point2.cast<T>())) {
    const Vector3<T> r = p2 - p1;
    length = calcLineLength<T>(r);
    u = r / length;
    r_rate = calcVelocityAt(V2, p2) - calcVelocityAt(V1, p1);
    rate = u.dot(r_rate);
    tension = spring.preload + spring.stiffness * (length - spring.rest) + spring.damping * rate;
  }
  static Vector3<T> calcVelocityAt(const Vector6<T>& twist, const Vector3<T>& p) {
    return linear(twist) + angular(twist).cross(p);
  }
  static Vector6<T> makeWrench(const Vector3<T>& p, const Vector3<T>& force) {
    Vector6<T> out;
    linear(out) = force;
    angular(out) = p.cross(force);
    return out;
  }
  /// On body 1; on body 2 its opposite.
  Vector6<T> calcWrench() const { return makeWrench(p1, tension * u); }
  /// d(f u) of Eq. (2), by displacements of the points and changes of their velocities.
  Vector3<T> calcForceChange(const Vector3<T>& dr, const Vector3<T>& dr_rate) const {
    const T dl = u.dot(dr);
    const Vector3<T> du = (dr - dl * u) / length;
    const T dl_rate = du.dot(r_rate) + u.dot(dr_rate);
    return (spring.stiffness * dl + spring.damping * dl_rate) * u + tension * du;
  }
  /// Eqs. (2) to (4) for a coordinate whose columns are J_i of the bodies, and their velocities change by dV_i in body
  /// coordinates.
  struct Change {
    Vector6<T> wrench1, wrench2;  ///< by the coordinate, of Eq. (4)
    Vector6<T> wrench_v;          ///< on body 1 by its rate, on body 2 its opposite
  };
  Change calcChange(const Vector6<T>& J1, const Vector6<T>& J2, const Vector6<T>& dV1, const Vector6<T>& dV2) const {
    const Vector3<T> dp1 = calcVelocityAt(J1, p1), dp2 = calcVelocityAt(J2, p2), dr = dp2 - dp1;
    const Vector6<T> dW1 = dV1 + crossMotion(J1, V1), dW2 = dV2 + crossMotion(J2, V2);
    const Vector3<T> dr_rate =
        calcVelocityAt(dW2, p2) + angular(V2).cross(dp2) - calcVelocityAt(dW1, p1) - angular(V1).cross(dp1);
    const Vector3<T> df = calcForceChange(dr, dr_rate), force = tension * u;
    return {makeWrench(p1, df - angular(J1).cross(force)), makeWrench(p2, df - angular(J2).cross(force)),
            makeWrench(p1, (spring.damping * u.dot(dr)) * u)};
  }

  const PointSpring& spring;
  Vector6<T> V1, V2;
  Vector3<T> p1, p2, u, r_rate;
  T length, rate, tension;
};

/// A shorter line, m, has no direction at the start of a motion.
constexpr double kShortestSpring = 1e-6;

/// l of Eq. (1); needs placements.
inline double calcPointSpringLength(const PointSpring& spring, const Workspace& ws) {
  return calcLineLength<double>(ws.X_WB[spring.body2].act(spring.point2) - ws.X_WB[spring.body1].act(spring.point1));
}

}  // namespace bielle
