#pragma once
// Which of many trials the sanitizers see.

namespace bielle::testing {

/// Sanitizers make differences thirty times as slow and find errors of memory in any mechanism: they see one of several. A
/// number that divides none of the numbers of kinds gives every kind its turns.
class Selection {
 public:
  explicit Selection(int several = 3) : several_(several) {}

  bool isLeftOut() {
#ifdef __SANITIZE_ADDRESS__
    return count_++ % several_ != 0;
#else
    return false;
#endif
  }

 private:
  const int several_;
  int count_ = 0;
};

}  // namespace bielle::testing
