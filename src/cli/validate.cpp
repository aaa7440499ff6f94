// bielle validate: hands over to bielle-validate, which alone knows Simbody.
#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "cli/commands.h"

namespace bielle::cli {

void addValidate(CLI::App& app) {
  app.add_subcommand("validate", "Compare the dynamics with Simbody's (see bielle validate --help)");
}

int runValidate(char** arguments) {
  std::string program = "bielle-validate";
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path beside = self.parent_path() / program;
  if (!error && access(beside.c_str(), X_OK) == 0) program = beside.string();
  arguments[0] = program.data();
  execvp(program.c_str(), arguments);  // without a slash, PATH is searched
  std::cerr << "bielle: error: bielle-validate is neither beside this program nor on the PATH; build Bielle with "
               "-DBIELLE_BUILD_VALIDATION=ON (it needs Simbody)"
            << std::endl;
  return kBadInput;
}

}  // namespace bielle::cli
