#pragma once
/// \file YAML that is written: texts, lists, and maps in the order in which their keys were first used.
#include <string>
#include <utility>
#include <vector>

namespace bielle {

class YamlTree {
 public:
  YamlTree() = default;
  YamlTree(std::string text) : text_(std::move(text)) {}
  YamlTree(const char* text) : text_(text) {}
  static YamlTree makeLine();  ///< a map that is written in one line

  YamlTree& operator[](const std::string& key);  ///< makes it a map
  void add(YamlTree item);                       ///< makes it a list

  /// With a comment above it.
  std::string format(const std::string& comment) const;

 private:
  template <typename Emitter>
  void emit(Emitter& out) const;

  bool in_line_ = false;
  std::string text_;
  std::vector<YamlTree> items_;
  std::vector<std::pair<std::string, YamlTree>> entries_;
};

}  // namespace bielle
