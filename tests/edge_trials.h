#pragma once
// Trials that every world must pass: soles and edges over the sides and corners of steps.
#include <functional>
#include <memory>
#include <vector>

#include "bielle/worlds/world.h"

namespace bielle::worlds::testing {

using MakeWorld = std::function<std::unique_ptr<World>(const Model&, const WorldOptions&)>;

struct BlockSize {
  double half_length = 0.05, half_width = 0.03;  // of its foot, m
  double mass = 10;                              // kg
};
// A block on one contact, whose weight bears at a place in its frame, m.
Model makeBlock(ContactKind kind, const Vector3d& com, const BlockSize& size = {});
// A block at rest on a step that a sole or an edge of any size overhangs, wherever the step is and however it is turned.
struct EdgeTrial {
  Model model;
  GroundStep step;
  VectorXd q;
  double weight = 0;  // N
};
std::vector<EdgeTrial> makeEdgeTrials(int count);

// Soles and edges of a block overhang the sides and corners of steps by up to half of their length, and stay where they are. So do
// those of makeEdgeTrials().
void checkOverhangs(const MakeWorld& makeWorld);
// The moment about the normal under which a sole or an edge turns is that of corners that each bear their share of the weight, on level
// ground, where a step is elsewhere, and where half of it overhangs one.
void checkTwists(const MakeWorld& makeWorld);
// A block slides over a step and against the side of the next one, which holds it.
void checkRisers(const MakeWorld& makeWorld);

}  // namespace bielle::worlds::testing
