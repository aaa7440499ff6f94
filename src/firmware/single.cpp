// The functions of single precision that generated code brings with it, compiled from the text that is printed.
#include "firmware/single.h"

#include <map>

#include "model/embed.h"

#define BIELLE_FILE BIELLE_EMBED
#include "functions.inc"
#undef BIELLE_FILE
#define BIELLE_FILE BIELLE_ENTRY

namespace bielle::firmware {
namespace {

#include "firmware/arctangent.h"
#include "firmware/sine.h"

}  // namespace

float calcSine(float x) { return sine(x, 0); }
float calcCosine(float x) { return sine(x, 1); }
float calcArctangent(float y, float x) { return arctangent(y, x); }

const std::string& getSingleFunction(const std::string& name) {
  static const std::map<std::string, std::string> texts = {
#include "functions.inc"
  };
  return texts.at(name + ".h");
}

}  // namespace bielle::firmware
