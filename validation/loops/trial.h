#pragma once
// One problem in one engine with one setting: how far off, how open, how long.
#include <string>
#include <vector>

#include "loops/engines.h"
#include "loops/problem.h"

namespace bielle::loops {

struct Trial {
  double setting = 0;          // in fact used
  std::vector<double> errors;  // at the times of the problem, as far as it went: the largest of the outputs that count
  double cpu = 0;              // processor time of advancing, s
  double gap = 0;              // largest opening of the loops, m
  double drift = 0;            // largest change of the invariant, over the size of its parts
  double until = 0;            // s
  std::string end;             // why it ended early; empty if it did not
};

struct TrialOptions {
  double limit = 20;    // of the processor's time, s
  double duration = 0;  // shorter than that of the problem, s; 0: all of it
};

// \param setting  of the engine at pace 1
Trial runTrial(const Problem& problem, const Engine& engine, double setting, const TrialOptions& options = {});

// One after the other from coarse to fine, until one would take too long.
std::vector<Trial> runTrials(const Problem& problem, const Engine& engine, const TrialOptions& options = {});

// Of the outputs that count.
double calcError(const Problem& problem, const VectorXd& q, const VectorXd& v, const Motion& truth);

}  // namespace bielle::loops
