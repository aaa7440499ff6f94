// Rows of the shapes of bodies: legs from each other, other bodies from each other, and all but feet from the ground.
#include <set>

#include "bielle/dynamics/ground.h"
#include "check_rows.h"

namespace bielle::validation {
namespace {

std::string getBody(const Model& model, int shape) { return model.bodies()[model.shapes()[shape].body].name; }

Worst findNearest(const CheckContext& context, const std::vector<ShapePair>& pairs, CheckRow::Kind kind) {
  const Model& model = context.model();
  Worst worst(CheckRow::Kind::AtLeast, kind);
  for (int k = 0; k <= context.motion.numStages(); ++k) {
    const NearestPair nearest = findNearestPair(model, context.trace.nodes[k].bodies, pairs);
    if (nearest.pair < 0) break;
    const ShapePair& pair = pairs[nearest.pair];
    worst.add(nearest.distance.distance, k, getBody(model, pair.b) + " and " + getBody(model, pair.a));
  }
  return worst;
}

Worst findLowest(const CheckContext& context, bool fitted, CheckRow::Kind kind) {
  const Model& model = context.model();
  std::set<int> feet = {0};  // what stands in the world does not fall on it
  for (const ContactFrame& contact : model.contacts()) feet.insert(contact.body);
  Worst worst(CheckRow::Kind::AtLeast, kind);
  for (int k = 0; k <= context.motion.numStages(); ++k)
    for (const Shape& shape : model.shapes()) {
      if (shape.fitted != fitted || feet.count(shape.body)) continue;
      const SE3& X_WB = context.trace.nodes[k].bodies[shape.body];
      worst.add(calcGroundDistance(context.motion.summary.ground, shape, X_WB).distance, k,
                model.bodies()[shape.body].name);
    }
  return worst;
}

}  // namespace

// Shapes of the robot's files are judged, if it has any; those fitted to visuals are wider than the bodies and only inform. So
// do all shapes of one leg and of the trunk: in files, too, they may overlap near joints.
void addShapeRows(CheckContext& context) {
  const Model& model = context.model();
  bool fitted = true;
  for (const Shape& shape : model.shapes()) fitted &= shape.fitted;
  const CheckRow::Kind kind = fitted ? CheckRow::Kind::Note : CheckRow::Kind::AtLeast;
  std::vector<ShapePair> legs, others;
  for (const ShapePair& pair : listShapePairs(model))
    if (model.shapes()[pair.a].fitted == fitted && model.shapes()[pair.b].fitted == fitted)
      (pair.of_two_legs ? legs : others).push_back(pair);
  const std::string nothing = "there are no two shapes";
  context.add(findNearest(context, legs, kind), "shapes: between the legs", "m", context.bounds.shapes, nothing);
  context.add(findNearest(context, others, CheckRow::Kind::Note), "shapes: within legs and trunk", "m", 0, nothing);
  if (model.hasFreeFlyer())
    context.add(findLowest(context, fitted, kind), "shapes: from the ground", "m", context.bounds.shapes,
                "there is no shape");
}

}  // namespace bielle::validation
