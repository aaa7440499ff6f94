#include "io/aside_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "bielle/model/error.h"
#include "io/text_file.h"

namespace bielle {

void failToWrite(const std::string& path, const std::string& why) {
  throw ModelError(path, "file", "it cannot be written: " + why,
                   "check the directory, its permissions and the free space");
}

namespace {

// A device or a pipe is written to, not replaced.
bool isSpecial(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  return std::filesystem::is_other(status);
}

}  // namespace

AsideFile::AsideFile(const std::string& path)
    : path_(path), aside_(isSpecial(path) ? path : path + ".part" + std::to_string(getpid())) {}

AsideFile::~AsideFile() {
  if (aside_ != path_ && !aside_.empty()) std::remove(aside_.c_str());
}

void AsideFile::write(const std::string& text) {
  errno = 0;
  std::ofstream file(aside_, std::ios::binary | std::ios::trunc);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) failToWrite(path_, std::strerror(errno));
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
