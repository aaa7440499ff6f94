// A trajectory as comma-separated values.
#include "fuzz_record.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  bielle::fuzz::tryRecord("trajectory.csv", bielle::fuzz::toText(data, size));
  return 0;
}
