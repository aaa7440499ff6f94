#pragma once
// Two robots compared by what they have and how they move, joints matched by name.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "mechanisms.h"

namespace bielle::testing {

inline constexpr double kTolerance = 1e-10;

// Largest differences over random states: relative of matrices, in m and rad of closures.
struct Difference {
  double mass_matrix = 0, bias = 0, closures = 0;
  std::string missing;  // the first element that differs in kind, number or name
  bool isZero() const {
    return missing.empty() && mass_matrix < kTolerance && bias < kTolerance && closures < kTolerance;
  }
};

// The configuration of b that places all bodies as q does those of a; balls of b count from q_ref.
inline VectorXd mapConfiguration(const Model& a, const Model& b, ConstVectorRef q_ref, ConstVectorRef q) {
  VectorXd out = b.makeNeutral();
  for (const Joint& joint : a.joints()) {
    if (joint.nq == 0) continue;
    const Joint& other = b.joints()[b.findJoint(joint.name)];
    out.segment(other.idx_q, other.nq) = q.segment(joint.idx_q, joint.nq);
    if (joint.kind != JointKind::Spherical) continue;
    const Eigen::Quaterniond r0(Eigen::Vector4d(q_ref.segment<4>(joint.idx_q))),
        r(Eigen::Vector4d(q.segment<4>(joint.idx_q)));
    out.segment<4>(other.idx_q) = (r0.conjugate() * r).coeffs();
  }
  return out;
}

inline VectorXd mapVelocity(const Model& a, const Model& b, ConstVectorRef v) {
  VectorXd out(b.nv());
  for (const Joint& joint : a.joints())
    if (joint.nv) out.segment(b.joints()[b.findJoint(joint.name)].idx_v, joint.nv) = v.segment(joint.idx_v, joint.nv);
  return out;
}

inline bool areSame(double a, double b) { return a == b || std::abs(a - b) < 1e-11; }

inline std::string compareParts(const Model& a, const Model& b) {
  if (a.nq() != b.nq() || a.nv() != b.nv() || a.numBodies() != b.numBodies()) return "joints";
  for (int i = 1; i < a.numBodies(); ++i) {
    const Joint& joint = a.joints()[i];
    const int j = b.findJoint(joint.name);
    if (j < 0 || a.bodies()[i].name != b.bodies()[j].name || getNv(b.joints()[j].kind) != joint.nv) return joint.name;
    for (int k = 0; k < joint.nv; ++k) {
      const int ka = joint.idx_v + k, kb = b.joints()[j].idx_v + k;
      if (joint.kind != JointKind::Spherical && joint.kind != JointKind::FreeFlyer &&
          (!areSame(a.lowerLimits()[ka], b.lowerLimits()[kb]) || !areSame(a.upperLimits()[ka], b.upperLimits()[kb])))
        return "limits of " + joint.name;
      if (a.armature()[ka] != b.armature()[kb]) return "armature of " + joint.name;
    }
  }
  if (a.nu() != b.nu()) return "motors";
  for (int i = 0; i < a.nu(); ++i)
    if (a.motors()[i].name != b.motors()[i].name || a.motors()[i].effort_limit != b.motors()[i].effort_limit)
      return "motor " + a.motors()[i].name;
  for (const Frame& frame : a.frames())
    if (b.findFrame(frame.name) < 0) return "frame " + frame.name;
  if (a.closures().size() != b.closures().size() || a.numClosureRows() != b.numClosureRows()) return "closures";
  for (const Closure& closure : a.closures())
    if (const int i = b.findClosure(closure.name); i < 0 || b.closures()[i].kind != closure.kind) return closure.name;
  const auto countPrimitives = [](const Model& model) {  // not every format has meshes
    return std::count_if(model.visuals().begin(), model.visuals().end(),
                         [](const Visual& visual) { return visual.shape != Visual::Shape::Mesh; });
  };
  if (countPrimitives(a) != countPrimitives(b)) return "shapes";
  for (const ContactFrame& contact : a.contacts()) {
    const int i = b.findContact(contact.name);
    if (i < 0 || b.contacts()[i].kind != contact.kind) return contact.name;
    if (std::abs(b.contacts()[i].half_length - contact.half_length) > 1e-11 ||
        std::abs(b.contacts()[i].half_width - contact.half_width) > 1e-11)
      return contact.name;
  }
  if (a.contacts().size() != b.contacts().size()) return "contacts";
  if (a.pointSprings().size() != b.pointSprings().size()) return "point springs";
  for (size_t s = 0; s < a.pointSprings().size(); ++s)
    if (a.pointSprings()[s].name != b.pointSprings()[s].name) return a.pointSprings()[s].name;
  if (a.gravity() != b.gravity()) return "gravity";
  return "";
}

// Differences of the residuals of a closure, wherever the bodies stand.
inline double compareClosure(const Workspace& wa, const Closure& ca, const Workspace& wb, const Closure& cb,
                             ConstVectorRef qa, ConstVectorRef qb) {
  if (ca.kind == ClosureKind::Coupler) {
    double ra = -ca.offset, rb = -cb.offset;
    for (const CouplerTerm& t : ca.terms) ra += t.calcDerivative(0, qa[t.idx_q]);
    for (const CouplerTerm& t : cb.terms) rb += t.calcDerivative(0, qb[t.idx_q]);
    // A coefficient of a pair is 1 in MuJoCo: that of a linear term.
    const size_t y = ca.terms[0].isLinear() ? 0 : 1;
    const double factor = ca.terms.size() == 2 ? ca.terms[y].coefficient / cb.terms[y].coefficient : 1;
    return std::abs(ra - factor * rb);
  }
  const SE3 a1 = getPlacement(wa, ca.body1, ca.X_B1), a2 = getPlacement(wa, ca.body2, ca.X_B2),
            b1 = getPlacement(wb, cb.body1, cb.X_B1), b2 = getPlacement(wb, cb.body2, cb.X_B2);
  double worst = ((a1.p - a2.p) - (b1.p - b2.p)).norm();
  if (ca.kind == ClosureKind::Distance) worst = std::max(worst, std::abs(ca.length - cb.length));
  if (ca.kind == ClosureKind::Slider) {  // the points may be anywhere along their axes
    const Vector3d axis = b1.R * cb.axis, apart = (a1.p - a2.p) - (b1.p - b2.p);
    worst = std::max((apart - axis.dot(apart) * axis).norm(), (a1.R * ca.axis).cross(axis).norm());
  }
  if (ca.kind == ClosureKind::Weld6D || ca.kind == ClosureKind::Slider)
    worst = std::max(worst, (a1.R * a2.R.transpose() - b1.R * b2.R.transpose()).norm());
  if (ca.kind == ClosureKind::Hinge5D) {
    const Vector3d of_a = (a1.R * ca.axis).cross(a2.R * ca.axis), of_b = (b1.R * cb.axis).cross(b2.R * cb.axis);
    worst = std::max(worst, (of_a - of_b).norm());  // the axes may point to either side together
  }
  return worst;
}

inline Difference compare(const Model& a, const Model& b, ConstVectorRef q_ref) {
  Difference out;
  out.missing = compareParts(a, b);
  if (!out.missing.empty()) return out;
  std::mt19937 rng(11);
  Workspace wa(a), wb(b);
  MatrixXd order = MatrixXd::Zero(b.nv(), a.nv());  // of velocities
  for (int k = 0; k < a.nv(); ++k) order.col(k) = mapVelocity(a, b, VectorXd::Unit(a.nv(), k));
  for (int i = 0; i < 4; ++i) {
    const VectorXd qa = a.integrate(q_ref, randomVector(rng, a.nv(), 0.5)), va = randomVector(rng, a.nv());
    const VectorXd qb = mapConfiguration(a, b, q_ref, qa), vb = order * va;
    updatePositions(a, wa, qa), updatePositions(b, wb, qb);
    updateVelocities(a, wa, va), updateVelocities(b, wb, vb);
    updateMassMatrix(a, wa), updateMassMatrix(b, wb);
    updateBias(a, wa), updateBias(b, wb);
    out.mass_matrix = std::max(out.mass_matrix, calcRelativeError(order.transpose() * wb.M * order, wa.M));
    out.bias = std::max(out.bias, calcRelativeError(order.transpose() * wb.b, wa.b));
    for (const Closure& closure : a.closures())
      out.closures =
          std::max(out.closures, compareClosure(wa, closure, wb, b.closures()[b.findClosure(closure.name)], qa, qb));
  }
  return out;
}

}  // namespace bielle::testing
