#include "results/ground_json.h"

namespace bielle {

Json describeGround(const Ground& ground) {
  Json steps = Json::array();
  for (const GroundStep& step : ground.steps)
    steps.push_back({{"top", {step.top.x(), step.top.y(), step.top.z()}},
                     {"length", step.length},
                     {"width", step.width},
                     {"yaw", step.yaw},
                     {"pitch", step.pitch},
                     {"roll", step.roll}});
  return {{"height", ground.height}, {"friction", ground.friction}, {"steps", steps}};
}

Ground readGround(const Json& json) {
  Ground ground;
  ground.height = json.at("height");
  ground.friction = json.at("friction");
  for (const Json& step : json.at("steps")) {
    const Json& top = step.at("top");
    ground.steps.push_back({Vector3d(top.at(0), top.at(1), top.at(2)), step.at("length"), step.at("width"),
                            step.at("yaw"), step.at("pitch"), step.at("roll")});
  }
  return ground;
}

}  // namespace bielle
