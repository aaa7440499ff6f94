#include "bielle/motion/limits.h"

#include <cmath>

#include "bielle/model/error.h"

namespace bielle {
namespace {

// Limits of coordinates, with the scale s of each.
struct Bounds {
  std::vector<int> dofs;
  std::vector<double> lower, upper;

  void add(int dof, double low, double high) {
    dofs.push_back(dof);
    lower.push_back(low);
    upper.push_back(high);
  }
  double getScale(size_t i) const {
    const double width = upper[i] - lower[i];
    return std::isfinite(width) ? 0.5 * width : 1;
  }
};

// Values by motor: those of the model, except those given by name.
VectorXd replaceByName(const Model& model, VectorXd values, const std::map<std::string, double>& given,
                       const std::string& what) {
  for (const auto& [name, value] : given) {
    const int motor = model.findMotor(name);
    const std::string element = what + " limit of '" + name + "'";
    if (motor < 0) {
      std::string known;
      for (const Motor& m : model.motors()) known += (known.empty() ? "" : ", ") + m.name;
      throw ModelError(model.name(), element, "there is no such motor", "choose one of: " + known);
    }
    if (!(value > 0)) throw ModelError(model.name(), element, "it is not positive", "give a positive limit");
    values[motor] = value;
  }
  return values;
}

Bounds listRanges(const Model& model) {
  Bounds bounds;
  for (int k = 0; k < model.nv(); ++k) {
    const double lower = model.lowerLimits()[k], upper = model.upperLimits()[k];
    const Joint& joint = model.joints()[model.dofs()[k].joint];
    if (joint.nv != 1 || !(std::isfinite(lower) || std::isfinite(upper))) continue;
    if (lower == upper)
      throw ModelError(model.name(), "joint '" + joint.name + "'",
                       "its range has no width, so that no barrier can keep it",
                       "make the joint fixed, or widen its range");
    bounds.add(k, lower, upper);
  }
  return bounds;
}

Bounds listVelocities(const Model& model, const LimitOptions& options) {
  VectorXd limits(model.nu());
  for (int m = 0; m < model.nu(); ++m) limits[m] = model.velocityLimits()[model.motors()[m].dof];
  limits = replaceByName(model, limits, options.velocities, "velocity");
  Bounds bounds;
  for (int m = 0; m < model.nu(); ++m)
    if (std::isfinite(limits[m])) bounds.add(model.motors()[m].dof, -limits[m], limits[m]);
  return bounds;
}

// Eq. (1) or (2)
void addBarrier(const LimitOptions& options, const std::string& name, const Bounds& bounds,
                std::unique_ptr<Residual> residual, StageSpec& stage) {
  const int n = static_cast<int>(bounds.dofs.size());
  VectorXd scale(n);
  for (int i = 0; i < n; ++i) scale[i] = bounds.getScale(i);
  const VectorXd lower = VectorXd::Map(bounds.lower.data(), n), upper = VectorXd::Map(bounds.upper.data(), n);
  if (options.barrier == LimitBarrier::Quadratic)
    stage.costs.push_back(
        {name, options.quadratic_weight,
         Activation::makeBarrier(scale.cwiseAbs2().cwiseInverse(), lower + options.quadratic_margin * scale,
                                 upper - options.quadratic_margin * scale),
         std::move(residual)});
  else
    stage.costs.push_back({name, options.logarithmic_weight,
                           Activation::makeLogBarrier(VectorXd::Ones(n), lower, upper, options.margin * scale),
                           std::move(residual)});
}

}  // namespace

void addLimits(const Model& model, const LimitOptions& options, std::vector<StageSpec>& stages) {
  if (!options.areEnforced()) return;
  VectorXd efforts(model.nu());
  for (int m = 0; m < model.nu(); ++m) efforts[m] = model.motors()[m].effort_limit;
  efforts = replaceByName(model, efforts, options.efforts, "effort");
  const Bounds ranges = listRanges(model), velocities = listVelocities(model, options);
  for (StageSpec& stage : stages) {
    stage.effort_limits = efforts;
    if (!ranges.dofs.empty()) addBarrier(options, "joint ranges", ranges, makeJointPosition(model, ranges.dofs), stage);
    if (!velocities.dofs.empty())
      addBarrier(options, "motor velocities", velocities, makeJointVelocity(velocities.dofs), stage);
  }
}

}  // namespace bielle
