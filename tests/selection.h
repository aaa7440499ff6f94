#pragma once
// Which of many trials the first tier of the tests makes, and the sanitizers.
#include <cstdlib>
#include <string>

namespace bielle::testing {

/// Cases that are tagged [sweep] try one of several mechanisms, and all of them in the second tier (tests/tiers.cmake). The
/// sanitizers, which make differences thirty times as slow and find errors of memory in any mechanism, try one of eleven of these.
/// A number that divides none of the numbers of kinds gives every kind its turns.
class Selection {
 public:
  explicit Selection(int several = 5) : several_(sweep_ == "all" ? 1 : sweep_ == "few" ? 11 * several : several) {}

  bool isLeftOut() { return count_++ % several_ != 0; }

 private:
  const std::string sweep_ = std::getenv("BIELLE_SWEEP") ? std::getenv("BIELLE_SWEEP") : "";
  const int several_;
  int count_ = 0;
};

}  // namespace bielle::testing
