#pragma once
/// \file The tree of a robot as a URDF: beside a YAML file, or without one for whom it may concern.
#include <string>

#include "bielle/model/model.h"
#include "io/format_warnings.h"

namespace bielle {

struct UrdfDialect {
  /// Joints as <drake:joint> where URDF has none, limits only where there are some, no frames for loops.
  bool for_drake = false;
  std::string attributes;  ///< of <robot>, each with a space before it
  std::string elements;    ///< after all links and joints
};

/// The tree with its mimics; whatever of it the dialect cannot say goes to `warnings`.
/// \throws ModelError for joints that it does not have
std::string formatUrdfTree(const Model& model, const UrdfDialect& dialect, FormatWarnings& warnings);

/// The URDF of a pair with a YAML file: frames of closures and contacts without a name get one.
/// \param remark  comment at its head
std::string formatUrdfBesideYaml(const Model& model, const std::string& remark);

}  // namespace bielle
