#pragma once
// A benchmark problem: a mechanism, where it starts, what is asked, and how it really moves.
#include <functional>
#include <string>
#include <vector>

#include "bielle/model/model.h"
#include "loops/one_freedom.h"

namespace bielle::loops {

struct Motion {
  VectorXd q, v;
};

struct Output {
  std::string name, unit;
};

// A value that is printed somewhere, or the closed form's own to be kept.
struct Digits {
  double time = 0;
  int output = 0;  // index
  double value = 0;
  double tolerance = 0;  // to which the value is good
};

struct Problem {
  std::string name, title;
  Model model;
  Motion start;                 // closed
  VectorXd torques;             // of the motors, constant (nu)
  double duration = 0;          // s
  double pace = 1;              // fixed steps are that much longer than those of slow mechanisms
  std::vector<double> times;    // at which errors are told
  std::vector<Output> outputs;  // places and angles
  int judged = 0;               // the first of them count as the error
  std::function<VectorXd(const VectorXd& q, const VectorXd& v)> calcOutputs;
  // The true motion; calls by increasing times are quickest.
  std::function<Motion(double t)> calcMotion;
  // What stays: the energy less the work of constant torques, or another quantity; and what its change is compared with.
  std::string invariant;
  std::function<double(const VectorXd& q, const VectorXd& v)> calcInvariant;
  double invariant_scale = 1;
  std::vector<Digits> digits;
};

// Sets calcMotion, and `start` at time 0. \param speed  ds/dt at s_0
void setMotion(Problem& problem, const OneFreedom& motion, double s0, double speed);

// The invariant is the energy of the model less the work of the torques, on the scale of the kinetic energy in motion.
void setEnergy(Problem& problem);

// Of as many horizontal rods.
Problem makeFourbars(int count);
Problem makeSqueezer();
Problem makeBricard();
Problem makeSliderCrank();
Problem makeSpatialFourbar();
// \param step  of the integration of its true motion, s
Problem makeGovernor(double step = 2.5e-4);

// All of them; N four-bars with 2 of them.
std::vector<std::string> listProblems();
// \param name  of the list, or fourbars_N
// \throws InputError when there is none
Problem makeProblem(const std::string& name);

}  // namespace bielle::loops
