#include "firmware/printer.h"

#include "model/number_text.h"

namespace bielle::firmware {
namespace {

constexpr size_t kLongestInline = 50;

}  // namespace

std::string formatConstant(double value, const Style& style) {
  std::string text = style.is_single ? formatNumber(value, "%.9g") : formatExact(value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text + style.suffix;
}

std::string printProgram(const Program& program, const Style& style, const std::function<std::string(int)>& nameInput,
                         const std::vector<std::string>& targets) {
  return printLoop(program, style, nameInput, targets, {}).before;
}

LoopText printLoop(const Program& program, const Style& style, const std::function<std::string(int)>& nameInput,
                   const std::vector<std::string>& targets, const std::vector<int>& changing) {
  const std::vector<bool> varying = program.findVarying(changing);
  std::vector<bool> is_kept(varying.size(), false);  // constant in the loop, and used there
  for (size_t i = 0; i < varying.size(); ++i)
    if (const auto& line = program.code()[i]; varying[i] && line.op != Op::Input)
      for (int operand : {line.a, line.b})
        if (operand >= 0 && !varying[static_cast<size_t>(operand)]) is_kept[static_cast<size_t>(operand)] = true;
  std::vector<int> uses(program.code().size());
  for (const auto& line : program.code()) {
    if (line.op == Op::Constant || line.op == Op::Input) continue;
    ++uses[static_cast<size_t>(line.a)];
    if (line.b >= 0) ++uses[static_cast<size_t>(line.b)];
  }
  for (int i : program.outputs()) ++uses[static_cast<size_t>(i)];
  LoopText out;
  std::vector<std::string> text(program.code().size());
  int named = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const Program::Instruction& line = program.code()[i];
    const auto a = [&] { return text[static_cast<size_t>(line.a)]; };
    const auto b = [&] { return text[static_cast<size_t>(line.b)]; };
    const auto call = [&](const std::string& name, bool of_math = true) {
      return (of_math ? style.functions + name + (style.functions.empty() ? style.suffix : "") : name) + "(" + a() +
             (line.b >= 0 ? ", " + b() : "") + ")";
    };
    const auto infix = [&](const char* sign) { return "(" + a() + " " + sign + " " + b() + ")"; };
    switch (line.op) {
      case Op::Constant:
        text[i] = formatConstant(line.constant, style);
        if (line.constant < 0) text[i] = "(" + text[i] + ")";
        continue;
      case Op::Input:
        text[i] = nameInput(line.a);
        continue;
      case Op::Negate:
        text[i] = "(-" + a() + ")";
        break;
      case Op::Sqrt:
        text[i] = call("root", false);
        break;
      case Op::Sin:
        text[i] = style.is_single ? "sine(" + a() + ", 0)" : call("sin");
        break;
      case Op::Cos:
        text[i] = style.is_single ? "sine(" + a() + ", 1)" : call("cos");
        break;
      case Op::Atan2:
        text[i] = style.is_single ? call("arctangent", false) : call(style.functions.empty() ? "atan2" : "arctan2");
        break;
      case Op::Min:
        text[i] = call("least", false);
        break;
      case Op::Add:
        text[i] = infix("+");
        break;
      case Op::Subtract:
        text[i] = infix("-");
        break;
      case Op::Multiply:
        text[i] = infix("*");
        break;
      case Op::Divide:
        text[i] = infix("/");
        break;
    }
    if (uses[i] < 2 && text[i].size() < kLongestInline && !is_kept[i]) continue;
    const std::string name = "t" + std::to_string(named++);
    (varying[i] ? out.body : out.before) += "  " + style.declare + name + " = " + text[i] + style.end + "\n";
    text[i] = name;
  }
  for (size_t k = 0; k < targets.size(); ++k)
    (changing.empty() ? out.before : out.body) +=
        "  " + targets[k] + " = " + text[static_cast<size_t>(program.outputs()[k])] + style.end + "\n";
  return out;
}

std::string fillIn(std::string text, const std::vector<std::pair<std::string, std::string>>& values) {
  for (const auto& [key, value] : values)
    for (size_t at = 0; (at = text.find(key, at)) != std::string::npos; at += value.size())
      text.replace(at, key.size(), value);
  return text;
}

}  // namespace bielle::firmware
