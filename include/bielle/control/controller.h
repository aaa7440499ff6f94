#pragma once
/// \file The interface of feedback laws: from what is measured to torques.
#include "bielle/model/model.h"

namespace bielle {

/// What is known of a robot at an instant of control.
struct Measurement {
  double time = 0;  ///< since the start of the controller, s
  VectorXd q, v;    ///< nq, nv: coordinates of the model, from an estimator or a simulated world
  /// Per contact of the model, whether it is believed to stand; empty: not known.
  std::vector<char> contacts{};
  double delay = 0;  ///< from `time` until the torques computed from this act, s

  double getActionTime() const { return time + delay; }  ///< when they act, s
};

/// Where a foot is foreseen to stand next.
struct PredictedFoothold {
  int contact = 0;  ///< of the model
  double time = 0;  ///< of its landing, since the start of the controller, s
  SE3 X_WF;         ///< of the contact's frame in the world
};

/// Called at every instant of control, in the order of time.
class Controller {
 public:
  virtual ~Controller() = default;
  /// Torques of the motors in their order (nu, N m or N), not cut at their limits. It does not throw, and allocates
  /// nothing unless a controller says so.
  virtual void update(const Measurement& measurement, VectorRef u) = 0;
  /// The instant of its plan at which a controller is, s: feet that land early or late bring it ahead or hold it back.
  virtual double getPlanTime(double time) const { return time; }
  /// Of the feet that are to land within the time for which a controller plans; empty if it plans nothing itself.
  virtual const std::vector<PredictedFoothold>& getFootholds() const {
    static const std::vector<PredictedFoothold> none;
    return none;
  }
};

}  // namespace bielle
