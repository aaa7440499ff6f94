#include "formats/aside_file.h"

#include <fcntl.h>
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

void writeTextDirectory(const std::string& path, const std::map<std::string, std::string>& files) {
  namespace fs = std::filesystem;
  fs::path place = path;
  if (!place.has_filename()) place = place.parent_path();  // "DIR/"
  std::error_code error;
  const bool is_there = fs::exists(place, error);
  if (is_there && !fs::is_directory(place, error)) failToWrite(path, "it is a file");
  if (is_there)
    for (const fs::directory_entry& entry : fs::directory_iterator(place, error))
      if (!files.count(entry.path().filename().string()))
        throw InputError(path, "directory", "it holds another file, '" + entry.path().filename().string() + "'",
                         "give a new directory, so that nothing is lost");
  const std::string aside = place.string() + kPart + std::to_string(getpid());
  const auto fail = [&](const std::string& why) {
    std::error_code ignored;
    fs::remove_all(aside, ignored);
    failToWrite(path, why);
  };
  if (!fs::create_directory(aside, error)) fail(error ? error.message() : "'" + aside + "' is there");
  for (const auto& [name, text] : files) {
    std::ofstream file(fs::path(aside) / name, std::ios::binary);
    file << text;
    file.close();
    if (!file) fail(std::strerror(errno));
  }
  if (renameat2(AT_FDCWD, aside.c_str(), AT_FDCWD, place.c_str(), is_there ? RENAME_EXCHANGE : RENAME_NOREPLACE) != 0)
    fail(std::strerror(errno));
  if (is_there) fs::remove_all(aside, error);  // the one that was there
}

}  // namespace bielle
