#include "results/line_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "bielle/model/error.h"
#include "formats/aside_file.h"

namespace bielle {

LineLog::LineLog(const std::string& path, const std::string& header, const std::string& mismatch) : path_(path) {
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) failToWrite(path, std::strerror(errno));
  try {
    if (flock(file_, LOCK_EX | LOCK_NB) != 0)
      throw InputError(path, "log", "another process is using it", "wait for it, or give another directory");
    read(header, mismatch);
  } catch (...) {
    close(file_);
    throw;
  }
}

LineLog::~LineLog() { close(file_); }

void LineLog::read(const std::string& header, const std::string& mismatch) {
  std::ifstream stream(path_, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const size_t whole = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
  if (whole < text.size() && ftruncate(file_, static_cast<off_t>(whole)) != 0) failToWrite(path_, std::strerror(errno));
  text.resize(whole);
  if (text.empty()) {
    append(header);
    return;
  }
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = text.find('\n', begin);
    lines_.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (lines_.front() != header)
    throw InputError(path_, "line 1", mismatch, "give another directory, or remove this one");
  lines_.erase(lines_.begin());
}

void LineLog::append(const std::string& line) {
  const std::string text = line + "\n";
  size_t done = 0;
  while (done < text.size()) {
    const ssize_t count = ::write(file_, text.data() + done, text.size() - done);
    if (count < 0 && errno != EINTR) failToWrite(path_, std::strerror(errno));
    if (count > 0) done += static_cast<size_t>(count);
  }
}

}  // namespace bielle
