#include "bielle/robots/generators.h"

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

template <typename Parameters>
Generator makeGenerator(const std::string& name, const std::string& help, Model (*make)(const Parameters&)) {
  return {name, help, listOptions(Parameters(), "parameter", name),
          [make](const OptionSet& parameters) { return make(readOptions<Parameters>(parameters)); }};
}

// The chain of robots/fourbar_chain.h, its rods drawn.
struct FourBarChainParameters {
  FourBarChainParameters() {
    options.radius = 0.01;
    options.count = 3;
  }
  FourBarChainOptions options;
};

void describe(OptionFields& f, FourBarChainParameters& p) {
  FourBarChainOptions& o = p.options;
  f.integer("count", o.count, {1, 1000}, "number of four-bars");
  f.number("ground", o.ground, "m", {0.01, 10}, "distance between the pivots of crank and rocker");
  f.number("crank", o.crank, "m", {0.01, 10}, "length of the crank");
  f.number("coupler", o.coupler, "m", {0.01, 10}, "length of the coupler, the ground of the next four-bar");
  f.number("rocker", o.rocker, "m", {0.01, 10}, "length of the rocker");
  f.number("crank_angle", o.crank_angle, "rad", {-3.15, 3.15}, "angle from the ground in the reference `closed`");
  f.number("density", o.density, "kg/m", {0.01, 100}, "mass per length of the rods");
  f.number("radius", o.radius, "m", {0.001, 0.1}, "radius of the rods");
}

Model makeChain(const FourBarChainParameters& p) {
  checkParameters("fourbar_chain", p);
  return makeFourBarChain(p.options).model;
}

}  // namespace

const std::vector<Generator>& getGenerators() {
  static const std::vector<Generator> generators = {
      makeGenerator("cleobot", "biped with parallel legs: 3-RRS lower legs, hips turned by three crank-and-rod chains",
                    makeCleobot),
      makeGenerator("leg_biped",
                    "biped composed of parts: hips driven by motors or 3-RRS limbs, knees by motors, belts or "
                    "four-bars, ankles by "
                    "motors, differentials or rods",
                    makeLegBiped),
      makeGenerator("rsu_biped",
                    "biped with serial hips and knees, ankles driven by two rods with spherical ends (RSU)",
                    makeRsuBiped),
      makeGenerator("humanoid", "rsu_biped with two arms and grippers whose fingers mimic each other", makeHumanoid),
      makeGenerator("belt_biped", "biped with serial hips, knees driven by belts, ankles by differentials",
                    makeBeltBiped),
      makeGenerator("belt_knee", "biped with knees driven by belts, otherwise serial", makeBeltKnee),
      makeGenerator("differential_ankle", "biped with ankles driven by differentials, otherwise serial",
                    makeDifferentialAnkle),
      makeGenerator("kangaroo",
                    "biped driven only by ball screws: hip differentials, parallelograms; 96 redundant rows",
                    makeKangaroo),
      makeGenerator("kangaroo_leg", "left leg of kangaroo with the trunk on a vertical rail; 48 redundant rows",
                    makeKangarooLeg),
      makeGenerator("fivebar_leg", "planar leg on a rail: two coaxial motors, four rods, a point foot", makeFiveBarLeg),
      makeGenerator("spring_biped", "biped like Cassie: heel rods, leaf springs at shin and heel", makeSpringBiped),
      makeGenerator("spring_leg", "leg like Cassie's with rigid springs: tarsus and toe moved by four-bars",
                    makeSpringLeg),
      makeGenerator("delta", "Clavel's delta with hinges only: many more rows than rank", makeDelta),
      makeGenerator("fourbar_chain", "chain of planar four-bars, each on the coupler of the previous one", makeChain),
  };
  return generators;
}

const Generator& findGenerator(const std::string& name) {
  std::string known;
  for (const Generator& generator : getGenerators()) {
    if (generator.name == name) return generator;
    known += (known.empty() ? "" : ", ") + generator.name;
  }
  throw InputError("", "robot '" + name + "'", "there is no such generator", "choose one of: " + known);
}

}  // namespace bielle
