#include "formats/yaml_tree.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>

namespace bielle {

YamlTree YamlTree::makeLine() {
  YamlTree tree;
  tree.in_line_ = true;
  return tree;
}

YamlTree& YamlTree::operator[](const std::string& key) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&key](const auto& e) { return e.first == key; });
  if (found != entries_.end()) return found->second;
  return entries_.emplace_back(key, YamlTree()).second;
}

void YamlTree::add(YamlTree item) { items_.push_back(std::move(item)); }

template <typename Emitter>
void YamlTree::emit(Emitter& out) const {
  if (in_line_) out << YAML::Flow;
  if (!entries_.empty()) {
    out << YAML::BeginMap;
    for (const auto& [key, value] : entries_) {
      out << YAML::Key << key << YAML::Value;
      value.emit(out);
    }
    out << YAML::EndMap;
  } else if (!items_.empty()) {
    out << YAML::BeginSeq;
    for (const YamlTree& item : items_) item.emit(out);
    out << YAML::EndSeq;
  } else {
    out << text_;
  }
}

std::string YamlTree::format(const std::string& comment) const {
  YAML::Emitter out;
  out << YAML::Comment(comment) << YAML::Newline;
  emit(out);
  return std::string(out.c_str()) + "\n";
}

}  // namespace bielle
