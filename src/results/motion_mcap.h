#pragma once
/// \file A motion as an MCAP file of Foxglove's messages (protobuf), which Foxglove, Lichtblick, PlotJuggler and Rerun show.
///
/// Times count from the start of the motion. Topics; those under /plan are there of a motion that was carried out, with the plan:
/// | topic                         | message                  | at                                                      |
/// |-------------------------------|--------------------------|---------------------------------------------------------|
/// | /tf, /plan/tf                 | foxglove.FrameTransforms | nodes: bodies in the frame `world`, those of the plan as plan/NAME |
/// | /scene/robot, /scene/plan     | foxglove.SceneUpdate     | the start: shapes and meshes of bodies, steps of the ground |
/// | /scene/forces                 | foxglove.SceneUpdate     | stages: arrows of the forces of contacts and closures   |
/// | /scene/footholds              | foxglove.SceneUpdate     | touchdowns: the sole on the ground; predicted ones, if any |
/// | /joints, /plan/joints         | foxglove.JointStates     | nodes: coordinates with one rate each; efforts of motors |
/// | /motors, /plan/motors         | foxglove.JointStates     | nodes: motors alone                                     |
/// | /robot_description            | std_msgs/msg/String      | the start: a URDF of the shapes, meshes as rods         |
/// | /com, /plan/com               | foxglove.PoseInFrame     | nodes: centre of mass                                   |
/// | /wrenches/contacts, /closures | bielle.msg.Wrenches      | stages                                                  |
/// | /footholds, /plan/footholds   | bielle.msg.Footholds     | touchdowns; nodes: predicted ones                       |
/// | /events                       | foxglove.Log             | phases, touchdowns, pushes, a fall, how it ended        |
///
/// A stage is written at the time of its node; an impact, which has no forces, is left out.
#include <optional>
#include <string>
#include <vector>

#include "bielle/formats/reader.h"
#include "bielle/motion/record.h"
#include "results/json_text.h"

namespace bielle {

struct MotionMcap {
  std::string mcap;
  std::vector<std::string> warnings;  ///< what the file lacks
};

/// \param plan     at the same times, of a motion that was carried out
/// \param summary  of the result
/// \throws InputError in a build without protobuf
MotionMcap formatMotionMcap(const LoadedRobot& robot, const MotionRecord& record,
                            const std::optional<MotionRecord>& plan, const Json& summary);

}  // namespace bielle
