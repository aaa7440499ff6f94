#pragma once
// The closed robot at a given serial state: configuration, velocity and acceleration (lift.h).
#include <string>
#include <vector>

#include "bielle/motion/lift.h"
#include "dynamics/linkage_ratio.h"

namespace bielle {

class PostureLift {
 public:
  PostureLift(const Model& closed, const SerialModel& serial);

  // Closes the loops on the serial joints of q_s, from the configuration of the previous call. On failure, see why()
  // and joint().
  NumericalStatus setConfiguration(const VectorXd& q_s, double singular);
  // Sets a closed configuration.
  NumericalStatus setClosedConfiguration(const VectorXd& q, double singular);

  const VectorXd& q() const { return q_; }
  // The closed velocity and acceleration for the serial ones.
  VectorXd liftVelocity(const VectorXd& v_s);
  void liftMotion(const VectorXd& v_s, const VectorXd& a_s, VectorXd& v, VectorXd& a);
  // nv x nv of the serial model: closed velocities per unit of the serial ones.
  MatrixXd calcTangent() const;
  double margin() const { return margin_; }
  const std::string& why() const { return why_; }
  const std::string& joint() const { return joint_; }  // LiftNode::joint

 private:
  struct Drive {
    Linkage linkage;
    ClusterPoint here, next;
    std::vector<int> serial_positions, serial_dofs;  // of the linkage's joints in the serial model
  };
  NumericalStatus closeDrive(Drive& drive, const VectorXd& target);
  NumericalStatus checkMargin(double singular);
  NumericalStatus fail(NumericalStatus status, const std::string& joint, const std::string& why);

  const Model &closed_, &serial_;
  std::vector<Drive> drives_;
  std::vector<std::pair<int, int>> free_joints_;  // outside loops: in the closed and in the serial model
  VectorXd q_;
  double margin_ = 1;
  std::string why_, joint_;
};

}  // namespace bielle
