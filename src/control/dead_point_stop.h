#pragma once
/// \file Torques that keep linkages from passing their dead points, at every instant of control.
///
/// Plans keep a margin to dead points (problem_options.h); a robot that is thrown off its plan may use it up, and past a dead point its
/// linkage snaps into another configuration. With rho the transmission of a linkage (linkage.h), s = rho where its joints, s =
/// 1/rho where its motors come to a dead point, and g = ds/dv_M by its motors, the way to the stop at s = s_0 is
///     d = (s - s_0) / |g|,    d' = g . v_M / |g|                                                                    (1)
/// to first order, of the motors, rad or m; s goes through zero at the dead point, so that d does not turn round there.
/// The motors of a linkage that will be past the stop after the time T, if they go on like this, brake:
///     u += D max(0, -(d/T + d')) g/|g|,    D = k I/(h + delay)                                                      (2)
/// I is their inertia along g, with the bodies that they carry. More damping than that would make them swing, since torques are
/// held for an instant of control, h, and act later by the delay.
#include <vector>

#include "bielle/control/controller.h"
#include "dynamics/linkage_workspace.h"

namespace bielle {

class DeadPointStop {
 public:
  /// \param q  nq: closed, where all transmissions are 1   \param stop  s_0; 0: no stops
  /// \throws InputError when there are stops and q is open or a dead point
  DeadPointStop(const Model& model, ConstVectorRef q, double stop);
  /// Adds (2) to the torques (nu). It neither allocates nor throws.
  void add(const Measurement& measurement, VectorRef u);

 private:
  void brake(double s, double ds, const Measurement& measurement, VectorRef u) const;

  Model model_;
  const double stop_;
  std::vector<Linkage> linkages_;
  LinkageWorkspaces memory_;
  VectorXd inertia_;   // of each motor with what follows it (nu)
  VectorXd gradient_;  // nu
  double time_ = 0, period_ = 0;
};

}  // namespace bielle
