#include "bielle/design/gradient.h"

#include <algorithm>
#include <cmath>

#include "bielle/model/error.h"

namespace bielle {
namespace {

constexpr double kStep = 1e-3;  // of the width of the bounds
constexpr int kStretches = 12;  // of a motion, for peaks

// What a direction cannot carry.
bool isSameButForPlaces(const Model& a, const Model& b) {
  const auto same = [](const Vector3d& x, const Vector3d& y) { return (x - y).norm() < 1e-12; };
  bool out = a.numBodies() == b.numBodies() && a.closures().size() == b.closures().size() &&
             a.contacts().size() == b.contacts().size() && same(a.gravity(), b.gravity());
  for (int i = 1; out && i < a.numBodies(); ++i) {
    const Joint &j = a.joints()[i], &k = b.joints()[i];
    out = j.kind == k.kind && same(j.axis, k.axis) && same(j.axis2, k.axis2);
  }
  for (size_t c = 0; out && c < a.closures().size(); ++c) {
    const Closure &j = a.closures()[c], &k = b.closures()[c];
    out = j.kind == k.kind && same(j.axis, k.axis) && j.kp == k.kp && j.kd == k.kd;
  }
  return out;
}

// Adds weight times the way from one model to another.
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
  }
  for (size_t c = 0; c < from.contacts().size(); ++c)
    addTwist(from.contacts()[c].X_BF, to.contacts()[c].X_BF, out.contacts[c]);
  out.armature += weight * (to.armature() - from.armature());
}

int countNodes(const MotorSlopes& motion) { return static_cast<int>(motion.dt.size()); }

MeasurePieces makePieces(size_t pieces, size_t variables) {
  const auto rows = static_cast<Eigen::Index>(pieces), columns = static_cast<Eigen::Index>(variables);
  return {VectorXd::Zero(rows), MatrixXd::Zero(rows, columns)};
}

// Eq. (1)
void addRms(const MotorSlopes& motion, int m, Eigen::Index piece, MeasurePieces& out) {
  double duration = 0, squares = 0;
  for (int k = 0; k < countNodes(motion); ++k) {
    duration += motion.dt[k];
    squares += motion.dt[k] * motion.u(m, k) * motion.u(m, k);
  }
  const double value = duration > 0 ? std::sqrt(squares / duration) : 0;
  if (value == 0) return;
  out.values[piece] = value;
  for (size_t i = 0; i < motion.du.size(); ++i)
    for (int k = 0; k < countNodes(motion); ++k)
      out.gradients(piece, i) += motion.dt[k] * motion.u(m, k) * motion.du[i](m, k) / (duration * value);
}

// Eq. (2)
void addEnergy(const MotorSlopes& motion, int m, Eigen::Index piece, MeasurePieces& out) {
  for (int k = 0; k < countNodes(motion); ++k) {
    const double u = motion.u(m, k), v = motion.v(m, k);
    out.values[piece] += motion.dt[k] * std::abs(u * v);
    for (size_t i = 0; i < motion.du.size(); ++i)
      out.gradients(piece, i) +=
          motion.dt[k] * (u * v < 0 ? -1 : 1) * (motion.du[i](m, k) * v + u * motion.dv[i](m, k));
  }
}

// Eq. (3)
void addPeak(const MotorSlopes& motion, int m, int stretch, Eigen::Index piece, MeasurePieces& out) {
  const int begin = stretch * countNodes(motion) / kStretches, end = (stretch + 1) * countNodes(motion) / kStretches;
  for (int k = begin; k < end; ++k) {
    if (!(std::abs(motion.u(m, k)) > out.values[piece])) continue;
    out.values[piece] = std::abs(motion.u(m, k));
    for (size_t i = 0; i < motion.du.size(); ++i)
      out.gradients(piece, i) = motion.u(m, k) < 0 ? -motion.du[i](m, k) : motion.du[i](m, k);
  }
}

}  // namespace

bool hasGradient(Measure measure) {
  return measure == Measure::PeakTorque || measure == Measure::RmsTorque || measure == Measure::Energy;
}

std::vector<ModelVariation> calcDesignVariations(const Parametrization& robot, const VectorXd& x) {
  const Model here = robot.make(x);
  std::vector<ModelVariation> out(x.size(), ModelVariation(here));
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double h = kStep * (robot.upper()[i] - robot.lower()[i]);
    for (const auto& [steps, weight] : {std::pair{-2, 1.0}, {-1, -8.0}, {1, 8.0}, {2, -1.0}}) {
      const Model there = robot.make(x + steps * h * VectorXd::Unit(x.size(), i));
      if (!isSameButForPlaces(here, there))
        throw ModelError(here.name(), "variable '" + robot.variables()[i].name + "'",
                         "it changes an axis, gain or gravity: motor torques have no gradient along it",
                         "search without gradients, by bobyqa or sbplx");
      addChange(here, there, weight / (12 * h), out[i]);
    }
  }
  return out;
}

MotorSlopes calcMotorSlopes(const Model& model, const std::vector<int>& kept_dofs, const SerialTrajectory& trajectory,
                            const LiftResult& lifted, const std::vector<ModelVariation>& variations) {
  const int N = static_cast<int>(lifted.dt.size()), nu = model.nu();
  MotorSlopes out{lifted.dt, MatrixXd(nu, N), MatrixXd(nu, N), {}, {}, ""};
  out.du.assign(variations.size(), MatrixXd::Zero(nu, N));
  out.dv = out.du;
  KeptMotion motion(model, kept_dofs);
  KeptMotion::Variation variation(model);
  for (int k = 0; k < N; ++k) {
    KeptMotionStatus status = motion.update(lifted.constraints[k], lifted.trajectory.xs[k].head(model.nq()),
                                            trajectory.v[k], trajectory.a[k], trajectory.forces[k]);
    for (size_t i = 0; i < variations.size() && status == KeptMotionStatus::Ok; ++i) {
      status = motion.calcVariation(variations[i], variation);
      if (status != KeptMotionStatus::Ok) break;
      if (lifted.dt[k] > 0) out.du[i].col(k) = variation.u;
      for (int m = 0; m < nu; ++m) out.dv[i](m, k) = variation.motion.v[model.motors()[m].dof];
    }
    if (status != KeptMotionStatus::Ok) {
      out.failure = std::string("no gradient at node ") + std::to_string(k) + ": " + getMessage(status);
      return out;
    }
    out.u.col(k) = lifted.dt[k] > 0 ? motion.u() : VectorXd(VectorXd::Zero(nu));
    for (int m = 0; m < nu; ++m) out.v(m, k) = motion.v()[model.motors()[m].dof];
  }
  return out;
}

MeasurePieces calcMeasurePieces(Measure measure, const std::vector<int>& motors,
                                const std::vector<MotorSlopes>& motions) {
  const size_t variables = motions.front().du.size(), pairs = motors.size() * motions.size();
  const int stretches = measure == Measure::PeakTorque ? kStretches : 1;
  MeasurePieces out = makePieces(measure == Measure::Energy ? 1 : pairs * stretches, variables);
  Eigen::Index piece = 0;
  for (const MotorSlopes& motion : motions)
    for (int m : motors) {
      if (measure == Measure::Energy) addEnergy(motion, m, 0, out);
      if (measure == Measure::RmsTorque) addRms(motion, m, piece, out);
      for (int s = 0; s < stretches; ++s, ++piece)
        if (measure == Measure::PeakTorque) addPeak(motion, m, s, piece, out);
    }
  return out;
}

}  // namespace bielle
