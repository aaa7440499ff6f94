#include <cstdio>
#include <ostream>

#include "bielle/solve/fddp.h"

namespace bielle {

const char* getName(FddpTermination termination) {
  switch (termination) {
    case FddpTermination::Converged:
      return "converged";
    case FddpTermination::MaxIterations:
      return "iteration limit";
    case FddpTermination::RegularizationMax:
      return "regularization limit";
    case FddpTermination::Infeasible:
      return "locally infeasible";
    case FddpTermination::Interrupted:
      return "interrupted";
    case FddpTermination::Failed:
      return "failed";
  }
  return "";
}

void printFddpHeader(std::ostream& out) {
  char text[128];
  std::snprintf(text, sizeof text, "%5s %15s %10s %10s %10s %10s %10s %9s\n", "iter", "cost", "gap", "violation",
                "gradient", "step", "regul.", "time [s]");
  out << text;
}

void printFddpIteration(std::ostream& out, const FddpIteration& line) {
  char text[128];
  std::snprintf(text, sizeof text, "%5d %15.8e %10.3e %10.3e %10.3e %10.3e %10.3e %9.3f\n", line.iteration, line.cost,
                line.gap, line.violation, line.gradient, line.step, line.regularization, line.seconds);
  out << text;
}

std::function<FddpAction(const FddpIteration&, const ShootingTrajectory&)> makeFddpPrinter(std::ostream& out) {
  return [&out](const FddpIteration& line, const ShootingTrajectory&) {
    if (line.iteration == 1) printFddpHeader(out);
    printFddpIteration(out, line);
    out.flush();
    return FddpAction::Continue;
  };
}

}  // namespace bielle
