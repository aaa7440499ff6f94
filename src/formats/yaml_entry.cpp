#include "formats/yaml_entry.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <sstream>

#include "bielle/model/error.h"
#include "formats/text_file.h"
#include "formats/yaml_progress.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

void requireProgress(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  YamlProgress progress;
  while (parser.HandleNextDocument(progress)) continue;
}

// Rows of the table, which constants make before main().
std::set<std::string>& getKeyRows() {
  static std::set<std::string> rows;
  return rows;
}

}  // namespace

YamlKeys::YamlKeys(const std::string& files, const std::string& place, std::vector<std::string> keys)
    : keys_(std::move(keys)) {
  std::string row = "| " + files + " | " + (place.empty() ? "" : "`" + place + "`") + " | ";
  for (const std::string& key : keys_) row += (&key == &keys_.front() ? "`" : ", `") + key + "`";
  getKeyRows().insert(row + " |\n");
}

std::string describeYamlKeys() {
  std::string text;
  for (const std::string& row : getKeyRows()) text += row;
  return text;
}

YamlEntry::YamlEntry(std::string path, std::string element, const YAML::Node& node)
    : path_(std::move(path)), element_(std::move(element)), node_(std::make_shared<const YAML::Node>(node)) {}

YamlEntry YamlEntry::withSymbols(std::shared_ptr<const Symbols> symbols) const {
  YamlEntry entry = *this;
  entry.symbols_ = std::move(symbols);
  return entry;
}

YamlEntry YamlEntry::makeChild(const std::string& element, const YAML::Node& node) const {
  YamlEntry child(path_, element, node);
  child.symbols_ = symbols_;
  return child;
}

void YamlEntry::fail(const std::string& problem, const std::string& remedy) const {
  const int line = node_->IsDefined() ? node_->Mark().line : -1;
  throw InputError(
      path_, (element_.empty() ? "document" : element_) + (line >= 0 ? " (line " + std::to_string(line + 1) + ")" : ""),
      problem, remedy);
}

void YamlEntry::failUnknown(const std::string& kind, const std::string& name,
                            const std::vector<std::string>& known) const {
  fail("there is no " + kind + " '" + name + "'", "known are " + listItems(known));
}

bool YamlEntry::isMap() const { return node_->IsMap(); }
bool YamlEntry::isList() const { return node_->IsSequence(); }

bool YamlEntry::isWord(const std::string& word) const { return node_->IsScalar() && node_->Scalar() == word; }

bool YamlEntry::isText() const {
  return node_->IsScalar() && !node_->Scalar().empty() && !parseNumber(node_->Scalar());
}

std::string YamlEntry::getText() const {
  if (!node_->IsScalar() || node_->Scalar().empty()) fail("it is not a name", "give one word");
  return node_->Scalar();
}

double YamlEntry::getNumber(bool may_be_infinite) const {
  if (!node_->IsScalar()) fail("it is not a number", "give one number");
  const std::optional<double> number = parseNumber(node_->Scalar());
  double value = number.value_or(0);
  if (!number) {
    if (!symbols_) fail("it is not a number", "give one number");
    try {
      value = symbols_->calcNumber(node_->Scalar());
    } catch (const ExpressionError& error) {
      fail(error.problem, error.remedy);
    }
  }
  if (std::isnan(value) || (std::isinf(value) && !may_be_infinite)) fail("it is not finite", "give a finite number");
  return value;
}

std::vector<YamlEntry> YamlEntry::getList(int count) const {
  if (!isList()) fail("it is not a list", "write it as [a, b, ...]");
  if (count >= 0 && static_cast<int>(node_->size()) != count)
    fail("it has " + std::to_string(node_->size()) + " element(s)", "give " + std::to_string(count));
  std::vector<YamlEntry> entries;
  for (const YAML::Node& item : *node_)
    entries.push_back(makeChild(element_ + "[" + std::to_string(entries.size()) + "]", item));
  return entries;
}

std::vector<std::string> YamlEntry::getTexts(int count) const {
  std::vector<std::string> out;
  for (const YamlEntry& entry : getList(count)) out.push_back(entry.getText());
  return out;
}

std::vector<double> YamlEntry::getNumbers(int count) const {
  std::vector<double> out;
  for (const YamlEntry& entry : getList(count)) out.push_back(entry.getNumber());
  return out;
}

Vector3d YamlEntry::getVector3() const {
  if (!symbols_ || !node_->IsScalar()) return Eigen::Map<const Vector3d>(getNumbers(3).data());
  try {
    return symbols_->calcPoint(node_->Scalar());
  } catch (const ExpressionError& error) {
    fail(error.problem, error.remedy);
  }
}

std::vector<std::pair<std::string, YamlEntry>> YamlEntry::getMap() const {
  std::vector<std::pair<std::string, YamlEntry>> pairs;
  if (node_->IsNull()) return pairs;
  if (!isMap()) fail("it is not a map", "write it as {name: value, ...}");
  std::set<std::string> seen;
  for (const auto& pair : *node_) {
    if (!pair.first.IsScalar()) fail("one of its keys is not a name", "use plain words as keys");
    const std::string key = pair.first.Scalar();
    if (!seen.insert(key).second) fail("key '" + key + "' is given twice", "keep one");
    pairs.emplace_back(
        key, makeChild(element_.empty() ? "key '" + key + "'" : element_ + ": key '" + key + "'", pair.second));
  }
  return pairs;
}

std::map<std::string, YamlEntry> YamlEntry::getFields(const YamlKeys& keys) const {
  const std::vector<std::string>& known = keys;
  std::map<std::string, YamlEntry> fields;
  for (const auto& [key, entry] : getMap()) {
    if (!contains(known, key)) entry.fail("it is unknown", "known keys are " + listItems(known));
    fields.emplace(key, entry);
  }
  return fields;
}

const YamlEntry* find(const YamlFields& fields, const std::string& key) {
  const auto it = fields.find(key);
  return it == fields.end() ? nullptr : &it->second;
}

const YamlEntry& require(const YamlFields& fields, const std::string& key, const YamlEntry& owner) {
  const YamlEntry* entry = find(fields, key);
  if (!entry) owner.fail("it has no '" + key + "'", "add it");
  return *entry;
}

void readYamlDocument(const std::string& path, const std::string& text,
                      const std::function<void(const YamlEntry&)>& read) {
  requireUtf8(text, path);
  try {
    requireProgress(text);
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    for (size_t i = 1; i < documents.size(); ++i)
      if (!documents[i].IsNull())
        YamlEntry(path, "", documents[i])
            .fail("it is a further document, behind a line '---' or '...'", "put it into a file of its own");
    read(YamlEntry(path, "", documents.empty() ? YAML::Node() : documents.front()));
  } catch (const YAML::Exception& error) {
    throw InputError(path, "line " + std::to_string(error.mark.line + 1), "it is not well-formed YAML: " + error.msg,
                     "correct the syntax");
  }
}

}  // namespace bielle
