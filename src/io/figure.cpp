#include "io/figure.h"

#include <spawn.h>
#include <sys/wait.h>

#include <cerrno>

#include "io/aside_file.h"

extern char** environ;

namespace bielle {

std::string quoteGnuplot(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

bool drawSvg(const std::string& path, const std::string& script, int width, int height) {
  AsideFile figure(path), source(path + ".gnuplot");  // the script is never committed and thus removed
  source.write("set terminal svg size " + std::to_string(width) + "," + std::to_string(height) +
               " font 'Helvetica,13' background 'white'\nset output " + quoteGnuplot(figure.aside()) + "\n" + script +
               "\nset output\n");
  const std::string file = source.aside();
  const char* arguments[] = {"gnuplot", file.c_str(), nullptr};
  pid_t child = 0;
  const int error = posix_spawnp(&child, "gnuplot", nullptr, nullptr, const_cast<char**>(arguments), environ);
  if (error == ENOENT) return false;
  int status = error;
  if (error == 0) {
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  }
  if (status != 0) failToWrite(path, "gnuplot failed");
  figure.commit();
  return true;
}

}  // namespace bielle
