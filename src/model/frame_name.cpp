#include "model/frame_name.h"

namespace bielle {

std::string findFrameName(const Model& model, int body, const SE3& X_BF) {
  for (const Frame& frame : model.frames())
    if (frame.body == body && frame.X_BF.p == X_BF.p && frame.X_BF.R == X_BF.R) return frame.name;
  return model.bodies()[body].name;
}

}  // namespace bielle
