#pragma once
// What holds the bodies of a linkage together, with as few coordinates as possible.
//
// Bodies that are welded are one group, and two hinges whose axes meet in a body without anything else a universal joint. A rod that touches two others by balls, universal joints or parallel hinges holds two
// points at a distance: one equation, and no coordinate. So does a strut with a slide between its ends, whose length is the slide's.
// Of what remains, a spanning tree with the fewest coordinates is chosen anew; each other joint closes a loop.
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bielle/dynamics/linkage.h"
#include "bielle/dynamics/workspace.h"
#include "dynamics/reduction.h"

namespace bielle::firmware {

// A joint between two bodies: of the tree, or a closure.
struct Edge {
  std::string name;
  JointKind kind = JointKind::Fixed;
  int a = 0, b = 0;  // groups of welded bodies
  SE3 X_a, X_b;      // frames in the groups
  Vector3d axis, axis2;
  VectorXd q;                    // at the reference
  std::vector<int> coordinates;  // of those in use
  int joint = -1;                // of the model of the cluster
  bool needed = false;           // its coordinate is that of a motor, a serial joint, a coupler or a spring
  bool used = true;

  bool isBall() const { return kind == JointKind::Spherical; }
  bool isHinge() const { return kind == JointKind::Revolute || kind == JointKind::Continuous; }
  bool hasCentre() const { return isBall() || kind == JointKind::Universal; }
  int other(int group) const { return group == a ? b : a; }
  const SE3& in(int group) const { return group == a ? X_a : X_b; }
};

// A step from group to group along an edge.
struct Step {
  int edge;
  bool forward;  // from a to b
};

// A rod or strut.
struct RodDistance {
  int a, b;               // groups
  Vector3d pa, pb;        // in them
  double k0 = 0, k1 = 0;  // D^2 = k0 + 2 k1 s + s^2 with the coordinate of a slide; without one k0
  int slide = -1;         // edge
  std::string name{};
};

struct PointMass {
  int group;
  Vector3d point;
  double mass;
};

class LinkageGraph {
 public:
  // \param q  nq of the whole model, closed   \param planar_rods  as of makeMechanism()
  // \throws InputError when motors, serial joints and couplers alone close a loop
  LinkageGraph(const Model& model, const Linkage& linkage, ConstVectorRef q, bool planar_rods);

  const Model& loops() const { return loops_; }  // the model of the cluster
  int toCluster(int joint) const;                // body of loops(), or -1
  int getGroup(int body) const { return group_[static_cast<size_t>(body)]; }
  const SE3& place(int body) const { return places_[static_cast<size_t>(body)]; }  // in its group
  bool isRod(int group) const { return gone_.count(group) > 0; }
  Edge& findEdge(int joint);
  // The way from one group to another along the tree.
  std::vector<Step> findPath(int from, int to) const;

  std::vector<Edge> edges;
  std::vector<int> tree, closing;  // edges
  std::vector<RodDistance> distances;
  std::vector<PointMass> masses;  // of rods
  std::vector<std::string> rods;
  double ignored_offset = 0;  // m, as of Mechanism

 private:
  void markNeeded();
  void weld();
  void addEdge(Edge edge, int body1, const SE3& X_1, int body2, const SE3& X_2);
  void addEdges();
  std::vector<int> listEdges(int group) const;
  void visitMasses(int group, const std::function<void(const Vector3d& com, double mass)>& visit) const;
  bool isHeldOtherwise(int group) const;
  void joinHinges();
  bool findHeights(const Edge& one, int group1, const Edge& two, int group2, const SE3& X_12, double& h1,
                   double& h2) const;
  bool isConnectedWithout(const std::vector<int>& without, const std::set<int>& groups) const;
  bool removeRod();
  bool removePlainRod(int group, const std::vector<int>& ends, const Edge& one, const Edge& two);
  bool removeStrut(int group, const std::vector<int>& ends);
  void finishRod(RodDistance distance, const std::vector<int>& ends, const std::vector<std::pair<int, SE3>>& parts,
                 const Vector3d& p1, const Vector3d& p2, const std::string& name);
  void plant();

  const Model& model_;
  const Linkage& linkage_;
  const ReducedCluster& cluster_;
  const Model& loops_;
  Workspace ws_;
  bool planar_;
  VectorXd q_;
  std::set<int> needed_;     // joints of the cluster's model
  std::vector<int> group_;   // of bodies, by its first one
  std::vector<SE3> places_;  // of bodies in their groups
  std::set<int> gone_;       // groups that are rods
};

}  // namespace bielle::firmware
