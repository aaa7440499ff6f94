#pragma once
/// \file How softly a file of MuJoCo closes its loops.
#include <array>
#include <map>
#include <string>
#include <vector>

#include "dynamics/soft_loops.h"

namespace bielle {

/// An equality as the file has it.
struct MjcfEquality {
  std::string tag, name;
  std::string closure;               ///< that it is, or is part of, in the model
  double lever = 0;                  ///< of a point of a hinge: its place along the axis, m
  std::array<std::string, 2> links;  ///< of a connect or weld
  std::vector<std::map<std::string, double>>
      sums;  ///< of joints or tendons: the sums of coordinates that it ties, by joint
  SoftSettings settings;
};

/// A body as MuJoCo estimates its inverse inertia.
struct MjcfBody {
  Vector3d centre = Vector3d::Zero();  ///< of mass, in its link
  bool slides =
      false;  ///< and does nothing else, on the ground, along axes of its inertia: 1/m for translations, from version 3 on
};

struct MjcfSoftness {
  SoftStep step;
  std::vector<MjcfEquality> equalities;
  std::map<std::string, std::vector<double>> start;  ///< coordinates of the joints as the file stands
  std::map<std::string, MjcfBody> bodies;            ///< by link
};

/// \throws InputError as loadRobot() does
MjcfSoftness readMjcfSoftness(const std::string& path);

/// Versions of MuJoCo: those before 3 scale rotations of welds by the inertia of translations, and those before 3.7 do not know
/// dJ/dt v of connects and welds; that of joints and tendons none does.
enum class MujocoVersion { Two, Three, ThreeSeven };

/// The loops of the model of that file. A = A_1 + A_2 of each row sums inverse inertias of both sides in the posture of the file:
/// of connects and welds those of the bodies at their centres of mass, the mean of three directions, J M^{-1} J^T; of joints and tendons
/// those of their coordinates.
SoftLoops makeSoftLoops(const Model& model, const MjcfSoftness& file,
                        MujocoVersion version = MujocoVersion::ThreeSeven);

}  // namespace bielle
