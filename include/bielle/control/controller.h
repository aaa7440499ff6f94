#pragma once
/// \file The interface of feedback laws: from measurements to torques.
#include "bielle/model/model.h"

namespace bielle {

/// The measured state of a robot at an instant of control.
struct Measurement {
  double time = 0;  ///< since the start of the controller, s
  VectorXd q, v;    ///< nq, nv: coordinates of the model, from an estimator or a simulated world
  /// Per contact of the model, whether it is believed to stand; empty: not known.
  std::vector<char> contacts{};
  double delay = 0;  ///< from `time` until the torques computed from this act, s

  double actionTime() const { return time + delay; }  ///< when they act, s
};

/// The predicted next foothold of a foot.
struct PredictedFoothold {
  int contact = 0;  ///< index into the model's contacts
  double time = 0;  ///< of its landing, since the start of the controller, s
  SE3 X_WF;         ///< of the contact's frame in the world
};

/// Called at every instant of control, in the order of time.
class Controller {
 public:
  virtual ~Controller() = default;
  /// Torques of the motors in their order (nu, N m or N), not limited. Does not throw, and allocates nothing unless a
  /// controller's documentation says otherwise.
  virtual void update(const Measurement& measurement, VectorRef u) = 0;
  /// The current time in the controller's plan, s. Early landings advance it, late ones hold it back.
  virtual double getPlanTime(double time) const { return time; }
  /// For the feet that land within the controller's horizon; empty if it does not plan.
  virtual const std::vector<PredictedFoothold>& footholds() const {
    static const std::vector<PredictedFoothold> none;
    return none;
  }
};

}  // namespace bielle
