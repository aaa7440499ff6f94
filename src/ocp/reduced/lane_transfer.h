#pragma once
// Transfers numbers between nodes, each of which stores its numbers contiguously, and lanes (lanes.h), which store the
// values of all nodes side by side for each number.
#include <array>

#include "bielle/math/se3.h"
#include "math/lanes.h"

namespace bielle {

// The nodes of a batch. Lanes without a node repeat the first one.
template <typename Node>
struct LaneSource {
  Node* const* nodes;
  int count;
  Node& operator[](int lane) const { return *nodes[lane < count ? lane : 0]; }
};

// Each lane below count of out (size numbers) receives the numbers at get(lane); the others receive those of lane 0.
template <typename Get>
void gatherLanes(int count, Eigen::Index size, Lanes* out, const Get& get) {
  std::array<const double*, kLane> in;
  for (int l = 0; l < kLane; ++l) in[l] = get(l < count ? l : 0);
  packLanes(in, size, out);
}

// get(lane) is the destination of the numbers of a lane below count, or null for none.
template <typename Get>
void scatterLanes(const Lanes* in, Eigen::Index size, int count, const Get& get, Eigen::Index stride = 1) {
  std::array<double*, kLane> out{};
  for (int l = 0; l < count; ++l) out[l] = get(l);
  unpackLanes(in, size, out, stride);
}

// Placements as arrays of numbers.
static_assert(sizeof(SE3) == 12 * sizeof(double) && sizeof(SE3Of<Lanes>) == 12 * sizeof(Lanes));
inline const double* getNumbers(const SE3& X) { return X.R.data(); }
inline double* getNumbers(SE3& X) { return X.R.data(); }
inline Lanes* getNumbers(SE3Of<Lanes>& X) { return X.R.data(); }
inline const Lanes* getNumbers(const SE3Of<Lanes>& X) { return X.R.data(); }

inline LaneMask makeMask(bool value) { return value ? Lanes(0) <= Lanes(0) : Lanes(0) < Lanes(0); }

}  // namespace bielle
