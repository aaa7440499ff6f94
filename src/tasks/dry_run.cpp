#include "tasks/dry_run.h"

#include <cctype>
#include <fstream>
#include <regex>

#include "model/number_text.h"
#include "tasks/cases.h"
#include "tasks/child.h"

namespace bielle::tasks {
namespace {

void readWarnings(const std::string& log, std::set<std::string>& warnings) {
  constexpr const char* kBegin = "bielle: ";
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);)
    if (line.rfind(std::string(kBegin) + "warning: ", 0) == 0) warnings.insert(line.substr(std::string(kBegin).size()));
}

// Where a flag or word stands: --step is none of --steps.
size_t findWhole(const std::string& text, const std::string& word) {
  const auto goesOn = [&text](size_t at) { return at < text.size() && (std::isalnum(text[at]) || text[at] == '-'); };
  size_t at = text.find(word);
  while (at != std::string::npos && (goesOn(at + word.size()) || (at > 0 && goesOn(at - 1))))
    at = text.find(word, at + 1);
  return at;
}

// Whether a complaint is about the value of an option, or what stands before its "=": of a flag it may name nothing else.
bool isNamed(const std::string& complaint, const YamlEntry& option) {
  const std::string problem = complaint.substr(0, complaint.find("; "));
  for (const YamlEntry& value : option.isList() ? option.getList() : std::vector<YamlEntry>{option}) {
    const std::string text = value.getText(), name = text.substr(0, text.find('='));
    if (!name.empty() && findWhole(problem, name) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

std::optional<std::string> findComplaint(std::vector<std::string> command, const std::string& log,
                                         std::set<std::string>& warnings) {
  command.push_back("--dry-run");
  SignalWatch watch;
  const std::optional<int> status = watch.waitForChild(startChild(command, log));
  if (!status) return std::nullopt;
  if (*status == 0) {
    readWarnings(log, warnings);
    return "";
  }
  std::string complaint = findError(log);
  if (complaint.empty()) {
    std::ifstream file(log);
    std::getline(file, complaint);
  }
  const std::string hint = "; see --help";  // a remedy of its own names the command
  if (complaint.size() > hint.size() && complaint.compare(complaint.size() - hint.size(), hint.size(), hint) == 0)
    complaint.resize(complaint.size() - hint.size());
  return complaint.empty() ? "it cannot be checked" : complaint;
}

PlannedMotion readPlannedMotion(const std::string& log) {
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);) {
    std::smatch found;
    if (!std::regex_match(line, found,
                          std::regex("planned: (\\d+) phases, \\d+ stages, (\\S+) s( at most)?(, a cycle)?")))
      continue;
    return {found[4].matched ? std::nullopt : parseNumber(found[2].str()), std::stoi(found[1].str())};
  }
  return {};
}

void refuse(const std::string& command, const std::string& complaint, const OptionEntries& options,
            const YamlEntry& other) {
  const YamlEntry* guilty = nullptr;
  size_t first = std::string::npos;  // a remedy behind it may name others
  for (const auto& [name, entry] : options) {
    const size_t at = findWhole(complaint, "--" + name);
    if (at >= first) continue;
    first = at;
    guilty = &entry;
  }
  for (const auto& [name, entry] : options)
    if (!guilty && isNamed(complaint, entry)) guilty = &entry;
  (guilty ? *guilty : other)
      .fail("`bielle " + command + "` rejects it: " + complaint, "see `bielle " + command + " --help`");
}

}  // namespace bielle::tasks
