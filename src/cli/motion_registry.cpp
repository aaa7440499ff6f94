#include "cli/motion_registry.h"

#include "bielle/motion/squat.h"

namespace bielle::cli {
namespace {

// The request owns its options; listOptions() is found by their type.
template <typename Options>
std::function<MotionRequest()> makeRequests(Motion (*make)(const Model&, const Options&, Formulation)) {
  return [make] {
    const auto options = std::make_shared<Options>();
    return MotionRequest{listOptions(*options), [options, make](const Model& model, Formulation formulation) {
                           return make(model, *options, formulation);
                         }};
  };
}

}  // namespace

const std::vector<MotionEntry>& getMotions() {
  static const std::vector<MotionEntry> motions = {
      {"squat",
       "down and up again, feet flat: the height of the centre of mass follows a sine",
       "bielle solve squat --robot bipetto --depth 0.7 -o squat",
       {"depth", "duration"},
       makeRequests<SquatOptions>(makeSquat)},
  };
  return motions;
}

}  // namespace bielle::cli
