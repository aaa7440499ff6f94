#pragma once
// Parameters of generated robots.
#include <string>

#include "bielle/model/options.h"

namespace bielle {

// \throws InputError naming the first parameter outside its bounds
template <typename Parameters>
void checkParameters(const std::string& robot, const Parameters& parameters) {
  listOptions(parameters, "parameter", robot).check();
}

}  // namespace bielle
