#pragma once
// Pivots: where the rigid links of a robot are fastened to each other, as drawings for a workshop need them.
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

struct Pivot {
  std::string name;                  // of the joint or closure
  Vector3d p = Vector3d::Zero();     // in the frame of the link, m
  Vector3d axis = Vector3d::Zero();  // of a hinge, a unit vector in the frame of the link; zero of anything else
  int motor = -1;                    // of the model, if it drives the pivot
};

// Bodies that closures weld to each other are one link, named and placed by the first of them.
struct RigidLink {
  std::string name;
  std::vector<int> bodies;    // in increasing order; 0 is the ground
  std::vector<SE3> X_LB;      // their placements in the frame of the first one
  std::vector<Pivot> pivots;  // joints by which it is carried and that it carries, then closures
};

// All links of the model, the ground among them, in the order of their first bodies.
std::vector<RigidLink> listRigidLinks(const Model& model);

// Of parallel hinges, and of a hinge and another pivot, perpendicular to the axis; else of the points, m.
double calcPivotDistance(const Pivot& a, const Pivot& b);

struct LinkDistance {
  int link = 0;          // index among the links
  int from = 0, to = 0;  // indices of its pivots
  double length = 0;     // calcPivotDistance, m
};

// Distances that fix the places of the pivots of each link to each other: one of two, three of three, of more those along the
// shortest tree. Pivots at one place are one, and links of a single place have none.
std::vector<LinkDistance> listLinkDistances(const std::vector<RigidLink>& links);

}  // namespace bielle
