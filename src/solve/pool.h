#pragma once
// Things of various sizes that a scratch memory keeps.
#include <algorithm>
#include <memory>
#include <vector>

namespace bielle {

template <typename T>
class Pool {
 public:
  void takeBack() { num_taken_ = 0; }
  template <typename Fits, typename Resize>
  T& take(const Fits& fits, const Resize& resize) {
    const auto free = items_.begin() + num_taken_++;
    const auto found = std::find_if(free, items_.end(), [&](const std::unique_ptr<T>& item) { return fits(*item); });
    if (found != items_.end()) {
      free->swap(*found);
      return **free;
    }
    items_.push_back(std::make_unique<T>());
    resize(*items_.back());
    items_[num_taken_ - 1].swap(items_.back());
    return *items_[num_taken_ - 1];
  }

 private:
  std::vector<std::unique_ptr<T>> items_;  // the first ones are taken
  std::ptrdiff_t num_taken_ = 0;
};

}  // namespace bielle
