#pragma once
// A motion in one drawing.
#include <string>

#include "bielle/dynamics/ground.h"
#include "bielle/motion/record.h"

namespace bielle {

// SVG: a row of pictures at equal intervals from the first node to the last, seen from the right, a little from ahead and from
// above, by an eye that goes along with the centre of mass (a disc). Rods join the joints of each body, paler behind the centre
// of mass; soles are blue; lines on the floor are 0.2 m apart. All pictures have one scale.
std::string drawMotionStrip(const Model& model, const MotionRecord& record, const Ground& ground, int pictures = 6);

}  // namespace bielle
