#pragma once
// The linkages that `bielle synthesize` found, as a page.
#include <optional>
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "cli/synthesis.h"

namespace bielle::cli {

// The directory of the i-th, below that of the output.
std::string getLegName(size_t i);

// "rms torque [N m]", or what else is least: name and unit.
std::pair<std::string, std::string> nameValue(const JointDemand& demand);

// Writes directory/synthesis.html; the robots are in directory/leg_N.
// \param motion  of the demand, or empty   \param motor  of the catalogue, or a bare one
void writeSynthesisPage(const std::string& directory, const SoughtLinkage& sought,
                        const std::vector<FoundLinkage>& found, const JointDemand& demand, const std::string& motion,
                        const Motor& motor);

}  // namespace bielle::cli
