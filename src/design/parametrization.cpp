#include "bielle/design/parametrization.h"

#include <cmath>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "bielle/robots/generators.h"
#include "design/draft.h"

namespace bielle {
namespace {

struct Line {
  Vector3d from, aside, along;  // to = from + aside + along
};

Line getLine(const RobotDraft& draft, const LengthChange& change) {
  const RobotDraft::Place to = draft.getPlace(change.to);
  Line line;
  line.from = draft.getPlaceIn(to.body, change.from);
  line.aside = change.across.dot(to.p - line.from) * change.across;
  line.along = to.p - line.from - line.aside;
  return line;
}

// `length` over the one in the robot as it was.
void setLength(RobotDraft& draft, const LengthChange& change, double length, double original) {
  const Line line = getLine(draft, change);
  const double now = line.along.norm();
  draft.setPlace(change.to, line.from + line.aside + length / now * line.along);
  if (!change.stretched.empty()) draft.stretch(change.stretched, line.from, line.along / now, length / original);
}

}  // namespace

Parametrization::Parametrization(Model model, std::vector<DesignVariable> variables, std::string source)
    : source_(std::move(source)), variables_(std::move(variables)), model_(std::move(model)) {
  start_ = VectorXd::Zero(static_cast<Eigen::Index>(variables_.size()));
  for (size_t i = 0; i < variables_.size(); ++i) {
    const DesignVariable& variable = variables_[i];
    if (!variable.parameter.empty() || variable.lengths.empty() == variable.shifts.empty())
      throw ModelError(source_, "variable '" + variable.name + "'", "it is neither a length nor a shift, or both",
                       "give one of `length` and `shift`; `parameter` is for generated robots");
    RobotDraft draft(model_);
    for (const ShiftChange& shift : variable.shifts) draft.getPlace(shift.of);
    for (size_t k = 0; k < variable.lengths.size(); ++k) {
      const LengthChange& change = variable.lengths[k];
      const double length = getLine(draft, change).along.norm();
      if (k == 0) start_[static_cast<Eigen::Index>(i)] = length;
      if (!(length > 1e-9 && length + variable.lower - start_[static_cast<Eigen::Index>(i)] > 1e-9))
        throw ModelError(source_, "variable '" + variable.name + "'",
                         "the distance of '" + change.from + "' and '" + change.to + "' is zero, or would become so",
                         "name two places apart, and raise the lower bound");
      setLength(draft, change, length, length);
    }
  }
  finish();
}

Parametrization::Parametrization(const std::string& generator, std::vector<std::pair<std::string, double>> settings,
                                 std::vector<DesignVariable> variables, std::string source)
    : source_(std::move(source)),
      generator_(generator),
      settings_(std::move(settings)),
      variables_(std::move(variables)) {
  for (const DesignVariable& variable : variables_)
    if (variable.parameter.empty())
      throw ModelError(source_, "variable '" + variable.name + "'", "it is no parameter of the generator",
                       "give `parameter`; `length` and `shift` are for given robots");
  start_.resize(static_cast<Eigen::Index>(variables_.size()));
  model_ = generate(nullptr, &start_);
  finish();
}

Model Parametrization::generate(const VectorXd* x, VectorXd* start) const {
  const GeneratorRequest request = findGenerator(generator_).makeRequest();
  for (const auto& [name, value] : settings_) setParameter(request.parameters, name, value);
  for (size_t i = 0; i < variables_.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    if (x) setParameter(request.parameters, variables_[i].parameter, (*x)[k]);
    for (const Parameter& parameter : request.parameters)
      if (start && parameter.name == variables_[i].parameter) (*start)[k] = *parameter.value;
    if (start) setParameter(request.parameters, variables_[i].parameter, (*start)[k]);  // refuses unknown names
  }
  return request.make();
}

void Parametrization::finish() {
  if (variables_.empty()) throw ModelError(source_, "variables", "there are none", "name at least one");
  lower_ = upper_ = start_;
  std::set<std::string> names;
  for (size_t i = 0; i < variables_.size(); ++i) {
    const DesignVariable& variable = variables_[i];
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    lower_[k] = variable.lower, upper_[k] = variable.upper;
    std::ostringstream bounds;
    bounds << variable.lower << " .. " << variable.upper;
    const std::string element = "variable '" + variable.name + "'";
    if (!names.insert(variable.name).second) throw ModelError(source_, element, "it is given twice", "rename one");
    if (!(std::isfinite(variable.lower) && std::isfinite(variable.upper) && variable.lower < variable.upper))
      throw ModelError(source_, element, "its bounds " + bounds.str() + " are crossed", "give the lower one first");
    if (!(start_[k] >= variable.lower && start_[k] <= variable.upper)) {
      std::ostringstream problem;
      problem << "the robot has " << start_[k] << " " << variable.unit << ", outside of its bounds " << bounds.str();
      throw ModelError(source_, element, problem.str(), "widen the bounds");
    }
  }
  make(start_);
}

Model Parametrization::make(const VectorXd& x) const {
  if (x.size() != start_.size() || !x.allFinite())
    throw ModelError(source_, "design", "its numbers are not as many as the variables, or not finite");
  if (!generator_.empty()) return generate(&x, nullptr);
  const RobotDraft original(model_);
  RobotDraft draft(model_);
  for (size_t i = 0; i < variables_.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    for (const ShiftChange& shift : variables_[i].shifts)
      draft.setPlace(shift.of, draft.getPlace(shift.of).p + x[k] * shift.along);
    for (const LengthChange& change : variables_[i].lengths) {
      const double length = getLine(original, change).along.norm();
      // An unchanged value is reproduced up to the rounding of a square root.
      if (x[k] != start_[k] || getLine(draft, change).along.norm() != length)
        setLength(draft, change, length + x[k] - start_[k], length);
    }
  }
  return draft.build();
}

}  // namespace bielle
