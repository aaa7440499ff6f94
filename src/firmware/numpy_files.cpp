#include "firmware/languages.h"
namespace bielle::firmware {
std::map<std::string, std::string> writeNumPy(const Maps&) { return {}; }
}  // namespace bielle::firmware
