#pragma once
/// \file The XML documents of a model of MuJoCo: its own, and those that it includes.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "formats/xml_document.h"

namespace bielle {

/// Reads included files where the elements in an <include> are asked for. Elements belong to it.
class MjcfFiles {
 public:
  /// \throws InputError for what is not XML with the root <mujoco>
  explicit MjcfFiles(const std::string& path);

  const XMLElement& root() const { return *root_; }
  /// Of all files that were read.
  std::vector<const XMLElement*> listRoots() const;
  /// The elements in another; in place of an <include>, those in the root of the file that it names. That file is beside
  /// the main one, as in MuJoCo, or beside the one that includes it.
  /// \throws InputError naming the line for files that are missing, that include each other without end, or are included
  ///   twice
  std::vector<const XMLElement*> getChildren(const XMLElement& element, const char* tag = nullptr);
  /// Where the element is written.
  const std::string& getPath(const XMLElement& element) const;

 private:
  struct File {
    std::string path, canonical;
    std::unique_ptr<XMLDocument> document;
    const XMLElement* include = nullptr;  // that it was read for; null of the main file
  };

  const XMLElement& open(const std::string& path, const std::string& root, const XMLElement* include);
  const XMLElement& getIncluded(const XMLElement& include);
  const File& getFile(const XMLElement& element) const;
  void refuseRepetition(const XMLElement& include, const std::string& canonical) const;

  std::map<const XMLDocument*, File> files_;
  std::map<const XMLElement*, const XMLElement*> included_;  // roots by their <include>
  std::string main_;
  const XMLElement* root_ = nullptr;
  size_t bytes_ = 0;
};

}  // namespace bielle
