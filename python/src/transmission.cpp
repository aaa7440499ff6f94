#include <pybind11/stl.h>

#include "bielle/dynamics/closing.h"
#include "bielle/dynamics/ratio.h"
#include "bielle/model/names.h"
#include "bind.h"
#include "busy.h"
#include "model_access.h"

namespace bielle::python {
namespace {

// A sweep with the names that its rows and columns have.
struct NamedSweep {
  std::vector<std::string> joints, motors;
  std::vector<RatioSample> samples;  // of the sweep
  std::string begin, end;
  bool full_turn = false;
};

NamedSweep sweep(const Model& model, const std::string& joint, const VectorXd& q, const SweepOptions& options) {
  const Linkage linkage = makeLinkage(model, q, {joint});
  RatioSweep found = sweepRatio(model, linkage, q, 0, options);
  NamedSweep out;
  out.joints = linkage.joint_names;
  out.motors = linkage.motor_names;
  out.samples = std::move(found.samples);
  out.begin = found.begin;
  out.end = found.end;
  out.full_turn = found.full_turn;
  return out;
}

struct NamedHeld {
  NumericalStatus status = NumericalStatus::Ok;
  double gap = 0;
  std::string joint;
};

NamedHeld name(const Model& model, const HeldResult& result) {
  return {result.status, result.gap, result.joint < 0 ? "" : model.joints()[static_cast<size_t>(result.joint)].name};
}

// What starts from where it was last, with the model of its names.
class HeldCloser {
 public:
  HeldCloser(std::shared_ptr<Model> model, const py::object& q, const std::vector<std::string>& hold)
      : model_(std::move(model)), closer_(*model_, readVector(q, model_->nq(), "q"), hold) {}

  py::tuple close(const py::object& q) {
    const BusyGuard guard(is_busy_, "loop closer");
    VectorXd closed = readVector(q, model_->nq(), "q");
    const HeldResult result = closer_.close(closed);
    return py::make_tuple(makeArray(closed), name(*model_, result));
  }
  bool reset(const py::object& q) {
    const BusyGuard guard(is_busy_, "loop closer");
    return closer_.reset(readVector(q, model_->nq(), "q"));
  }

 private:
  std::shared_ptr<Model> model_;
  LoopCloser closer_;
  std::atomic<bool> is_busy_{false};
};

class HeldMap {
 public:
  HeldMap(std::shared_ptr<Model> model, const py::object& q)
      : model_(std::move(model)), map_(*model_, readVector(q, model_->nq(), "q")) {}

  py::tuple getMotors(const py::object& joints) {
    const BusyGuard guard(is_busy_, "linkage map");
    VectorXd out(model_->nu());
    const HeldResult result = map_.calcMotors(readVector(joints, model_->nu(), "joints"), out);
    return py::make_tuple(makeArray(out), name(*model_, result));
  }
  py::tuple getJoints(const py::object& motors) {
    const BusyGuard guard(is_busy_, "linkage map");
    VectorXd out(model_->nu());
    const HeldResult result = map_.calcJoints(readVector(motors, model_->nu(), "motors"), out);
    return py::make_tuple(makeArray(out), name(*model_, result));
  }
  bool reset(const py::object& q) {
    const BusyGuard guard(is_busy_, "linkage map");
    return map_.reset(readVector(q, model_->nq(), "q"));
  }
  py::array q() {
    const BusyGuard guard(is_busy_, "linkage map");
    return makeArray(map_.q());
  }
  std::vector<std::string> jointNames() const {
    std::vector<std::string> names;
    for (int joint : map_.joints()) names.push_back(model_->joints()[static_cast<size_t>(joint)].name);
    return names;
  }
  std::vector<std::string> motorNames() const { return getNames(model_->motors()); }

 private:
  std::shared_ptr<Model> model_;
  LinkageMap map_;
  std::atomic<bool> is_busy_{false};
};

void bindClosing(py::module_& module) {
  Value<NamedHeld>(module, "HeldResult", "Whether held coordinates are where they are asked to be.")
      .field("status", &NamedHeld::status,
             "NumericalStatus: OK; NEAR_DEAD_POINT: they are, but hardly determine the linkage there; NOT_CLOSED: they "
             "are "
             "at the nearest values in reach; NOT_FINITE")
      .field("gap", &NamedHeld::gap, "the largest distance from what is asked for, rad or m")
      .field("joint", &NamedHeld::joint, "name of the joint that has it, or empty");
  py::class_<HeldCloser>(
      module, "LoopCloser",
      "Closes one configuration after the other while some joints are held, each from the one before it.")
      .def(py::init<std::shared_ptr<Model>, const py::object&, const std::vector<std::string>&>(), py::arg("model"),
           py::arg("q"), py::arg("hold"),
           "q: a closed configuration (nq,) to start from; hold: names of joints of any kind. Raises InputError "
           "when q is open, or there is no such joint.")
      .def("close", &HeldCloser::close, py::arg("q"),
           "(q closed (nq,), HeldResult): held joints stay; what is out of reach is at the nearest value in reach.")
      .def("reset", &HeldCloser::reset, py::arg("q"),
           "Starts from another closed configuration (nq,); False, and nothing changes, if it is open.");
  py::class_<HeldMap>(
      module, "LinkageMap",
      "Positions of all motors for those of the joints that they drive, and back; each call starts from "
      "the configuration of the one before it.")
      .def(py::init<std::shared_ptr<Model>, const py::object&>(), py::arg("model"), py::arg("q"),
           "q: a closed configuration (nq,) to start from. Raises InputError when it is open, or a linkage has not as "
           "many "
           "serial joints as motors.")
      .def("motors", &HeldMap::getMotors, py::arg("joints"),
           "(positions of the motors (nu,), HeldResult) for those of the joints (nu,), rad or m.")
      .def("joints", &HeldMap::getJoints, py::arg("motors"),
           "(positions of the joints (nu,), HeldResult) for those of the motors (nu,), rad or m.")
      .def("reset", &HeldMap::reset, py::arg("q"),
           "Starts from another closed configuration (nq,); False, and nothing changes, if it is open.")
      .def_property_readonly("joint_names", &HeldMap::jointNames, "in the order of the joints")
      .def_property_readonly("motor_names", &HeldMap::motorNames, "in the order of the motors, that of u")
      .def_property_readonly("q", &HeldMap::q, "configuration (nq,) of the last call");
}

}  // namespace

void bindTransmission(py::module_& module) {
  bindClosing(module);
  py::enum_<DeadPointKind>(module, "DeadPointKind")
      .value("NONE", DeadPointKind::None)
      .value("OUTPUT", DeadPointKind::Output)
      .value("MOTORS", DeadPointKind::Motors);
  Value<LinkageRatio>(module, "LinkageRatio", "Speeds of the motors of a linkage by those of its joints, v_M = R v_J.")
      .field("R", &LinkageRatio::R, "(m, m), row of the motor, column of the joint")
      .field("dR", &LinkageRatio::dR, "derivatives of R by each joint, m of (m, m)")
      .field("condition", &LinkageRatio::condition, "largest over smallest singular value of R");
  Value<RatioSample>(module, "RatioSample", "A linkage at one configuration of a sweep.")
      .field("s", &RatioSample::s, "length along the curve from the start, rad or m")
      .field("branch", &RatioSample::branch, "counted by dead points of the output from the start")
      .field("joints", &RatioSample::joints, "angles of the linkage's joints (m,), rad or m")
      .field("motors", &RatioSample::motors, "angles of its motors (m,), rad or m")
      .field("ratio", &RatioSample::ratio, "at a dead point of the output: infinite")
      .field("dead", &RatioSample::dead, "DeadPointKind")
      .field("loses_rank", &RatioSample::loses_rank, "the loops can continue in several ways")
      .field("q", &RatioSample::q, "configuration of the cluster; empty for a motor on the joint");
  Value<NamedSweep>(module, "RatioSweep", "The reduction ratio of a linkage along the motion of one joint.")
      .field("joints", &NamedSweep::joints, "names, the swept one first")
      .field("motors", &NamedSweep::motors, "names")
      .field("samples", &NamedSweep::samples, "in increasing s, dead points included")
      .field("begin", &NamedSweep::begin, "why the curve begins there")
      .field("end", &NamedSweep::end, "why it ends there")
      .field("full_turn", &NamedSweep::full_turn, "both ends are the same configuration");
  module.def(
      "sweep_ratio",
      [](const Model& model, const std::string& joint, const py::object& q, double step, double length) {
        const VectorXd start = readVector(q, model.nq(), "q");
        SweepOptions options;
        options.step = step;
        options.length = length;
        const py::gil_scoped_release release;
        return sweep(model, joint, start, options);
      },
      py::arg("model"), py::arg("joint"), py::arg("q"), py::arg("step") = SweepOptions().step,
      py::arg("length") = SweepOptions().length,
      "Moves a joint through its range from the closed configuration q (nq,), other joints of its linkage held.\n\n"
      "step: largest along the curve, rad or m. Raises InputError when no linkage drives the joint.");
}

}  // namespace bielle::python
