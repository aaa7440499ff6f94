#pragma once
/// \file A controller that takes a closed robot for its serial model, as most do.
///
/// It measures the joints that the serial model has, and requests torques tau of those joints. With R the ratio of the motors to
/// the joints (bielle/dynamics/ratio.h) the motors of the closed robot are given
///
///     u = R^{-T} tau                                                                                                (1)
///
/// Belief::Serial takes R of the posture that is measured: the linkages pass torques on as they do, but weigh nothing and have
/// no rotors, as in the paper. Belief::Ratio takes R where the robot stands, as if linkages were gears, and the rotors as they
/// appear at the joints there.
///
/// With generated maps (worlds/generated_maps.h), joints and their speeds are those that the maps make of the motors', and Eq. (1) is
/// theirs.
#include <memory>
#include <optional>
#include <string>

#include "bielle/control/controller.h"
#include "bielle/control/policy.h"
#include "bielle/motion/serial_model.h"
#include "worlds/generated_maps.h"

namespace bielle {
class PostureLift;
}

namespace bielle::worlds {

class SerialController : public Controller {
 public:
  /// \param inner  controls the serial model   \param maps  in place of the library's
  SerialController(const Model& closed, const SerialModel& serial, std::unique_ptr<Controller> inner, Belief belief,
                   std::optional<GeneratedMaps> maps = {});
  ~SerialController() override;

  /// Allocates. At a dead point, where Eq. (1) has no solution, R is that of the last posture away from one.
  void update(const Measurement& measurement, VectorRef u) override;
  double getPlanTime(double time) const override { return inner_->getPlanTime(time); }
  const std::vector<PredictedFoothold>& footholds() const override { return inner_->footholds(); }
  const GeneratedMaps* maps() const { return maps_ ? &*maps_ : nullptr; }

 private:
  const Model closed_;
  const SerialModel serial_;
  const std::unique_ptr<Controller> inner_;
  const Belief belief_;
  std::optional<GeneratedMaps> maps_;
  // Without them.
  std::unique_ptr<PostureLift> posture_;
  MatrixXd R_;  // nu x nu
};

/// What a plan of the serial model means to the closed robot.
struct SerialReference {
  std::optional<Policy>
      policy;  ///< without gains: states and torques by Eq. (1); those of motors by the maps, where there are some
  double first_missed = -1;  ///< when linkages first cannot follow, s; negative: they can
  std::string message;       ///< why not
};
/// Where linkages cannot follow, they stay as they last could. \param plan  of the serial model
SerialReference makeReference(const Model& closed, const SerialModel& serial, const Policy& plan, Belief belief,
                              std::optional<GeneratedMaps> maps = {});

}  // namespace bielle::worlds
