#pragma once
// JSON files, and JSON that people can read: objects over several lines, lists of numbers on one, matrices one row per
// line.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace bielle {

using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8 are replaced.
std::string formatJson(const Json& json, int indent = 0);

/// Elements nested deeper are refused: what copies or prints JSON recurses.
constexpr int kDeepestJson = 100;
/// \throws std::exception when it is no JSON, or nested too deep
Json parseJson(const std::string& text);

/// Hands the object in a file to `read`, which may ask for what is not there.
/// \throws ModelError naming the file when it cannot be read, holds no object, or `read` did not find what it asked for
void readJsonFile(const std::string& path, const std::string& remedy, const std::function<void(const Json&)>& read);

}  // namespace bielle
