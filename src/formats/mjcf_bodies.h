#pragma once
// The bodies of a file of MuJoCo (mjcf.h), with their joints, shapes, soles and sites.
#include <array>
#include <set>
#include <string>

#include "formats/format_warnings.h"
#include "formats/mjcf.h"
#include "formats/xml_document.h"

namespace bielle {

// Writes them into <worldbody>. Returns the names of meshes, which are left out.
std::set<std::string> writeMjcfBodies(const Model& model, ConstVectorRef q_ref, const MjcfOptions& options,
                                      FormatWarnings& warnings, XMLElement& world);
// An end of a spatial tendon, which is a point spring or a distance.
struct TendonEnd {
  std::string site;  // a frame of the model there, or one made for it
  int body;
  Vector3d point;  // in the body
};
std::array<TendonEnd, 2> findTendonEnds(const Model& model, const PointSpring& spring);
std::array<TendonEnd, 2> findTendonEnds(const Model& model, const Closure& distance);

// Numbers as attributes, in the shortest digits that read back the same.
std::string formatMjcf(double value);
std::string formatMjcf(ConstVectorRef values);

}  // namespace bielle
