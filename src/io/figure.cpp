#include "io/figure.h"

#include "io/aside_file.h"
#include "io/process.h"

namespace bielle {

std::string quoteGnuplot(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

bool drawSvg(const std::string& path, const std::string& script, int width, int height) {
  if (!isOnPath("gnuplot")) return false;
  AsideFile figure(path), source(path + ".gnuplot");  // the script is never committed and thus removed
  source.write("set terminal svg size " + std::to_string(width) + "," + std::to_string(height) +
               " font 'Helvetica,13' background 'white'\nset output " + quoteGnuplot(figure.aside()) + "\n" + script +
               "\nset output\n");
  if (waitForProcess(startProcess({"gnuplot", source.aside()})) != 0) failToWrite(path, "gnuplot failed");
  figure.commit();
  return true;
}

}  // namespace bielle
