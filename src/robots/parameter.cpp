#include <sstream>

#include "bielle/model/error.h"
#include "bielle/robots/generators.h"

namespace bielle {

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
    if (*p.value >= p.lower && *p.value <= p.upper) continue;
    std::ostringstream problem;
    problem << *p.value << (p.unit == "1" ? "" : " " + p.unit) << " is outside " << p.lower << " .. " << p.upper;
    throw ModelError(robot, "parameter '" + p.name + "'", problem.str(), "give a value within its bounds");
  }
}

}  // namespace bielle
