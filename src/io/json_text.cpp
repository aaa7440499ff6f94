#include "io/json_text.h"

#include "bielle/io/text_file.h"
#include "bielle/model/error.h"

namespace bielle {

namespace {

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

std::string formatJson(const Json& json, int indent) {
  const bool nested = std::any_of(json.begin(), json.end(), [](const Json& item) { return item.is_structured(); });
  if (!json.is_structured() || json.empty() || (json.is_array() && !nested)) return dump(json);
  const std::string margin(indent + 2, ' ');
  std::string text;
  for (const auto& [key, item] : json.items()) {
    text += (text.empty() ? "\n" : ",\n") + margin;
    if (json.is_object()) text += dump(Json(key)) + ": ";
    text += formatJson(item, indent + 2);
  }
  const std::string end = "\n" + std::string(indent, ' ');
  return json.is_object() ? "{" + text + end + "}" : "[" + text + end + "]";
}

void readJsonFile(const std::string& path, const std::string& remedy, const std::function<void(const Json&)>& read) {
  const std::string text = readTextFile(path, remedy);
  try {
    const Json json = Json::parse(text);
    if (!json.is_object()) throw ModelError(path, "JSON", "it is no object", remedy);
    read(json);
  } catch (const Json::exception& error) {
    throw ModelError(path, "JSON", error.what(), remedy);
  }
}

}  // namespace bielle
