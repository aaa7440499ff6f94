#include "formats/aside_file.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "bielle/model/error.h"
#include "formats/text_file.h"

namespace bielle {

void failToWrite(const std::string& path, const std::string& why) {
  throw InputError(path, "file", "it cannot be written: " + why,
                   "check the directory, its permissions and the free space");
}

namespace {

// A device or a pipe is written to, not replaced.
bool isSpecial(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  return std::filesystem::is_other(status);
}

constexpr const char* kPart = ".part";

// Removes what processes that were killed have left of a file. That of a process which still runs is its own.
void removeLeftovers(const std::filesystem::path& path) {
  const std::string prefix = path.filename().string() + kPart;
  const std::filesystem::path directory = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code error;
  for (std::filesystem::directory_iterator it(directory, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.rfind(prefix, 0) != 0) continue;
    pid_t process = 0;
    const char* const last = name.data() + name.size();
    const auto number = std::from_chars(name.data() + prefix.size(), last, process);
    if (number.ec != std::errc() || number.ptr != last || process <= 0) continue;
    std::error_code ignored;
    if (kill(process, 0) != 0 && errno == ESRCH) std::filesystem::remove(it->path(), ignored);
  }
}

}  // namespace

AsideFile::AsideFile(const std::string& path)
    : path_(path), aside_(isSpecial(path) ? path : path + kPart + std::to_string(getpid())) {
  if (aside_ != path_) removeLeftovers(path_);
}

AsideFile::~AsideFile() {
  if (aside_ != path_ && !aside_.empty()) std::remove(aside_.c_str());
}

void AsideFile::write(const std::string& text) {
  errno = 0;
  std::ofstream file(aside_, std::ios::binary | std::ios::trunc);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  const bool has_reader_left = aside_ == path_ && errno == EPIPE;  // of a pipe: it has seen enough
  if (!file && !has_reader_left) failToWrite(path_, std::strerror(errno));
}

void AsideFile::commit() {
  if (aside_ != path_ && std::rename(aside_.c_str(), path_.c_str()) != 0) failToWrite(path_, std::strerror(errno));
  aside_.clear();
}

void writeTextFile(const std::string& path, const std::string& text) {
  AsideFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace bielle
