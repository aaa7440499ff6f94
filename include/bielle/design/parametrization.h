#pragma once
/// \file A robot as a function of named, bounded numbers: parameters of a generator, or lengths and shifts of a given
/// robot.
#include <string>
#include <vector>

#include "bielle/dynamics/variation.h"

namespace bielle {

/// The distance between two places of one body (named as in src/design/draft.h); `to` moves along the line.
struct LengthChange {
  std::string from, to;
  Vector3d across = Vector3d::Zero();  ///< unit vector in the body: only the part perpendicular to it counts; zero: all
  std::string stretched;               ///< link whose mass, inertia and drawing grow with the length, or empty
};

/// A joint or frame moved along a direction of the body that it is fixed to.
struct ShiftChange {
  std::string of;
  Vector3d along = Vector3d::UnitX();  ///< unit vector
};

/// One number. With several lengths, the first one is the value and the others change by the same amount (left and
/// right legs, which need not be equal to the last digit); all shifts are by the value, relative to the given robot.
struct DesignVariable {
  std::string name, unit = "m";
  double lower = 0, upper = 0;
  std::string parameter;  ///< of the generator, or
  std::vector<LengthChange> lengths;
  std::vector<ShiftChange> shifts;
};

/// Makes robots from numbers, fast and without files; names and orders are those of the initial model.
class Parametrization {
 public:
  /// A given robot.
  /// \param source  file that defines the variables, named in errors
  /// \throws ModelError for unknown names, places on different bodies, bounds that cross or exclude the given robot
  Parametrization(Model model, std::vector<DesignVariable> variables, std::string source = "");
  /// A generated robot; `settings` are the values of other parameters of the generator.
  Parametrization(const std::string& generator, std::vector<std::pair<std::string, double>> settings,
                  std::vector<DesignVariable> variables, std::string source = "");

  const std::vector<DesignVariable>& variables() const { return variables_; }
  const VectorXd& start() const { return start_; }  ///< the robot as it is
  const VectorXd& lower() const { return lower_; }
  const VectorXd& upper() const { return upper_; }
  const Model& startModel() const { return model_; }

  /// A given robot is changed in the order of the variables.
  /// \throws ModelError when the numbers do not define a robot
  Model make(const VectorXd& x) const;

 private:
  Model generate(const VectorXd* x, VectorXd* start) const;
  void finish();

  std::string source_, generator_;
  std::vector<std::pair<std::string, double>> settings_;
  std::vector<DesignVariable> variables_;
  Model model_;
  VectorXd start_, lower_, upper_;
};

/// Derivative of the model with respect to every variable at x. Placements, inertias and armatures are smooth functions
/// of the numbers, polynomials of at most the third degree for lengths and shifts; they are differenced by the
/// five-point rule over a thousandth of the bounds, which is exact for polynomials up to the fourth degree.
/// \throws ModelError when a variable changes anything but placements, inertias and armatures (an axis, a gain)
std::vector<ModelVariation> calcDesignVariations(const Parametrization& robot, const VectorXd& x);

}  // namespace bielle
