#pragma once
/// \file Parsing of XML by TinyXML, which recurses without a limit.
#include <tinyxml.h>

#include <string>

namespace bielle {

/// \throws ModelError naming `path` for text that is not UTF-8 or not well-formed XML, that declares entities, or that nests deeper
///   than any robot
void parseXml(const std::string& xml, const std::string& path, TiXmlDocument& document);

/// Attribute of an element, empty without it or without the element.
std::string getAttribute(const TiXmlElement* element, const char* attribute);

}  // namespace bielle
