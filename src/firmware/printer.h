#pragma once
// Programs as text.
#include <functional>
#include <string>

#include "firmware/expression.h"

namespace bielle::firmware {

struct Style {
  std::string declare = "const double ";  // before the name of an intermediate result
  std::string end = ";";                  // of a statement
  std::string suffix;                     // of constants and functions of C: f of float
  std::string functions;                  // before the names of functions: "np."
  bool is_single = false;
};

std::string formatConstant(double value, const Style& style);

// A statement a line, of which the last assign the outputs to the targets.
std::string printProgram(const Program& program, const Style& style, const std::function<std::string(int)>& nameInput,
                         const std::vector<std::string>& targets);

// The same within a loop that changes some inputs: what does not depend on them comes before it.
struct LoopText {
  std::string before, body;
};
LoopText printLoop(const Program& program, const Style& style, const std::function<std::string(int)>& nameInput,
                   const std::vector<std::string>& targets, const std::vector<int>& changing);

// A text with its keys replaced, one after the other.
std::string fillIn(std::string text, const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace bielle::firmware
