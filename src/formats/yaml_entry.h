#pragma once
// Access to a YAML file: every error names the file, the key and the line. Only yaml_entry.cpp includes yaml-cpp.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bielle/math/types.h"
#include "formats/expressions.h"

namespace YAML {
class Node;
}

namespace bielle {

/// The keys that one kind of map may have. Each is a constant beside its reader: getFields() accepts nothing else, so that
/// describeYamlKeys() lists what is read.
class YamlKeys {
 public:
  /// \param files  kinds of files that have such maps, e.g. "robot, part"
  /// \param place  of the map in them: `[]` is each entry of a list, capitals are names that the user gives, e.g.
  ///               "contacts.NAME"; empty: the whole file
  YamlKeys(const std::string& files, const std::string& place, std::vector<std::string> keys);
  operator const std::vector<std::string>&() const { return keys_; }

 private:
  std::vector<std::string> keys_;
};
/// What the readers of this program accept: rows of a table in Markdown, files, place and keys, in alphabetical order.
std::string describeYamlKeys();

// An entry of the file: its value, and its name for messages.
class YamlEntry {
 public:
  YamlEntry(std::string path, std::string element, const YAML::Node& node);

  /// The same entry, and all below it, whose numbers and points may be expressions of these symbols.
  YamlEntry withSymbols(std::shared_ptr<const Symbols> symbols) const;

  /// \throws InputError, naming file, element and line
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const;
  /// Of a name that is none of those that may stand here.
  [[noreturn]] void failUnknown(const std::string& kind, const std::string& name,
                                const std::vector<std::string>& known) const;
  const std::string& element() const { return element_; }
  bool isMap() const;
  bool isList() const;
  bool isWord(const std::string& word) const;
  bool isText() const;  ///< a scalar that is no number

  // Return the requested type, or call fail().
  std::string getText() const;
  double getNumber(bool may_be_infinite = false) const;
  /// Elements of a list; `count` < 0: of any length.
  std::vector<YamlEntry> getList(int count = -1) const;
  std::vector<std::string> getTexts(int count = -1) const;
  std::vector<double> getNumbers(int count = -1) const;
  /// A list of three numbers or, with symbols, an expression of points.
  Vector3d getVector3() const;
  const std::string& path() const { return path_; }
  /// Pairs of a map in the order of the file; a missing value counts as an empty map.
  std::vector<std::pair<std::string, YamlEntry>> getMap() const;
  /// The map by key. \throws InputError for a key that is not among the known ones
  std::map<std::string, YamlEntry> getFields(const YamlKeys& known) const;

 private:
  YamlEntry makeChild(const std::string& element, const YAML::Node& node) const;

  std::string path_, element_;
  std::shared_ptr<const YAML::Node> node_;
  std::shared_ptr<const Symbols> symbols_;
};

using YamlFields = std::map<std::string, YamlEntry>;

/// Null if the key is missing.
const YamlEntry* find(const YamlFields& fields, const std::string& key);
/// \throws InputError naming the owner, if the key is missing
const YamlEntry& require(const YamlFields& fields, const std::string& key, const YamlEntry& owner);

/// Passes the document to `read`. \throws InputError if `text`, of the file `path`, is not YAML in UTF-8
void readYamlDocument(const std::string& path, const std::string& text,
                      const std::function<void(const YamlEntry&)>& read);

}  // namespace bielle
