#pragma once
// Settings on command lines.
#include <string>
#include <utility>

namespace bielle {

// name=value. \throws InputError that shows the example
std::pair<std::string, std::string> splitSetting(const std::string& flag, const std::string& setting,
                                                 const std::string& example);

// name=number. \throws InputError that shows the example
std::pair<std::string, double> parseSetting(const std::string& flag, const std::string& setting,
                                            const std::string& example);

}  // namespace bielle
