#pragma once
/// \file The rods of linkages: bodies that hang on one joint, without a motor and no serial one, and whose other end a closure
/// holds; or two halves of one that a weld joins.
#include <optional>

#include "bielle/model/model.h"

namespace bielle {

struct RodEnd {
  bool is_first = false;            ///< body 1 of the closure is the rod (or both are), else body 2
  Vector3d far = Vector3d::Zero();  ///< from its joint to the one at its other end, m (frame of its body)
};

/// The rod that a closure ends; none where it closes something else.
std::optional<RodEnd> findRodEnd(const Model& model, const Closure& closure);

}  // namespace bielle
