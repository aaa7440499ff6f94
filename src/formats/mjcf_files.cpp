#include "formats/mjcf_files.h"

#include <filesystem>

#include "bielle/model/error.h"
#include "formats/robot_files.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

constexpr size_t kMostMjcfBytes = 16'000'000;  // of all files together

std::string findCanonical(const fs::path& path) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(path, error);
  return (error ? path : canonical).string();
}

}  // namespace

MjcfFiles::MjcfFiles(const std::string& path) : main_(path) { root_ = &open(path, "mujoco", nullptr); }

const XMLElement& MjcfFiles::open(const std::string& path, const std::string& root, const XMLElement* include) {
  const std::string xml = readRobotText(path);
  bytes_ += xml.size();
  if (bytes_ > kMostMjcfBytes)
    throw InputError(path, "file", "it exceeds the largest size of a MuJoCo file, with those included (16 MB)",
                     "give one without embedded data");
  auto document = std::make_unique<XMLDocument>();
  const XMLElement& element = parseXml(xml, path, root, *document);
  const XMLDocument* key = document.get();
  files_[key] = {path, findCanonical(path), std::move(document), include};
  return element;
}

const MjcfFiles::File& MjcfFiles::getFile(const XMLElement& element) const { return files_.at(element.GetDocument()); }

const std::string& MjcfFiles::getPath(const XMLElement& element) const { return getFile(element).path; }

std::vector<const XMLElement*> MjcfFiles::listRoots() const {
  std::vector<const XMLElement*> roots;
  for (const auto& [document, file] : files_) roots.push_back(document->RootElement());
  return roots;
}

std::vector<const XMLElement*> MjcfFiles::getChildren(const XMLElement& element, const char* tag) {
  std::vector<const XMLElement*> children;
  for (const XMLElement* e : bielle::getChildren(element)) {
    const std::string& own = getTag(*e);
    if (own == "include") {
      for (const XMLElement* c : getChildren(getIncluded(*e), tag)) children.push_back(c);
    } else if (!tag || own == tag) {
      children.push_back(e);
    }
  }
  return children;
}

const XMLElement& MjcfFiles::getIncluded(const XMLElement& include) {
  if (const auto it = included_.find(&include); it != included_.end()) return *it->second;
  const std::string &path = getPath(include), name = getAttribute(&include, "file");
  if (name.empty()) throw InputError(path, describe(include), "it names no file", "give its attribute 'file'");
  std::error_code error;
  fs::path place = fs::path(main_).parent_path() / name;
  if (!fs::is_regular_file(place, error)) place = fs::path(path).parent_path() / name;
  if (!fs::is_regular_file(place, error))
    throw InputError(path, describe(include), "there is no file '" + name + "'",
                     "correct the name, which is relative to " + main_ + ", or add the file");
  refuseRepetition(include, findCanonical(place));
  const XMLElement& root = open(place.string(), "", &include);
  included_[&include] = &root;
  return root;
}

// MuJoCo reads no file twice either.
void MjcfFiles::refuseRepetition(const XMLElement& include, const std::string& canonical) const {
  std::string chain;
  for (const XMLElement* e = &include; e; e = getFile(*e).include) {
    const File& file = getFile(*e);
    chain = file.path + " -> " + chain;
    if (file.canonical == canonical)
      throw InputError(getPath(include), describe(include), "the files include each other: " + chain + file.path,
                       "remove one of these <include>");
  }
  for (const auto& [document, file] : files_)
    if (file.canonical == canonical)
      throw InputError(getPath(include), describe(include), "the file '" + file.path + "' is included twice",
                       "remove one <include>, or copy the file");
}

}  // namespace bielle
