#pragma once
// Robots that others have published. They are not part of the project: tests find them in the directories that BIELLE_ROBOTS lists,
// or skip what needs them and say so.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

namespace bielle::testing {

/// The first of those directories that holds `name`, or empty.
inline std::string findPublishedDirectory(const std::string& name) {
  const char* list = std::getenv("BIELLE_ROBOTS");
  std::istringstream directories(list ? list : "");
  for (std::string directory; std::getline(directories, directory, ':');)
    if (std::filesystem::exists(std::filesystem::path(directory) / name)) return directory;
  return "";
}

/// Directory of a published robot; empty, with a warning, if there is none.
inline std::string findPublished(const std::string& name) {
  const std::string directory = findPublishedDirectory(name);
  if (!directory.empty()) return directory + "/" + name;
  WARN("skipped: no directory of BIELLE_ROBOTS holds the published robot " + name);
  return "";
}

}  // namespace bielle::testing
