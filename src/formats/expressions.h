#pragma once
/// \file Arithmetic with named numbers and points, for files whose numbers are expressions. Only expressions.cpp includes muParser.
#include <memory>
#include <string>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

/// What an expression cannot be evaluated for.
struct ExpressionError {
  std::string problem, remedy;
};

/// Named numbers and points. Known from the start: pi, the point origin and the unit vectors x, y, z. Operators and functions are those of muParser
/// (+ - * / ^, comparisons, && and ||, a ? b : c, sqrt, abs, min, max, sin, cos, tan, asin, acos, atan, atan2), and hypot.
class Symbols {
 public:
  Symbols();
  ~Symbols();
  Symbols(const Symbols&) = delete;
  Symbols& operator=(const Symbols&) = delete;

  /// \throws ExpressionError if the name is no identifier, or is that of another symbol or function
  void define(const std::string& name, double value);
  /// Its components are the numbers name.x, name.y and name.z.
  void define(const std::string& name, const Vector3d& value);
  bool has(const std::string& name) const;

  /// A number. \throws ExpressionError for what is not an expression, for unknown names, points, and values that are not finite
  double calcNumber(const std::string& expression) const;
  /// A point by an expression that holds for each component by itself ("knee + 0.1*z"). \throws ExpressionError
  Vector3d calcPoint(const std::string& expression) const;
  /// Whether a point occurs in it. \throws ExpressionError
  bool usesPoints(const std::string& expression) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace bielle
