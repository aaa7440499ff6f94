#include <algorithm>

#include "bielle/design/parametrization.h"
#include "bielle/model/error.h"

namespace bielle {
namespace {

constexpr double kStep = 1e-3;  // of the width of the bounds

// Whether the models agree in everything that a direction cannot change.
bool isSameButForPlaces(const Model& a, const Model& b) {
  const auto same = [](const Vector3d& x, const Vector3d& y) { return (x - y).norm() < 1e-12; };
  bool out = a.numBodies() == b.numBodies() && a.closures().size() == b.closures().size() &&
             a.contacts().size() == b.contacts().size() && a.pointSprings().size() == b.pointSprings().size() &&
             a.jointForces().size() == b.jointForces().size() && a.shapes().size() == b.shapes().size() &&
             same(a.gravity(), b.gravity());
  for (int i = 1; out && i < a.numBodies(); ++i) {
    const Joint &j = a.joints()[i], &k = b.joints()[i];
    out = j.kind == k.kind && same(j.axis, k.axis) && same(j.axis2, k.axis2);
  }
  for (size_t c = 0; out && c < a.closures().size(); ++c) {
    const Closure &j = a.closures()[c], &k = b.closures()[c];
    out = j.kind == k.kind && same(j.axis, k.axis) && j.kp == k.kp && j.kd == k.kd &&
          std::equal(j.terms.begin(), j.terms.end(), k.terms.begin(), k.terms.end(),
                     [](const CouplerTerm& s, const CouplerTerm& t) { return s.higher.size() == t.higher.size(); });
  }
  for (size_t f = 0; out && f < a.jointForces().size(); ++f) {
    const JointForce &j = a.jointForces()[f], &k = b.jointForces()[f];
    out = j.joint == k.joint && j.friction_speed == k.friction_speed;
  }
  return out;
}

// Adds weight times the difference between two models.
void addChange(const Model& from, const Model& to, double weight, ModelVariation& out) {
  const auto addTwist = [weight](const SE3& X, const SE3& Y, Vector6d& twist) {
    twist += weight * log6(X.inverseTimes(Y));
  };
  for (int i = 1; i < from.numBodies(); ++i) {
    addTwist(from.joints()[i].X_PJ, to.joints()[i].X_PJ, out.joints[i]);
    out.inertias[i] += weight * (to.bodies()[i].inertia.toMatrix() - from.bodies()[i].inertia.toMatrix());
  }
  for (size_t c = 0; c < from.closures().size(); ++c) {
    addTwist(from.closures()[c].X_B1, to.closures()[c].X_B1, out.frames1[c]);
    addTwist(from.closures()[c].X_B2, to.closures()[c].X_B2, out.frames2[c]);
    out.offsets[c] += weight * (to.closures()[c].offset - from.closures()[c].offset);
    out.lengths[c] += weight * (to.closures()[c].length - from.closures()[c].length);
    for (size_t i = 0; i < from.closures()[c].terms.size(); ++i) {
      const CouplerTerm &s = from.closures()[c].terms[i], &t = to.closures()[c].terms[i];
      auto row = out.coefficients[c].row(static_cast<Eigen::Index>(i));
      row[0] += weight * (t.coefficient - s.coefficient);
      for (size_t k = 0; k < s.higher.size(); ++k)
        row[static_cast<Eigen::Index>(k) + 1] += weight * (t.higher[k] - s.higher[k]);
    }
  }
  const auto getNumbers = [](const PointSpring& s) {
    return Eigen::Vector4d(s.stiffness, s.rest, s.preload, s.damping);
  };
  for (size_t s = 0; s < from.pointSprings().size(); ++s) {
    const PointSpring &a = from.pointSprings()[s], &b = to.pointSprings()[s];
    out.points1[s] += weight * (b.point1 - a.point1);
    out.points2[s] += weight * (b.point2 - a.point2);
    out.springs[s] += weight * (getNumbers(b) - getNumbers(a));
  }
  const auto getForces = [](const JointForce& f) {
    Vector5d numbers;
    numbers << f.stiffness, f.rest, f.preload, f.damping, f.friction;
    return numbers;
  };
  for (size_t f = 0; f < from.jointForces().size(); ++f)
    out.joint_forces[f] += weight * (getForces(to.jointForces()[f]) - getForces(from.jointForces()[f]));
  for (size_t c = 0; c < from.contacts().size(); ++c)
    addTwist(from.contacts()[c].X_BF, to.contacts()[c].X_BF, out.contacts[c]);
  for (size_t s = 0; s < from.shapes().size(); ++s) {
    const Shape &a = from.shapes()[s], &b = to.shapes()[s];
    addTwist(a.X_BS, b.X_BS, out.shapes[s].frame);
    out.shapes[s].half += weight * (b.half - a.half);
    out.shapes[s].radius += weight * (b.radius - a.radius);
  }
  out.armature += weight * (to.armature() - from.armature());
}

}  // namespace

std::vector<ModelVariation> calcDesignVariations(const Parametrization& robot, const VectorXd& x) {
  const Model here = robot.make(x);
  std::vector<ModelVariation> out(x.size(), ModelVariation(here));
  for (Eigen::Index i : robot.listContinuous()) {
    const double h = kStep * (robot.upper()[i] - robot.lower()[i]);
    for (const auto& [steps, weight] : {std::pair{-2, 1.0}, {-1, -8.0}, {1, 8.0}, {2, -1.0}}) {
      const Model there = robot.make(x + steps * h * VectorXd::Unit(x.size(), i));
      if (!isSameButForPlaces(here, there))
        throw InputError(here.name(), "variable '" + robot.variables()[i].name + "'",
                         "it changes an axis, a gain, gravity or which joints have springs, by which dynamics are not "
                         "differentiated",
                         "leave it out");
      addChange(here, there, weight / (12 * h), out[i]);
    }
  }
  return out;
}

}  // namespace bielle
