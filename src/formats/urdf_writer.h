#pragma once
/// \file The tree of a robot as a URDF: beside a YAML file, or without one for whom it may concern.
#include <string>

#include "bielle/model/model.h"
#include "formats/format_warnings.h"
#include "formats/xml_document.h"

namespace bielle {

/// The tree with its mimics as <robot>; whatever of it the file cannot say goes to `warnings`.
/// \param for_drake  joints are <drake:joint> where URDF has none, limits are only where there are some, and frames for loops nowhere
/// \throws InputError for joints that it does not have
XMLElement& addUrdfTree(const Model& model, bool for_drake, XMLDocument& document, FormatWarnings& warnings);

/// The URDF of a pair with a YAML file: frames of closures and contacts without a name get one.
/// \param remark  comment at its head
std::string formatUrdfBesideYaml(const Model& model, const std::string& remark);

}  // namespace bielle
