#pragma once
// FNV-1a of 64 bits (G. Fowler, L. Noll, P. Vo): tells texts apart that nobody means to confuse.
#include <cstdint>
#include <string>

namespace bielle {

/// Of several texts, one after the other, by passing on what the last call returned.
inline std::uint64_t hashText(const std::string& text, std::uint64_t hash = 0xcbf29ce484222325) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

}  // namespace bielle
