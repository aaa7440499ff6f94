#pragma once
// A log that long searches go on from: lines, the first of which says what the others belong to.
#include <string>
#include <vector>

namespace bielle {

class LineLog {
 public:
  // Opens and locks the file, and drops a last line that was cut off. A new file gets the header.
  // \throws InputError when another process has locked it, it cannot be written, or `header` is not its first line, for
  //   which `mismatch` says what has changed
  LineLog(const std::string& path, const std::string& header, const std::string& mismatch);
  ~LineLog();
  LineLog(const LineLog&) = delete;
  LineLog& operator=(const LineLog&) = delete;

  // Those of earlier runs, without the header.
  const std::vector<std::string>& lines() const { return lines_; }
  const std::string& path() const { return path_; }
  // Writes a line and its end. \throws InputError when it cannot be written
  void append(const std::string& line);

 private:
  void read(const std::string& header, const std::string& mismatch);

  std::string path_;
  int file_ = -1;
  std::vector<std::string> lines_;
};

}  // namespace bielle
