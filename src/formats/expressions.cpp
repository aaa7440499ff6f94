#include "formats/expressions.h"

#include <muParser.h>

#include <cmath>
#include <map>

#include "model/listing.h"

namespace bielle {
namespace {

const char kNameCharacters[] = "0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";

double calcHypot(double a, double b) { return std::hypot(a, b); }

bool isIdentifier(const std::string& name) {
  return !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) &&
         name.find_first_not_of("0123456789_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ") == std::string::npos;
}

}  // namespace

struct Symbols::Data {
  mu::Parser parser;
  std::map<std::string, double> numbers;  // nodes of a map stay where they are: the parser points to them
  std::map<std::string, Vector3d> points;
  std::map<std::string, double>
      components;  // of the points: one at a time, or none, so that numbers made of them are none

  void setComponents(int i) {
    for (auto& [name, value] : components) value = i < 0 ? std::nan("") : points.at(name)[i];
  }

  // Names that occur in it; addresses are null if they are unknown.
  const mu::varmap_type& listUsed(const std::string& expression) {
    parser.SetExpr(expression);
    return parser.GetUsedVar();
  }

  double evaluate(const std::string& expression) {
    parser.SetExpr(expression);
    return parser.Eval();
  }

  // Why an expression has no finite value.
  [[noreturn]] void explain(const std::string& expression, bool may_have_points) {
    try {
      for (const auto& [name, address] : listUsed(expression)) {
        if (!address) failUnknown(name);
        if (points.count(name) && !may_have_points)
          throw ExpressionError{"'" + name + "' is a point, not a number", "name a component, such as " + name + ".x"};
      }
    } catch (const mu::Parser::exception_type& error) {
      throw ExpressionError{"'" + expression + "' is not an expression: " + error.GetMsg(), "correct it"};
    }
    throw ExpressionError{"'" + expression + "' is not finite", "look for a root, an arc or a quotient out of range"};
  }

  [[noreturn]] void failUnknown(const std::string& name) const {
    std::vector<std::string> known;
    for (const auto& [number, value] : numbers)
      if (number.find('.') == std::string::npos) known.push_back(number);
    for (const auto& [point, value] : points) known.push_back(point);
    throw ExpressionError{"'" + name + "' is unknown", "known are " + listItems(known)};
  }
};

Symbols::Symbols() : data_(std::make_unique<Data>()) {
  mu::Parser& parser = data_->parser;
  // The same roundings whatever the numbers, and `0.5 && 0.5` is true (findings/muparser-folds-and.sh).
  parser.EnableOptimizer(false);
  parser.DefineNameChars(kNameCharacters);
  parser.ClearConst();
  parser.DefineFun("hypot", calcHypot);
  define("pi", M_PI);
  define("origin", Vector3d::Zero());
  define("x", Vector3d::UnitX());
  define("y", Vector3d::UnitY());
  define("z", Vector3d::UnitZ());
}

Symbols::~Symbols() = default;

bool Symbols::has(const std::string& name) const { return data_->numbers.count(name) || data_->points.count(name); }

void Symbols::define(const std::string& name, double value) {
  if (!isIdentifier(name))
    throw ExpressionError{"'" + name + "' cannot be used in expressions", "use letters, digits and _"};
  if (has(name) || data_->parser.GetFunDef().count(name))
    throw ExpressionError{"the name '" + name + "' is taken", "choose another one"};
  const auto it = data_->numbers.emplace(name, value).first;
  data_->parser.DefineVar(name, &it->second);
}

void Symbols::define(const std::string& name, const Vector3d& value) {
  define(name, 0.0);
  data_->numbers.erase(name);
  data_->parser.RemoveVar(name);
  data_->points[name] = value;
  data_->parser.DefineVar(name, &(data_->components[name] = std::nan("")));
  for (int i = 0; i < 3; ++i) {
    const std::string component = name + "." + "xyz"[i];
    data_->parser.DefineVar(component, &(data_->numbers[component] = value[i]));
  }
}

bool Symbols::usesPoints(const std::string& expression) const {
  try {
    for (const auto& [name, address] : data_->listUsed(expression))
      if (data_->points.count(name)) return true;
    return false;
  } catch (const mu::Parser::exception_type&) {
    data_->explain(expression, true);
  }
}

double Symbols::calcNumber(const std::string& expression) const {
  try {
    const double value = data_->evaluate(expression);
    if (std::isfinite(value)) return value;
  } catch (const mu::Parser::exception_type&) {
  }
  data_->explain(expression, false);
}

Vector3d Symbols::calcPoint(const std::string& expression) const {
  Vector3d point;
  try {
    data_->parser.SetExpr(expression);
    for (int i = 0; i < 3; ++i) {
      data_->setComponents(i);
      point[i] = data_->parser.Eval();
    }
  } catch (const mu::Parser::exception_type&) {
    point[0] = std::nan("");
  }
  data_->setComponents(-1);
  if (!point.allFinite()) data_->explain(expression, true);
  if (!point.isZero(0) && !usesPoints(expression))
    throw ExpressionError{"it is a number, not three", "write it as [a, b, c], or with points such as x"};
  return point;
}

}  // namespace bielle
