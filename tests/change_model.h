#pragma once
// A model that differs from another.
#include <functional>

#include "bielle/model/builder.h"

namespace bielle::testing {

using Change = std::function<void(ModelParts&)>;

inline Model changeModel(const Model& model, const Change& change) {
  ModelParts parts = takeParts(model);
  change(parts);
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace bielle::testing
