#pragma once
// Plans of one motion for robots a little beside one another, whose problems are evaluated but not solved: differences need many of
// them. Their guesses stay rough, since nobody starts from them, and what the first of them has found far from mattering is not
// computed again: how far legs reach, where the path of the centre of mass stays within that by a margin. Standing postures are
// found from the first of them, and exact up to rounding.
#include <optional>
#include <vector>

#include "bielle/math/types.h"

namespace bielle {

class NeighbourPlans {
 public:
  NeighbourPlans() = default;
  NeighbourPlans(const NeighbourPlans&) = delete;
  NeighbourPlans& operator=(const NeighbourPlans&) = delete;

  // While one lives, a plan that this thread makes is one of those. Steps are planned in the same order in each.
  class Use {
   public:
    explicit Use(NeighbourPlans& plans);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    NeighbourPlans* before_;
  };

  // Those in use in this thread, or null.
  static NeighbourPlans* get();

  // Whether legs reach everything of the next steps of a plan by a margin, for whom it is known.
  std::optional<bool>& getReach();

  VectorXd posture;  // standing, of the first robot; empty before

 private:
  std::vector<std::optional<bool>> reach_;
  size_t next_ = 0;
};

}  // namespace bielle
