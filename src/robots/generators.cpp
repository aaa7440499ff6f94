#include "bielle/robots/generators.h"

#include <cmath>

#include "bielle/model/error.h"
#include "bielle/robots/fourbar_chain.h"
#include "robots/cleobot.h"
#include "robots/delta.h"
#include "robots/fivebar_leg.h"
#include "robots/humanoid.h"
#include "robots/kangaroo.h"
#include "robots/leg_biped.h"
#include "robots/spring_biped.h"
#include "robots/spring_leg.h"

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

// The chain of robots/fourbar_chain.h, its rods drawn.
struct FourBarChainParameters {
  FourBarChainParameters() { options.radius = 0.01; }
  FourBarChainOptions options;
  double count = 3;
};

std::vector<Parameter> listParameters(FourBarChainParameters& p) {
  FourBarChainOptions& o = p.options;
  return {{"count", &p.count, "1", 1, 1000, "number of four-bars"},
          {"ground", &o.ground, "m", 0.01, 10, "distance between the pivots of crank and rocker"},
          {"crank", &o.crank, "m", 0.01, 10, "length of the crank"},
          {"coupler", &o.coupler, "m", 0.01, 10, "length of the coupler, the ground of the next four-bar"},
          {"rocker", &o.rocker, "m", 0.01, 10, "length of the rocker"},
          {"crank_angle", &o.crank_angle, "rad", -3.15, 3.15, "angle from the ground in the reference `closed`"},
          {"density", &o.density, "kg/m", 0.01, 100, "mass per length of the rods"},
          {"radius", &o.radius, "m", 0.001, 0.1, "radius of the rods"}};
}

Model makeChain(const FourBarChainParameters& parameters) {
  FourBarChainParameters p = parameters;
  checkParameters("fourbar_chain", listParameters(p));
  if (p.count != std::floor(p.count))
    throw ModelError("fourbar_chain", "parameter 'count'", "it is not a whole number", "give 1, 2, 3, ...");
  p.options.count = static_cast<int>(p.count);
  return makeFourBarChain(p.options).model;
}

}  // namespace

const std::vector<Generator>& getGenerators() {
  static const std::vector<Generator> generators = {
      {"cleobot", "biped with parallel legs: 3-RRS lower legs, hips turned by three crank-and-rod chains",
       makeRequests<CleobotParameters>(makeCleobot)},
      {"leg_biped",
       "biped composed of parts: hips driven by motors or 3-RRS limbs, knees by motors, belts or four-bars, ankles by "
       "motors, differentials or rods",
       makeRequests<LegBipedParameters>(makeLegBiped)},
      {"rsu_biped", "biped with serial hips and knees, ankles driven by two rods with spherical ends (RSU)",
       makeRequests<RsuBipedParameters>(makeRsuBiped)},
      {"humanoid", "rsu_biped with two arms and grippers whose fingers mimic each other",
       makeRequests<HumanoidParameters>(makeHumanoid)},
      {"belt_biped", "biped with serial hips, knees driven by belts, ankles by differentials",
       makeRequests<BeltBipedParameters>(makeBeltBiped)},
      {"belt_knee", "biped with knees driven by belts, otherwise serial",
       makeRequests<BeltKneeParameters>(makeBeltKnee)},
      {"differential_ankle", "biped with ankles driven by differentials, otherwise serial",
       makeRequests<DifferentialAnkleParameters>(makeDifferentialAnkle)},
      {"kangaroo", "biped driven only by ball screws: hip differentials, parallelograms; 96 redundant rows",
       makeRequests<KangarooParameters>(makeKangaroo)},
      {"kangaroo_leg", "left leg of kangaroo with the trunk on a vertical rail; 48 redundant rows",
       makeRequests<KangarooParameters>(makeKangarooLeg)},
      {"fivebar_leg", "planar leg on a rail: two coaxial motors, four rods, a point foot",
       makeRequests<FiveBarLegParameters>(makeFiveBarLeg)},
      {"spring_biped", "biped like Cassie: heel rods, leaf springs at shin and heel",
       makeRequests<SpringBipedParameters>(makeSpringBiped)},
      {"spring_leg", "leg like Cassie's with rigid springs: tarsus and toe moved by four-bars",
       makeRequests<SpringLegParameters>(makeSpringLeg)},
      {"delta", "Clavel's delta with hinges only: many more rows than rank", makeRequests<DeltaParameters>(makeDelta)},
      {"fourbar_chain", "chain of planar four-bars, each on the coupler of the previous one",
       makeRequests<FourBarChainParameters>(makeChain)},
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
