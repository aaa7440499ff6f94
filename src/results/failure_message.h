#pragma once
// How every program words an error of its command line.
#include <CLI/CLI.hpp>
#include <string>

namespace bielle::cli {

inline std::string describeFailure(const CLI::App*, const CLI::Error& error) {
  return "bielle: error: " + std::string(error.what()) + "; see --help\n";
}

}  // namespace bielle::cli
