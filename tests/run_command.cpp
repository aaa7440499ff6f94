#include "run_command.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "robot_directory.h"

namespace bielle::testing {
namespace {

void redirect(const std::string& path, int flags, int descriptor) { dup2(open(path.c_str(), flags, 0600), descriptor); }

}  // namespace

Command::Command(const std::vector<std::string>& arguments, const std::string& input) {
  directory_ = (std::filesystem::temp_directory_path() / "bielle_command_XXXXXX").string();
  if (!mkdtemp(directory_.data())) throw std::runtime_error("no temporary directory");
  std::ofstream(directory_ + "/in", std::ios::binary) << input;
  std::vector<std::string> copy = arguments;
  std::vector<char*> argv;
  for (std::string& argument : copy) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("no new process");
  if (pid_ > 0) return;
  redirect(directory_ + "/in", O_RDONLY, STDIN_FILENO);
  redirect(directory_ + "/out", O_WRONLY | O_CREAT, STDOUT_FILENO);
  redirect(directory_ + "/err", O_WRONLY | O_CREAT, STDERR_FILENO);
  execv(argv[0], argv.data());
  _exit(127);
}

Command::~Command() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  std::filesystem::remove_all(directory_);
}

bool Command::waitForOutput(const std::string& text, double seconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < deadline) {
    if (readFile(directory_ + "/out").find(text) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

void Command::sendSignal(int signal) { kill(pid_, signal); }

CommandResult Command::wait() {
  int state = 0;
  waitpid(pid_, &state, 0);
  pid_ = -1;
  CommandResult result;
  result.status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  result.out = readFile(directory_ + "/out");
  result.err = readFile(directory_ + "/err");
  return result;
}

CommandResult runCommand(const std::vector<std::string>& arguments, const std::string& input) {
  return Command(arguments, input).wait();
}

}  // namespace bielle::testing
