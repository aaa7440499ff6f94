#pragma once
// Maps as files of a language.
#include "firmware/map.h"

namespace bielle::firmware {

// Source, header and test, by name. is_cpp: in a namespace instead of by a prefix.
std::map<std::string, std::string> writeC(const Maps& maps, bool is_single, bool is_cpp);
// One module of functions over arrays of postures: of NumPy, or tensors.
std::map<std::string, std::string> writePython(const Maps& maps, bool is_torch);

// Transmissions of ros2_control around what writeC() makes in C++; the readme receives how they are built.
std::map<std::string, std::string> writeRos2(const std::vector<Maps>& all, std::string& readme);

// What holds of the maps, line by line: ranges, ways to compute, operations, errors.
std::vector<std::string> describe(const Maps& maps, bool is_single);

// Formulas beyond positions.
struct Formulas {
  explicit Formulas(const Maps& maps);
  Program ratio;       // R, R^-1 by rows, and what is positive on the branch of the reference
  Program ratio_rate;  // dR/dt by rows, and d log D_J/dt
  Program held;        // of the joints
};

}  // namespace bielle::firmware
