#include "cli/motion_registry.h"

#include "bielle/motion/jump.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"

namespace bielle::cli {
namespace {

template <typename Options>
struct Preset {
  const char *name, *help;
  void (*apply)(Options&);
};

// The request owns its options; listOptions() is found by their type.
template <typename Options>
std::function<MotionRequest()> makeRequests(Motion (*make)(const Model&, const Options&, const ProblemOptions&),
                                            const std::vector<Preset<Options>>& presets = {}) {
  return [=] {
    const auto options = std::make_shared<Options>();
    MotionRequest request;
    request.options = listOptions(*options);
    for (const Preset<Options>& preset : presets)
      request.presets.push_back({preset.name, preset.help, [=] { preset.apply(*options); }});
    request.make = [=](const Model& model, const ProblemOptions& problem) { return make(model, *options, problem); };
    return request;
  };
}

constexpr const char* kPaper = "those published with the paper, on its structure: no footholds, a velocity instead";

}  // namespace

const std::vector<MotionEntry>& getMotions() {
  static const std::vector<MotionEntry> motions = {
      {"squat",
       "down and up again, feet flat: the height of the centre of mass follows a sine",
       "bielle solve squat --robot bipetto --depth 0.7 -o squat",
       {"depth", "duration"},
       makeRequests<SquatOptions>(makeSquat)},
      {"walk",
       "steps forward or backward on level ground, from standing to standing",
       "bielle solve walk --robot bipetto --speed 0.5 -o walk",
       {"speed", "steps", "single_support", "double_support", "swing_height"},
       makeRequests<WalkOptions>(makeWalk, {{"paper", kPaper, setPaperWeights}})},
      {"side-walk",
       "steps to the left or to the right",
       "bielle solve side-walk --robot bipetto --speed -0.2 -o side",
       {"speed", "steps", "single_support", "double_support", "swing_height"},
       makeRequests<SideWalkOptions>(makeSideWalk, {{"paper", kPaper, setPaperWeights}})},
      {"turn",
       "steps on the spot or along an arc, to another heading",
       "bielle solve turn --robot bipetto --angle 1.57 --radius 0.5 -o turn",
       {"angle", "radius", "steps", "single_support", "double_support", "swing_height"},
       makeRequests<TurnOptions>(makeTurn)},
      {"stairs",
       "up or down stairs, one foot per step",
       "bielle solve stairs --robot bipetto --height 0.06 --stairs 4 -o stairs",
       {"height", "depth", "stairs", "speed", "width", "double_support", "swing_height"},
       makeRequests<StairsOptions>(makeStairs, {{"paper", kPaper, setPaperWeights}})},
      {"jump",
       "push, fly for a given time, land: the height of the centre of mass at mid-flight follows from the time",
       "bielle solve jump --robot bipetto --flight 0.3 --length 0.2 -o jump",
       {"flight", "length"},
       makeRequests<JumpOptions>(makeJump)},
  };
  return motions;
}

}  // namespace bielle::cli
