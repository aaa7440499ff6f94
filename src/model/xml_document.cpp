#include "model/xml_document.h"

#include <algorithm>

#include "bielle/model/error.h"
#include "model/text_file.h"

namespace bielle {
namespace {

constexpr int kMaxDepth = 200;

// The end of the tag that begins at i, outside of quotes.
size_t findTagEnd(const std::string& xml, size_t i) {
  for (; i < xml.size() && xml[i] != '>'; ++i)
    if (xml[i] == '"' || xml[i] == '\'') i = std::min(xml.find(xml[i], i + 1), xml.size() - 1);
  return i;
}

// Counts every tag that TinyXML may take for an opening one, and what closes it only where TinyXML sees it too.
void checkDepth(const std::string& xml, const std::string& path) {
  int depth = 0;
  for (size_t i = xml.find('<'); i < xml.size(); i = xml.find('<', i)) {
    if (xml.compare(i, 4, "<!--") == 0) {
      i = xml.find("-->", i + 4);
    } else if (xml.compare(i, 9, "<![CDATA[") == 0) {
      i = xml.find("]]>", i + 9);
    } else if (xml.compare(i, 2, "<!") == 0 || xml.compare(i, 2, "<?") == 0) {
      i = xml.find('>', i);
    } else if (xml.compare(i, 2, "</") == 0) {
      --depth;
      ++i;
    } else {
      ++depth;
      i = findTagEnd(xml, i + 1);
      if (i < xml.size() && xml[i - 1] == '/') --depth;
    }
    if (depth > kMaxDepth)
      throw ModelError(path, "document", "elements are nested deeper than " + std::to_string(kMaxDepth),
                       "close them; a robot needs few levels");
  }
}

// References to characters may stand for what is none.
void checkAttributes(const TiXmlElement& element, const std::string& path) {
  for (const TiXmlAttribute* a = element.FirstAttribute(); a; a = a->Next())
    if (findNotUtf8(a->ValueStr()) != std::string::npos)
      throw ModelError(path, "<" + element.ValueStr() + "> (line " + std::to_string(element.Row()) + ")",
                       std::string("its attribute '") + a->Name() + "' refers to a character that is not in UTF-8",
                       "write the character itself, in UTF-8");
  for (const TiXmlElement* e = element.FirstChildElement(); e; e = e->NextSiblingElement()) checkAttributes(*e, path);
}

}  // namespace

void parseXml(const std::string& xml, const std::string& path, TiXmlDocument& document) {
  requireUtf8(xml, path);
  checkDepth(xml, path);
  document.Parse(xml.c_str());
  const int row = document.ErrorRow();  // 0 at the end of the text
  if (document.Error())
    throw ModelError(path, row > 0 ? "line " + std::to_string(row) : "document",
                     std::string("it is not well-formed XML: ") + document.ErrorDesc(), "correct the syntax");
  if (document.RootElement()) return checkAttributes(*document.RootElement(), path);
  const size_t declaration = xml.find("<!DOCTYPE");
  if (declaration != std::string::npos)
    throw ModelError(
        path, "<!DOCTYPE> (line " + std::to_string(1 + std::count(xml.begin(), xml.begin() + declaration, '\n')) + ")",
        "it declares entities, which are not read",
        "have them replaced, as by `xmllint --noent --dropdtd`, or use properties of xacro");
}

std::string getAttribute(const TiXmlElement* element, const char* attribute) {
  const char* text = element ? element->Attribute(attribute) : nullptr;
  return text ? text : "";
}

}  // namespace bielle
