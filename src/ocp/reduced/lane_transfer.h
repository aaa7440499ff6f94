#pragma once
// Numbers between nodes, which each have theirs side by side, and lanes (lanes.h), where each number has its nodes side by side.
#include <array>

#include "bielle/math/se3.h"
#include "math/lanes.h"

namespace bielle {

// The nodes of a batch. Lanes without a node do what the first one does.
template <typename Node>
struct LaneSource {
  Node* const* nodes;
  int count;
  Node& operator[](int lane) const { return *nodes[lane < count ? lane : 0]; }
};

// Each lane of out (size numbers) gets those at get(lane), which is asked for lanes below count; the others get those of lane 0.
template <typename Get>
void gatherLanes(int count, Eigen::Index size, Lanes* out, const Get& get) {
  std::array<const double*, kLane> in;
  for (int l = 0; l < kLane; ++l) in[l] = get(l < count ? l : 0);
  packLanes(in, size, out);
}

// get(lane) says where the numbers of a lane below count go, null for nowhere.
template <typename Get>
void scatterLanes(const Lanes* in, Eigen::Index size, int count, const Get& get, Eigen::Index stride = 1) {
  std::array<double*, kLane> out{};
  for (int l = 0; l < count; ++l) out[l] = get(l);
  unpackLanes(in, size, out, stride);
}

// Placements as the numbers they are made of.
static_assert(sizeof(SE3) == 12 * sizeof(double) && sizeof(SE3Of<Lanes>) == 12 * sizeof(Lanes));
inline const double* getNumbers(const SE3& X) { return X.R.data(); }
inline double* getNumbers(SE3& X) { return X.R.data(); }
inline Lanes* getNumbers(SE3Of<Lanes>& X) { return X.R.data(); }
inline const Lanes* getNumbers(const SE3Of<Lanes>& X) { return X.R.data(); }

inline LaneMask makeMask(bool value) { return value ? Lanes(0) <= Lanes(0) : Lanes(0) < Lanes(0); }

}  // namespace bielle
