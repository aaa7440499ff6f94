#include "worlds/batch_parameters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "model/number_text.h"
#include "model/rod_end.h"

namespace bielle::worlds {
namespace {

using MatrixView = Eigen::Ref<const MatrixXd>;

constexpr double kShortestRod = 1e-9;  // m: shorter ones have no direction

// A parameter of a name, if it is given. \param is_possible  tells whether a number may be one
template <typename M, typename IsPossible>
void take(const M& given, const char* name, const char* wanted, const IsPossible& is_possible, M& out) {
  if (given.size() == 0) return;
  if constexpr (M::ColsAtCompileTime == 1)
    requireShape(given.transpose(), 1, out.size(), name);
  else
    requireShape(given, out.rows(), out.cols(), name);
  for (Eigen::Index i = 0; i < given.size(); ++i)
    if (!is_possible(given.data()[i])) {
      const Eigen::Index size = M::ColsAtCompileTime == 1 ? 1 : given.rows();
      throw std::invalid_argument("worlds: " + std::string(name) + " of world " + std::to_string(i / size) + " has a " +
                                  std::to_string(given.data()[i]) + "; give numbers that are " + wanted);
    }
  out = given;
}

// What a winding has beside its constant means nothing without one.
void checkWindings(const Model& model, const WorldParameters& p) {
  for (Eigen::Index i = 0; i < p.torque_constants.size(); ++i) {
    const bool is_ideal =
        !(p.resistances.data()[i] > 0) && std::isinf(p.voltages.data()[i]) && std::isinf(p.currents.data()[i]);
    if (p.torque_constants.data()[i] > 0 || is_ideal) continue;
    const Eigen::Index motor = i % p.torque_constants.rows(), world = i / p.torque_constants.rows();
    throw std::invalid_argument("worlds: motor '" + model.motors()[static_cast<size_t>(motor)].name + "' of world " +
                                std::to_string(world) +
                                " has a resistance, a voltage or a current without a torque constant, where they mean "
                                "nothing; give torque_constants, N m/A");
  }
}

}  // namespace

void requireShape(const MatrixView& x, Eigen::Index rows, Eigen::Index columns, const char* name) {
  if (x.rows() == rows && x.cols() == columns) return;
  throw std::invalid_argument("worlds: " + std::string(name) + " is " + std::to_string(x.rows()) + " x " +
                              std::to_string(x.cols()) + "; give " + std::to_string(rows) + " x " +
                              std::to_string(columns) + ", a column per world");
}

WorldParameters makeParameters(const Model& model, int count, double friction) {
  WorldParameters out;
  out.mass_factors.setOnes(model.numBodies(), count);
  for (MatrixXd* x :
       {&out.armatures, &out.effort_limits, &out.torque_constants, &out.resistances, &out.voltages, &out.currents})
    x->resize(model.nu(), count);
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[m];
    out.armatures.row(m).setConstant(model.armature()[motor.dof]);
    out.effort_limits.row(m).setConstant(motor.effort_limit);
    out.torque_constants.row(m).setConstant(motor.drive.torque_constant);
    out.resistances.row(m).setConstant(motor.drive.resistance);
    out.voltages.row(m).setConstant(motor.drive.voltage);
    out.currents.row(m).setConstant(motor.drive.current);
  }
  out.friction.setConstant(count, friction);
  out.delays.setZero(count);
  out.rod_changes.setZero(static_cast<Eigen::Index>(model.closures().size()), count);
  return out;
}

void takeParameters(const Model& model, const WorldParameters& given, WorldParameters& out) {
  const auto isAbove = [](double x) { return x > 0; };
  const auto isPositive = [](double x) { return x > 0 && std::isfinite(x); };
  const auto isNotNegative = [](double x) { return x >= 0 && std::isfinite(x); };
  WorldParameters all = out;
  take(given.mass_factors, "mass_factors", "positive", isPositive, all.mass_factors);
  take(given.armatures, "armatures", "not negative", isNotNegative, all.armatures);
  take(given.effort_limits, "effort_limits", "positive", isAbove, all.effort_limits);
  take(given.friction, "friction", "not negative", isNotNegative, all.friction);
  take(given.delays, "delays", "not negative", isNotNegative, all.delays);
  take(given.torque_constants, "torque_constants", "not negative", isNotNegative, all.torque_constants);
  take(given.resistances, "resistances", "not negative", isNotNegative, all.resistances);
  take(given.voltages, "voltages", "positive", isAbove, all.voltages);
  take(given.currents, "currents", "positive", isAbove, all.currents);
  const auto isFinite = [](double x) { return std::isfinite(x); };
  take(given.rod_changes, "rod_changes", "finite", isFinite, all.rod_changes);
  checkWindings(model, all);
  std::swap(out, all);
}

void updateMotor(const WorldParameters& parameters, int m, int world, Motor& motor) {
  motor.effort_limit = parameters.effort_limits(m, world);
  MotorDrive& drive = motor.drive;
  drive.torque_constant = parameters.torque_constants(m, world);
  if (!drive.hasWinding()) return;
  drive.resistance = parameters.resistances(m, world);
  drive.voltage = parameters.voltages(m, world);
  const double most = drive.efficiency * drive.ratio * drive.torque_constant * parameters.currents(m, world);
  motor.effort_limit = std::min(motor.effort_limit, most);
}

Rods::Rods(const Model& model, const Reduction& reduction) {
  for (const Closure& closure : model.closures()) {
    Rod rod;
    rod.closure = closure.name;
    rod.is_distance = closure.kind == ClosureKind::Distance;
    if (rod.is_distance) {
      rod.length = closure.length;
    } else if (const std::optional<RodEnd> end = findRodEnd(model, closure); end && end->far.norm() > kShortestRod) {
      rod.length = end->far.norm();
      (end->is_first ? rod.shift1 : rod.shift2) =
          (end->is_first ? closure.X_B1 : closure.X_B2).R.transpose() * end->far.normalized();
    } else {
      rod.refusal =
          "it does not close the end of a rod; name a rod with a body of its own, or a closure of type distance";
    }
    rods_.push_back(rod);
  }
  for (const ReducedCluster& cluster : reduction.clusters) {
    if (cluster.rank == cluster.closures.rows) continue;
    for (const int c : cluster.closure_indices)
      rods_[static_cast<size_t>(c)].refusal = "of the " + std::to_string(cluster.closures.rows) +
                                              " rows of its loops " +
                                              std::to_string(cluster.closures.rows - cluster.rank) +
                                              " are redundant, so that they move at the lengths that they have and may "
                                              "lock at others; hold the rod by a ball "
                                              "and a universal joint, or make it a closure of type distance";
  }
}

void Rods::check(const MatrixView& changes) const {
  for (Eigen::Index world = 0; world < changes.cols(); ++world)
    for (size_t c = 0; c < rods_.size(); ++c) {
      const double change = changes(static_cast<Eigen::Index>(c), world);
      if (change == 0) continue;
      std::string why = rods_[c].refusal;
      if (why.empty() && !(rods_[c].length + change > kShortestRod))
        why = "its rod has a length of " + formatNumber(rods_[c].length, "%.6g") + " m; take off less than that";
      if (!why.empty())
        throw std::invalid_argument("worlds: rod_changes of world " + std::to_string(world) + ", closure '" +
                                    rods_[c].closure + "': " + why);
    }
}

void Rods::write(ConstVectorRef changes, int lane, std::vector<ClosureChangeOf<Lanes>>& out) const {
  for (size_t c = 0; c < rods_.size(); ++c) {
    const Rod& rod = rods_[c];
    const double change = changes[static_cast<Eigen::Index>(c)], length = rod.is_distance ? rod.length + change : 0;
    for (int i = 0; i < 3; ++i) {
      out[c].shift1[i].set(lane, change * rod.shift1[i]);
      out[c].shift2[i].set(lane, change * rod.shift2[i]);
    }
    out[c].length.set(lane, length);
    out[c].square.set(lane, length * length);
  }
}

}  // namespace bielle::worlds
