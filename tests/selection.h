#pragma once
// Which of many trials the first tier of the tests makes, and the sanitizers.
#include <cstdlib>

namespace bielle::testing {

/// Cases that are tagged [sweep] try one of several mechanisms, and all of them in the second tier (tests/tiers.cmake). The
/// sanitizers, which make differences thirty times as slow and find errors of memory in any mechanism, see the first tier.
/// A number that divides none of the numbers of kinds gives every kind its turns.
class Selection {
 public:
  explicit Selection(int several = 5) : several_(several) {}

  bool isLeftOut() { return !tries_all_ && count_++ % several_ != 0; }

 private:
  const int several_;
  const bool tries_all_ = std::getenv("BIELLE_SWEEP") != nullptr;
  int count_ = 0;
};

}  // namespace bielle::testing
