#pragma once
/// \file Ratios of the linkages of robots, at requested angles of a joint.
#include <string>

#include "bielle/design/parametrization.h"
#include "bielle/model/model.h"
#include "design/linkage_search.h"

namespace bielle {

struct JointRatios {
  VectorXd ratios;  ///< |R| (ratio.h) at the angles
  double
      distance;  ///< way of motor or joint from the range of the angles to the nearest dead point, or to where loops lose rank, rad; infinite if there is none
};

/// On the branch of the robot's posture.
/// \throws InputError if the linkage does not reach all angles without a dead point, or has several motors
JointRatios calcJointRatios(const Model& model, const std::string& joint, const VectorXd& angles);

/// Generated robots by the values of their variables, whose linkages keep `distance` from dead points.
LinkageFamily makeRobotLinkages(const Parametrization& robot, const std::string& joint, const VectorXd& angles,
                                double distance);

}  // namespace bielle
