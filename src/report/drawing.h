#pragma once
// The drawing of a robot: the shapes of its file; for bodies without shapes, rods between their joints and frames.
#include "bielle/formats/reader.h"
#include "results/json_text.h"

namespace bielle {

// {"visuals": [{body, shape, pose, size, rgba, mesh}], "meshes": [base64 of an STL file]}. `mesh` counts in "meshes".
// Meshes that are missing, not STL or too large (3 MB each, 12 MB in total) are omitted.
Json describeDrawing(const LoadedRobot& robot);

}  // namespace bielle
