// Finding the files of robots.
#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "bielle/model/error.h"
#include "formats/robot_files.h"
#include "formats/text_file.h"
#include "model/listing.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

constexpr std::uintmax_t kLargestFile = 256'000'000;

bool isFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool isDirectory(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

bool isTree(const fs::path& path) {
  return path.extension() == ".urdf" || contains(listExchangeExtensions(), path.extension().string());
}

// robot.urdf, else the one named as the directory, else the only one; without any, the YAML, MJCF, SDF or USD named as the
// directory.
std::string findInDirectory(const fs::path& directory) {
  const fs::path named = fs::absolute(directory).lexically_normal();
  const std::string stem = (named.has_filename() ? named : named.parent_path()).filename().string();
  for (const std::string& candidate : {std::string("robot"), stem})
    if (isFile(directory / (candidate + ".urdf"))) return (directory / (candidate + ".urdf")).string();
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error))
    if (it->path().extension() == ".urdf" && isFile(it->path())) found.push_back(it->path().string());
  if (found.size() == 1) return found.front();
  std::vector<std::string> extensions = listExchangeExtensions();
  extensions.insert(extensions.begin(), ".yaml");
  for (const std::string& extension : extensions)
    if (found.empty() && isFile(directory / (stem + extension))) return (directory / (stem + extension)).string();
  if (found.empty())
    for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error))
      if (it->path().extension() == ".xacro") refuseXacro(it->path().string(), "file");
  std::sort(found.begin(), found.end());
  throw InputError(directory.string(), "directory",
                   found.empty() ? "it holds no .urdf file" : "it holds several .urdf files: " + listItems(found),
                   found.empty() ? "put robot.urdf there" : "give one of them by its path");
}

// The URDF beside settings that name no other robot; else the file itself.
std::string findTreeOf(const fs::path& settings) {
  const fs::path urdf = fs::path(settings).replace_extension(".urdf");
  if (settings.extension() != ".yaml" || !isFile(urdf)) return settings.string();
  const YamlFile yaml = readYaml(settings.string());
  return yaml.models.empty() && !yaml.generator && !yaml.composed ? urdf.string() : settings.string();
}

// In the directories of robots; empty when there is none.
std::string findByName(const std::string& name) {
  std::vector<std::string> files = {name + ".urdf", "robot.urdf", name + ".yaml"};
  for (const std::string& extension : listExchangeExtensions()) files.push_back(name + extension);
  for (const std::string& directory : getRobotDirectories())
    for (const std::string& file : files)
      if (const fs::path path = fs::path(directory) / name / file; isFile(path)) return path.string();
  return "";
}

bool hasGenerator(const fs::path& path) {
  if (path.extension() != ".yaml" || !isFile(path)) return false;
  const YamlFile yaml = readYaml(path.string());
  return yaml.generator || yaml.composed;
}

// Whether this is a file that names a generator, or completes a robot that is there.
bool isRobotByItself(const fs::path& path) {
  try {
    return hasGenerator(path) || (isFile(path) && !findModel(readYaml(path.string())).empty());
  } catch (const InputError&) {
    return false;  // reported when the robot is requested
  }
}

}  // namespace

const std::vector<std::string>& listExchangeExtensions() {
  static const std::vector<std::string> extensions = {".xml", ".sdf", ".usda", ".usd", ".usdc", ".usdz"};
  return extensions;
}

std::string readRobotText(const std::string& path) {
  std::error_code unknown;
  if (const auto size = fs::file_size(path, unknown); !unknown && size > kLargestFile)
    throw InputError(path, "file", "it exceeds the largest size of a robot file (256 MB)", "give a URDF or YAML file");
  return readTextFile(path);
}

std::vector<std::string> getRobotDirectories() {
  std::vector<std::string> directories;
  const auto add = [&directories](const std::string& directory) {
    if (!directory.empty() && std::find(directories.begin(), directories.end(), directory) == directories.end())
      directories.push_back(directory);
  };
  if (const char* variable = std::getenv("BIELLE_ROBOTS")) {
    const std::string list = variable;
    for (size_t begin = 0, end = 0; begin <= list.size(); begin = end + 1) {
      end = std::min(list.find(':', begin), list.size());
      add(list.substr(begin, end - begin));
    }
  }
  // First beside the running program: an installed program must not use the source tree it was built from.
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    const fs::path beside = program.parent_path().parent_path() / "share/bielle/robots";
    if (isDirectory(beside)) add(beside.string());
  }
  // A module of another program, such as Python's, has them beside it.
  if (Dl_info module; dladdr(reinterpret_cast<const void*>(&readRobotText), &module) != 0 && module.dli_fname)
    if (const fs::path beside = fs::path(module.dli_fname).parent_path() / "robots"; isDirectory(beside))
      add(beside.string());
  add(BIELLE_SOURCE_ROBOTS);
  add(BIELLE_INSTALL_ROBOTS);
  return directories;
}

std::string findModel(const YamlFile& yaml) {
  for (const std::string& model : yaml.models) {
    const fs::path place = fs::path(yaml.path).parent_path() / model;
    std::string beside;
    if (isFile(place)) beside = place.string();
    if (isDirectory(place)) beside = findInDirectory(place);
    for (const std::string& file : {beside, findByName(model)})
      if (isTree(file) || hasGenerator(file)) return file;
  }
  return "";
}

std::vector<std::string> listRobots() {
  std::set<std::string> names;
  for (const std::string& directory : getRobotDirectories()) {
    std::error_code error;
    for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error)) {
      const std::string name = it->path().filename().string();
      const auto has = [&](const std::string& extension) { return isFile(it->path() / (name + extension)); };
      const std::vector<std::string>& others = listExchangeExtensions();
      if (has(".urdf") || std::any_of(others.begin(), others.end(), has) ||
          isRobotByItself(it->path() / (name + ".yaml")))
        names.insert(name);
    }
  }
  return {names.begin(), names.end()};
}

std::string findRobotFile(const std::string& name_or_path) {
  const fs::path path = name_or_path;
  const bool is_name = !name_or_path.empty() && name_or_path.find('/') == std::string::npos &&
                       path.extension() != ".yaml" && !isTree(path);
  if (is_name)
    if (const std::string file = findByName(name_or_path); !file.empty()) return file;
  if (isDirectory(path)) return findInDirectory(path);
  if (isFile(path)) return findTreeOf(path);
  throw InputError("", "robot '" + name_or_path + "'",
                   is_name
                       ? "there is no robot of this name in " + listItems(getRobotDirectories()) + ", and no such path"
                       : "there is no such file or directory",
                   "give a path, or one of the known names: " + listItems(listRobots()));
}

std::string nameClosure(const std::string& made, const YamlFile& file) {
  return makeUnusedName(made, [&](const std::string& name) {
    return std::any_of(file.closures.begin(), file.closures.end(),
                       [&](const auto& other) { return other.name == name; });
  });
}

std::string namePointSpring(const std::string& made, const YamlFile& file) {
  return makeUnusedName(made, [&](const std::string& name) {
    return std::any_of(file.point_springs.begin(), file.point_springs.end(),
                       [&](const auto& other) { return other.spring.name == name; });
  });
}

}  // namespace bielle
