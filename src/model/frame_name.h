#pragma once
/// \file Names of places in bodies, for messages and tables.
#include "bielle/model/model.h"

namespace bielle {

/// The frame of the model at this very place of a body, else the body.
std::string findFrameName(const Model& model, int body, const SE3& X_BF);

}  // namespace bielle
