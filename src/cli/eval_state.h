#pragma once
// A state in a file, of `bielle eval` and `bielle simulate`: a JSON object of joints, torques and contacts, by name.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle::cli {

struct EvalState {
  VectorXd q, v, u;                 // nq, nv, nu
  std::vector<int> contacts;        // indices of the contacts in force, as listed
  std::vector<int> placed, moving;  // joints whose position is given, whose velocity is given
};

// Reads a file, or the standard input for "-". \throws InputError naming the file and the element
// \param q  of the joints that the file does not give
EvalState readState(const Model& model, const std::string& path, ConstVectorRef q);

// Closes the loops; joints that the file places stay where they are, if they can, and a warning tells which cannot.
// \throws InputError when the loops do not close nearby
// \param file  named in messages
void closeState(const Model& model, const std::string& file, EvalState& state);
// Then the motion: the least velocity with that of the joints that the file moves; one that keeps the loops closed, if it does not.
void closeMotion(const Model& model, const std::string& file, EvalState& state);
// Tells that a joint does not start with what the file gives.
void warnOfMisfit(const std::string& file, const Joint& joint, const std::string& what, double given, double taken);

// The part of eval's help that describes the format of a state.
extern const char* const kStateHelp;

}  // namespace bielle::cli
