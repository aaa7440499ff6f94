#include "report/assets.h"

#include <map>

#include "model/embed.h"

#define BIELLE_FILE BIELLE_EMBED
#include "assets.inc"
#undef BIELLE_FILE
#define BIELLE_FILE BIELLE_ENTRY

namespace bielle {

const std::string& getAsset(const std::string& name) {
  static const std::map<std::string, std::string> assets = {
#include "assets.inc"
  };
  return assets.at(name);
}

}  // namespace bielle
