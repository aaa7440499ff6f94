#include "results/setting.h"

#include <charconv>
#include <sstream>

#include "bielle/model/error.h"

namespace bielle {

std::pair<std::string, std::string> splitSetting(const std::string& flag, const std::string& setting,
                                                 const std::string& example) {
  const size_t equals = setting.find('=');
  if (equals == std::string::npos)
    throw InputError("", flag + " '" + setting + "'", "it is not of the form name=value",
                     "e.g. " + flag + " " + example);
  return {setting.substr(0, equals), setting.substr(equals + 1)};
}

std::pair<std::string, double> parseSetting(const std::string& flag, const std::string& setting,
                                            const std::string& example) {
  const size_t equals = setting.find('=');
  double value = 0;
  const char* end = setting.data() + setting.size();
  const char* begin = equals == std::string::npos ? end : setting.data() + equals + 1;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end)
    throw InputError("", flag + " '" + setting + "'", "it is not of the form name=number",
                     "e.g. " + flag + " " + example);
  return {setting.substr(0, equals), value};
}

std::vector<Play> parsePlays(const std::vector<std::string>& settings) {
  std::vector<Play> plays;
  for (const std::string& setting : settings) {
    std::istringstream parts(setting);
    for (std::string part; std::getline(parts, part, ',');) {
      const auto [name, size] = parseSetting("--play", part, "closure_ankle*=0.0003");
      plays.push_back({name, size});
    }
  }
  return plays;
}

void requireOnce(const std::string& flag, const std::vector<std::string>& settings, const std::string& example,
                 std::set<std::string> given) {
  for (const std::string& setting : settings) {
    const std::string name = splitSetting(flag, setting, example).first;
    if (!given.insert(name).second)
      throw InputError("", flag + " " + setting, "'" + name + "' is given twice", "give it once");
  }
}

}  // namespace bielle
