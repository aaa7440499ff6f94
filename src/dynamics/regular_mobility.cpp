#include "dynamics/regular_mobility.h"

#include "bielle/dynamics/assembly.h"

namespace bielle {

Mobility calcRegularMobility(const Model& model, ConstVectorRef q) {
  constexpr double kAside = 0.05;  // rad or m
  Mobility most = calcMobility(model, q);
  for (const double sign : {1.0, -1.0}) {
    const VectorXd v = sign * kAside * VectorXd::LinSpaced(model.nv(), -0.7, 1.1);
    const AssemblyResult aside = closeConfiguration(model, model.integrate(q, v));
    if (aside.status != NumericalStatus::Ok) continue;
    const Mobility there = calcMobility(model, aside.q);
    if (there.rank > most.rank) most = there;
  }
  return most;
}

}  // namespace bielle
