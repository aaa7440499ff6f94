#include "bielle/motion/registry.h"

#include <algorithm>
#include <map>

#include "bielle/model/error.h"
#include "bielle/motion/jump.h"
#include "bielle/motion/run.h"
#include "bielle/motion/squat.h"
#include "bielle/motion/stairs.h"
#include "bielle/motion/walk.h"
#include "model/missing_part.h"
#include "motion/footholds.h"
#include "motion/motion_part.h"
#include "motion/obstacles.h"

namespace bielle {
namespace {

// \throws MissingPart when this program has the description of a motion, but not the motion itself
const MotionPart& getPart(const std::string& motion) {
  const auto part = getMotionParts().find(motion);
  if (part == getMotionParts().end()) throw MissingPart("the motion " + motion);
  return part->second;
}

// describe() is found by the type of the options.
template <typename Options>
MotionRequest makeRequest(const std::string& motion) {
  return {listOptions(Options()),
          {},
          [motion](const Model& model, const StandingRobot& standing, const OptionSet& options) {
            return getPart(motion).planner(model, standing, options);
          },
          {}};
}

MotionRequest makeFootholdsRequest() {
  MotionRequest request = makeRequest<FootholdsOptions>("footholds");
  request.files.push_back(
      {"footholds",
       "YAML file, a list `footholds` of {foot: left or right, x, y, z [m], yaw, pitch, roll [rad]}, "
       "relative to the middle of the feet at the start",
       [](const std::string& path, MotionRequest& changed) {
         changed.options.set("footholds", getPart("footholds").read(path));
       }});
  return request;
}

// The options of a part of a sequence, under their names there.
OptionSet selectPart(const OptionSet& options, const std::string& part) {
  OptionSet selected;
  for (Option option : options) {
    if (option.name.rfind(part + ".", 0) != 0) continue;
    option.name.erase(0, part.size() + 1);
    selected.add(std::move(option));
  }
  return selected;
}

std::vector<SequencePart> listParts(const std::vector<std::pair<std::string, MotionPlanner>>& planners,
                                    const OptionSet& options) {
  std::vector<SequencePart> parts;
  for (const auto& [name, planner] : planners)
    parts.push_back(
        {name, [planner = planner, own = selectPart(options, name)](const Model& model, const StandingRobot& standing) {
           return planner(model, standing, own);
         }});
  return parts;
}

}  // namespace

std::map<std::string, MotionPart>& getMotionParts() {
  static std::map<std::string, MotionPart> parts{{"squat", {makePlanner(planSquat)}}};
  return parts;
}

const std::vector<MotionEntry>& getMotions() {
  static const std::vector<MotionEntry> motions = {
      {"squat",
       "go down and up again with feet flat; the height of the centre of mass follows a sine",
       "bielle solve squat --robot bipetto --depth 0.7 -o squat",
       {"depth", "duration"},
       makeRequest<SquatOptions>("squat")},
      {"walk",
       "steps forward or backward on level ground, from standing to standing",
       "bielle solve walk --robot bipetto --speed 0.5 -o walk",
       {"speed", "steps", "periodic", "single_support", "double_support", "swing_height"},
       makeRequest<WalkOptions>("walk")},
      {"side-walk",
       "steps to the left or to the right",
       "bielle solve side-walk --robot bipetto --speed -0.2 -o side",
       {"speed", "steps", "periodic", "single_support", "double_support", "swing_height"},
       makeRequest<SideWalkOptions>("side-walk")},
      {"turn",
       "steps on the spot or along an arc, to another heading",
       "bielle solve turn --robot bipetto --angle 1.57 --radius 0.5 -o turn",
       {"angle", "radius", "steps", "periodic", "single_support", "double_support", "swing_height"},
       makeRequest<TurnOptions>("turn")},
      {"stairs",
       "climb or descend stairs, one foot per step",
       "bielle solve stairs --robot bipetto --height 0.06 --stairs 4 -o stairs",
       {"height", "depth", "slope", "stairs", "speed", "width", "double_support", "swing_height"},
       makeRequest<StairsOptions>("stairs")},
      {"footholds",
       "steps on uneven footholds from a file",
       "bielle solve footholds --robot bipetto --footholds stones.yaml -o stones",
       {"rim", "single_support", "double_support", "swing_height"},
       makeFootholdsRequest()},
      {"box",
       "a step onto a box, and down again if requested",
       "bielle solve box --robot bipetto --height 0.1 --down -o box",
       {"height", "length", "width", "distance", "down", "single_support", "swing_height"},
       makeRequest<BoxOptions>("box")},
      {"gap",
       "a step over a gap in the ground",
       "bielle solve gap --robot bipetto --width 0.2 -o gap",
       {"width", "distance", "depth", "single_support", "swing_height"},
       makeRequest<GapOptions>("gap")},
      {"jump",
       "push off, fly for a given time, land; the time determines the height of the centre of mass at mid-flight",
       "bielle solve jump --robot bipetto --flight 0.3 --length 0.2 -o jump",
       {"flight", "length"},
       makeRequest<JumpOptions>("jump")},
      {"run",
       "steps with flights between them, from standing to standing",
       "bielle solve run --robot bipetto --speed 1 -o run",
       {"speed", "steps", "periodic", "flight", "stance", "swing_height"},
       makeRequest<RunOptions>("run")},
      {"hop",
       "lift one foot, take off and land on the other one",
       "bielle solve hop --robot bipetto --foot left --flight 0.15 -o hop",
       {"foot", "hops", "flight", "length", "stance", "swing_height"},
       makeRequest<HopOptions>("hop")},
  };
  return motions;
}

const MotionEntry& findMotion(const std::string& file, const std::string& name) {
  std::string known;
  for (const MotionEntry& entry : getMotions()) {
    if (entry.name == name) return entry;
    known += (known.empty() ? "" : ", ") + entry.name;
  }
  throw InputError(file, "motion '" + name + "'", "there is no such motion", "choose one of: " + known);
}

MotionRequest makeSequenceRequest(const std::vector<std::string>& motions) {
  MotionRequest request;
  std::map<std::string, int> times;
  for (const std::string& motion : motions) {
    const MotionRequest& part = findMotion("", motion).request;
    const int time = ++times[motion];
    const std::string name = time == 1 ? motion : motion + std::to_string(time);
    for (Option option : part.options) {
      option.name = name + "." + option.name;
      request.options.add(std::move(option));
    }
    request.parts.emplace_back(name, part.planner);
  }
  request.planner = [parts = request.parts](const Model& model, const StandingRobot& standing,
                                            const OptionSet& options) {
    return planSequence(model, listParts(parts, options), standing);
  };
  return request;
}

std::vector<SequencePart> listParts(const MotionRequest& request) { return listParts(request.parts, request.options); }

Motion makeMotion(const Model& model, const MotionRequest& request, const ProblemOptions& problem) {
  Motion motion = makeMotion(model, request.plan(model, makeStandingRobot(model)), problem);
  motion.request = std::make_shared<const MotionRequest>(request);
  const LimitOptions& limits = problem.limits;
  for (const auto& [motor, value] : limits.efforts) motion.options.emplace_back(kEffortLimit + motor, value);
  for (const auto& [motor, value] : limits.velocities) motion.options.emplace_back(kVelocityLimit + motor, value);
  for (const auto& [motor, value] : limits.powers) motion.options.emplace_back(kPowerLimit + motor, value);
  if (!limits.enforced) motion.options.emplace_back(kNoLimits, true);
  if (limits.dead_point_margin != LimitOptions().dead_point_margin)
    motion.options.emplace_back(kDeadPointMargin, limits.dead_point_margin);
  for (const auto& [linkage, value] : limits.dead_point_margins)
    motion.options.emplace_back(kDeadPointMarginOf + linkage, value);
  return motion;
}

}  // namespace bielle
