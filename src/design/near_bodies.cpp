#include "design/near_bodies.h"

#include <fnmatch.h>

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/motion/motion.h"

namespace bielle {
namespace {

std::pair<int, int> getBodies(const Model& model, const ShapePair& pair) {
  const auto get = [&](int shape) { return model.shapes()[static_cast<size_t>(shape)].body; };
  return std::minmax(get(pair.a), get(pair.b));
}

}  // namespace

BodyPairs findOverlaps(const Model& model) {
  Workspace ws(model);
  updatePlacements(model, ws, makeStandingPosture(model));
  BodyPairs out;
  for (const ShapePair& pair : listShapePairs(model)) {
    const Shape &a = model.shapes()[static_cast<size_t>(pair.a)], &b = model.shapes()[static_cast<size_t>(pair.b)];
    if (!a.fitted || !b.fitted) continue;
    if (calcDistance(a, ws.X_WB[a.body], b, ws.X_WB[b.body]).distance < 0) out.insert(getBodies(model, pair));
  }
  return out;
}

BodyPairs findBodyPairs(const Model& model, const std::vector<std::array<std::string, 2>>& names) {
  BodyPairs out;
  const auto fits = [&](const std::string& name, int body) {
    return fnmatch(name.c_str(), model.bodies()[static_cast<size_t>(body)].name.c_str(), FNM_NOESCAPE) == 0;
  };
  for (const auto& [first, second] : names)
    for (int a = 0; a < model.numBodies(); ++a)
      for (int b = 0; b < model.numBodies(); ++b)
        if (a != b && fits(first, a) && fits(second, b)) out.insert(std::minmax(a, b));
  return out;
}

std::vector<ShapePair> listPairsBut(const BodyPairs& left_out, const Model& model) {
  std::vector<ShapePair> pairs = listShapePairs(model);
  const auto is_left_out = [&](const ShapePair& pair) { return left_out.count(getBodies(model, pair)) > 0; };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_left_out), pairs.end());
  return pairs;
}

std::string describePair(const Model& model, int body_a, int body_b) {
  return model.bodies()[static_cast<size_t>(body_a)].name + " and " + model.bodies()[static_cast<size_t>(body_b)].name;
}

}  // namespace bielle
