#pragma once
/// \file What a time step costs in accuracy: many worlds at once beside MuJoCo.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

/// A robot that springs and dampers at its motors hold in a posture, without control, while its first body is pushed.
struct PrecisionOptions {
  std::vector<double> time_steps;      ///< s, of which 10 ms is a multiple
  double finest = 1e-3 / 32;           ///< s, likewise; its motion is taken for the converged one
  double seconds = 1, push = 60;       ///< the latter of the first world, N, for 50 ms
  int worlds = 32, mujoco_worlds = 2;  ///< MuJoCo's are those that the first ones are
};

/// One program at one time step.
struct Precision {
  std::string world;
  double time_step = 0;
  double error =
      0;  ///< largest difference of a joint's angle or travel from the converged motion of the same program, rad or m
  double apart = 0;  ///< the same of its converged motion from that of many worlds
  double gap = 0;    ///< largest opening of a closure at a sample, m
  double moves = 0;  ///< as far as any joint goes in that, likewise
  double rate = 0;   ///< seconds of a robot per second of processor time
};

/// Many worlds at once, and MuJoCo on the file that we export, by each of its integrators, with closures and contacts as stiff as the
/// file has them, or its step allows.
/// \param model  has feet, or is fixed
std::vector<Precision> measurePrecision(const Model& model, const PrecisionOptions& options);

}  // namespace bielle
