#pragma once
// A controller whose model has fewer joints than the robot: the same mechanism cut elsewhere (dynamics/ball_cuts.h).
#include <memory>

#include "bielle/control/controller.h"

namespace bielle {

// Hands the states of those joints over, and the torques back. Allocates nothing.
class RestrictedController : public Controller {
 public:
  // \param model  of `inner`; its joints and motors are some of the robot's, by name and in the same order
  RestrictedController(const Model& robot, const Model& model, std::unique_ptr<Controller> inner);
  void update(const Measurement& measurement, VectorRef u) override;
  double getPlanTime(double time) const override { return inner_->getPlanTime(time); }
  const std::vector<PredictedFoothold>& footholds() const override { return inner_->footholds(); }

 private:
  const std::unique_ptr<Controller> inner_;
  const std::vector<int> coordinates_, dofs_;
  Measurement measurement_;
};

}  // namespace bielle
