#include "io/json_text.h"

namespace bielle {

std::string formatJson(const Json& json, int indent) {
  const bool nested = std::any_of(json.begin(), json.end(), [](const Json& item) { return item.is_structured(); });
  if (!json.is_structured() || json.empty() || (json.is_array() && !nested)) return json.dump();
  const std::string margin(indent + 2, ' ');
  std::string text;
  for (const auto& [key, item] : json.items()) {
    text += (text.empty() ? "\n" : ",\n") + margin;
    if (json.is_object()) text += Json(key).dump() + ": ";
    text += formatJson(item, indent + 2);
  }
  const std::string end = "\n" + std::string(indent, ' ');
  return json.is_object() ? "{" + text + end + "}" : "[" + text + end + "]";
}

}  // namespace bielle
