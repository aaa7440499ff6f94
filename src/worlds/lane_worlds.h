#pragma once
/// \file Plans that are carried out many at a time, in the lanes of one WorldBatch.
#include <functional>
#include <memory>

#include "bielle/worlds/batch.h"
#include "worlds/carrying.h"

namespace bielle::worlds {

/// One run of them. All have the same period of control; delays of torques are of whole periods, without jitter.
struct LaneRun {
  Controller* controller = nullptr;  ///< its own, or one that remembers nothing from update to update
  Model machine;                     ///< that of the batch, but for masses (robot_errors.h)
  Ground ground;                     ///< with its coefficient of friction; all have steps, or none
  PerceptionOptions sensors = {};
  ExecutionOptions options = {};
};

struct LaneOptions {
  double time_step = 0;  ///< s; 0: that of Bielle's own world
  int lanes = 16, threads = 1;  ///< the record of each is kept until it ends
};

/// As carryOut() in Bielle's own world for each. What comes of a run differs from that by rounding, which falls enlarge, and depends
/// neither on the lanes nor on the other runs.
/// \param model  of all machines   \param make  run by its number; called when a lane is free for it
/// \param done  is given each in the order of their ends
/// \throws InputError as makeBielleWorld(), and what make() and done() throw
void carryOutInLanes(const Plan& plan, const Model& model, int count, const LaneOptions& options,
                     const std::function<std::unique_ptr<LaneRun>(int run)>& make,
                     const std::function<void(int run, const LaneRun&, const Execution&, const World&)>& done);

}  // namespace bielle::worlds
