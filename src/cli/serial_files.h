#pragma once
// What `bielle convert --serial` writes.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle::cli {

struct SerialFiles {
  Model model;
  VectorXd q;          // its nq: the closed posture where linkages are frozen
  std::string tables;  // JSON (docs/linkages.md)
  std::vector<std::string> warnings;
};
// \param file  of the model, as the tables name it   \throws InputError when the robot has no equivalent serial chain
SerialFiles makeSerialFiles(const Model& closed, const std::string& file);

}  // namespace bielle::cli
