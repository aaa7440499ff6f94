#pragma once
// The bodies of a file of MuJoCo (mjcf.h), with their joints, shapes, soles and sites.
#include <set>
#include <string>

#include "formats/format_warnings.h"
#include "formats/mjcf.h"
#include "formats/xml_document.h"

namespace bielle {

// Writes them into <worldbody>. Returns the names of meshes, which are left out.
std::set<std::string> writeMjcfBodies(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options,
                                      FormatWarnings& warnings, XMLElement& world);
// The site at end 1 or 2 of a point spring: a frame of the model there, or one made for it.
std::string findSpringSite(const Model& model, const PointSpring& spring, int end);

// Numbers as attributes, in the shortest digits that read back the same.
std::string formatMjcf(double value);
std::string formatMjcf(ConstVectorRef values);

}  // namespace bielle
