// The only file that uses libzip.
#include "results/npz.h"

#include <zip.h>

#include <memory>

#include "bielle/model/error.h"

namespace bielle {
namespace {

// The first date of the format, so that archives of the same numbers are identical at any place and time.
constexpr zip_uint16_t kFirstDay = (1 << 5) | 1;
constexpr size_t kLargest = size_t{1} << 28;  // all arrays together, bytes

[[noreturn]] void fail(const std::string& path, const std::string& element, const std::string& problem) {
  throw InputError(path, element, problem, "give a trajectory that Bielle wrote");
}

// Errors of libzip that cannot occur: everything is in memory and we set the sizes.
[[noreturn]] void failInMemory(const char* message) {
  throw std::runtime_error(std::string("a NumPy archive could not be created: ") + message);
}

struct ArchiveDeleter {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct SourceDeleter {
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};
struct FileDeleter {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using Archive = std::unique_ptr<zip_t, ArchiveDeleter>;
using File = std::unique_ptr<zip_file_t, FileDeleter>;
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

// The size that the archive states for an entry is not trusted: a small file can unpack to more than the memory.
std::string readEntry(zip_t* archive, zip_int64_t index, const std::string& path, const std::string& name,
                      size_t largest) {
  const File file(zip_fopen_index(archive, index, 0));
  if (!file) fail(path, name, std::string("it cannot be read: ") + zip_strerror(archive));
  std::string bytes;
  char buffer[65536];
  zip_int64_t count = 0;
  while ((count = zip_fread(file.get(), buffer, sizeof buffer)) > 0) {
    bytes.append(buffer, static_cast<size_t>(count));
    if (bytes.size() > largest) fail(path, name, "it exceeds the largest size of a trajectory (256 MiB)");
  }
  if (count < 0) fail(path, name, "it is damaged");
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
    const zip_int64_t index =
        input ? zip_file_add(archive.get(), (name + ".npy").c_str(), input, ZIP_FL_ENC_UTF_8) : zip_int64_t{-1};
    if (index < 0) {
      zip_source_free(input);
      failInMemory(zip_strerror(archive.get()));
    }
    zip_file_set_dostime(archive.get(), static_cast<zip_uint64_t>(index), 0, kFirstDay, 0);
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
  size_t left = kLargest;
  for (zip_int64_t i = 0; i < zip_get_num_entries(archive.get(), 0); ++i) {
    const char* entry = zip_get_name(archive.get(), i, ZIP_FL_ENC_GUESS);
    if (!entry) fail(path, "file", zip_strerror(archive.get()));
    const std::string name = entry, bytes = readEntry(archive.get(), i, path, name, left);
    left -= bytes.size();
    const size_t stem = name.size() > 4 ? name.size() - 4 : 0;
    if (name.substr(stem) != ".npy") fail(path, name, "it is not a .npy file");
    arrays[name.substr(0, stem)] = parseNpy(path, name, bytes);
  }
  return arrays;
}

}  // namespace bielle
