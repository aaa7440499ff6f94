#pragma once
/// \file Numbers, and names for what has none, in the files that a robot is written as.
#include <string>
#include <utility>
#include <vector>

#include "bielle/model/model.h"
#include "model/number_text.h"
#include "model/stiction.h"

namespace bielle {

/// Every digit (model/number_text.h): what is read back is the same. Loops that close by construction stay closed.
std::string formatExact(const Vector3d& v, const char* separator = " ");

/// The root link is carried by the free-flyer that the reader makes: nothing else is on the ground.
bool hasImpliedFreeFlyer(const Model& model);

/// A frame of the model at this place; if there is none, `made`.
std::string findFrameName(const Model& model, int body, const SE3& X_BF, const std::string& made);

/// Told where files have no place for it.
inline constexpr const char* kStictionLost = "its stiction is left out: it has the friction of sliding";
/// Keys and numbers of an entry of `joint_forces`: the stiffness, and what is not zero.
std::vector<std::pair<const char*, std::string>> getJointForceData(const WholeJointForce& whole);

/// Frames, visuals or shapes of a model by their bodies, in their order.
template <typename Part>
std::vector<std::vector<const Part*>> sortByBody(const Model& model, const std::vector<Part>& parts) {
  std::vector<std::vector<const Part*>> sorted(static_cast<size_t>(model.numBodies()));
  for (const Part& part : parts) sorted[static_cast<size_t>(part.body)].push_back(&part);
  return sorted;
}

/// \throws InputError
[[noreturn]] void refuseToWrite(const Model& model, const std::string& element, const std::string& problem);

}  // namespace bielle
