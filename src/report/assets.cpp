#include "report/assets.h"

#include <map>

// The assembler copies each file between two symbols.
#define BIELLE_ASSET(id, name, path)                                                        \
  __asm__(                                                                                  \
      ".section .rodata\n"                                                                  \
      ".global bielle_asset_" #id "_begin\nbielle_asset_" #id "_begin:\n.incbin \"" path    \
      "\"\n"                                                                                \
      ".global bielle_asset_" #id "_end\nbielle_asset_" #id "_end:\n.byte 0\n.previous\n"); \
  extern "C" const char bielle_asset_##id##_begin[], bielle_asset_##id##_end[];
#include "assets.inc"
#undef BIELLE_ASSET

namespace bielle {

const std::string& getAsset(const std::string& name) {
#define BIELLE_ASSET(id, name, path) {name, {bielle_asset_##id##_begin, bielle_asset_##id##_end}},
  static const std::map<std::string, std::string> assets = {
#include "assets.inc"
  };
#undef BIELLE_ASSET
  return assets.at(name);
}

}  // namespace bielle
