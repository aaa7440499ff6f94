#pragma once
// Settings on command lines.
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bielle/model/wear.h"

namespace bielle {

// name=value. \throws InputError that shows the example
std::pair<std::string, std::string> splitSetting(const std::string& flag, const std::string& setting,
                                                 const std::string& example);

// name=number. \throws InputError that shows the example
std::pair<std::string, double> parseSetting(const std::string& flag, const std::string& setting,
                                            const std::string& example);

// The option --play: NAME=SIZE, or several with commas between them. \throws InputError as parseSetting() does
std::vector<Play> parsePlays(const std::vector<std::string>& settings);

// \param given  names that other options have set   \throws InputError where a name is given twice
void requireOnce(const std::string& flag, const std::vector<std::string>& settings, const std::string& example,
                 std::set<std::string> given = {});

}  // namespace bielle
