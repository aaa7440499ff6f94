#pragma once
// A small robot as text, to be mutated, a temporary directory to read it from, and what files hold.
#include <filesystem>
#include <string>

namespace bielle::testing {

/// A closed toy: base -> arm -> hand (a frame), base -> rod; closed by "hand" and "rod".
extern const char* const kToyUrdf;
extern const char* const kToyYaml;

/// `text` with the one place that reads `from` reading `to`; throws std::logic_error unless there is exactly one.
std::string replaceOnce(const std::string& text, const std::string& from, const std::string& to);

/// The whole file, empty if there is none; and its lines.
std::string readFile(const std::filesystem::path& path);
int countLines(const std::filesystem::path& path);

/// A fresh directory, removed with everything in it at the end.
class RobotDirectory {
 public:
  RobotDirectory();
  ~RobotDirectory();
  RobotDirectory(const RobotDirectory&) = delete;
  RobotDirectory& operator=(const RobotDirectory&) = delete;

  /// Writes a file, with the directories above it, and returns its path.
  std::string write(const std::string& name, const std::string& text) const;
  /// Writes robot.urdf, and robot.yaml unless it is empty; returns the directory.
  std::string writeRobot(const std::string& urdf, const std::string& yaml) const;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace bielle::testing
