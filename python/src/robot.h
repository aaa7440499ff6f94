#pragma once
/// \file A robot as Python holds it: a model, and where it came from.
#include <memory>

#include "model_access.h"

namespace bielle::python {

struct Robot {
  std::string name;              // as requested
  std::shared_ptr<Model> model;  // shared with all that is made of it
  std::string file, directory;   // empty: not from files
  std::vector<std::string> warnings;
};

}  // namespace bielle::python
