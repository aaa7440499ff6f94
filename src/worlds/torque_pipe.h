#pragma once
#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "bielle/math/types.h"

namespace bielle::worlds {

// Torques on their way to the motors of a world, from those that act on; grows to what a delay needs.
class TorquePipe {
 public:
  void clear() { size_ = 0; }
  // \param time  when they act; those that are overtaken never do
  void send(double time, ConstVectorRef u) {
    while (size_ > 1 && get(size_ - 1).time >= time) --size_;
    if (size_ == ring_.size()) {
      std::rotate(ring_.begin(), ring_.begin() + static_cast<std::ptrdiff_t>(first_), ring_.end());
      first_ = 0;
      ring_.emplace_back();
    }
    Torques& last = get(size_++);
    last.time = time;
    last.u = u;
  }
  // Those that act at a time.
  const VectorXd& take(double time) {
    for (; size_ > 1 && get(1).time <= time; --size_) first_ = (first_ + 1) % ring_.size();
    return get(0).u;
  }
  // When others act, after take().
  double getNext() { return size_ > 1 ? get(1).time : std::numeric_limits<double>::infinity(); }

 private:
  struct Torques {
    double time = 0;
    VectorXd u;
  };
  Torques& get(size_t age) { return ring_[(first_ + age) % ring_.size()]; }
  std::vector<Torques> ring_;
  size_t first_ = 0, size_ = 0;
};

}  // namespace bielle::worlds
