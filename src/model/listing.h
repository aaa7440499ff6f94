#pragma once
#include <algorithm>
#include <string>
#include <vector>

namespace bielle {

/// "a, b, c", as messages list names; "none" if there are none.
inline std::string listItems(const std::vector<std::string>& items) {
  std::string text;
  for (const std::string& item : items) text += (text.empty() ? "" : ", ") + item;
  return text.empty() ? "none" : text;
}

/// The keys of a map, likewise.
template <typename Map>
std::string listKeys(const Map& map) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  return listItems(keys);
}

template <typename Item, typename Value>
bool contains(const std::vector<Item>& list, const Value& value) {
  return std::find(list.begin(), list.end(), static_cast<Item>(value)) != list.end();
}

}  // namespace bielle
