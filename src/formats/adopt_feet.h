#pragma once
/// \file The feet of a robot whose files do not say what it stands on.
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/workspace.h"

namespace bielle {

struct FoundFoot {
  std::string frame;  ///< empty: there is none yet
  int body = 0;
  SE3 X_BF, X_WF;  ///< z up and x forward
  bool is_named = false;
};

/// One foot, or the left and the right one, which are mirror images of each other, in the posture of the workspace; or one on each of
/// more than two legs that reach as low, from the front on, the left ones first. Legs are what hangs together without the base.
/// - frames with z up that are named foot or sole, the lowest ones, unless shapes of their bodies reach below them: then they are
///   ankles;
/// - otherwise new frames on the bodies whose shapes reach lowest, below the middle of what touches the ground there: z along
///   their flat side, x forward, along them if they are long;
/// - of a robot without shapes the lowest frames with z up. Empty if there are none.
std::vector<FoundFoot> findFeet(const Model& model, const Workspace& ws);

/// Where frames with z up face backward, as on legs whose links are turned by half a turn: new frames there, without names, that face
/// forward. \returns whether there are any
bool turnForward(std::vector<FoundFoot>& feet);

/// Of a robot without shapes whose `feet` are the frames of its last links, at their joints: new frames, z up, where the legs end if these
/// links are uniform rods with their centres of mass and moments of inertia. Empty if links have no length, or frames tell where they end.
std::vector<FoundFoot> findLegEnds(const Model& model, const Workspace& ws, const std::vector<FoundFoot>& feet);

/// What a foot stands on, without a name: the extent of its shapes along x and y of its frame; empty without shapes. A capsule along
/// x, and a box that is hardly wider than a rod, are blades; a ball is a point.
std::optional<ContactFrame> measureFoot(const Model& model, const FoundFoot& foot);

}  // namespace bielle
