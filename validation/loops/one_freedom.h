#pragma once
// The motion of a mechanism of one freedom without losses, by its energy: with T = M(s) s'^2 / 2 and the potential V(s),
//
//     t = integral of sqrt(M / (2 (E - V))) ds                                                                     (1)
//
// by Gauss's quadrature. Where s' vanishes the integrand is infinite, so that s is a function of another variable x:
//
//     runs      s = s_0 + x, s' never vanishes                                                                     (2)
//     released  s = s_0 + x^2 / (1 + x), from rest, never to rest again                                            (3)
//     swings    s = (s_0 + s_1) / 2 + (s_0 - s_1) / 2 cos x, between two rests                                     (4)
//
// Near a rest E - V is the integral of -dV/ds rather than the difference, which rounding spoils.
#include <functional>

#include "bielle/math/types.h"
#include "loops/moving_frame.h"

namespace bielle::loops {

// Of a mechanism whose coordinate is s.
struct Posture {
  VectorXd q, q_slope;  // coordinates of the model and their derivatives by s
  Energies energies;
};

class OneFreedom {
 public:
  struct State {
    double s = 0, rate = 0;
  };
  using CalcPosture = std::function<Posture(double s)>;

  // \param speed  ds/dt at s_0, not zero
  static OneFreedom makeRunning(CalcPosture calc, double start, double speed);
  // Released from rest towards larger s.
  static OneFreedom makeReleased(CalcPosture calc, double start);
  // Released from rest; the other rest is searched between `start` and `beyond`, which lies behind it.
  static OneFreedom makeSwinging(CalcPosture calc, double start, double beyond);

  // At a time of 0 or more; calls by increasing times are quickest.
  State calcState(double t) const;
  Posture calcPosture(double s) const { return calc_(s); }

 private:
  enum class Path { Runs, Released, Swings };
  OneFreedom(CalcPosture calc, Path path, double start, double other, double speed);
  struct Place {
    double s, slope;  // s(x), ds/dx
  };
  Place calcPlace(double x) const;
  double calcSinceRest(double x) const;
  double calcFreeEnergy(double x) const;
  double calcPace(double x) const;
  double calcTime(double from, double to) const;

  CalcPosture calc_;
  Path path_;
  double start_, other_, energy_, sign_ = 1;
  mutable double x_ = 0, time_ = 0;  // the beginning of a panel, and when it is passed
};

}  // namespace bielle::loops
