// The generators are above the reader, which gets them from here when a program that links them starts (model/missing_part.h).
#include "bielle/robots/robot_loader.h"

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "formats/robot_files.h"
#include "robots/composed_robot.h"
#include "robots/generator_entry.h"

namespace bielle {
namespace {

Model makeModel(const YamlFile& yaml) {
  if (yaml.composed) {
    const ComposedRobot robot(yaml.path);
    return combineFiles(robot.make(robot.parameters()), {}, nullptr);
  }
  const GeneratorEntry entry = readGeneratorEntry(*yaml.generator, yaml.settings ? &*yaml.settings : nullptr);
  try {
    return entry.generator.make(entry.parameters);
  } catch (const InputError& error) {
    // Of a part's file, or of parameters that are possible one by one, but not together.
    const std::string& file = error.source();
    yaml.generator->fail((file.empty() || file == yaml.generator->getText() ? "" : file + ": ") + error.element() +
                             ": " + error.problem(),
                         error.remedy());
  }
}

// As if they had been written and read again: a generated robot is the same by its generator and from its files, and
// whatever completes a robot, or fixes its base, has the same meaning for it.
RobotFiles generate(const YamlFile& yaml) {
  const Model model = makeModel(yaml);
  if (yaml.settings) requireUsed(locateBeside(*yaml.generator), *yaml.settings);
  return parseRobotText(formatRobot(model), yaml.path);
}

}  // namespace

}  // namespace bielle

extern "C" const bool bielle_robots = [] {
  bielle::getRobotSources().generate = &bielle::generate;
  return true;
}();
