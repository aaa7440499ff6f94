#pragma once
/// \file Text as it stands in XML.
#include <string>

namespace bielle {

/// The text with &, < and " escaped, for attributes and elements.
std::string escapeXml(const std::string& text);

}  // namespace bielle
