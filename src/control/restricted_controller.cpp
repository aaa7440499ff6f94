#include "control/restricted_controller.h"

#include "bielle/motion/serial_model.h"

namespace bielle {
namespace {

void restrictTo(const std::vector<int>& places, const VectorXd& from, VectorXd& to) {
  for (size_t i = 0; i < places.size(); ++i) to[static_cast<Eigen::Index>(i)] = from[places[i]];
}

}  // namespace

RestrictedController::RestrictedController(const Model& robot, const Model& model, std::unique_ptr<Controller> inner)
    : inner_(std::move(inner)),
      coordinates_(findRestrictedCoordinates(robot, model)),
      dofs_(findRestrictedDofs(robot, model)) {
  measurement_.q.resize(model.nq());
  measurement_.v.resize(model.nv());
  measurement_.contacts.reserve(model.contacts().size());
}

void RestrictedController::update(const Measurement& measurement, VectorRef u) {
  measurement_.time = measurement.time;
  measurement_.delay = measurement.delay;
  measurement_.contacts = measurement.contacts;
  restrictTo(coordinates_, measurement.q, measurement_.q);
  restrictTo(dofs_, measurement.v, measurement_.v);
  inner_->update(measurement_, u);
}

}  // namespace bielle
