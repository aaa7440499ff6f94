#pragma once
// A file written under a temporary name and renamed when complete. Devices and pipes are written directly.
#include <string>

namespace bielle {

class AsideFile {
 public:
  /// Removes the temporary files of this path that processes which no longer run have left.
  explicit AsideFile(const std::string& path);
  /// Removes what was not committed.
  ~AsideFile();
  AsideFile(const AsideFile&) = delete;
  AsideFile& operator=(const AsideFile&) = delete;

  /// The stream to write to.
  const std::string& aside() const { return aside_; }
  /// \throws InputError when the text cannot be written; not for a pipe whose reader has ended
  void write(const std::string& text);
  /// Renames the file to its final name, replacing any existing file. \throws InputError when it cannot
  void commit();

 private:
  std::string path_, aside_;
};

/// \throws InputError "path: file: it cannot be written: why; ..."
[[noreturn]] void failToWrite(const std::string& path, const std::string& why);

}  // namespace bielle
