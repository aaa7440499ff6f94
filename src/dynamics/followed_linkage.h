#pragma once
// One cluster of loops for rounded_linkages.h: its postures for a supposed rank, Eq. (1), and changes of its placements.
#include <optional>
#include <vector>

#include "bielle/dynamics/closure.h"
#include "bielle/model/builder.h"
#include "dynamics/loop_conflict.h"

namespace bielle {

// A placement and its twist, m and rad, in its frame.
struct PlaceChange {
  ModelPlace place;
  SE3 change;
};

template <typename Parts>  // const or not
auto& findPlacement(Parts& parts, const ModelPlace& place) {
  if (place.kind == ModelPlace::Kind::Joint) return parts.joints[place.index].X_PJ;
  auto& closure = parts.closures[place.index];
  return place.kind == ModelPlace::Kind::Frame1 ? closure.X_B1 : closure.X_B2;
}

// Of a whole model only the cluster's closures are kept. Residuals and steps of dofs are in rad and in units of its length L.
class FollowedLinkage {
 public:
  FollowedLinkage(const Model& model, const LoopCluster& cluster);

  double length() const { return length_; }
  int numDofs() const { return static_cast<int>(dofs_.size()); }
  int numRows() const { return set_.rows; }
  const Model& model() const { return model_; }
  const std::vector<PlaceChange>& changes() const { return changes_; }

  // Residuals (rows), and their derivatives by the dofs and by the twists of the places, six each.
  struct Rows {
    VectorXd r;
    MatrixXd J, P;
  };
  Rows calcRows(const VectorXd& q, bool with_changes);

  VectorXd move(const VectorXd& q, const VectorXd& step) const;
  double calcDistance(const VectorXd& from, const VectorXd& to) const;

  // Finds the plane loops: at q the axes of their hinges are parallel within `most` rad, and their slides are perpendicular to these.
  void findPlaneLoops(const VectorXd& q, double most);

  // How far the axes of the plane loops are from parallel (two rows for a hinge, one for a slide), and the derivative by the twists of
  // the places. Where the rows are zero, motions of the linkage do not change them.
  Rows calcParallelRows(const VectorXd& q);

  // Adds twists, six a place, to the changes.
  void change(const VectorXd& twists);

  // Turns the frames of balls and hinges of plane loops, with the axes in them, so that one of their own axes is across the plane, if
  // rounding has turned it away. The mechanism is the same, but rows across the plane, which say nothing, are zero: rows that are a
  // millionth of the others count as much as these, and so does their rounding.
  void alignFrames(const VectorXd& q);

 private:
  // Of a loop: that of a joint, or of frame 1 of a hinge.
  struct Axis {
    ModelPlace place;
    bool slides = false;
  };
  struct PlaneLoop {
    int closure;
    std::vector<Axis> axes;
  };
  SE3 getPlacementInWorld(const ModelPlace& place) const;
  Vector3d getDirection(const ModelPlace& place) const;

  // Adds `by_turn`, the derivative by a rotation of an axis in the world, as one by the twists of all places that turn it.
  void addTurns(const ModelPlace& axis, const Eigen::RowVector3d& by_turn,
                Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row) const;

  // A twist of a joint's placement moves all bodies behind it as the joint would.
  void addChanges(int c, MatrixXd& P) const;

  Model model_;
  ConstraintSet set_;
  Workspace ws_;
  std::vector<int> dofs_;
  double length_;
  std::vector<double> units_;  // of dofs, rad or m
  std::vector<PlaceChange> changes_;
  std::vector<PlaneLoop> plane_loops_;
};

// Eq. (1) at a posture.
struct LinkageFit {
  VectorXd q;
  VectorXd sigma;
  MatrixXd N;    // of the ways that it can go, n x (n - m)
  MatrixXd U_0;  // of the rows that are to be dropped
  VectorXd r;
  double gap = 0;
};
// The posture near q of a linkage of rank m, in the least-squares sense; with m < 0 the rank is the number of singular values above
// `least`. None where the iterations do not converge.
std::optional<LinkageFit> fitLinkage(FollowedLinkage& linkage, VectorXd q, int m, double least = 0);

// Postures that a linkage, taken to have a rank, was followed to.
struct LinkageWay {
  std::vector<VectorXd> postures;
  double gap = 0;    // largest residual, rad or L
  double moved = 0;  // of a dof from the start, rad or L
};
// Follows a linkage of rank m along random ways from a posture, as far as its gaps stay within `opening` and it is regular.
LinkageWay followLinkage(FollowedLinkage& linkage, const LinkageFit& start, int m, int count, unsigned seed,
                         double opening);

}  // namespace bielle
