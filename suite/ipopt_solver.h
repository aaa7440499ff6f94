#pragma once
// A motion solved by IPOPT (Wächter and Biegler, "On the implementation of an interior-point filter line-search
// algorithm for large-scale nonlinear programming", Mathematical Programming 106, 2006), as the program of
// multiple_shooting.h or of collocation.h.
#include <string>
#include <utility>
#include <vector>

#include "bielle/motion/solve.h"

namespace bielle {

enum class IpoptTranscription { MultipleShooting, Collocation };
enum class IpoptHessian { GaussNewton, Lbfgs };

struct IpoptOptions {
  IpoptTranscription transcription = IpoptTranscription::MultipleShooting;
  IpoptHessian hessian = IpoptHessian::GaussNewton;
  int max_iterations = 300;
  double seconds = 1e6;  // of processor time, after which it ends with the iteration
  bool quiet = false;
  std::vector<std::pair<std::string, std::string>> settings;  // options of IPOPT by name, in place of those below
};

// The options of IPOPT that differ from its defaults, besides those above; docs/suite.md gives the reasons.
const std::vector<std::pair<std::string, std::string>>& listIpoptOptions();

// The end of a run, in words such as "converged" or "too late", which IPOPT knows more of than bielle::solve() does.
// Cost, violation and gap of a collocation are those of its own steps.
struct IpoptSolution {
  Solution solution;
  std::string end;
  std::vector<std::string> dropped{};  // redundant rows of closures, Collocation::listDropped()
};

// \throws InputError naming an option that IPOPT does not know
IpoptSolution solveByIpopt(const Motion& motion, const ShootingTrajectory& guess, const IpoptOptions& options = {});

}  // namespace bielle
