#pragma once
// The files of a campaign: runs.csv, campaign.md, map.svg if directions of pushes vary, summary.json.
#include "tasks/campaign.h"

namespace bielle::tasks {

// The largest impulse that was survived under some conditions: those at and below it that were tried were survived, the
// next one was not.
struct SurvivedImpulse {
  std::vector<std::string> values;  // of the columns before that of the impulse
  double impulse = 0;               // N s; 0: not even the smallest
  bool bounded = true;              // false: the largest that was tried
};
// Empty without pushes.
std::vector<SurvivedImpulse> findSurvivedImpulses(const CampaignResults& results);

// Returns the paths; a figure that cannot be drawn is left out with a note. The same results make the same bytes.
// \throws InputError when a file cannot be written
std::vector<std::string> writeCampaign(const std::string& directory, const CampaignResults& results,
                                       std::vector<std::string>& notes);

}  // namespace bielle::tasks
