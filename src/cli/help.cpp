// The help of the companions' commands, which src/cli/help holds (scripts/update_help.sh).
#include "cli/help.h"

#include <map>

#include "model/embed.h"

#define BIELLE_FILE BIELLE_EMBED
#include "help.inc"
#undef BIELLE_FILE
#define BIELLE_FILE BIELLE_ENTRY

namespace bielle::cli {

const std::string* findHelp(const std::vector<std::string>& words) {
  static const std::map<std::string, std::string> texts = {
#include "help.inc"
  };
  std::string name;
  const std::string* found = nullptr;
  for (const std::string& word : words) {
    name += (name.empty() ? "" : "-") + word;
    const auto text = texts.find(name + ".txt");
    if (text == texts.end()) break;
    found = &text->second;
  }
  return found;
}

}  // namespace bielle::cli
