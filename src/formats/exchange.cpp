// The readers of this library, entered when a program that links it starts (model/missing_part.h).
#include "formats/exchange_readers.h"

extern "C" const bool bielle_exchange = [] {
  bielle::getRobotSources().readers = {{".sdf", &bielle::readSdf},  {".xml", &bielle::readMjcf},
                                       {".usd", &bielle::readUsd},  {".usda", &bielle::readUsd},
                                       {".usdc", &bielle::readUsd}, {".usdz", &bielle::readUsd}};
  return true;
}();
