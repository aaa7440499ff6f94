#pragma once
// One solved motion as read from its directory, and as the page needs it.
#include <string>

#include "bielle/io/record.h"
#include "bielle/model/reader.h"
#include "io/json_text.h"

namespace bielle {

struct ReportRun {
  std::string directory;
  Json summary, check;  // check: null when there is none
  MotionRecord record;
  LoadedRobot robot;
};

// \throws ModelError naming the file and what is wrong
ReportRun readRun(const std::string& directory);

// The robot: its drawing (drawing.h), joints, motors, closures, contacts.
Json describeRobot(const LoadedRobot& robot);

// Quantities at every node and stage; placements of all bodies and of the feet come from q.
Json describeMotion(const ReportRun& run);

}  // namespace bielle
