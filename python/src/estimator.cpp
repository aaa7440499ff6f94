#include "bielle/control/estimator.h"

#include <pybind11/stl.h>

#include "bind.h"
#include "busy.h"
#include "model_access.h"

namespace bielle::python {
namespace {

// An estimator, with the model that it refers to.
class HeldEstimator {
 public:
  HeldEstimator(std::shared_ptr<Model> model, const py::object& q, const EstimatorOptions& options)
      : model_(std::move(model)), estimator_(*model_, readVector(q, model_->nq(), "q"), options) {}

  void reset(double time, const py::object& q, const py::object& v, const std::vector<std::string>& contacts) {
    const BusyGuard guard(is_busy_, "estimator");
    estimator_.reset(time, readVector(q, model_->nq(), "q"), readVector(v, model_->nv(), "v"), find(contacts));
  }

  NumericalStatus update(const SensorReadings& readings, const std::vector<std::string>& planned) {
    for (const VectorXd* numbers : {&readings.motor_positions, &readings.motor_torques})
      if (numbers->size() != model_->nu())
        throw py::value_error("readings: expected " + std::to_string(model_->nu()) + " numbers, one per motor, got " +
                              std::to_string(numbers->size()));
    const BusyGuard guard(is_busy_, "estimator");
    const std::vector<int> contacts = find(planned);
    const py::gil_scoped_release release;
    return estimator_.update(readings, contacts);
  }

  py::dict contacts() {
    const BusyGuard guard(is_busy_, "estimator");
    py::dict out;
    for (size_t c = 0; c < model_->contacts().size(); ++c)
      out[py::str(model_->contacts()[c].name)] = static_cast<bool>(estimator_.contacts()[c]);
    return out;
  }

  py::array getWrenches() {
    const BusyGuard guard(is_busy_, "estimator");
    RowMatrixXd out(model_->contacts().size(), 6);
    for (Eigen::Index c = 0; c < out.rows(); ++c) out.row(c) = estimator_.getWrench(static_cast<size_t>(c)).transpose();
    return makeArray(out);
  }

  template <typename Read>
  auto read(const Read& read) {
    const BusyGuard guard(is_busy_, "estimator");
    return read(estimator_);
  }

 private:
  std::vector<int> find(const std::vector<std::string>& names) const {
    std::vector<int> out;
    for (const std::string& name : names) out.push_back(findContact(*model_, name));
    return out;
  }

  std::shared_ptr<Model> model_;
  Estimator estimator_;
  std::atomic<bool> is_busy_{false};
};

void bindEstimatorOptions(py::module_& module) {
  Value<SensorReadings>(module, "SensorReadings", "Sensor readings at one instant of control.")
      .field("time", &SensorReadings::time, "s")
      .field("motor_positions", &SensorReadings::motor_positions, "(nu,), rad or m")
      .field("motor_torques", &SensorReadings::motor_torques,
             "(nu,), torques that acted since the previous instant, N m or N")
      .field("angular_velocity", &SensorReadings::angular_velocity,
             "angular velocity of the IMU in its frame (3,), rad/s")
      .field("specific_force", &SensorReadings::specific_force, "acceleration minus gravity in its frame (3,), m/s^2");
  Value<EstimatorOptions>(module, "EstimatorOptions", "Noise is one standard deviation, densities as in data sheets.")
      .field("imu", &EstimatorOptions::imu, "placement of the IMU in the trunk, SE3")
      .described();
}

}  // namespace

void bindEstimator(py::module_& module) {
  bindEstimatorOptions(module);
  py::class_<HeldEstimator>(
      module, "Estimator",
      "The state of a robot from the encoders of its motors and an IMU in its trunk: passive joints by closing the\n"
      "loops, the trunk by an invariant extended Kalman filter, contacts by the forces on the feet.")
      .def(py::init<std::shared_ptr<Model>, const py::object&, const EstimatorOptions&>(), py::arg("model"),
           py::arg("q"), py::arg("options") = EstimatorOptions(),
           "q: a closed configuration (nq,). Raises InputError when motors do not determine a joint.")
      .def("reset", &HeldEstimator::reset, py::arg("time"), py::arg("q"), py::arg("v"), py::arg("contacts"),
           "Starts from a closed state (nq,), (nv,), standing on the named contacts.")
      .def("update", &HeldEstimator::update, py::arg("readings"), py::arg("planned") = std::vector<std::string>(),
           "Processes the readings of an instant. planned: names of the contacts in the plan at this time.")
      .def_property_readonly(
          "q",
          [](HeldEstimator& e) { return e.read([](const Estimator& own) { return makeArray(own.measurement().q); }); },
          "(nq,)")
      .def_property_readonly(
          "v",
          [](HeldEstimator& e) { return e.read([](const Estimator& own) { return makeArray(own.measurement().v); }); },
          "(nv,)")
      .def_property_readonly("contacts", &HeldEstimator::contacts, "whether each contact stands, by name")
      .def_property_readonly("wrenches", &HeldEstimator::getWrenches,
                             "wrenches from the ground on the feet in their contact frames (contacts, 6), N and N m")
      .def_property_readonly(
          "margin", [](HeldEstimator& e) { return e.read([](const Estimator& own) { return own.margin(); }); },
          "the least that motors move in a unit motion of their linkage; 1 without linkages")
      .def_property_readonly(
          "message",
          [](HeldEstimator& e) { return e.read([](const Estimator& own) { return std::string(own.message()); }); },
          "message of the last status; empty if OK");
}

}  // namespace bielle::python
