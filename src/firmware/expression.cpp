#include "firmware/expression.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace bielle::firmware {
namespace {

Scalar makeNode(Op op, std::vector<Scalar> operands) {
  return Scalar(std::make_shared<const Node>(Node{op, 0, 0, std::move(operands)}));
}

double getConstant(const Scalar& a) { return a.node().constant; }
const Scalar& getOperand(const Scalar& a, size_t i = 0) { return a.node().operands[i]; }
bool isNegated(const Scalar& a) { return a.node().op == Op::Negate; }

}  // namespace

Scalar::Scalar(double constant) : node_(std::make_shared<const Node>(Node{Op::Constant, constant, 0, {}})) {}
bool Scalar::isConstant() const { return node_->op == Op::Constant; }
bool Scalar::is(double constant) const { return isConstant() && node_->constant == constant; }
Scalar& Scalar::operator+=(const Scalar& o) { return *this = *this + o; }
Scalar& Scalar::operator-=(const Scalar& o) { return *this = *this - o; }
Scalar& Scalar::operator*=(const Scalar& o) { return *this = *this * o; }

Scalar makeInput(int index) { return Scalar(std::make_shared<const Node>(Node{Op::Input, 0, index, {}})); }

Scalar operator+(const Scalar& a, const Scalar& b) {
  if (a.isConstant() && b.isConstant()) return getConstant(a) + getConstant(b);
  if (a.is(0)) return b;
  if (b.is(0)) return a;
  if (isNegated(b)) return a - getOperand(b);
  if (isNegated(a)) return b - getOperand(a);
  return makeNode(Op::Add, {a, b});
}

Scalar operator-(const Scalar& a, const Scalar& b) {
  if (a.isConstant() && b.isConstant()) return getConstant(a) - getConstant(b);
  if (a.is(0)) return -b;
  if (b.is(0)) return a;
  if (isNegated(b)) return a + getOperand(b);
  if (&a.node() == &b.node()) return 0;
  return makeNode(Op::Subtract, {a, b});
}

Scalar operator*(const Scalar& a, const Scalar& b) {
  if (a.isConstant() && b.isConstant()) return getConstant(a) * getConstant(b);
  if (b.isConstant()) return b * a;
  if (a.is(0)) return 0;
  if (a.is(1)) return b;
  if (a.is(-1)) return -b;
  if (isNegated(a)) return -(getOperand(a) * b);
  if (isNegated(b)) return a.isConstant() ? Scalar(-getConstant(a)) * getOperand(b) : -(a * getOperand(b));
  // Constants of a chain become one.
  if (a.isConstant() && b.node().op == Op::Multiply && getOperand(b).isConstant())
    return Scalar(getConstant(a) * getConstant(getOperand(b))) * getOperand(b, 1);
  return makeNode(Op::Multiply, {a, b});
}

Scalar operator/(const Scalar& a, const Scalar& b) {
  if (b.isConstant()) return Scalar(1 / getConstant(b)) * a;
  if (a.is(0)) return 0;
  if (isNegated(a)) return -(getOperand(a) / b);
  return makeNode(Op::Divide, {a, b});
}

Scalar operator-(const Scalar& a) {
  if (a.isConstant()) return -getConstant(a);
  if (isNegated(a)) return getOperand(a);
  if (a.node().op == Op::Subtract) return getOperand(a, 1) - getOperand(a);
  return makeNode(Op::Negate, {a});
}

Scalar sqrt(const Scalar& a) { return a.isConstant() ? Scalar(std::sqrt(getConstant(a))) : makeNode(Op::Sqrt, {a}); }
Scalar sin(const Scalar& a) { return a.isConstant() ? Scalar(std::sin(getConstant(a))) : makeNode(Op::Sin, {a}); }
Scalar cos(const Scalar& a) { return a.isConstant() ? Scalar(std::cos(getConstant(a))) : makeNode(Op::Cos, {a}); }
Scalar atan2(const Scalar& y, const Scalar& x) { return makeNode(Op::Atan2, {y, x}); }
Scalar min(const Scalar& a, const Scalar& b) { return makeNode(Op::Min, {a, b}); }

namespace {

struct Sum {
  Scalar rest = 0;
  double constant = 0;
};

Sum split(const Scalar& formula) {
  const Node& node = formula.node();
  const auto get = [&](size_t i) { return split(node.operands[i]); };
  switch (node.op) {
    case Op::Constant:
      return {0, node.constant};
    case Op::Negate: {
      const Sum a = get(0);
      return {-a.rest, -a.constant};
    }
    case Op::Add: {
      const Sum a = get(0), b = get(1);
      return {a.rest + b.rest, a.constant + b.constant};
    }
    case Op::Subtract: {
      const Sum a = get(0), b = get(1);
      return {a.rest - b.rest, a.constant - b.constant};
    }
    case Op::Multiply: {
      const Scalar& factor = node.operands[0];
      const Sum b = factor.isConstant() ? get(1) : Sum();
      if (b.constant == 0) return {formula, 0};
      return {factor * b.rest, getConstant(factor) * b.constant};
    }
    default:
      return {formula, 0};
  }
}

}  // namespace

Scalar gatherConstants(const Scalar& formula) {
  const Sum sum = split(formula);
  return sum.rest + sum.constant;
}

Scalar Derivative::operator()(const Scalar& formula) {
  if (const auto known = known_.find(&formula.node()); known != known_.end()) return known->second;
  const Scalar derived = derive(formula.node());
  kept_.push_back(formula);
  return known_[&formula.node()] = derived;
}

Scalar Derivative::derive(const Node& node) {
  const auto a = [&]() -> const Scalar& { return node.operands[0]; };
  const auto b = [&]() -> const Scalar& { return node.operands[1]; };
  switch (node.op) {
    case Op::Constant:
      return 0;
    case Op::Input: {
      const auto rate = rates_.find(node.input);
      return rate == rates_.end() ? Scalar(0) : rate->second;
    }
    case Op::Negate:
      return -(*this)(a());
    case Op::Sqrt:
      return (*this)(a()) / (2 * sqrt(a()));
    case Op::Sin:
      return cos(a()) * (*this)(a());
    case Op::Cos:
      return -(sin(a()) * (*this)(a()));
    case Op::Add:
      return (*this)(a()) + (*this)(b());
    case Op::Subtract:
      return (*this)(a()) - (*this)(b());
    case Op::Multiply:
      return (*this)(a()) * b() + a() * (*this)(b());
    case Op::Divide:
      return ((*this)(a()) - (a() / b()) * (*this)(b())) / b();
    case Op::Atan2:
      return (b() * (*this)(a()) - a() * (*this)(b())) / (a() * a() + b() * b());
    case Op::Min:
      break;  // a test of what is reached, which nobody differentiates
  }
  return 0;
}

OperationCount& OperationCount::operator+=(const OperationCount& o) {
  additions += o.additions;
  multiplications += o.multiplications;
  divisions += o.divisions;
  roots += o.roots;
  trigonometric += o.trigonometric;
  return *this;
}

OperationCount OperationCount::operator*(int times) const {
  return {additions * times, multiplications * times, divisions * times, roots * times, trigonometric * times};
}

Program::Program(const std::vector<Scalar>& outputs) {
  using Key = std::tuple<Op, double, int, int>;
  std::map<Key, int> found;                 // equal operations are one
  std::map<const Node*, int> instructions;  // of formulas that share a part, once
  const std::function<int(const Scalar&)> add = [&](const Scalar& formula) {
    const Node& node = formula.node();
    if (const auto known = instructions.find(&node); known != instructions.end()) return known->second;
    std::array<int, 2> at = {node.op == Op::Input ? node.input : -1, -1};
    for (size_t i = 0; i < node.operands.size(); ++i) at[i] = add(node.operands[i]);
    if ((node.op == Op::Add || node.op == Op::Multiply) && at[1] < at[0]) std::swap(at[0], at[1]);
    const auto [place, is_new] =
        found.try_emplace(Key{node.op, node.constant, at[0], at[1]}, static_cast<int>(code_.size()));
    if (is_new) code_.push_back({node.op, node.constant, at[0], at[1]});
    return instructions[&node] = place->second;
  };
  for (const Scalar& output : outputs) outputs_.push_back(add(output));
}

double estimateRounding(const Scalar& formula, const std::vector<double>& inputs) {
  const Program program({formula});
  std::vector<double> x, error;
  for (const Program::Instruction& line : program.code()) {
    const auto at = [&](int i) { return static_cast<size_t>(i); };
    const double a = line.op == Op::Constant || line.op == Op::Input ? 0 : x[at(line.a)],
                 b = line.b < 0 ? 0 : x[at(line.b)];
    const double e_a = line.op == Op::Constant || line.op == Op::Input ? 0 : error[at(line.a)],
                 e_b = line.b < 0 ? 0 : error[at(line.b)];
    double value = 0, carried = e_a + e_b;  // as sums, sines and cosines carry errors on
    switch (line.op) {
      case Op::Constant:
        value = line.constant;
        break;
      case Op::Input:
        value = inputs[at(line.a)];
        break;
      case Op::Negate:
        value = -a;
        break;
      case Op::Sqrt:
        value = std::sqrt(std::max(a, 0.0)), carried = e_a / std::max(2 * value, 1e-9);
        break;
      case Op::Sin:
        value = std::sin(a);
        break;
      case Op::Cos:
        value = std::cos(a);
        break;
      case Op::Add:
        value = a + b;
        break;
      case Op::Subtract:
        value = a - b;
        break;
      case Op::Multiply:
        value = a * b, carried = e_a * std::abs(b) + e_b * std::abs(a);
        break;
      case Op::Divide:
        value = a / b, carried = (e_a + e_b * std::abs(value)) / std::abs(b);
        break;
      case Op::Atan2:
        value = std::atan2(a, b), carried = (e_a * std::abs(b) + e_b * std::abs(a)) / (a * a + b * b);
        break;
      case Op::Min:
        value = std::min(a, b);
        break;
    }
    const bool is_exact = line.op == Op::Input || line.op == Op::Negate;
    x.push_back(value);
    error.push_back(carried + (is_exact ? 0 : std::abs(value)));
  }
  return error[static_cast<size_t>(program.outputs()[0])];
}

std::vector<bool> Program::findVarying(const std::vector<int>& inputs) const {
  std::vector<bool> out;
  for (const Instruction& line : code_) {
    if (line.op == Op::Input)
      out.push_back(std::find(inputs.begin(), inputs.end(), line.a) != inputs.end());
    else
      out.push_back(line.op != Op::Constant &&
                    (out[static_cast<size_t>(line.a)] || (line.b >= 0 && out[static_cast<size_t>(line.b)])));
  }
  return out;
}

OperationCount Program::count() const { return count(std::vector<bool>(code_.size(), true), true); }

OperationCount Program::count(const std::vector<bool>& varying, bool which) const {
  OperationCount out;
  for (size_t i = 0; i < code_.size(); ++i) {
    if (varying[i] != which) continue;
    const Op op = code_[i].op;
    out.additions += op == Op::Add || op == Op::Subtract;
    out.multiplications += op == Op::Multiply;
    out.divisions += op == Op::Divide;
    out.roots += op == Op::Sqrt;
    out.trigonometric += op == Op::Sin || op == Op::Cos || op == Op::Atan2;
  }
  return out;
}

}  // namespace bielle::firmware
