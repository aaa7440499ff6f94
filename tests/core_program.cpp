// A program that links the core alone: it knows the names and options of all motions, plans the squat of the robot whose file it is
// given, and misses all others, and the full formulation. Exits with 0 if all of this is so.
#include <cstdio>
#include <functional>

#include "bielle/formats/reader.h"
#include "bielle/motion/registry.h"
#include "model/missing_part.h"

namespace {

using namespace bielle;

// What a MissingPart tells; empty if nothing is missing.
std::string findMissing(const std::function<void()>& work) {
  try {
    work();
    return "";
  } catch (const MissingPart& missing) {
    return missing.what();
  }
}

bool isMissing(const std::string& part, const std::function<void()>& work) {
  const std::string found = findMissing(work);
  const bool ok = part.empty() ? found.empty() : found.find("without " + part + ";") != std::string::npos;
  if (!ok) std::printf("'%s' instead of '%s'\n", found.c_str(), part.c_str());
  return ok;
}

}  // namespace

int main(int, char** arguments) {
  const Model model = loadRobot(arguments[1]).model;
  bool ok = getMotions().size() == 11;
  for (const MotionEntry& entry : getMotions()) {
    ok &= !entry.request.options.listValues().empty();
    ok &= isMissing(entry.name == "squat" ? "" : "the motion " + entry.name, [&] { makeMotion(model, entry.request); });
  }
  ProblemOptions full;
  full.formulation = Formulation::Full;
  ok &= isMissing("the full formulation", [&] { makeMotion(model, findMotion("", "squat").request, full); });
  ok &= isMissing("the motion footholds", [] {
    MotionRequest request = findMotion("", "footholds").request;
    request.files.front().read("no file", request);
  });
  return ok ? 0 : 1;
}
