#pragma once
// What the planned postures ask of motors, joints, legs and ground (docs/motions.md, "Before the first iteration").
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "bielle/dynamics/workspace.h"
#include "bielle/motion/motion.h"
#include "model/number_text.h"
#include "motion/statics.h"

namespace bielle {

// Of the friction that a force along an axis of a sole needs, over its slope: pyramids are in the cones, with a margin.
inline const double kPyramid = std::sqrt(2) / (1 - kConeMargin);

// Takes what is doubtful, and a remedy.
using TellDoubt = std::function<void(const std::string& doubt, const std::string& remedy)>;

class PostureChecks {
 public:
  // \param tell  may be null  \param com  of the robot where it starts, m (world)
  PostureChecks(const Motion& motion, const TellDoubt& tell, const Vector3d& com);

  // That motors hold the posture in which the motion starts. \throws InputError naming them where they are far too weak
  void checkStart();
  // Tells of motors that are too weak or too slow for the guess, or have too little power, of feet that would slip, and of legs that do not reach.
  void doubt();

 private:
  // A posture of the plan that is compared.
  struct Moment {
    int node = 0;
    double time = 0;  // s, with free durations at their longest
    const ContactPhase* phase = nullptr;
    double load = 1;      // on the feet, mean over the phase, over the weight
    bool middle = false;  // of the phase; or its first node

    std::string describe() const { return "in '" + phase->name + "' at " + formatNumber(time, "%.3g") + " s"; }
  };

  // What the plan needs of a motor or joint, where that is most of what is allowed.
  struct Need {
    double needed = 0, allowed = std::numeric_limits<double>::infinity();
    Moment moment;

    double share() const { return needed / allowed; }
  };

  VectorXd getStart() const { return problem_.initialState().head(model_.nq()); }
  // Before, it has stood there.
  bool startsAtRest() const { return problem_.initialState().segment(model_.nq(), model_.nv()).isZero(0); }
  VectorXd getPosture(int node) const { return motion_.guess.xs[static_cast<size_t>(node)].head(model_.nq()); }
  const ContactFrame& getContact(const ContactTarget& target) const { return model_.contacts()[target.contact]; }

  std::string formatEffort(const Motor& motor, double value) const;
  void listMoments();
  Vector3d calcFall(const Moment& moment, const Vector3d& com) const;
  HoldingShare calcShare(const Moment& moment, ConstVectorRef q, const Vector3d& com, const VectorXd& limits) const;
  VectorXd getLimits(int node) const;
  std::string listMotors(const VectorXd& u, const VectorXd& limits) const;
  void needFriction(const Moment& moment, Need& friction) const;
  bool needReach(const Moment& moment, Need& reach, std::string& foot);
  void needEfforts(const Moment& moment, const VectorXd& q, std::vector<Need>& efforts);
  void needSpeeds(const Moment& before, const Moment& after, const VectorXd& limits, std::vector<Need>& speeds) const;
  void needPowers(const Moment& before, const Moment& after, std::vector<Need>& powers);
  void tellEfforts(const std::vector<Need>& efforts) const;
  void tellSpeeds(const std::vector<Need>& speeds) const;
  void tellPowers(const std::vector<Need>& powers) const;

  const Motion& motion_;
  const RobotProblem& problem_;
  const Model& model_;
  const TellDoubt& tell_;
  Workspace ws_;
  double gravity_;  // m/s^2
  Vector3d com_;    // at the start
  Moment start_;
  std::vector<Moment> moments_;
  bool held_ = false;  // told that motors cannot hold the start
};

}  // namespace bielle
