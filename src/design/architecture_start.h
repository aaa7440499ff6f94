#pragma once
/// \file The start of the designs of one architecture: its motions, and what objective and constraints name of it.
#include <optional>
#include <vector>

#include "design/evaluation.h"

namespace bielle {

struct ArchitectureStart {
  Model model;
  std::vector<std::vector<int>> term_motors,
      constraint_motors;                                 ///< by objective and by constraint, numbers of the model
  std::vector<std::optional<WorkspaceGrid>> term_grids;  ///< by objective, of workspaces
  std::vector<std::optional<SolvedMotion>> solved;       ///< none where the start has no such motion
  BodyPairs left_out;                                    ///< of constraints on distances
  std::vector<std::vector<JointRange>> term_ranges, constraint_ranges;  ///< likewise, of measures of joints
};

/// \param must_solve  whether a motion that fails is an error
/// \param must_keep  whether motions are carried over to other designs
/// \throws InputError for unknown motors, motors without the limits of a constraint, and the motions that must be
ArchitectureStart makeArchitectureStart(Model model, const std::vector<DesignMotion>& motions,
                                        const std::vector<ObjectiveTerm>& objective, const EvaluationOptions& options,
                                        bool must_solve, bool must_keep);

/// The mean of Eq. (2) of evaluation.h over all postures of the start, 0 if all are feasible.
double calcMeanGap(const ArchitectureStart& start, const Model& model);

}  // namespace bielle
