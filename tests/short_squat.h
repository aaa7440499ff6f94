#pragma once
// A short squat, and records and directories to write it to.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "bielle/motion/record.h"
#include "bielle/motion/squat.h"
#include "bielle/robots/robot_loader.h"
#include "problem_probe.h"

namespace bielle::testing {

class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "bielle_io_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline void writeText(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// A short squat and its guess, moved so that nothing is zero by chance.
struct ShortSquat {
  explicit ShortSquat(StepRule step = StepRule::Euler) : robot(loadRobot("bipetto")) {
    SquatOptions options;
    options.duration = 0.12;
    options.settle = 0;
    options.time_step = 0.03;
    motion = makeSquat(robot.model, options, {Formulation::Reduced, step});
    ProblemProbe probe(*motion.problem);
    for (size_t k = 0; k < motion.guess.xs.size(); ++k) {
      VectorXd& x = motion.guess.xs[k];
      VectorXd dx = VectorXd::LinSpaced(motion.problem->tangentSize(k), -0.01, 0.02) * (0.3 + k);
      x = probe.integrate(x, dx);
      if (k < motion.guess.us.size()) motion.guess.us[k] += VectorXd::LinSpaced(robot.model.nu(), 0.1, 1.7 / 3);
    }
  }
  LoadedRobot robot;
  Motion motion;
};

inline bool areEqual(const RowMatrixXd& a, const RowMatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && (a.array() == b.array()).all();
}

inline void checkEqual(const MotionRecord& a, const MotionRecord& b) {
  CHECK(a.q_names == b.q_names);
  CHECK(a.v_names == b.v_names);
  CHECK(a.u_names == b.u_names);
  CHECK(a.closure_names == b.closure_names);
  CHECK(a.contact_names == b.contact_names);
  CHECK(areEqual(a.time, b.time));
  CHECK(areEqual(a.q, b.q));
  CHECK(areEqual(a.v, b.v));
  CHECK(areEqual(a.a, b.a));
  CHECK(areEqual(a.u, b.u));
  CHECK(areEqual(a.closure_wrenches, b.closure_wrenches));
  CHECK(areEqual(a.contact_wrenches, b.contact_wrenches));
  CHECK(a.has_midpoints == b.has_midpoints);
  CHECK(areEqual(a.q_mid, b.q_mid));
  CHECK(areEqual(a.v_mid, b.v_mid));
  CHECK(areEqual(a.com, b.com));
  CHECK(areEqual(a.gap, b.gap));
}

}  // namespace bielle::testing
