// The only file that knows libzip.
#include "io/npz.h"

#include <zip.h>

#include <memory>

#include "bielle/model/error.h"

namespace bielle {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& element, const std::string& problem) {
  throw ModelError(path, element, problem, "give a trajectory that Bielle wrote");
}

// What libzip says, when it should never say it: all is in memory, and sizes are ours.
[[noreturn]] void failInMemory(const char* message) {
  throw std::runtime_error(std::string("a NumPy archive cannot be made: ") + message);
}

struct ArchiveDeleter {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct SourceDeleter {
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};
using Archive = std::unique_ptr<zip_t, ArchiveDeleter>;
using Source = std::unique_ptr<zip_source_t, SourceDeleter>;

std::string readSource(zip_source_t* source) {
  std::string bytes;
  if (zip_source_open(source) != 0) failInMemory(zip_error_strerror(zip_source_error(source)));
  char buffer[65536];
  for (zip_int64_t n = 0; (n = zip_source_read(source, buffer, sizeof buffer)) > 0;)
    bytes.append(buffer, static_cast<size_t>(n));
  zip_source_close(source);
  return bytes;
}

}  // namespace

std::string formatArchive(const NpyArrays& arrays) {
  Source output(zip_source_buffer_create(nullptr, 0, 0, nullptr));
  if (!output) failInMemory("out of memory");
  zip_source_keep(output.get());  // the archive takes one reference with it
  Archive archive(zip_open_from_source(output.get(), ZIP_CREATE | ZIP_TRUNCATE, nullptr));
  if (!archive) {
    zip_source_free(output.get());
    failInMemory("it cannot be opened");
  }
  std::map<std::string, std::string> files;  // libzip reads them when the archive is closed
  for (const auto& [name, array] : arrays) {
    const std::string& bytes = files[name + ".npy"] = formatNpy(array);
    zip_source_t* input = zip_source_buffer(archive.get(), bytes.data(), bytes.size(), 0);
    if (!input || zip_file_add(archive.get(), (name + ".npy").c_str(), input, ZIP_FL_ENC_UTF_8) < 0) {
      zip_source_free(input);
      failInMemory(zip_strerror(archive.get()));
    }
  }
  if (zip_close(archive.get()) != 0) failInMemory(zip_strerror(archive.get()));
  archive.release();
  return readSource(output.get());
}

NpyArrays readArchive(const std::string& path) {
  int code = 0;
  const Archive archive(zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    fail(path, "file", "it cannot be read: " + why);
  }
  NpyArrays arrays;
  for (zip_int64_t i = 0; i < zip_get_num_entries(archive.get(), 0); ++i) {
    zip_stat_t stat;
    zip_stat_init(&stat);
    zip_file_t* file = zip_fopen_index(archive.get(), i, 0);
    if (!file || zip_stat_index(archive.get(), i, 0, &stat) != 0) fail(path, "file", zip_strerror(archive.get()));
    const std::string name = stat.name;
    std::string bytes(stat.size, '\0');
    const zip_int64_t count = zip_fread(file, bytes.data(), bytes.size());
    zip_fclose(file);
    if (count != static_cast<zip_int64_t>(bytes.size())) fail(path, name, "it is cut short");
    const size_t stem = name.size() > 4 ? name.size() - 4 : 0;
    if (name.substr(stem) != ".npy") fail(path, name, "it is no .npy file");
    arrays[name.substr(0, stem)] = parseNpy(path, name, bytes);
  }
  return arrays;
}

}  // namespace bielle
