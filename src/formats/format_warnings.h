#pragma once
/// \file What a format for other programs cannot say, as warnings.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// What a file says of motors beyond their joints and limits: the ratio and the rotor's inertia, or all that ours says.
enum class MotorData { None, Gears, All };

class FormatWarnings {
 public:
  explicit FormatWarnings(const Model& model) : model_(model) {}

  /// "robot: element: problem"
  void add(const std::string& element, const std::string& problem);
  /// What our YAML file alone says: serial joints, importance of joints, and of windings, gears and losses of motors what is not
  /// `written`.
  void addYamlOnly(MotorData written = MotorData::None);
  /// Armature of joints. \param of_motors  also of those with a motor
  void addArmature(bool of_motors);
  /// Contacts, references and gravity.
  void addTargets();
  /// What a file of bodies and joints, URDF or SDF, does not say: armature, motors, springs between points, contacts, references
  /// and gravity.
  void addBeyondTree();

  const std::vector<std::string>& get() const { return warnings_; }

 private:
  const Model& model_;
  std::vector<std::string> warnings_;
};

}  // namespace bielle
