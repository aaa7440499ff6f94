#pragma once
// The problems of the paper's example code: Euler steps and costs alone, without limits of motors or joints and without
// any other constraint.
#include "bielle/motion/motion.h"

namespace bielle::paper {

constexpr double kTimeStep = 0.015;  // s

// Horizontal velocity of the frame's origin times exp(-slope z) (2), z its height over `ground`, m/s; slope in 1/m.
std::unique_ptr<Residual> makeFlyHigh(const BodyFrame& frame, double slope, double ground);
// Horizontal distance between two frames (1), m.
std::unique_ptr<Residual> makeFrameDistance(const BodyFrame& a, const BodyFrame& b);

// Weights of a foot that may land anywhere, over h.
struct LandingWeights {
  double height = 0;    // over that of a place, 1/m^2
  double tilt = 0;      // rotation about x and y of the place, 1
  double velocity = 0;  // and angular velocity, s^2/m^2 and s^2
};
// \param suffix  of the names of the costs
void addLandingCosts(const ContactFrame& foot, const SE3& X_WF, const LandingWeights& weights,
                     const std::string& suffix, StageSpec& stage);

// Regularization of state, about a posture at rest (weights: 2 nv), and of motor torques.
StageSpec makeRegularizedStage(const Model& model, const VectorXd& q, double state_weight, const VectorXd& weights,
                               double control_weight);

// Appends a phase to the schedule, and to the guess the torques that hold the robot at q. \param nodes  stages of
// kTimeStep
void addPhase(const Model& model, const std::string& name, int nodes, const std::vector<ContactTarget>& contacts,
              const VectorXd& q, Motion& motion);

}  // namespace bielle::paper
