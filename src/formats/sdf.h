#pragma once
/// \file A robot as a file of Gazebo (SDF 1.7).
///
/// Bodies keep their names and frames and stand at q_ref, where coordinates of joints are zero in SDF, so that limits and
/// rests of springs move by q_ref. A loop closes by a second joint of a body, named after the closure: a weld is `fixed`, a ball
/// `ball`, a hinge `revolute`. SDF makes such a joint where the bodies stand, therefore q_ref should be closed. These joints come
/// last, because engines that leave out the second joint of a body then keep the tree. A body on a free-flyer over the ground has
/// no joint.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct SdfText {
  std::string xml;
  std::vector<std::string> warnings;  ///< each names something that SDF cannot express or that was changed
};

/// \param q_ref  closed configuration (nq), as of findClosedConfiguration
/// \throws InputError naming a joint that SDF does not have: planar, or a free-flyer that a body carries
SdfText formatSdf(const Model& model, ConstVectorRef q_ref);

}  // namespace bielle
