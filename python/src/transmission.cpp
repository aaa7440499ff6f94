#include <pybind11/stl.h>

#include "bielle/dynamics/ratio.h"
#include "bind.h"
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

}  // namespace

void bindTransmission(py::module_& module) {
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
