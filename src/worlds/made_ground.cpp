#include "worlds/made_ground.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "bielle/model/error.h"

namespace bielle::worlds {
namespace {

constexpr int kMostTiles = 10000;

void require(bool ok, const char* what, const char* remedy) {
  if (!ok) throw InputError("terrain", what, "it is out of range", remedy);
}

}  // namespace

Ground makeRamp(const RampOptions& o) {
  require(std::isfinite(o.slope) && std::abs(o.slope) < 1, "slope", "give height over length, e.g. 0.05");
  require(std::isfinite(o.start), "start", "give metres, e.g. 0.3");
  require(o.length > 0 && o.length <= 1000, "length", "give metres, e.g. 20");
  require(o.width > 0 && o.width <= 1000, "width", "give metres, e.g. 4");
  Ground ground;
  // Down: the robot starts on a level box at height 0, from whose edge the ramp goes down to the plane.
  const double rise = o.slope * o.length;
  ground.height = std::min(0.0, rise);
  if (rise < 0) ground.steps.push_back({{o.start - o.length / 2, 0, 0}, o.length, o.width, 0, 0, 0});
  ground.steps.push_back({{o.start + o.length / 2, 0, rise / 2}, o.length, o.width, 0, -std::atan(o.slope), 0});
  return ground;
}

Ground makeTiles(const TileOptions& o) {
  require(o.height >= 0 && o.height <= 1, "height", "give metres, e.g. 0.01");
  require(o.lowest <= 0 && o.lowest >= -1, "lowest", "give metres, e.g. -0.01");
  require(std::isfinite(o.start), "start", "give metres, e.g. 0.2");
  require(o.size > 0, "size", "give metres, e.g. 0.25");
  require(o.length > 0 && o.width > 0 && o.length / o.size * o.width / o.size <= kMostTiles, "length",
          "give a smaller field or larger tiles");
  const int columns = static_cast<int>(std::ceil(o.length / o.size)),
            rows = static_cast<int>(std::ceil(o.width / o.size));
  std::mt19937 generator(o.seed);
  Ground ground;
  ground.height = o.lowest;
  if (o.lowest < 0) ground.steps.push_back({{o.start - o.length / 2, 0, 0}, o.length, o.width, 0, 0, 0});
  for (int column = 0; column < columns; ++column)
    for (int row = 0; row < rows; ++row) {
      // The generator is the same everywhere; the standard's distributions are not.
      const double height = o.lowest + (o.height - o.lowest) * (generator() / 4294967295.0);
      ground.steps.push_back(
          {{o.start + (column + 0.5) * o.size, (row + 0.5 - 0.5 * rows) * o.size, height}, o.size, o.size, 0, 0, 0});
    }
  return ground;
}

}  // namespace bielle::worlds
