#include "tasks/dry_run.h"

#include <cctype>
#include <fstream>

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
  return complaint.empty() ? "it cannot be checked" : complaint;
}

void refuse(const std::string& command, const std::string& complaint, const OptionEntries& options,
            const YamlEntry& other) {
  const YamlEntry* guilty = &other;
  for (const auto& [name, entry] : options) {
    const size_t at = complaint.find("--" + name);
    const size_t end = at == std::string::npos ? at : at + name.size() + 2;
    // The whole flag: --step is none of --steps.
    if (at != std::string::npos &&
        (end == complaint.size() || !(std::isalnum(complaint[end]) || complaint[end] == '-')))
      guilty = &entry;
  }
  guilty->fail("`bielle " + command + "` rejects it: " + complaint, "see `bielle " + command + " --help`");
}

}  // namespace bielle::tasks
