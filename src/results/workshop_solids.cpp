#include "results/workshop_solids.h"

#include <map>
#include <set>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "formats/pivots.h"
#include "results/json_text.h"

namespace bielle {
namespace {

constexpr double kMm = 1000;  // per m

Json makePlacement(const SE3& X) {
  Json out = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.push_back(X.R(row, column));
    out.push_back(kMm * X.p[row]);
  }
  return out;
}

Json makeSolid(const Visual& visual) {
  Json solid;
  const Vector3d size = kMm * visual.size;
  switch (visual.shape) {
    case Visual::Shape::Box:
      solid = {{"shape", "box"}, {"size", {size.x(), size.y(), size.z()}}};
      break;
    case Visual::Shape::Cylinder:
      solid = {{"shape", "cylinder"}, {"size", {size.x(), size.y()}}};
      break;
    default:
      solid = {{"shape", "sphere"}, {"size", {size.x()}}};
  }
  solid["at"] = makePlacement(visual.X_BV);
  solid["color"] = {visual.rgba[0], visual.rgba[1], visual.rgba[2]};
  return solid;
}

}  // namespace

WorkshopSolids formatSolids(const Model& model, const VectorXd& q) {
  Workspace ws(model);
  updatePlacements(model, ws, q);
  std::map<int, Json> solids;  // by body
  std::set<int> with_meshes;
  for (const Visual& visual : model.visuals()) {
    if (visual.shape == Visual::Shape::Mesh)
      with_meshes.insert(visual.body);
    else
      solids[visual.body].push_back(makeSolid(visual));
  }
  if (solids.empty())
    throw InputError(model.name(), "the drawing",
                     "it has no boxes, cylinders and spheres, which a STEP file is made of",
                     "give the links such <visual> elements");
  WorkshopSolids out;
  for (const int body : with_meshes)
    out.warnings.push_back("link '" + model.bodies()[static_cast<size_t>(body)].name + "': its meshes are left out");
  Json links = Json::array();
  for (auto& [body, list] : solids)
    links.push_back({{"name", model.bodies()[static_cast<size_t>(body)].name},
                     {"at", makePlacement(ws.X_WB[body])},
                     {"solids", std::move(list)}});
  out.json = formatJson({{"robot", model.name()}, {"links", std::move(links)}});
  return out;
}

std::string formatLinks(const Model& model, double hole) {
  const auto list = [](const Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  Json links = Json::array();
  for (const RigidLink& link : listRigidLinks(model)) {
    Json pivots = Json::array();
    for (const Pivot& pivot : link.pivots)
      pivots.push_back({{"name", pivot.name},
                        {"at", list(kMm * pivot.p)},
                        {"axis", pivot.axis.isZero() ? Json() : list(pivot.axis)}});
    links.push_back({{"name", link.name}, {"pivots", std::move(pivots)}});
  }
  return formatJson({{"robot", model.name()}, {"hole", kMm * hole}, {"links", std::move(links)}});
}

}  // namespace bielle
