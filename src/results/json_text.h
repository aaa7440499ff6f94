#pragma once
// JSON files, and human-readable JSON: objects over several lines, lists of numbers on one line, matrices one row per
// line.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace bielle {

using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8 are replaced.
std::string formatJson(const Json& json, int indent = 0);

/// Deeper nesting is rejected, because copying and printing JSON recurses.
constexpr int kDeepestJson = 100;
/// \throws std::exception when it is not JSON, or nested too deep
Json parseJson(const std::string& text);

/// What is wrong with a text or its entries, without the names that the library gives to its errors. Other errors as
/// they are.
std::string describeJsonError(const std::exception& error);

/// Passes the object in a file to `read`, which may access missing elements.
/// \throws InputError naming the file when it cannot be read, holds no object, or lacks an element that `read` accesses
void readJsonFile(const std::string& path, const std::string& remedy, const std::function<void(const Json&)>& read);

}  // namespace bielle
