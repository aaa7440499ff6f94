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
    const double last = unit * std::pow(10, exponent - decimals);
    if (kind_ == Kind::Angles && unit == 1 && digits >= kFewestDigits && isRoundedConstant(*value, last / 2))
      constant_ = std::max(constant_, last / 2);
    finest_ = unit_ == 0 ? last : std::min(finest_, last);
    unit_ = unit;
    if (static_cast<int>(largest_.size()) <= digits) largest_.resize(digits + 1, 0);
    largest_[digits] = std::max(largest_[digits], std::abs(*value) * unit);
    most_digits_ = std::max(most_digits_, digits);
    if (are_floats || digits >= kDigitsOfFloat) {
      const double off = std::abs(*value - static_cast<double>(static_cast<float>(*value))) * unit;
      all_floats_ = all_floats_ && off <= 0.51 * last;
      float_ = std::max(float_, std::abs(*value) * unit * std::pow(2, -24));
    }
  }
}

double Decimals::calcHalfUnit() const {
  if (most_digits_ == 0) return 0;
  double half = std::max(0.5 * finest_, constant_);
  if (most_digits_ >= kFewestDigits) {
    // The largest of those that have nearly all of the digits; zeros at the end are left out by many.
    double largest = 0;
    for (int n = std::max(1, most_digits_ - 2); n <= most_digits_; ++n) largest = std::max(largest, largest_[n]);
    half = std::max(half, 0.5 * std::pow(10, std::floor(std::log10(largest / unit_)) + 1 - most_digits_) * unit_);
  }
  return all_floats_ ? std::max(half, float_) : half;
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
