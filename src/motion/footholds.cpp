#include "motion/footholds.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "bielle/model/error.h"
#include "bielle/motion/stairs.h"
#include "formats/text_file.h"
#include "formats/yaml_entry.h"
#include "math/constants.h"
#include "math/so3.h"
#include "model/number_text.h"
#include "motion/course.h"
#include "motion/standing_ground.h"

namespace bielle {
namespace {

constexpr double kSamePlace = 1e-3;  // m, rad
constexpr size_t kMostSteps = 200;
constexpr double kSunken = 0.05;  // of the plane under the lowest stone, m
const YamlKeys kFootholdsKeys("footholds", "", {"footholds"});
const YamlKeys kFootholdKeys("footholds", "footholds[]", {"foot", "x", "y", "z", "yaw", "pitch", "roll"});

Footstep readFoothold(const YamlEntry& entry) {
  const YamlFields fields = entry.getFields(kFootholdKeys);
  const YamlEntry& foot = require(fields, "foot", entry);
  if (!foot.isWord("left") && !foot.isWord("right")) foot.fail("it is not a foot", "give left or right");
  const auto get = [&](const std::string& key) {
    const YamlEntry* number = find(fields, key);
    return number ? number->getNumber() : 0;
  };
  for (const char* key : {"x", "y"}) require(fields, key, entry);
  constexpr double kSteepest = 0.7;  // rad
  for (const char* key : {"pitch", "roll"})
    if (std::abs(get(key)) > kSteepest)
      find(fields, key)->fail("the foothold is steeper than " + formatNumber(kSteepest) + " rad", "give radians");
  if (std::abs(get("yaw")) > kPi)
    find(fields, "yaw")->fail("the foothold is turned by more than half a turn", "give radians, from -pi to pi");
  Footstep step;
  step.side = foot.isWord("left") ? Side::Left : Side::Right;
  step.X_WF.p << get("x"), get("y"), get("z");
  step.X_WF.R = makeAxisRotation(Vector3d::UnitZ(), get("yaw")) * makeAxisRotation(Vector3d::UnitY(), get("pitch")) *
                makeAxisRotation(Vector3d::UnitX(), get("roll"));
  return step;
}

// The footholds in the world, and the step that brings the feet together.
std::vector<Footstep> makeSteps(const Stance& stance, const std::vector<Footstep>& footholds) {
  std::vector<Footstep> steps;
  for (const Footstep& foothold : footholds) {
    if (!steps.empty() && steps.back().side == foothold.side)
      throw InputError("", "foothold " + std::to_string(steps.size() + 1),
                       std::string("the ") + getName(foothold.side) + " steps twice in a row",
                       "let the feet step alternately");
    steps.push_back({foothold.side, stance.middle * foothold.X_WF});
  }
  const Footstep& last = steps.back();
  const SE3& foot = stance.feet[static_cast<int>(last.side)];
  const SE3 moved = last.X_WF * foot.inverse();
  if (std::abs(moved.R(2, 2) - 1) > kSamePlace * kSamePlace)
    throw InputError("", "foothold " + std::to_string(steps.size()),
                     "it is inclined, but the motion ends there with both feet on the ground",
                     "make the last foothold level: no pitch, no roll");
  const Side other = getOther(last.side);
  const SE3 beside = moved * stance.feet[static_cast<int>(other)];
  const SE3 there = FootstepPlan{stance.feet, steps}.getStance(static_cast<int>(steps.size()))[static_cast<int>(other)];
  const SE3 gap = there.inverseTimes(beside);
  if (gap.p.norm() > kSamePlace || log3(gap.R).norm() > kSamePlace) steps.push_back({other, beside});
  return steps;
}

// Stones under all footholds. If all of them rise over the level of the start it is that of the plane; otherwise the plane
// lies under the lowest stone, and the robot starts from a platform.
Ground makeGround(const Model& model, const Stance& stance, const std::vector<Footstep>& steps, double rim) {
  Ground ground;
  double lowest = stance.middle.p.z();
  for (const Footstep& step : steps) {
    const ContactFrame& sole = model.contacts()[stance.contacts[static_cast<int>(step.side)]];
    const GroundStep stone = makeStone(sole, step.X_WF, rim);
    ground.steps.push_back(stone);
    for (double x : {-0.5, 0.5})
      for (double y : {-0.5, 0.5}) {
        const Vector3d corner =
            makeAxisRotation(Vector3d::UnitZ(), stone.yaw) * Vector3d(x * stone.length, y * stone.width, 0);
        lowest = std::min(lowest, stone.calcHeight(stone.top.x() + corner.x(), stone.top.y() + corner.y()));
      }
  }
  ground.height = stance.middle.p.z();
  if (lowest >= stance.middle.p.z() - kSamePlace) return ground;
  ground.height = lowest - kSunken;
  double width = 0, length = 0;
  for (int i = 0; i < 2; ++i) {
    const ContactFrame& sole = model.contacts()[stance.contacts[i]];
    const SE3 X_PF = stance.middle.inverseTimes(stance.feet[i]);
    for (double x : {-sole.half_length, sole.half_length})
      for (double y : {-sole.half_width, sole.half_width}) {
        const Vector3d corner = X_PF.act(Vector3d(x, y, 0));
        width = std::max(width, 2 * (std::abs(corner.y()) + rim));
        length = std::max(length, 2 * (std::abs(corner.x()) + rim));
      }
  }
  ground.steps.push_back({stance.middle.p, length, width, calcHeading(stance.middle)});
  return ground;
}

// Passes every entry of a list of footholds, which is checked. \param source  of the text, for messages
void readList(const std::string& source, const std::string& text, const std::function<void(const YamlEntry&)>& pass) {
  readYamlDocument(source, text, [&](const YamlEntry& document) {
    const YamlFields fields = document.getFields(kFootholdsKeys);
    const YamlEntry& list = require(fields, "footholds", document);
    const std::vector<YamlEntry> entries = list.getList();
    if (entries.empty() || entries.size() > kMostSteps)
      list.fail("it has no footholds, or more than 200",
                "give one entry per step, e.g. {foot: right, x: 0.2, y: -0.1}");
    for (const YamlEntry& entry : entries) {
      readFoothold(entry);
      pass(entry);
    }
  });
}

std::vector<Footstep> parseFootholds(const std::string& list) {
  std::vector<Footstep> footholds;
  readList("option 'footholds'", "footholds: " + list,
           [&footholds](const YamlEntry& entry) { footholds.push_back(readFoothold(entry)); });
  return footholds;
}

}  // namespace

std::string readFootholds(const std::string& path) {
  std::string list;
  readList(path, readTextFile(path, "give a YAML file with a list of footholds"), [&list](const YamlEntry& entry) {
    const YamlFields fields = entry.getFields(kFootholdKeys);
    list += list.empty() ? "[" : ", ";
    const char* separator = "{";
    for (const std::string& key : static_cast<const std::vector<std::string>&>(kFootholdKeys))
      if (const YamlEntry* value = find(fields, key)) {
        list += separator + key + ": " + value->getText();
        separator = ", ";
      }
    list += "}";
  });
  return list + "]";
}

MotionPlan planFootholds(const Model& model, const FootholdsOptions& o, const StandingRobot& standing) {
  if (o.footholds.empty())
    throw InputError("", "footholds", "none are given",
                     "solve the motion with a file, `bielle solve footholds --footholds FILE.yaml`, and carry out its "
                     "result");
  listOptions(o).check();
  const Stance stance = makeStance(model, o.gait, standing);
  requireLevel(model, listSoles(stance), "walk over footholds");
  Course course{"footholds", makeSteps(stance, parseFootholds(o.footholds)), {}};
  course.ground = makeGround(model, stance, course.steps, o.rim);
  MotionPlan plan = planCourse(model, stance, course, o.gait);
  plan.options = listOptions(o).listValues();
  return plan;
}

Motion makeFootholds(const Model& model, const FootholdsOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planFootholds(model, options, makeStandingRobot(model)), problem);
}

}  // namespace bielle
