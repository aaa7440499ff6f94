#pragma once
/// \file A robot as a function of named, bounded numbers: parameters of a generator, lengths and shifts of a given robot, ratios of
/// gears, and choices: of parts of a generator, which are architectures, and of motors from a catalogue.
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/variation.h"
#include "bielle/model/options.h"
#include "bielle/robots/robot_loader.h"

namespace bielle {

/// The distance between two places of one body (named as in src/design/draft.h); `to` moves along the line. Or the length of a
/// closure that is a distance, named by `rod` alone.
struct LengthChange {
  std::string from, to;
  Vector3d across = Vector3d::Zero();  ///< unit vector in the body: only the part perpendicular to it counts; zero: all
  std::string stretched;               ///< link whose mass, inertia and drawing grow with the length, or empty
  std::string rod = {};                ///< closure
};

/// A joint or frame moved along a direction of the body that it is fixed to.
struct ShiftChange {
  std::string of;
  Vector3d along = Vector3d::UnitX();  ///< unit vector
};

/// What a gear costs whose ratio i is larger than that of the motor as it comes, with i in units of that ratio. It loses the share
///     loss (1 - 1/i)                                                                                                   (1)
/// of the power in both directions, that which rolls in a planetary stage of ratio i, while the rest turns with the
/// carrier (H. W. Mueller, "Epicyclic Drive Trains", 1982); makers state losses of up to 3 % a stage (maxon GPX UP: Design
/// World, October 2020). It weighs mass_per_effort for each N m by which the motor's largest torque grows: two pairs of
/// motors with the same rotors (LK-Tech MG4010-10 and -36, MG6012-8 and -36, data sheets) differ by 190 g and by 35 N m
/// of stall torque together. Smaller ratios change neither.
struct GearCost {
  double loss = 0.03;
  double mass_per_effort = 0.0054;  ///< kg per N m
};

/// One number. With several lengths, the first one is the value and the others change by the same amount (left and
/// right legs, which need not be equal to the last digit); all shifts are by the value, relative to the given robot.
struct DesignVariable {
  std::string name, unit = "m";
  double lower = 0, upper = 0;
  std::string parameter;  ///< of the generator, or
  std::vector<LengthChange> lengths;
  std::vector<ShiftChange> shifts;
  /// Motors whose gear has the value as its ratio, turns of the rotor per turn of the joint (* stands for any text); or, with
  /// choices, whose type this is.
  std::vector<std::string> motors;
  /// Names of the values 0, 1, ... of a choice: of the parameter, or of motors.
  std::vector<std::string> choices;
  std::vector<Motor> types;         ///< of choices of motors, in their order
  std::vector<std::string> masses;  ///< parameters of the generator that are the mass of one motor of the type
  std::optional<double> start;      ///< of ratios and choices, if it differs from the robot's value
  GearCost gear;                    ///< of ratios

  bool isChoice() const { return !choices.empty(); }
  bool isArchitecture() const { return isChoice() && !parameter.empty(); }
};

/// A value with its unit, or the name of a choice.
std::string describeValue(const DesignVariable& variable, double value);

/// Makes robots from numbers, fast and without files; names and orders are those of the initial model.
class Parametrization {
 public:
  /// A given robot. Where the type of a motor is chosen, the link that carries it, which includes the present one, becomes heavier or
  /// lighter by the difference, a point mass at the joint.
  /// \param source  file that defines the variables, named in errors
  /// \throws InputError for unknown names, places on different bodies, bounds that cross or exclude the given robot,
  ///   two variables that set the same thing
  Parametrization(Model model, std::vector<DesignVariable> variables, std::string source = "");
  /// A generated robot; `settings` are the values of other parameters of the generator. Bounds beyond those of a
  /// parameter are refused as well.
  Parametrization(const std::string& generator, OptionValues settings, std::vector<DesignVariable> variables,
                  std::string source = "");

  const std::vector<DesignVariable>& variables() const { return variables_; }
  const VectorXd& start() const { return start_; }  ///< the robot as it is
  const VectorXd& lower() const { return lower_; }
  const VectorXd& upper() const { return upper_; }
  const Model& startModel() const { return model_; }
  bool isGiven() const { return !generator_; }  ///< not of a generator

  /// Choices of parts of a generator at x: models with the same parts have the same bodies, joints and motors.
  std::vector<int> getArchitecture(const VectorXd& x) const;
  /// Indices of the variables that are not choices.
  std::vector<Eigen::Index> listContinuous() const;
  /// Every combination of choices, with the other variables at their start values; the start design comes first.
  std::vector<VectorXd> listCombinations() const;

  /// A given robot is changed in the order of the variables. Choices are rounded to whole numbers.
  /// \throws InputError when the numbers do not define a robot
  Model make(const VectorXd& x) const;

 private:
  void readStart();
  void refuseSharedTargets(const Model& robot) const;
  OptionSet getParameters() const;
  Model generate(const VectorXd& x) const;
  Model changePlaces(const VectorXd& x) const;
  Model changeMotors(Model model, const VectorXd& x) const;
  void finish();

  std::string source_;
  std::optional<Generator> generator_;
  OptionValues settings_;
  std::vector<DesignVariable> variables_;
  Model model_;
  VectorXd start_, lower_, upper_;
};

/// Derivative of the model with respect to every variable at x, zero for choices. Placements, inertias and armatures
/// are smooth functions of the numbers, polynomials of at most the third degree for lengths and shifts; they are
/// differenced by the five-point rule over a thousandth of the bounds, which is exact for polynomials up to the fourth
/// degree.
/// \throws InputError when a variable changes anything but placements, inertias and armatures (an axis, a gain)
std::vector<ModelVariation> calcDesignVariations(const Parametrization& robot, const VectorXd& x);

}  // namespace bielle
