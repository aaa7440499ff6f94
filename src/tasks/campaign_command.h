#pragma once
// The command lines of a campaign's runs.
#include <set>
#include <string>
#include <vector>

#include "tasks/campaign_spec.h"

namespace bielle::tasks {

// A value of each axis, by its index.
using CampaignCell = std::vector<size_t>;

std::string formatImpulse(const ImpulseSearch& search, int multiple);

// What runs that one task does (`bielle simulate --runs`) share of their commands, and what is a run's own.
struct SplitCommand {
  std::vector<std::string> shared, own;
};
SplitCommand splitCommand(const std::vector<std::string>& arguments);
// Whether a task does several: those that Bielle's own world steps many at once. \param shared  of them
bool goesTogether(const std::vector<std::string>& shared);

class CampaignCommands {
 public:
  // \param directories  of the motions; empty: phases count as time 0
  // \throws InputError when a plan has no such phase
  CampaignCommands(const CampaignSpec& spec, const std::vector<std::string>& directories);

  // Arguments of `bielle simulate` after the motion. `impulse`: of a search, N s.
  std::vector<std::string> make(const CampaignCell& cell, const std::string& impulse) const;

 private:
  const CampaignSpec& spec_;
  std::vector<std::vector<std::string>> phase_times_;  // per motion, per value of the axis of phases, s
};

// Dry runs of the motions that have to be solved, of one cell, and of those that differ from it in one value, equal ones
// once. `bielle`, `simulate`: paths of the programs; `log`: a file for the outputs.
// False if the user asks for the end before they are done. \param warnings  to which those of the runs are added
// \throws InputError naming the file and the key that is refused
bool checkCommands(const CampaignSpec& spec, const std::string& bielle, const std::string& simulate,
                   const std::string& log, std::set<std::string>& warnings);

}  // namespace bielle::tasks
