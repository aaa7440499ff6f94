#pragma once
// The bases of all loop clusters at one configuration, for whoever needs them again.
#include "dynamics/reduction.h"

namespace bielle {

struct LoopBases {
  virtual ~LoopBases() = default;
  virtual const ReducedCluster& getCluster(int index) const = 0;
  virtual const ClusterBasis& getBasis(int index) const = 0;
};

}  // namespace bielle
