#include "bielle/motion/obstacles.h"

#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/stairs.h"
#include "motion/course.h"
#include "motion/gait.h"

namespace bielle {
namespace {

constexpr double kBank = 1.2, kBankWidth = 2;  // m

double calcHalfLength(const Model& model, const Stance& stance) {
  return std::max(model.contacts()[stance.contacts[0]].half_length, model.contacts()[stance.contacts[1]].half_length);
}

// Both feet, moved by each displacement in turn; displacements are from the start, in the axes of its middle frame.
std::vector<Footstep> moveTogether(const Stance& stance, const std::vector<Vector3d>& displacements) {
  const Matrix3d R = calcMiddle(stance.feet[0], stance.feet[1]).R;
  std::vector<Footstep> steps;
  for (const Vector3d& displacement : displacements)
    for (Side side : {Side::Right, Side::Left}) {
      SE3 X = stance.feet[static_cast<int>(side)];
      X.p += R * displacement;
      steps.push_back({side, X});
    }
  return steps;
}

void checkBox(const Model& model, const Stance& stance, const BoxOptions& o) {
  requireOption(o.height > 0 && o.height <= 10, "height", "it is outside 0 .. 10 m", "give metres, e.g. 0.1");
  const ContactFrame& foot = model.contacts()[stance.contacts[0]];
  requireOption(o.length >= 2 * calcHalfLength(model, stance) && o.length <= 10, "length",
                "the box is shorter than the sole, or longer than 10 m", "give metres, e.g. 0.2");
  requireOption(o.width > (stance.feet[0].p - stance.feet[1].p).norm() + 2 * foot.half_width && o.width <= 100, "width",
                "the box is too narrow for the feet, or wider than 100 m", "give metres, e.g. 0.8");
  requireOption(o.distance >= 0 && std::isfinite(o.distance), "distance", "it is negative or not finite",
                "give the distance from the soles to the box in metres, e.g. 0.05");
  requireOption(o.down == 0 || o.down == 1, "down", "it is neither 0 nor 1", "give 1 to step down again");
}

void checkGap(const GapOptions& o) {
  requireOption(o.width > 0 && o.width < kBank, "width", "it is outside 0 .. 1.2 m", "give metres, e.g. 0.15");
  requireOption(o.distance >= 0 && std::isfinite(o.distance), "distance", "it is negative or not finite",
                "give the distance from the soles to the gap in metres, e.g. 0.02");
  requireOption(o.depth > 0 && o.depth <= 100, "depth", "it is outside 0 .. 100 m", "give metres, e.g. 0.3");
}

template <typename Options>
std::vector<std::pair<std::string, double>> listOptionValues(Options options) {
  return listValues(listOptions(options));
}

}  // namespace

LocomotionOptions BoxOptions::makeGaitDefaults() {
  LocomotionOptions gait = StairsOptions::makeGaitDefaults();
  gait.timing.single = 0.6;
  gait.swing.leave = 0.25;
  gait.swing.arrive = 0.75;
  return gait;
}

std::vector<OptionEntry> listOptions(BoxOptions& o) {
  std::vector<OptionEntry> entries = {{"height", &o.height, "m", "height of the box"},
                                      {"length", &o.length, "m", "length of its top; the feet stand in the middle"},
                                      {"width", &o.width, "m", "width of the box"},
                                      {"distance", &o.distance, "m", "distance from the soles to the box"},
                                      {"down", &o.down, "0 or 1", "1: step down again behind the box"}};
  for (OptionEntry& entry : listOptions(o.gait)) entries.push_back(std::move(entry));
  return entries;
}

std::vector<OptionEntry> listOptions(GapOptions& o) {
  std::vector<OptionEntry> entries = {
      {"width", &o.width, "m", "width of the gap in the direction of travel"},
      {"distance", &o.distance, "m", "distance of the soles from its edges, on both sides"},
      {"depth", &o.depth, "m", "depth of the gap's floor below its banks"}};
  for (OptionEntry& entry : listOptions(o.gait)) entries.push_back(std::move(entry));
  return entries;
}

MotionPlan planBox(const Model& model, const BoxOptions& o, const VectorXd& q0) {
  const Stance stance = makeStance(model, o.gait, q0);
  checkBox(model, stance, o);
  const SE3 start = calcMiddle(stance.feet[0], stance.feet[1]);
  const double stride = calcHalfLength(model, stance) + o.distance + o.length / 2;
  const Vector3d top(stride, 0, o.height), behind(2 * stride, 0, 0);
  Course course{"box", moveTogether(stance, {top}), {}};
  if (o.down != 0) course.steps = moveTogether(stance, {top, behind});
  course.ground.height = start.p.z();
  course.ground.steps = {{start.act(top), o.length, o.width, calcHeading(start)}};
  MotionPlan plan = planCourse(model, stance, course, o.gait);
  plan.options = listOptionValues(o);
  const Goal height =
      makeCourseGoal(model, stance, "height", o.height, Vector3d::UnitZ(), listLandings(plan.schedule)[1]);
  plan.goals.insert(plan.goals.begin(), height);
  return plan;
}

MotionPlan planGap(const Model& model, const GapOptions& o, const VectorXd& q0) {
  const Stance stance = makeStance(model, o.gait, q0);
  checkGap(o);
  const SE3 start = calcMiddle(stance.feet[0], stance.feet[1]);
  const double half = calcHalfLength(model, stance), edge = half + o.distance, stride = o.width + 2 * edge;
  Course course{"gap", moveTogether(stance, {Vector3d(stride, 0, 0)}), {}};
  course.ground.height = start.p.z() - o.depth;
  for (double middle : {edge - kBank / 2, edge + o.width + kBank / 2})
    course.ground.steps.push_back({start.act(Vector3d(middle, 0, 0)), kBank, kBankWidth, calcHeading(start)});
  MotionPlan plan = planCourse(model, stance, course, o.gait);
  plan.options = listOptionValues(o);
  const Goal across = makeCourseGoal(model, stance, "across", stride, start.R.col(0), plan.schedule.numStages());
  plan.goals.insert(plan.goals.begin(), across);
  return plan;
}

Motion makeBox(const Model& model, const BoxOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planBox(model, options, makeStandingPosture(model)), problem);
}

Motion makeGap(const Model& model, const GapOptions& options, const ProblemOptions& problem) {
  return makeMotion(model, planGap(model, options, makeStandingPosture(model)), problem);
}

}  // namespace bielle
