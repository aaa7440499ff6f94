#pragma once
// What `bielle synthesize` looks for, and what it writes.
#include <optional>
#include <string>
#include <vector>

#include "bielle/design/parametrization.h"
#include "bielle/model/options.h"
#include "design/fourbar_drawing.h"
#include "report/run.h"

namespace bielle::cli {

// Linkages of a generated robot, by some of its parameters.
struct SoughtLinkage {
  std::string generator;  // by which findGenerator() finds it
  OptionValues settings;  // of other parameters
  std::vector<DesignVariable> variables;
  LinkageFamily family;
  std::string margin;  // what that of the family is
  double least_margin = 0;
};

// Four-bars by their drawing, at the knees of a biped with the part `drawn`. \param robot  name or path
SoughtLinkage makeDrawnKnees(const std::string& robot, const FourBarSpace& space, const JointDemand& demand);

// \param parameters  NAME[=LOW:HIGH] each   \param distance  least way to a dead point
SoughtLinkage makeVariedLinkages(const std::string& robot, const std::vector<std::string>& parameters,
                                 const std::string& joint, const JointDemand& demand, double distance);

// A robot's file. \param origin  how it was found
std::string formatRobot(const SoughtLinkage& sought, const FoundLinkage& found, const std::string& origin);

// Writes a specification for `bielle design`: the motion solved anew for each, and the best refined by gradients. Its start design is
// the first that makes the motion from its plan.
// \param motor  type of the catalogue, or empty
// \returns the number of that one in `found`; none if there is none
std::optional<size_t> writeDesign(const std::string& path, const SoughtLinkage& sought, std::vector<FoundLinkage> found,
                                  const ReportRun& motion, const std::string& joint, const std::string& motor,
                                  const std::string& origin);

}  // namespace bielle::cli
