#include "formats/xml_document.h"

#include <algorithm>
#include <set>

#include "bielle/model/error.h"
#include "formats/text_file.h"

namespace bielle {
namespace {

// References to characters may stand for what is none, and tinyxml2 lets attributes be repeated.
void checkAttributes(const XMLElement& element, const std::string& path) {
  std::set<std::string> names;
  for (const tinyxml2::XMLAttribute* a = element.FirstAttribute(); a; a = a->Next()) {
    const std::string attribute = std::string("its attribute '") + a->Name() + "'";
    if (findNotUtf8(a->Value()) != std::string::npos)
      throw InputError(path, describe(element), attribute + " refers to a character that is not in UTF-8",
                       "write the character itself, in UTF-8");
    if (!names.insert(a->Name()).second)
      throw InputError(path, describe(element), attribute + " is given twice", "keep one of them");
  }
  for (const XMLElement* e : getChildren(element)) checkAttributes(*e, path);
}

void refuseEntities(const XMLDocument& document, const std::string& path) {
  for (const tinyxml2::XMLNode* node = document.FirstChild(); node; node = node->NextSibling()) {
    const std::string text = node->ToUnknown() ? node->Value() : "";
    if (text.rfind("DOCTYPE", 0) == 0 && text.find('[') != std::string::npos)
      throw InputError(path, "<!DOCTYPE> (line " + std::to_string(node->GetLineNum()) + ")",
                       "it declares entities, which are not read",
                       "have them replaced, as by `xmllint --noent --dropdtd`, or use properties of xacro");
  }
}

// Logs and results are taken for robots.
void requireElements(const std::string& text, const std::string& path) {
  const unsigned char first =
      static_cast<unsigned char>(text[std::min(text.find_first_not_of(" \t\r\n"), text.size())]);
  if (first > ' ' && first < 0x80 && first != '<')  // others are of another encoding
    throw InputError(path, "document",
                     "it is no XML: it begins with '" + std::string(1, static_cast<char>(first)) + "'",
                     "give a robot (URDF, MuJoCo's XML, SDF, USD or YAML), or the directory of a result");
}

class Printer : public tinyxml2::XMLPrinter {
  void PrintSpace(int depth) override {
    for (int i = 0; i < depth; ++i) Write("  ", 2);
  }
};

}  // namespace

const XMLElement& parseXml(const std::string& xml, const std::string& path, const std::string& root,
                           XMLDocument& document) {
  requireElements(xml, path);
  requireUtf8(xml, path);
  if (document.Parse(xml.c_str()) == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED)
    throw InputError(path, "document", "elements are nested deeper than " + std::to_string(TINYXML2_MAX_ELEMENT_DEPTH),
                     "close them; a robot needs few levels");
  refuseEntities(document, path);
  const int line = document.ErrorLineNum();  // 0 of an empty text
  if (document.Error())
    throw InputError(path, line > 0 ? "line " + std::to_string(line) : "document",
                     std::string("it is not well-formed XML (") + document.ErrorName() + ")", "correct the syntax");
  if (!document.RootElement()) throw InputError(path, "document", "it has no elements", "give a file with a robot");
  if (!root.empty() && getTag(*document.RootElement()) != root)
    throw InputError(path, "document", "its outermost element is not <" + root + ">",
                     root == "robot" ? "give a URDF file"
                     : root == "sdf" ? "give an SDF file"
                                     : "give a MuJoCo file (MJCF)");
  checkAttributes(*document.RootElement(), path);
  return *document.RootElement();
}

std::string getTag(const XMLElement& element) { return element.Name(); }

std::string getAttribute(const XMLElement* element, const char* attribute) {
  const char* text = element ? element->Attribute(attribute) : nullptr;
  return text ? text : "";
}

std::string getText(const XMLElement& element) { return element.GetText() ? element.GetText() : ""; }

std::string describe(const XMLElement& element) {
  return "<" + getTag(element) + "> (line " + std::to_string(element.GetLineNum()) + ")";
}

std::string formatLines(const std::set<int>& lines) {
  constexpr int kListedLines = 8;
  std::string list;
  int count = 0;
  for (int line : lines) {
    if (count == kListedLines) {
      list += " and " + std::to_string(lines.size() - kListedLines) + " more";
      break;
    }
    list += (count++ ? ", " : "") + std::to_string(line);
  }
  return (lines.size() > 1 ? " (lines " : " (line ") + list + ")";
}

std::vector<const XMLElement*> getChildren(const XMLElement& element, const char* tag) {
  std::vector<const XMLElement*> children;
  for (const XMLElement* e = element.FirstChildElement(tag); e; e = e->NextSiblingElement(tag)) children.push_back(e);
  return children;
}

void setAttributes(XMLElement& element, XmlAttributes attributes) {
  for (const auto& [name, value] : attributes) element.SetAttribute(name, value.c_str());
}

XMLElement& addElement(tinyxml2::XMLNode& parent, const char* tag, XmlAttributes attributes) {
  XMLElement& element = *parent.GetDocument()->NewElement(tag);
  parent.InsertEndChild(&element);
  setAttributes(element, attributes);
  return element;
}

void addText(XMLElement& parent, const char* tag, const std::string& text) {
  addElement(parent, tag).SetText(text.c_str());
}

std::string formatXml(const XMLDocument& document) {
  Printer printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace bielle
