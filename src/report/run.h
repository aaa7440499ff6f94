#pragma once
// One solved motion as read from its directory, and as the page needs it.
#include <optional>
#include <string>

#include "bielle/formats/reader.h"
#include "bielle/motion/record.h"
#include "results/json_text.h"

namespace bielle {

struct ReportRun {
  std::string directory;
  Json summary, check;  // check: null when there is none
  MotionRecord record;
  std::optional<MotionRecord> plan;  // of a motion that was carried out, at the same times
  LoadedRobot robot;
};

// \throws InputError naming the file and what is wrong
ReportRun readRun(const std::string& directory);

// A posture as a motion of one node. \param motion  its name
ReportRun makeStillRun(const LoadedRobot& robot, ConstVectorRef q, const std::string& motion);

// The robot: its drawing (drawing.h), joints, motors, closures, contacts.
Json describeRobot(const LoadedRobot& robot);

// Quantities at every node and stage; placements of all bodies and of the feet come from q. Predicted footholds if there are.
Json describeMotion(const ReportRun& run);

// The plan of a motion that was carried out: what of describeMotion() does not depend on forces of contacts and
// closures. Null when there is none.
Json describePlan(const ReportRun& run);

}  // namespace bielle
