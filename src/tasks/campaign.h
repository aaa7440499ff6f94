#pragma once
/// \file The runs of a campaign: each a task, a run of `bielle-simulate`, each written to a log when it ends.
///
/// The log DIR/runs.jsonl has one line per finished run, in the order in which they ended. Runs in the log are not done
/// again, and what is no longer requested does no harm: axes and motions may be added between two calls, and the runs
/// of a motion that has changed are done anew. All else follows from outcomes in the order of the axes, and thus does not
/// depend on where the tasks are done and how many at a time.
#include <functional>
#include <string>
#include <vector>

#include "results/json_text.h"
#include "tasks/campaign_spec.h"
#include "tasks/engine.h"

namespace bielle::tasks {

struct CampaignOptions {
  std::string bielle, simulate;  ///< paths of the programs
  tasks::TaskEngine* engine = nullptr;
  std::function<void(const std::string&)> progress;
};

constexpr const char *kStood = "stood", *kFell = "fell", *kUndecided = "not decided", *kRefused = "refused";

/// One finished run. Under `outcome` of its result: stood, fell, not decided, failed, or, not in the log, refused.
struct CampaignRun {
  std::vector<std::string> values;  ///< of the columns
  std::string command;              ///< arguments of `bielle simulate` after the motion
  Json result;

  bool stood() const { return result.at("outcome") == kStood; }
};

/// The axes are the columns; of a search for the largest impulse there is one more, "push impulse", behind them.
struct CampaignResults {
  std::vector<std::string> columns;
  std::vector<CampaignRun> runs;  ///< in the order of the axes, the last column varying first
  bool searched = false;          ///< for the largest impulses
  bool interrupted = false;       ///< by the user
  bool complete = true;           ///< false if runs failed, or returned an invalid result
};

/// Checks options by dry runs, solves the motions that are to be solved (in DIR/motions), and does what the log lacks.
/// \throws InputError when an option is refused, a motion cannot be solved, or the log is of another version of the
/// program
CampaignResults runCampaign(const CampaignSpec& spec, const std::string& directory, const CampaignOptions& options);

}  // namespace bielle::tasks
