#pragma once
// Formulas as data: built once by ordinary arithmetic, then differentiated, evaluated, counted and printed in any language.
#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "firmware/single.h"

namespace bielle::firmware {

enum class Op { Constant, Input, Negate, Sqrt, Sin, Cos, Add, Subtract, Multiply, Divide, Atan2, Min };

struct Node;

// An immutable formula of numbered inputs. Operations with 0 and 1 vanish as it is built.
class Scalar {
 public:
  Scalar(double constant = 0);  // NOLINT: Eigen converts
  explicit Scalar(std::shared_ptr<const Node> node) : node_(std::move(node)) {}

  const Node& node() const { return *node_; }
  bool is(double constant) const;
  bool isConstant() const;
  Scalar& operator+=(const Scalar& o);
  Scalar& operator-=(const Scalar& o);
  Scalar& operator*=(const Scalar& o);

 private:
  std::shared_ptr<const Node> node_;
};

struct Node {
  Op op;
  double constant = 0;           // of a constant
  int input = 0;                 // of an input
  std::vector<Scalar> operands;  // one or two
};

Scalar makeInput(int index);
Scalar operator+(const Scalar& a, const Scalar& b);
Scalar operator-(const Scalar& a, const Scalar& b);
Scalar operator*(const Scalar& a, const Scalar& b);
Scalar operator/(const Scalar& a, const Scalar& b);
Scalar operator-(const Scalar& a);
Scalar sqrt(const Scalar& a);
Scalar sin(const Scalar& a);
Scalar cos(const Scalar& a);
Scalar atan2(const Scalar& y, const Scalar& x);
Scalar min(const Scalar& a, const Scalar& b);
// The same formula, of whose sum all constants are one: large ones that cancel do so before they are rounded.
Scalar gatherConstants(const Scalar& formula);
// How far rounding moves a formula at these inputs, to first order, over the unit of rounding.
double estimateRounding(const Scalar& formula, const std::vector<double>& inputs);

// Forward differentiation: the derivatives of formulas while their inputs change at given rates.
class Derivative {
 public:
  // \param rates  of the inputs; those that are not among them are constant
  explicit Derivative(std::map<int, Scalar> rates) : rates_(std::move(rates)) {}
  Scalar operator()(const Scalar& formula);

 private:
  Scalar derive(const Node& node);
  std::map<int, Scalar> rates_;
  std::map<const Node*, Scalar> known_;
  std::vector<Scalar> kept_;  // so that no other formula gets the address of a known one
};

// What a program costs.
struct OperationCount {
  int additions = 0, multiplications = 0, divisions = 0, roots = 0, trigonometric = 0;
  OperationCount& operator+=(const OperationCount& o);
  OperationCount operator*(int times) const;
};

// Formulas as a straight line of operations, each done once.
class Program {
 public:
  struct Instruction {
    Op op;
    double constant;
    int a, b;  // earlier instructions; a of an input: its index
  };
  Program() = default;
  explicit Program(const std::vector<Scalar>& outputs);

  const std::vector<Instruction>& code() const { return code_; }
  const std::vector<int>& outputs() const { return outputs_; }  // instructions
  OperationCount count() const;
  // Instructions that depend on an input.
  std::vector<bool> findVarying(const std::vector<int>& inputs) const;
  // Of these alone, or of the others.
  OperationCount count(const std::vector<bool>& varying, bool which) const;

  // T: double or float; every constant and every result is rounded to it, as the generated code does.
  template <typename T>
  std::vector<T> evaluate(const std::vector<T>& inputs) const;

 private:
  std::vector<Instruction> code_;
  std::vector<int> outputs_;
};

template <typename T>
std::vector<T> Program::evaluate(const std::vector<T>& inputs) const {
  thread_local std::vector<T> x;
  x.resize(code_.size());
  for (size_t i = 0; i < code_.size(); ++i) {
    const Instruction& line = code_[i];
    const auto a = [&] { return x[static_cast<size_t>(line.a)]; };
    const auto b = [&] { return x[static_cast<size_t>(line.b)]; };
    switch (line.op) {
      case Op::Constant:
        x[i] = static_cast<T>(line.constant);
        break;
      case Op::Input:
        x[i] = inputs[static_cast<size_t>(line.a)];
        break;
      case Op::Negate:
        x[i] = -a();
        break;
      case Op::Sqrt:
        x[i] = a() > 0 ? std::sqrt(a()) : T(0);
        break;
      case Op::Sin:
        x[i] = calcSine(a());
        break;
      case Op::Cos:
        x[i] = calcCosine(a());
        break;
      case Op::Add:
        x[i] = a() + b();
        break;
      case Op::Subtract:
        x[i] = a() - b();
        break;
      case Op::Multiply:
        x[i] = a() * b();
        break;
      case Op::Divide:
        x[i] = a() / b();
        break;
      case Op::Atan2:
        x[i] = calcArctangent(a(), b());
        break;
      case Op::Min:
        x[i] = a() < b() ? a() : b();
        break;
    }
  }
  std::vector<T> out;
  for (int i : outputs_) out.push_back(x[static_cast<size_t>(i)]);
  return out;
}

using Vector3s = Eigen::Matrix<Scalar, 3, 1>;
using Matrix3s = Eigen::Matrix<Scalar, 3, 3>;
using MatrixXs = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

}  // namespace bielle::firmware

namespace Eigen {
template <>
struct NumTraits<bielle::firmware::Scalar> : GenericNumTraits<bielle::firmware::Scalar> {
  using Real = bielle::firmware::Scalar;
  using NonInteger = Real;
  using Nested = Real;
  using Literal = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 3,
    MulCost = 3
  };
};
}  // namespace Eigen
