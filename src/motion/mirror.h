#pragma once
/// \file The left-right mirror image of a robot, where it is one of itself.
///
/// A reflection G of the world takes a motion of the robot to another one of the same robot if every body i has a partner p(i) that
/// is its mirror image: in the neutral configuration, with X_i placements and S the reflection in the middle plane there,
///     X_p = S X_i C_i,   C_i fixed, det C_i.R = -1,                                                                (1)
/// and joints, masses and motors of p are those of i, reflected. Placements then go to
///     X_p' = G X_i C_i,                                                                                            (2)
/// coordinates of joints with one axis to themselves or their negatives, and rotations R of a ball to C_i^T R C_i.
#include <optional>
#include <string>
#include <vector>

#include "bielle/model/model.h"

namespace bielle {

class MirroredRobot {
 public:
  /// The middle plane is halfway between two contacts, along the line between them in the neutral configuration.
  /// \param why  receives what has no mirror image, where there is none
  static std::optional<MirroredRobot> find(const Model& model, int left, int right, std::string& why);

  /// The state (q, v) of the mirror image. \param G  reflection of the world in a vertical plane, and a displacement
  VectorXd mapState(const SE3& G, const VectorXd& x) const;
  /// nu
  VectorXd mapTorques(const VectorXd& u) const;
  /// Index of the contact that is the mirror image, -1 if there is none, and C of Eq. (1) between their frames.
  int getContact(int contact) const;
  SE3 getContactMap(int contact) const;

 private:
  struct Partner {
    int body = -1;
    SE3 C;
    double sign = 1, sign2 = 1;  // of the coordinates of joints with one axis or two
  };

  explicit MirroredRobot(const Model& model) : model_(model) {}
  bool pairChildren(int parent, const SE3& S, const std::vector<SE3>& placements, std::string& why);
  // How far body j is from the mirror image of body i, in the worst of all comparisons; 1 is too far.
  double compare(int i, int j, const SE3& S, const std::vector<SE3>& placements, Partner& partner,
                 std::string& what) const;

  Model model_;
  std::vector<Partner> partners_;  // of bodies
  std::vector<int> motors_;        // partners of motors
};

}  // namespace bielle
