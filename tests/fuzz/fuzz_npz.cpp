// A trajectory as a NumPy archive.
#include "fuzz_record.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  bielle::fuzz::tryRecord("trajectory.npz", bielle::fuzz::toText(data, size));
  return 0;
}
