#pragma once
/// \file Grounds that no motion was planned for.
#include "bielle/dynamics/ground.h"

namespace bielle::worlds {

/// A ramp from x = `start` on, `length` long and `width` wide about y = 0, that rises by `slope` (height over length; negative:
/// it goes down). \throws InputError on numbers that make no sense, as makeTiles() does
struct RampOptions {
  double slope = 0.05;  ///< 1
  double start = 0.3;   ///< m
  double length = 20;   ///< along the horizontal, m
  double width = 4;     ///< m
};
Ground makeRamp(const RampOptions& options);

/// Square tiles whose heights are random, evenly distributed between `lowest` and `height`. They begin `start` ahead of the origin;
/// before them the ground is level, at 0.
struct TileOptions {
  double height = 0.01;  ///< of the highest, m
  double size = 0.25;    ///< edge of a tile, m
  double start = 0.2;    ///< m
  double length = 10;    ///< of the field, m
  double width = 4;      ///< of the field, about y = 0, m
  unsigned seed = 1;     ///< the same seed makes the same field on every machine
  double lowest = 0;     ///< of the lowest, at most 0, m
};
Ground makeTiles(const TileOptions& options);

}  // namespace bielle::worlds
