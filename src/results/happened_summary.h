#pragma once
#include <optional>
#include <string>

#include "bielle/results/result.h"
#include "results/json_text.h"

namespace bielle {

// The summary of a result of what happened, without what tells how it was solved.
Json makeHappenedSummary(const MotionResult& result);

// The summary of a plan or of what happened, then with the name of its world and without what only plans have.
struct AnySummary {
  MotionSummary facts;
  std::optional<std::string> world;  // none: a plan
};

// \throws InputError as readSummary()
AnySummary readAnySummary(const std::string& directory);

}  // namespace bielle
