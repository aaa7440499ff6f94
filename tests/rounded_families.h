#pragma once
/// \file Random linkages that move only because their axes lie as they do, with numbers rounded as files have them.
#include <random>

#include "bielle/model/builder.h"

namespace bielle::testing {

enum class Family { PlaneFourBar, SixBar, Spherical, Bennett, Parallelogram, PlaneInSpace, Bricard };
inline constexpr Family kFamilies[] = {Family::PlaneFourBar, Family::SixBar,        Family::Spherical,
                                       Family::Bennett,      Family::Parallelogram, Family::PlaneInSpace};
const char* getName(Family family);

/// Bodies, the first of them the ground, and the hinges between them where they stand.
struct HingeNet {
  struct Hinge {
    int body1, body2;
    SE3 X_W;  ///< z along its axis
  };
  int bodies = 0;
  std::vector<Hinge> hinges;  ///< the first carries body2; one that comes to a body that is carried closes a loop
};

/// Regular in its posture. One freedom.
HingeNet makeHingeNet(Family family, std::mt19937& rng);

/// Joints of a net and closures of the kind, their coordinates zero in its posture. Coordinates of places, and roll, pitch and yaw, are
/// rounded to `decimals`, not at all if there are none.
Model makeModel(const HingeNet& net, std::optional<int> decimals, ClosureKind kind = ClosureKind::Hinge5D);

}  // namespace bielle::testing
