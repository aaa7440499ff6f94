#include "formats/decimals.h"

#include <cctype>
#include <cmath>
#include <sstream>

#include "formats/xml_document.h"
#include "math/constants.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr int kFewestDigits = 4;   // of a format with significant digits
constexpr int kDigitsOfFloat = 9;  // by which floats differ

// Of numbers that no placement in a loop depends on.
bool isAside(const std::string& tag) {
  for (const char* other : {"inertial", "visual", "collision", "geom", "camera", "light", "asset", "actuator", "sensor",
                            "keyframe", "gazebo", "transmission", "sensors", "plugin", "contact", "tendon"})
    if (tag == other) return true;
  return false;
}

// Whether it is rounded from a multiple of 15 degrees in radians, or from its sine.
bool isRoundedConstant(double value, double half) {
  constexpr double kStep = kPi / 12, kExact = 1e-14;
  if (std::abs(value) < kStep / 2) return false;
  const double angle = kStep * std::round(value / kStep);
  const double sine = std::abs(value) > 1 ? angle : std::sin(kStep * std::round(std::asin(value) / kStep));
  for (const double constant : {angle, sine})
    if (const double off = std::abs(value - constant); off > kExact && off <= 1.01 * half) return true;
  return false;
}

std::string takeNumbers(const std::string& text, size_t from, size_t count) {
  std::istringstream stream(text);
  std::string word, out;
  for (size_t i = 0; stream >> word && i < from + count; ++i)
    if (i >= from) out += word + " ";
  return out;
}

}  // namespace

void Decimals::add(const std::string& text, double unit, bool are_floats) {
  std::istringstream stream(text);
  for (std::string word; stream >> word;) {
    const std::optional<double> value = parseNumber(word);
    if (!value || !std::isfinite(*value) || *value == 0) continue;
    // Digits from the first that is not zero, and the place of the last one that is written.
    int digits = 0, decimals = 0, exponent = 0;
    bool is_behind = false;
    size_t i = word[0] == '+' || word[0] == '-' ? 1 : 0;
    for (; i < word.size() && (std::isdigit(static_cast<unsigned char>(word[i])) || word[i] == '.'); ++i) {
      if (word[i] == '.') {
        is_behind = true;
        continue;
      }
      digits += digits > 0 || word[i] != '0';
      decimals += is_behind;
    }
    if (i < word.size() && (word[i] == 'e' || word[i] == 'E')) exponent = std::atoi(word.c_str() + i + 1);
    const double last = std::pow(10, exponent - decimals);
    Group& group = groups_[unit];
    if (kind_ == Kind::Angles && unit == 1 && digits >= kFewestDigits && isRoundedConstant(*value, last / 2))
      group.constant = std::max(group.constant, last / 2);
    group.finest = std::min(group.finest, last);
    if (static_cast<int>(group.largest.size()) <= digits) group.largest.resize(digits + 1, 0);
    group.largest[digits] = std::max(group.largest[digits], std::abs(*value));
    group.most_digits = std::max(group.most_digits, digits);
    if (are_floats || digits >= kDigitsOfFloat) {
      const double off = std::abs(*value - static_cast<double>(static_cast<float>(*value)));
      group.all_floats = group.all_floats && off <= 0.51 * last;
      group.largest_float = std::max(group.largest_float, std::abs(*value));
    }
  }
}

int Decimals::most_digits() const {
  int most = 0;
  for (const auto& [unit, group] : groups_) most = std::max(most, group.most_digits);
  return most;
}

double Decimals::Group::calcHalfUnit() const {
  double half = std::max(0.5 * finest, constant);
  if (most_digits >= kFewestDigits) {
    // The largest of those that have nearly all of the digits; zeros at the end are left out by many.
    double most = 0;
    for (int n = std::max(1, most_digits - 2); n <= most_digits; ++n) most = std::max(most, largest[n]);
    half = std::max(half, 0.5 * std::pow(10, std::floor(std::log10(most)) + 1 - most_digits));
  }
  return all_floats ? std::max(half, largest_float * std::pow(2, -24)) : half;
}

// Numbers of few digits, such as right angles in degrees, are hardly rounded where others have more.
double Decimals::calcHalfUnit() const {
  double coarsest = 0, finest = HUGE_VAL;
  for (const auto& [unit, group] : groups_) {
    const double half = unit * group.calcHalfUnit();
    finest = std::min(finest, half);
    if (group.most_digits >= kFewestDigits) coarsest = std::max(coarsest, half);
  }
  return coarsest > 0 ? coarsest : groups_.empty() ? 0 : finest;
}

void GeometryDecimals::add(const tinyxml2::XMLElement& element, bool degrees) {
  const std::string tag = getTag(element);
  if (isAside(tag)) return;
  const auto get = [&](const char* name) { return getAttribute(&element, name); };
  const double turn = degrees ? kPi / 180 : 1;
  for (const char* name : {"pos", "anchor"}) lengths_.add(get(name));
  (tag == "axis" ? angles_ : lengths_).add(get("xyz"));
  for (const char* name : {"rpy", "quat", "axis", "xyaxes", "zaxis"}) angles_.add(get(name));
  angles_.add(get("euler"), turn);
  angles_.add(takeNumbers(get("axisangle"), 0, 3));
  angles_.add(takeNumbers(get("axisangle"), 3, 1), turn);
  lengths_.add(takeNumbers(get("relpose"), 0, 3));
  angles_.add(takeNumbers(get("relpose"), 3, 4));
  const std::string text = element.GetText() ? element.GetText() : "";
  if (tag == "pose") {
    const bool in_degrees = get("degrees") == "true" || get("degrees") == "1";
    lengths_.add(takeNumbers(text, 0, 3));
    angles_.add(takeNumbers(text, 3, 4), in_degrees ? kPi / 180 : 1);
  }
  if (tag == "xyz") angles_.add(text);
  for (const XMLElement* child : getChildren(element)) add(*child, degrees);
}

}  // namespace bielle
