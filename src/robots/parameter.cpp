#include <cmath>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/robots/generators.h"

namespace bielle {

double findChoice(const Parameter& parameter, const std::string& name) {
  std::string known;
  for (size_t i = 0; i < parameter.choices.size(); ++i) {
    if (parameter.choices[i] == name) return static_cast<double>(i);
    known += (known.empty() ? "" : ", ") + parameter.choices[i];
  }
  throw ModelError("", "parameter '" + parameter.name + "'", "'" + name + "' is not one of its choices",
                   known.empty() ? "give a number" : "choose one of: " + known);
}

void setParameter(const std::vector<Parameter>& parameters, const std::string& name, double value) {
  std::string known;
  for (const Parameter& parameter : parameters) {
    if (parameter.name == name) {
      *parameter.value = value;
      return;
    }
    known += (known.empty() ? "" : ", ") + parameter.name;
  }
  throw ModelError("", "parameter '" + name + "'", "there is no such parameter", "choose one of: " + known);
}

void checkParameters(const std::string& robot, const std::vector<Parameter>& parameters) {
  for (const Parameter& p : parameters) {
    const bool between = !p.choices.empty() && *p.value != std::floor(*p.value);
    if (*p.value >= p.lower && *p.value <= p.upper && !between) continue;
    std::ostringstream problem;
    problem << *p.value << (p.unit == "1" ? "" : " " + p.unit) << " is ";
    if (between)
      problem << "not the number of a choice";
    else
      problem << "outside " << p.lower << " .. " << p.upper;
    throw ModelError(robot, "parameter '" + p.name + "'", problem.str(),
                     between ? "give a whole number, or a name" : "give a value within its bounds");
  }
}

}  // namespace bielle
