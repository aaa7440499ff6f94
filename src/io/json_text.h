#pragma once
// JSON that people can read: objects over several lines, lists of numbers on one, matrices one row per line.
#include <nlohmann/json.hpp>

namespace bielle {

using Json = nlohmann::ordered_json;

std::string formatJson(const Json& json, int indent = 0);

}  // namespace bielle
