#include "worlds/make_world.h"

#include "bielle/model/error.h"
#include "bielle/worlds/bielle_world.h"
#ifdef BIELLE_WITH_MUJOCO
#include "worlds/mujoco_world.h"
#endif
#include "worlds/play_world.h"
#include "worlds/simbody_world.h"

namespace bielle::worlds {
namespace {

struct Entry {
  const char* name;
  bool controls_error;
  std::unique_ptr<World> (*make)(const Model& model, const WorldOptions& options);
};

const Entry kWorlds[] = {
    {"bielle", true, makeOwnWorld},
#ifdef BIELLE_WITH_MUJOCO
    {"mujoco", false,
     [](const Model& model, const WorldOptions& options) {
       return makeMujocoWorld(model, {options, {}});
     }},
#endif
    {"simbody", true,
     [](const Model& model, const WorldOptions& options) {
       SimbodyWorldOptions simbody;
       simbody.world = options;
       if (options.tolerance > 0) simbody.accuracy = options.tolerance;
       return makeSimbodyWorld(model, simbody);
     }},
};

const Entry& getEntry(const std::string& name) {
  std::string known;
  for (const Entry& entry : kWorlds) {
    if (entry.name == name) return entry;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError("", "world '" + name + "'", "there is no such world", "choose one of: " + known);
}

}  // namespace

std::vector<std::string> listWorlds() {
  std::vector<std::string> names;
  for (const Entry& entry : kWorlds) names.push_back(entry.name);
  return names;
}

bool controlsError(const std::string& name) { return getEntry(name).controls_error; }

std::unique_ptr<World> makeWorld(const std::string& name, const Model& model, const WorldOptions& options) {
  const Entry& entry = getEntry(name);
  if (options.tolerance > 0 && !entry.controls_error)
    throw InputError("", "tolerance of world '" + name + "'", "its steps are of a fixed length", "give a time step");
  return makePlayWorld(model, options, entry.make);
}

}  // namespace bielle::worlds
