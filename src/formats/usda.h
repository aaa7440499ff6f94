#pragma once
/// \file The text form of USD (.usda): prims with their metadata and properties, as they are written in one layer. Values stay text
/// until they are asked for, so that meshes cost no more than their place in the file.
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bielle {

/// An attribute, a relationship or an entry of metadata.
struct UsdProperty {
  std::string_view operation;  ///< prepend, append, add, delete, reorder, or none
  std::string_view type;       ///< "float", "rel", ...; none for metadata
  std::string_view name;
  std::string_view suffix;  ///< timeSamples, connect, ..., or none
  std::string_view value;   ///< as it is written; empty without one
  int line = 0;
  mutable bool is_used = false;  ///< somebody asked for it
};

struct UsdPrim {
  std::string_view specifier;  ///< def, over, class; none for the layer
  std::string_view type, name;
  int line = 0;
  const UsdPrim* parent = nullptr;
  std::vector<UsdProperty> metadata, properties;
  std::vector<std::unique_ptr<UsdPrim>> children;
  int variants = 0;  ///< line of its first variantSet
  /// Paths that its contents were taken over from, and its own: within them they mean what is there.
  std::vector<std::pair<std::string, std::string>> sources;

  /// "/robot/leg"
  std::string getPath() const;
  /// The value of an attribute or a relationship, marked as used; null without one. Lists that are only edited (delete, reorder) and
  /// time samples are none.
  const UsdProperty* find(std::string_view property) const;
  const UsdProperty* findMetadata(std::string_view key) const;
  const UsdPrim* findChild(std::string_view child) const;
  UsdPrim* findChild(std::string_view child) {
    return const_cast<UsdPrim*>(static_cast<const UsdPrim*>(this)->findChild(child));
  }
  /// Whether it has this schema applied. `of` names an instance: "PhysicsDriveAPI:angular".
  bool hasApi(std::string_view schema) const;
  /// Of all entries of metadata of this key but those that delete: apiSchemas may be prepended and appended.
  std::vector<std::string> listMetadata(std::string_view key) const;
};

struct UsdLayer {
  std::string text;  ///< which all prims refer to
  UsdPrim root;      ///< its metadata are the layer's
};

/// Prims that refer to others of the file, as flattened instances do, have their contents, too.
/// \param path  named in errors
/// \throws InputError with the line for what is no usda, nests deeper than 64 prims or has more than 100000 prims, or refers to
///   itself
std::unique_ptr<UsdLayer> parseUsda(std::string text, const std::string& path);

/// Keys of metadata by which a prim takes over what another prim, of this or of another file, has.
const std::vector<std::string>& listUsdArcs();
/// The prim of a path from `from` on; null if there is none.
const UsdPrim* findUsdPrim(const UsdPrim& from, const std::string& path);

/// The numbers of a value, those of tuples and lists one after the other; inf and nan are numbers. None for any other value.
std::optional<std::vector<double>> parseUsdNumbers(std::string_view value);
/// 0, 1, false, true
std::optional<bool> parseUsdBool(std::string_view value);
/// All quoted strings of a value, without their quotes; with '<', all paths.
std::vector<std::string> listUsdStrings(std::string_view value, char quote = '"');
/// A text as a value: within quotes.
std::string quoteUsd(const std::string& text);
/// A name as one of a prim: letters, digits and '_'.
std::string makeUsdName(const std::string& name);

}  // namespace bielle
