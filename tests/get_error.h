#pragma once
// The error message of a call.
#include <string>

#include "bielle/model/error.h"

namespace bielle::testing {

/// The text of the InputError that `act` throws; empty when it throws none.
template <typename Act>
std::string getError(const Act& act) {
  try {
    act();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace bielle::testing
