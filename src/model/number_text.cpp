#include "model/number_text.h"

#include <cstdio>

namespace bielle {

std::string formatNumber(double value, const char* format) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace bielle
