#pragma once
#include <iterator>

#include "bielle/solve/shooting_problem.h"

namespace bielle {

template <typename T>
void moveAll(std::vector<T>& from, std::vector<T>& to) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

// The last state of a part is the first one of the next.
inline void joinTrajectories(ShootingTrajectory& part, ShootingTrajectory& whole) {
  if (!whole.xs.empty()) whole.xs.pop_back();
  moveAll(part.xs, whole.xs);
  moveAll(part.us, whole.us);
}

}  // namespace bielle
