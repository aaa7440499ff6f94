#include <cmath>

#include "bielle/model/error.h"
#include "bielle/motion/footsteps.h"
#include "bielle/motion/registry.h"
#include "math/so3.h"
#include "motion/join.h"

namespace bielle {
namespace {

constexpr double kSameLevel = 1e-6;  // m
constexpr double kRim = 0.01;        // of a platform around the soles, m

// The platform under soles that stood on the plane of a plan if the common plane is lower: their bounding box, aligned
// with the first sole.
// \pre there is a sole
GroundStep makePlatform(const Model& model, const std::vector<ContactTarget>& soles) {
  const SE3& first = soles.front().X_WT;
  const double yaw = calcHeading(first);
  const Matrix3d R = makeAxisRotation(Vector3d::UnitZ(), yaw);
  Eigen::AlignedBox2d box;
  for (const ContactTarget& sole : soles) {
    const ContactFrame& frame = model.contacts()[sole.contact];
    for (double x : {-frame.half_length, frame.half_length})
      for (double y : {-frame.half_width, frame.half_width})
        box.extend((R.transpose() * sole.X_WT.act(Vector3d(x, y, 0))).head<2>().eval());
  }
  const Vector3d middle = R * Vector3d(box.center().x(), box.center().y(), 0);
  return {middle + first.p.z() * Vector3d::UnitZ(), box.sizes().x() + 2 * kRim, box.sizes().y() + 2 * kRim, yaw};
}

std::vector<ContactTarget> listSolesOnPlane(const MotionPlan& plan) {
  std::vector<ContactTarget> soles;
  for (const ContactPhase& phase : plan.schedule.phases)
    for (const ContactTarget& contact : phase.contacts)
      if (std::abs(contact.X_WT.p.z() - plan.ground.height) < kSameLevel) soles.push_back(contact);
  return soles;
}

Ground joinGrounds(const Model& model, const std::vector<MotionPlan>& plans) {
  Ground ground = plans.front().ground;
  ground.steps.clear();
  for (const MotionPlan& plan : plans) {
    ground.height = std::min(ground.height, plan.ground.height);
    if (plan.ground.friction != ground.friction)
      throw InputError("", "option '" + plan.name + ".friction'", "it differs from that of the previous motions",
                       "give the same friction for all motions of the sequence");
  }
  for (const MotionPlan& plan : plans) {
    const std::vector<ContactTarget> soles = listSolesOnPlane(plan);
    if (plan.ground.height > ground.height + kSameLevel && !soles.empty())
      ground.steps.push_back(makePlatform(model, soles));
    ground.steps.insert(ground.steps.end(), plan.ground.steps.begin(), plan.ground.steps.end());
  }
  return ground;
}

// Checks that steps and platforms of one motion do not lie under the feet of another.
void checkSoles(const Model& model, const MotionPlan& plan, const Ground& ground) {
  for (const ContactPhase& phase : plan.schedule.phases)
    for (const ContactTarget& sole : phase.contacts) {
      const ContactFrame& frame = model.contacts()[sole.contact];
      for (double x : {-frame.half_length, frame.half_length})
        for (double y : {-frame.half_width, frame.half_width}) {
          const Vector3d corner = sole.X_WT.act(Vector3d(x, y, 0));
          if (ground.calcHeight(corner.x(), corner.y()) > corner.z() + kSameLevel)
            throw InputError(
                "", "motion '" + plan.name + "' of the sequence",
                "its phase '" + phase.name + "' stands where another motion of the sequence has higher ground",
                "move away from there first, e.g. by a walk");
        }
    }
}

}  // namespace

MotionPlan planSequence(const Model& model, const std::vector<SequencePart>& parts, const StandingRobot& standing) {
  if (parts.empty())
    throw InputError("", "sequence", "it has no motions", "give at least one, e.g. squat, walk, stairs or jump");
  std::vector<MotionPlan> plans;
  for (const SequencePart& part : parts) {
    plans.push_back(
        part.plan(model, plans.empty() ? standing : makeStandingRobot(model, plans.back().q_end, standing.neighbours)));
    plans.back().name = part.name;
    requireOption(!plans.back().cycle, part.name + ".periodic", "a cycle does not start where another motion ends",
                  "leave it out");
  }
  MotionPlan sequence;
  sequence.name = "sequence";
  sequence.ground = joinGrounds(model, plans);
  for (const MotionPlan& plan : plans) checkSoles(model, plan, sequence.ground);
  sequence.q_start = standing.q;
  sequence.q_end = plans.back().q_end;
  for (size_t i = 0; i < plans.size(); ++i) {
    MotionPlan& plan = plans[i];
    const int start = sequence.schedule.numStages();
    for (Goal& goal : plan.goals) {
      goal.name = plan.name + "." + goal.name;
      goal.first += start;
      goal.last += start;
      for (Foothold& foothold : goal.footholds) foothold.node += start;
      sequence.goals.push_back(std::move(goal));
    }
    if (i + 1 < plans.size()) plan.stages.pop_back();
    moveAll(plan.stages, sequence.stages);
    joinTrajectories(plan.guess, sequence.guess);
    for (ContactPhase& phase : plan.schedule.phases) {
      phase.name = plan.name + ": " + phase.name;
      sequence.schedule.phases.push_back(std::move(phase));
    }
    for (auto& [name, value] : plan.options) sequence.options.emplace_back(plan.name + "." + name, value);
  }
  return sequence;
}

Motion makeSequence(const Model& model, const std::vector<SequencePart>& parts, const ProblemOptions& problem) {
  return makeMotion(model, planSequence(model, parts, makeStandingRobot(model)), problem);
}

}  // namespace bielle
