#include "formats/fastenings.h"

namespace bielle {

std::vector<std::vector<Vector3d>> listFastenings(const Model& model) {
  std::vector<std::vector<Vector3d>> points(model.numBodies());
  for (int i = 1; i < model.numBodies(); ++i) points[model.joints()[i].parent].push_back(model.joints()[i].X_PJ.p);
  for (const Closure& closure : model.closures()) {
    if (closure.kind == ClosureKind::Coupler) continue;
    points[closure.body1].push_back(closure.X_B1.p);
    points[closure.body2].push_back(closure.X_B2.p);
  }
  for (const ContactFrame& contact : model.contacts()) points[contact.body].push_back(contact.X_BF.p);
  return points;
}

}  // namespace bielle
