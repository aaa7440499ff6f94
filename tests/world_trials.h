#pragma once
// Trials that every world must pass: a robot stands, is dropped, is pushed; and what must be noticed.
#include <functional>
#include <memory>

#include "bielle/formats/reader.h"
#include "worlds/posture_hold.h"

namespace bielle::worlds::testing {

// Advances by control steps of 1 ms. \returns false if the world broke off
bool hold(World& world, const PostureHold& posture, double duration,
          const std::function<Vector3d(double time)>& push = {});

// Left less right side of Books' Eq. (1) over the largest of its terms.
double calcBalanceError(const Books& start, const Books& end);

struct TrialTolerances {
  double balance = 0.01;  // of calcBalanceError()
  double creep = 1e-6;    // of a robot that stands, m in half a second
  double gap = 1e-8;      // m
};
// Each takes a world of Bipetto on flat ground at height 0 and friction 0.7.
void checkStanding(World& world, const Model& model, const TrialTolerances& tolerances);
void checkDropped(World& world, const Model& model, const TrialTolerances& tolerances);
void checkPushed(World& world, const Model& model, const TrialTolerances& tolerances);
// In the air, a motor drives a hip into its stop.
void checkStopped(World& world, const Model& model, const TrialTolerances& tolerances);

// A five-bar with springs and dampers between its rods and to the ground.
Model makeSprungFivebar();
// It swings for half a second, like the full system under the method of Runge and Kutta, and the springs are booked.
// \returns the largest error of the coordinates at the end, rad
double checkSprung(World& world, const Model& model, double balance);

}  // namespace bielle::worlds::testing
