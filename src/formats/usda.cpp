#include "formats/usda.h"

#include <algorithm>
#include <set>

#include "bielle/model/error.h"
#include "formats/text_file.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr int kDeepest = 64;
constexpr int kMostPrims = 100000;

bool isOf(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool isWordPart(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == ':' ||
         c == '.' || c == '+' || c == '-' || (c & 0x80);
}

class UsdaParser {
 public:
  UsdaParser(UsdLayer& layer, const std::string& path) : text_(layer.text), path_(path), root_(layer.root) {}

  void parse() {
    skipSpace();
    if (takeIf('(')) parseMetadata(root_);
    parseContents(root_, 0);
  }

 private:
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) {
    throw InputError(path_, "line " + std::to_string(countLines()), problem, remedy);
  }

  // Of the place of the parser, which only moves on.
  int countLines() {
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<long>(counted_),
                                         text_.begin() + static_cast<long>(std::min(at_, text_.size())), '\n'));
    counted_ = std::min(at_, text_.size());
    return line_;
  }

  char peek(size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  bool isAtEnd() const { return at_ >= text_.size(); }

  void skipSpace() {
    while (!isAtEnd()) {
      const char c = peek();
      if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
        ++at_;
      } else if (c == '#' || (c == '/' && peek(1) == '/')) {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (c == '/' && peek(1) == '*') {
        at_ = text_.find("*/", at_ + 2);
        if (at_ == std::string_view::npos) at_ = text_.size(), fail("a comment does not end", "close it by */");
        at_ += 2;
      } else {
        return;
      }
    }
  }

  bool takeIf(char c) {
    skipSpace();
    if (isAtEnd() || peek() != c) return false;
    ++at_;
    return true;
  }

  void expect(char c, const char* where) {
    if (!takeIf(c))
      fail(std::string("there is no '") + c + "' " + where,
           "correct it, or let `usdcat FILE -o flat.usda --flatten` write the file");
  }

  std::string_view takeWord() {
    skipSpace();
    const size_t begin = at_;
    while (!isAtEnd() && isWordPart(peek())) ++at_;
    if (at_ == begin)
      fail(isAtEnd() ? "the file ends within a prim" : "there is no name where one belongs",
           "correct it, or let `usdcat FILE -o flat.usda --flatten` write the file");
    return text_.substr(begin, at_ - begin);
  }

  // Between quotes: one or three of them, " or '.
  void skipString() {
    const char quote = peek();
    const bool is_long = peek(1) == quote && peek(2) == quote;
    for (at_ += is_long ? 3 : 1; !isAtEnd(); ++at_) {
      if (peek() == '\\') {
        ++at_;
      } else if (peek() == quote && (!is_long || (peek(1) == quote && peek(2) == quote))) {
        at_ += is_long ? 3 : 1;
        return;
      } else if (!is_long && peek() == '\n') {
        break;
      }
    }
    fail("a text does not end", "close its quotes");
  }

  // @path@, or @@@path@@@.
  void skipAsset() {
    const std::string_view mark = text_.substr(at_, 3) == "@@@" ? "@@@" : "@";
    at_ = text_.find(mark, at_ + mark.size());
    if (at_ == std::string_view::npos) at_ = text_.size(), fail("the name of a file does not end", "close it by @");
    at_ += mark.size();
  }

  void skipPath() {
    at_ = text_.find('>', at_);
    if (at_ == std::string_view::npos) at_ = text_.size(), fail("a path does not end", "close it by >");
    ++at_;
  }

  // Brackets within brackets, with all that is in them.
  void skipBrackets() {
    std::string closing;
    do {
      skipSpace();
      if (isAtEnd()) fail("a bracket is not closed", "close it");
      const char c = peek();
      if (c == '"' || c == '\'')
        skipString();
      else if (c == '@')
        skipAsset();
      else if (c == '<')
        skipPath();
      else if (++at_; c == '(' || c == '[' || c == '{')
        closing += c == '(' ? ')' : c == '[' ? ']' : '}';
      else if (c == ')' || c == ']' || c == '}') {
        if (closing.back() != c) fail(std::string("'") + c + "' closes another bracket", "correct it");
        closing.pop_back();
      }
      if (closing.size() > kDeepest) fail("brackets nest too deeply", "no robot needs so many");
    } while (!closing.empty());
  }

  // \param is_arc  whether a path and an offset in brackets may follow a file, as in references
  std::string_view takeValue(bool is_arc) {
    skipSpace();
    const size_t begin = at_;
    const char c = peek();
    if (c == '"' || c == '\'') {
      skipString();
    } else if (c == '@') {
      skipAsset();
      if (is_arc && peek() == '<') skipPath();
    } else if (c == '<') {
      skipPath();
    } else if (c == '(' || c == '[' || c == '{') {
      skipBrackets();
    } else {
      takeWord();
    }
    const std::string_view value = text_.substr(begin, at_ - begin);
    if (is_arc && (c == '@' || c == '<') && takeIf('(')) --at_, skipBrackets();
    return value;
  }

  void parseMetadata(UsdPrim& prim) {
    while (true) {
      while (takeIf(';') || takeIf(',')) continue;
      if (takeIf(')')) return;
      if (peek() == '"' || peek() == '\'') {  // a comment
        skipString();
        continue;
      }
      UsdProperty entry;
      entry.name = takeWord();
      entry.line = countLines();
      if (isOf(entry.name, {"prepend", "append", "add", "delete", "reorder"})) {
        entry.operation = entry.name;
        entry.name = takeWord();
      }
      expect('=', "after a key of metadata");
      entry.value = takeValue(true);
      prim.metadata.push_back(entry);
    }
  }

  // \param siblings  the names of the prims before it in its parent
  void parsePrim(UsdPrim& parent, std::string_view specifier, int depth, std::set<std::string_view>& siblings) {
    if (depth >= kDeepest) fail("prims nest more than 64 deep", "no robot needs so many");
    if (++count_ > kMostPrims) fail("there are more than 100000 prims", "no robot needs so many");
    parent.children.push_back(std::make_unique<UsdPrim>());
    UsdPrim& prim = *parent.children.back();
    prim.specifier = specifier;
    prim.parent = &parent;
    prim.line = countLines();
    skipSpace();
    if (peek() != '"' && peek() != '\'') prim.type = takeWord();
    skipSpace();
    if (peek() != '"' && peek() != '\'') fail("a prim has no name", "give it one, in quotes");
    const size_t begin = at_ + 1;
    skipString();
    prim.name = text_.substr(begin, at_ - 1 - begin);
    if (prim.name.empty() || !std::all_of(prim.name.begin(), prim.name.end(), isWordPart))
      fail("the name of a prim is made of other characters than letters, digits and '_'", "correct the name");
    if (!siblings.insert(prim.name).second)
      fail("there are two prims '" + std::string(prim.name) + "' in one place", "remove one of them");
    if (takeIf('(')) parseMetadata(prim);
    expect('{', "after the name of a prim");
    parseContents(prim, depth + 1);
  }

  void parseProperty(UsdPrim& prim, std::string_view word) {
    UsdProperty property;
    property.line = countLines();
    if (isOf(word, {"prepend", "append", "add", "delete", "reorder"})) {
      property.operation = word;
      word = takeWord();
    }
    if (property.operation == "reorder" && isOf(word, {"nameChildren", "properties", "rootPrims"})) {
      expect('=', "after what is put in order");
      takeValue(false);
      return;
    }
    while (isOf(word, {"custom", "varying", "uniform", "config"})) word = takeWord();
    property.type = word;
    if (takeIf('[')) expect(']', "after '['");
    property.name = takeWord();
    const size_t point = property.name.find('.');
    if (point != std::string_view::npos) {
      property.suffix = property.name.substr(point + 1);
      property.name = property.name.substr(0, point);
    }
    if (takeIf('=')) property.value = takeValue(false);
    if (takeIf('(')) --at_, skipBrackets();
    prim.properties.push_back(property);
  }

  // Up to the bracket that closes the prim, or to the end of the file.
  void parseContents(UsdPrim& prim, int depth) {
    std::set<std::string_view> names;
    while (true) {
      while (takeIf(';')) continue;
      skipSpace();
      if (depth > 0 && takeIf('}')) return;
      if (depth == 0 && isAtEnd()) return;
      const std::string_view word = takeWord();
      if (isOf(word, {"def", "over", "class"})) {
        parsePrim(prim, word, depth, names);
      } else if (word == "variantSet") {
        if (prim.variants == 0) prim.variants = countLines();
        takeValue(false);
        expect('=', "after the name of a variantSet");
        takeValue(false);
      } else {
        parseProperty(prim, word);
      }
    }
  }

  const std::string_view text_;
  const std::string& path_;
  UsdPrim& root_;
  size_t at_ = 0, counted_ = 0;
  int line_ = 1, count_ = 0;
};

// Contents of other prims, taken over where a prim refers to them.
class UsdComposer {
 public:
  UsdComposer(const UsdPrim& root, const std::string& path) : root_(root), path_(path) {}

  void compose(UsdPrim& prim, int depth) {
    if (depth > kDeepest) fail(prim, "prims nest more than 64 deep");
    std::set<const UsdPrim*> merged;  // once each, also if several ways lead there, or classes lead to each other
    for (size_t i = 0; i < prim.metadata.size(); ++i) {  // those of its sources are added to them
      const UsdProperty entry = prim.metadata[i];
      if (!contains(listUsdArcs(), entry.name) || isOf(entry.operation, {"delete", "reorder"})) continue;
      if (entry.value.find('@') != std::string_view::npos) continue;  // another file, which the reader refuses
      for (const std::string& path : listUsdStrings(entry.value, '<')) {
        const UsdPrim* source = findUsdPrim(root_, path);
        if (!source) fail(prim, std::string(entry.name) + " leads to no prim: <" + path + ">");
        for (const UsdPrim* above = &prim; above; above = above->parent)
          if (above == source) fail(prim, std::string(entry.name) + " leads to itself: <" + path + ">");
        if (!merged.insert(source).second) continue;
        prim.sources.push_back({path, prim.getPath()});
        merge(*source, prim, depth);
      }
    }
    for (const auto& child : prim.children)
      if (child->specifier == "def") compose(*child, depth + 1);
  }

 private:
  [[noreturn]] void fail(const UsdPrim& prim, const std::string& problem) const {
    throw InputError(path_, "prim '" + prim.getPath() + "' (line " + std::to_string(prim.line) + ")", problem,
                     "correct it");
  }

  // What the prim says itself is stronger.
  void merge(const UsdPrim& source, UsdPrim& prim, int depth) {
    if (++count_ > kMostPrims) fail(prim, "with what it refers to, there are more than 100000 prims");
    if (depth > kDeepest) fail(prim, "with what it refers to, prims nest more than 64 deep");
    if (prim.type.empty()) prim.type = source.type;
    if (prim.variants == 0) prim.variants = source.variants;
    std::set<std::string_view> own;
    for (const UsdProperty& property : prim.properties) own.insert(property.name);
    for (const UsdProperty& property : source.properties)
      if (!own.count(property.name)) prim.properties.push_back(property);
    own.clear();
    for (const UsdProperty& entry : prim.metadata) own.insert(entry.name);
    for (const UsdProperty& entry : source.metadata)
      if (entry.name == "apiSchemas" || contains(listUsdArcs(), entry.name) || !own.count(entry.name))
        prim.metadata.push_back(entry);
    for (const auto& child : source.children) {
      UsdPrim* same = prim.findChild(child->name);
      if (!same) {
        prim.children.push_back(std::make_unique<UsdPrim>());
        same = prim.children.back().get();
        same->specifier = child->specifier;
        same->name = child->name;
        same->line = child->line;
        same->parent = &prim;
      }
      merge(*child, *same, depth + 1);
    }
  }

  const UsdPrim& root_;
  const std::string& path_;
  int count_ = 0;
};

const UsdProperty* findIn(const std::vector<UsdProperty>& properties, std::string_view name) {
  const UsdProperty* found = nullptr;
  for (const UsdProperty& property : properties) {
    if (property.name != name || isOf(property.operation, {"delete", "reorder"})) continue;
    property.is_used = true;
    if (property.suffix.empty() && !property.value.empty() && property.value != "None") found = &property;
  }
  return found;
}

}  // namespace

std::string UsdPrim::getPath() const { return parent ? parent->getPath() + "/" + std::string(name) : ""; }

const UsdProperty* UsdPrim::find(std::string_view property) const { return findIn(properties, property); }

const UsdProperty* UsdPrim::findMetadata(std::string_view key) const { return findIn(metadata, key); }

const UsdPrim* UsdPrim::findChild(std::string_view child) const {
  for (const auto& prim : children)
    if (prim->name == child) return prim.get();
  return nullptr;
}

bool UsdPrim::hasApi(std::string_view schema) const {
  for (const std::string& name : listMetadata("apiSchemas"))
    if (name == schema) return true;
  return false;
}

std::vector<std::string> UsdPrim::listMetadata(std::string_view key) const {
  std::vector<std::string> out;
  for (const UsdProperty& entry : metadata) {
    if (entry.name != key || isOf(entry.operation, {"delete", "reorder"})) continue;
    for (std::string& text : listUsdStrings(entry.value)) out.push_back(std::move(text));
  }
  return out;
}

const std::vector<std::string>& listUsdArcs() {
  static const std::vector<std::string> arcs = {"references", "payload", "inherits", "specializes"};
  return arcs;
}

const UsdPrim* findUsdPrim(const UsdPrim& from, const std::string& path) {
  const UsdPrim* at = &from;
  const bool is_absolute = !path.empty() && path[0] == '/';
  while (is_absolute && at->parent) at = at->parent;
  for (size_t begin = is_absolute ? 1 : 0; at && begin < path.size();) {
    const size_t end = std::min(path.find('/', begin), path.size());
    const std::string name = path.substr(begin, end - begin);
    at = name == ".." ? at->parent : at->findChild(name);
    begin = end + 1;
  }
  return at;
}

std::unique_ptr<UsdLayer> parseUsda(std::string text, const std::string& path) {
  requireUtf8(text, path);
  auto layer = std::make_unique<UsdLayer>();
  layer->text = std::move(text);
  UsdaParser(*layer, path).parse();
  UsdComposer(layer->root, path).compose(layer->root, 0);
  return layer;
}

}  // namespace bielle
