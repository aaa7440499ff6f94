#pragma once
/// \file XML, read and written by tinyxml2.
#include <tinyxml2.h>

#include <initializer_list>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace bielle {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

/// \returns the outermost element, whose tag is `root` (any if that is empty)
/// \throws InputError naming `path` for text that is not UTF-8 or not well-formed XML, that declares entities, that gives an
///   attribute twice, that nests deeper than tinyxml2 allows (100), or that has another root
const XMLElement& parseXml(const std::string& xml, const std::string& path, const std::string& root,
                           XMLDocument& document);

std::string getTag(const XMLElement& element);
/// Empty without the attribute or without the element.
std::string getAttribute(const XMLElement* element, const char* attribute);
/// Empty without any.
std::string getText(const XMLElement& element);
/// "<joint> (line 3)"
std::string describe(const XMLElement& element);
/// " (line 3)", or " (lines 3, 5 and 7 more)"
std::string formatLines(const std::set<int>& lines);
/// The elements in another; of one tag only, if it is given.
std::vector<const XMLElement*> getChildren(const XMLElement& element, const char* tag = nullptr);

using XmlAttributes = std::initializer_list<std::pair<const char*, std::string>>;
void setAttributes(XMLElement& element, XmlAttributes attributes);
/// A new last element of another, or the root of a document.
XMLElement& addElement(tinyxml2::XMLNode& parent, const char* tag, XmlAttributes attributes = {});
/// The same with a text.
void addText(XMLElement& parent, const char* tag, const std::string& text);
std::string formatXml(const XMLDocument& document);

}  // namespace bielle
