#!/bin/bash
# The search for a linkage stops at once, or forgets what it found, if designs that cannot close are NaN: seven of fourteen of
# pagmo's algorithms give back the design that they began with, without an error.
#
# Seen with pagmo 2.18 (Debian 12, libpagmo8 2.18.0-2+b1), on the three lengths of a four-bar between bounds, whose rocker is to
# follow another one's. Where bars do not reach each other the arccosine has no value, nor has the objective. All begin with the
# same twenty designs and may ask for a thousand, annealing for three thousand:
# - with infinity in place of NaN all fourteen find better designs;
# - with NaN, DE, saDE and DE1220 end after one generation; PSO, harmony search, annealing and the simple evolutionary algorithm go
#   on to the end. All seven give back the best design of the start, though they had evaluated better ones;
# - the other seven find better ones either way. A fifteenth, the bee colony, had not ended after 30 s and is not tried here.
# Objectives should be infinite there, and one's own record of the best design costs a line.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
boost=1.74.0+ds1-21 tbb=2021.8.0-2+deb12u1
apt-get download -qq libpagmo-dev=2.18.0-2+b1 libpagmo8=2.18.0-2+b1 libeigen3-dev=3.4.0-4 "libtbb-dev=$tbb" "libtbb12=$tbb" \
  "libboost1.74-dev=$boost" "libboost-serialization1.74-dev=$boost" "libboost-serialization1.74.0=$boost"
for package in *.deb; do dpkg -x "$package" root; done
cat > search.cpp <<'CPP'
#include <cmath>
#include <cstdio>
#include <limits>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/algorithms/compass_search.hpp>
#include <pagmo/algorithms/de.hpp>
#include <pagmo/algorithms/de1220.hpp>
#include <pagmo/algorithms/gaco.hpp>
#include <pagmo/algorithms/gwo.hpp>
#include <pagmo/algorithms/ihs.hpp>
#include <pagmo/algorithms/pso.hpp>
#include <pagmo/algorithms/pso_gen.hpp>
#include <pagmo/algorithms/sade.hpp>
#include <pagmo/algorithms/sea.hpp>
#include <pagmo/algorithms/sga.hpp>
#include <pagmo/algorithms/simulated_annealing.hpp>
#include <pagmo/algorithms/xnes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
using pagmo::vector_double;

static int evaluations = 0;
static double least, open_value;
// The angle of the rocker c on a ground of 1 m, for a crank a and a coupler b; no number where they do not reach each other.
static double calcRocker(const vector_double& x, double crank) {
  const double px = x[0] * std::cos(crank) - 1, py = x[0] * std::sin(crank), d = std::hypot(px, py);
  return std::atan2(py, px) - std::acos((x[2] * x[2] + d * d - x[1] * x[1]) / (2 * x[2] * d));
}
// How far the rocker is from where that of 0.35, 0.9 and 0.7 m is.
struct FourBar {
  std::pair<vector_double, vector_double> get_bounds() const { return {{0.2, 0.2, 0.2}, {1.2, 1.2, 1.2}}; }
  vector_double fitness(const vector_double& x) const {
    double sum = 0;
    for (int k = 0; k < 12; ++k)
      sum += std::pow(std::remainder(calcRocker(x, 0.5 * k) - calcRocker({0.35, 0.9, 0.7}, 0.5 * k), 2 * M_PI), 2);
    ++evaluations;
    if (sum < least) least = sum;
    return {std::isnan(sum) ? open_value : sum};
  }
};
int main() {
  using namespace pagmo;
  const std::pair<const char*, algorithm> all[] = {
      {"DE", algorithm(de(50, 0.8, 0.9, 2, 1e-6, 1e-6, 3))}, {"saDE", algorithm(sade(50, 2, 1, 1e-6, 1e-6, false, 3))},
      {"DE1220", algorithm(de1220(50, de1220_statics<void>::allowed_variants, 1, 1e-6, 1e-6, false, 3))},
      {"PSO", algorithm(pso(50, 0.7298, 2.05, 2.05, 0.5, 5, 2, 4, false, 3))},
      {"PSO by generations", algorithm(pso_gen(50, 0.7298, 2.05, 2.05, 0.5, 5, 2, 4, false, 3))},
      {"grey wolves", algorithm(gwo(50, 3))}, {"harmony search", algorithm(ihs(1000, 0.85, 0.35, 0.99, 1e-5, 1, 3))},
      {"annealing", algorithm(simulated_annealing(10, 0.1, 10, 10, 10, 1, 3))}, {"evolution by one", algorithm(sea(1000, 3))},
      {"genetic", algorithm(sga(50, 0.9, 1, 0.02, 1, 2, "exponential", "polynomial", "tournament", 3))},
      {"ants", algorithm(gaco(50, 13, 1, 0, 0.01, 1, 7, 100000, 100000, 0, false, 3))},
      {"compass", algorithm(compass_search(1000))},
      {"CMA-ES", algorithm(cmaes(50, -1, -1, -1, -1, 0.5, 1e-6, 1e-6, false, true, 3))},
      {"xNES", algorithm(xnes(50, -1, -1, -1, -1, 1e-6, 1e-6, false, true, 3))}};
  for (const auto& [name, algorithm] : all) {
    std::printf("%s:", name);
    for (double value : {std::numeric_limits<double>::infinity(), std::nan("")}) {
      open_value = value, least = 1e300;
      population starts(problem(FourBar{}), 20, 7);
      const double first = least;  // of the start, the same for all
      evaluations = 0;
      const double champion = algorithm.evolve(starts).champion_f()[0];
      std::printf(" %s, %s%s%s%s", std::isnan(value) ? "NaN" : "infinity", champion < first ? "better" : "its start",
                  champion > least ? " (had seen better)" : "", evaluations == 20 ? " (one generation)" : "",
                  std::isnan(value) ? "\n" : ";");
    }
  }
}
CPP
libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 -O1 search.cpp -isystem root/usr/include -isystem root/usr/include/eigen3 -L $libraries \
  -Wl,-rpath,"$PWD/$libraries" -lpagmo -lboost_serialization -ltbb -o search
./search | tee seen
cat > expected <<'TEXT'
DE: infinity, better; NaN, its start (had seen better) (one generation)
saDE: infinity, better; NaN, its start (had seen better) (one generation)
DE1220: infinity, better; NaN, its start (had seen better) (one generation)
PSO: infinity, better; NaN, its start (had seen better)
PSO by generations: infinity, better; NaN, better
grey wolves: infinity, better; NaN, better
harmony search: infinity, better; NaN, its start (had seen better)
annealing: infinity, better; NaN, its start (had seen better)
evolution by one: infinity, better; NaN, its start (had seen better)
genetic: infinity, better; NaN, better
ants: infinity, better; NaN, better
compass: infinity, better; NaN, better
CMA-ES: infinity, better; NaN, better
xNES: infinity, better; NaN, better
TEXT
diff expected seen && echo "as described"
