#pragma once
// The error message of a call.
#include <string>

#include "bielle/model/error.h"

namespace bielle::testing {

/// The text of the ModelError that `act` throws; empty when it throws none.
template <typename Act>
std::string getError(const Act& act) {
  try {
    act();
  } catch (const ModelError& error) {
    return error.what();
  }
  return "";
}

}  // namespace bielle::testing
