#pragma once
// Masses, armatures and friction of a robot whose base does not move, from logged torques.
#include <map>
#include <string>
#include <vector>

#include "cli/identify_tasks.h"
#include "identify/estimate.h"

namespace bielle::cli {

// The columns that it may have: positions, `v.NAME` and `u.NAME`.
std::vector<std::string> listTorqueColumns(const Model& model);

// The numbers that are asked for: masses, coms, armatures, frictions (with dampings), or names with * for any text.
// \throws InputError for what the robot has not
std::vector<LoadNumber> chooseLoads(const Model& model, const std::vector<std::string>& asked);

struct IdentifiedLoads {
  std::vector<LoadNumber> numbers;
  // Instants that are used; that are left out, since a linkage has no configuration, a joint is at its limit, or too fast for the window.
  int instants = 0, left_out = 0, at_stops = 0, too_fast = 0;
  double window = 0;  // s
  Estimate estimate;
};

struct TorqueChoice {
  std::vector<std::string> dynamics;  // of chooseLoads(); empty: torques are passed over
  double window = 0.1;                // s, of the polynomials
};

// What the log lacks. \param q  nq, closed   \throws InputError
void requireTorques(const Model& model, ConstVectorRef q, const IdentifyChoice& choice, const MotionLog& log);

// \param q  nq, closed   \param offsets  of the columns of positions, by name   \throws InputError
IdentifiedLoads identifyLoads(const Model& model, ConstVectorRef q, const IdentifyChoice& choice,
                              const TorqueChoice& torques, const MotionLog& log,
                              const std::map<std::string, double>& offsets, const EstimateOptions& options);

}  // namespace bielle::cli
