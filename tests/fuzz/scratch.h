#pragma once
// A directory in memory for the files that readers are given.
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace bielle::fuzz {

class Scratch {
 public:
  Scratch() : path_("/dev/shm/bielle-fuzz-" + std::to_string(getpid())) { std::filesystem::create_directories(path_); }
  ~Scratch() { std::filesystem::remove_all(path_); }

  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = path_ + "/" + name;
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
    return path;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline const Scratch& getScratch() {
  static const Scratch scratch;
  return scratch;
}

// Ends the program as a crash does, so that libFuzzer keeps the input.
[[noreturn]] inline void fail(const std::string& what) {
  std::fprintf(stderr, "%s\n", what.c_str());
  std::abort();
}

inline std::string toText(const uint8_t* data, size_t size) { return {reinterpret_cast<const char*>(data), size}; }

}  // namespace bielle::fuzz
