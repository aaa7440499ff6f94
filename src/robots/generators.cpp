#include "bielle/robots/generators.h"

#include "bielle/model/error.h"
#include "bielle/robots/cleobot.h"
#include "bielle/robots/rsu_biped.h"

namespace bielle {
namespace {

// The request owns its parameters; listParameters() is found by their type.
template <typename Parameters>
std::function<GeneratorRequest()> makeRequests(Model (*make)(const Parameters&)) {
  return [make] {
    const auto parameters = std::make_shared<Parameters>();
    return GeneratorRequest{listParameters(*parameters), [make, parameters] { return make(*parameters); }};
  };
}

}  // namespace

const std::vector<Generator>& getGenerators() {
  static const std::vector<Generator> generators = {
      {"cleobot", "biped with parallel legs: 3-RRS lower legs, hips turned by three crank-and-rod chains",
       makeRequests<CleobotParameters>(makeCleobot)},
      {"rsu_biped", "biped with serial hips and knees, ankles driven by two rods with spherical ends (RSU)",
       makeRequests<RsuBipedParameters>(makeRsuBiped)},
  };
  return generators;
}

const Generator& findGenerator(const std::string& name) {
  std::string known;
  for (const Generator& generator : getGenerators()) {
    if (generator.name == name) return generator;
    known += (known.empty() ? "" : ", ") + generator.name;
  }
  throw ModelError("", "robot '" + name + "'", "there is no such generator", "choose one of: " + known);
}

}  // namespace bielle
