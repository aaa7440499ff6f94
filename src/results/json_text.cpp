#include "results/json_text.h"

#include "bielle/model/error.h"
#include "formats/text_file.h"

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

Json parseJson(const std::string& text) {
  return Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepestJson) throw std::runtime_error("it is nested too deeply");
    return true;
  });
}

std::string describeJsonError(const std::exception& error) {
  const std::string text = error.what();
  const auto* json = dynamic_cast<const Json::exception*>(&error);
  if (!json) return text;
  const size_t begin = text.find("] ");  // the library's name of the error comes before
  const std::string plain = begin == std::string::npos ? text : text.substr(begin + 2);
  if (dynamic_cast<const Json::parse_error*>(json)) return "it is not JSON: " + plain.substr(0, plain.find(": "));
  constexpr int kNoSuchKey = 403;
  if (json->id == kNoSuchKey) {
    const size_t quote = plain.find('\'');
    return "it has no entry " + plain.substr(quote, plain.rfind('\'') + 1 - quote);
  }
  return "one of its entries is not what it should be: " + plain;
}

void readJsonFile(const std::string& path, const std::string& remedy, const std::function<void(const Json&)>& read) {
  const std::string text = readTextFile(path, remedy);
  try {
    const Json json = parseJson(text);
    if (!json.is_object()) throw std::runtime_error("it is not an object");
    read(json);
  } catch (const std::exception& error) {
    throw InputError(path, "JSON", describeJsonError(error), remedy);
  }
}

}  // namespace bielle
