// Loops of a file that are marked, but not closed.
#include <algorithm>

#include "formats/reader_dialects.h"
#include "model/listing.h"

namespace bielle {
namespace {

// closing_NAME_1, or a name whose last word but the 1 is cl, loop or closure, with or without a number.
bool isFirstEnd(const std::string& name) {
  if (name.size() < 3 || name.compare(name.size() - 2, 2, "_1") != 0) return false;
  std::string stem = name.substr(0, name.size() - 2);
  if (stem.rfind("closing_", 0) == 0) return stem.size() > 8;
  stem = stem.substr(stem.rfind('_') + 1);  // all of it without a '_'
  stem.erase(stem.find_last_not_of("0123456789") + 1);
  return stem == "cl" || stem == "loop" || stem == "closure";
}

}  // namespace

void warnOfOpenLoops(UrdfFile& tree, const YamlFile& settings) {
  const auto mimics = [](const UrdfJoint& joint) { return !joint.mimicked.empty(); };
  if (!tree.dependent.empty() && settings.closures.empty() &&
      std::none_of(tree.joints.begin(), tree.joints.end(), mimics))
    tree.warnings.push_back(
        tree.path + ": joint '" + tree.dependent.front() +
        (tree.dependent.size() > 1 ? "' and " + std::to_string(tree.dependent.size() - 1) + " others are" : "' is") +
        " said to depend on others (independent=\"false\"), but no <loop> or <coupling> says how, so "
        "that they move freely here; give `closures` in the robot's YAML file");
  std::vector<std::string> ends, closures;
  for (const auto& [name, link] : tree.links) {
    if (!isFirstEnd(name)) continue;
    const std::string base = name.substr(0, name.size() - 2), other = base + "_2";
    const auto is_named =
        [&name = name](const ClosureSpec& closure) {  // clang 14 does not capture a structured binding by itself
          return closure.frame1 == name || closure.frame2 == name;
        };
    if (!tree.links.count(other) || std::any_of(settings.closures.begin(), settings.closures.end(), is_named)) continue;
    ends.push_back("'" + name + "' and '" + other + "'");
    closures.push_back("{name: " + base.substr(base.rfind("closing_", 0) == 0 ? 8 : 0) + ", type: 3d, frames: [" +
                       name + ", " + other + "]}");
  }
  if (!ends.empty())
    tree.warnings.push_back(tree.path + ": links " + listItems(ends) + ": they look like the ends of " +
                            (ends.size() > 1 ? "loops, which are" : "a loop, which is") +
                            " open here; close them in the robot's YAML file, for example by `closures: [" +
                            listItems(closures) + "]` (3d a ball, 5d a hinge about z, 6d a weld)");
}

}  // namespace bielle
