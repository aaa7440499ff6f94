#pragma once
// A linkage as few equations in few coordinates (linkage_graph.h).
//
// A distance D is an equation in each coordinate of the chain between its points. About the axis n of a hinge with the
// angle u, the points are r_a and R(u) r_b, and
//     A cos(u) + B sin(u) = C,    A = 2 r_a . r_b',    B = 2 r_a . (n x r_b'),
//     C = |r_a|^2 + |r_b|^2 - D^2 - 2 (n . r_a) (n . r_b),    r_b' = r_b - n (n . r_b)                          (1)
//     u = atan2(B C +- A w, A C -+ B w),    w = sqrt(A^2 + B^2 - C^2)                                           (2)
// with one sign for each way to assemble it; w = 0 is a dead point. A slide is a root of a quadratic equation.
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/linkage.h"
#include "bielle/dynamics/workspace.h"
#include "firmware/expression.h"

namespace bielle::firmware {

struct Coordinate {
  std::string name;
  double reference = 0;
};

// One coordinate from the others: the two roots of (2), alike (1 of an equation of first order).
struct ClosedForm {
  std::vector<Scalar> roots;
  Scalar radicand = 1;  // w^2
};

struct Equation {
  std::vector<Scalar> rows;          // zero where closed, m or rad
  std::map<int, ClosedForm> solved;  // by coordinate
  std::vector<int> coordinates;
};

struct Mechanism {
  std::vector<Coordinate> coordinates;  // joints, then motors, then others; formulas have them as inputs
  int size = 0;                         // joints, and motors
  std::vector<Equation> equations;
  // Energy of the springs, and of the weight of the bodies that a serial model does not have, J: a formula of the coordinates and
  // of gravity (3), m/s^2, in the frame of the body that carries the linkage.
  Scalar potential = 0;
  double ignored_offset = 0;  // m, largest distance of the centre of mass of a rod from its line
  std::vector<std::string> rods;

  int gravity() const { return static_cast<int>(coordinates.size()); }  // first input
  int velocity() const { return gravity() + 3; }                        // first input, where there is one
  int ratio() const { return velocity() + gravity(); }                  // likewise, R by rows
};

// \param q  nq of the whole model, closed
// \param planar_rods  whether rods on parallel hinges are distances, which is right if the mobility stays what it is
Mechanism makeMechanism(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods);

}  // namespace bielle::firmware
