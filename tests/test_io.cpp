// Oracles: Python's own reader of ZIP files and numbers, the dynamics called directly, files read back to the last bit.
#include <fcntl.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/squat.h"
#include "bielle/results/result.h"
#include "bielle/robots/robot_loader.h"
#include "formats/text_file.h"
#include "get_error.h"
#include "get_error_of_reading.h"
#include "problem_probe.h"
#include "results/npz.h"
#include "results/opensim.h"
#include "results/plot.h"
#include "robot_directory.h"
#include "short_squat.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;

namespace {

bool areEqual(const Multipliers& a, const Multipliers& b) {
  return a.penalty == b.penalty && a.values.size() == b.values.size() &&
         std::equal(a.values.begin(), a.values.end(), b.values.begin(),
                    [](const VectorXd& x, const VectorXd& y) { return x.size() == y.size() && x == y; });
}

}  // namespace

TEST_CASE("coordinate names have the sizes of q and v, and name one-coordinate joints by themselves") {
  const Model model = loadRobot("bipetto").model;
  const std::vector<std::string> q = makePositionNames(model), v = makeVelocityNames(model);
  REQUIRE(static_cast<int>(q.size()) == model.nq());
  REQUIRE(static_cast<int>(v.size()) == model.nv());
  CHECK(q[0] == "root_joint.x");
  CHECK(q[6] == "root_joint.qw");
  CHECK(v[3] == "root_joint.wx");
  const Joint& knee = model.joints()[model.findJoint("knee_right")];
  CHECK(q[knee.idx_q] == "knee_right");
  const Joint& rod = model.joints()[model.findJoint("transmission_knee_right")];
  CHECK(q[rod.idx_q + 3] == "transmission_knee_right.qw");
  CHECK(v[rod.idx_v + 2] == "transmission_knee_right.wz");
  CHECK(findColumn(v, "transmission_knee_right.wz") == rod.idx_v + 2);
  CHECK_THROWS_AS(findColumn(v, "transmission_knee_right"), InputError);
}

TEST_CASE("a record holds what the dynamics say at each node") {
  const ShortSquat squat;
  const Model& model = squat.robot.model;
  const MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  const int stages = squat.motion.problem->numStages();
  REQUIRE(record.time.size() == stages + 1);
  CHECK(record.time[stages] == Approx(0.12));
  const int k = 2;
  const VectorXd x = squat.motion.guess.xs[k], q = x.head(model.nq()), v = x.tail(model.nv());
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const ConstraintSet& set = squat.motion.problem->spec(k).constraints;
  REQUIRE(updateConstrainedDynamics(model, ws, cws, set, q, v, calcMotorForces(model, squat.motion.guess.us[k])) ==
          NumericalStatus::Ok);
  CHECK((record.a.row(k).transpose() - cws.a).norm() < 1e-9 * cws.a.norm());
  CHECK(record.closure_wrenches.cols() == 36);
  // The wrenches by name do the work of the rows of lambda.
  VectorXd forces = VectorXd::Zero(model.nv());
  for (size_t c = 0; c < set.closures.size(); ++c) {
    const bool loop = static_cast<int>(c) < set.num_loops;
    const auto& names = loop ? record.closure_names : record.contact_names;
    const auto index = std::find(names.begin(), names.end(), set.closures[c].name) - names.begin();
    const Vector6d wrench =
        (loop ? record.closure_wrenches : record.contact_wrenches).row(k).segment<6>(6 * index).transpose();
    MatrixXd J = MatrixXd::Zero(getRows(set.closures[c].kind), model.nv());
    calcClosureJacobian(ws, set.closures[c], J);
    forces += J.transpose() * wrench;
  }
  const VectorXd expected = cws.J.transpose() * cws.lambda;
  CHECK((forces - expected).norm() < 1e-9 * expected.norm());
  CHECK((record.com.row(k).transpose() - calcCom(model, ws)).norm() < 1e-14);
  CHECK(record.gap.row(k).maxCoeff() >= calcLargestGap(ws, makeConstraintSet(model)));
}

// A record with numbers that need all their digits, and names that CSV must quote.
MotionRecord makeHardRecord(StepRule step = StepRule::Euler) {
  const ShortSquat squat(step);
  MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  record.v(0, 0) = 1.0 / 3;
  record.v(0, 1) = -0.0;
  record.v(0, 2) = 5e-324;
  record.v(0, 3) = 1.7976931348623157e308;
  record.closure_names[0] = "a, \"quoted\" name";
  record.closure_names[1] = "bièlle";
  return record;
}

TEST_CASE("trajectories come back from NumPy files to the last bit") {
  const TemporaryDirectory directory;
  const MotionRecord record = makeHardRecord();
  writeNpz(directory / "t.npz", record);
  checkEqual(readRecord(directory / "t.npz"), record);
  MotionRecord other = record;
  other.u(1, 1) = std::nextafter(other.u(1, 1), 1e9);
  CHECK_FALSE(areEqual(other.u, record.u));  // the comparison sees the last bit
}

TEST_CASE("a record whose tables do not fit its names and times is refused by name, not read beyond its end") {
  const ShortSquat squat;
  const MotionRecord whole = makeRecord(squat.motion, squat.motion.guess);
  const auto check = [&](const char* array, const std::function<void(MotionRecord&)>& spoil) {
    MotionRecord record = whole;
    spoil(record);
    for (const auto& write : {writeCsv, writeNpz})
      CHECK_THAT(getError([&] { write(TemporaryDirectory() / "t", record); }),
                 Catch::Contains("record, array '" + std::string(array) + "'"));
  };
  check("time", [](MotionRecord& r) { r = MotionRecord(); });
  check("q", [](MotionRecord& r) { r.q_names.push_back("more"); });
  check("v", [](MotionRecord& r) { r.v.conservativeResize(r.v.rows() - 1, Eigen::NoChange); });
  check("u", [](MotionRecord& r) { r.u.resize(0, 0); });
  check("contact_wrenches", [](MotionRecord& r) { r.contact_names.pop_back(); });
  check("q_mid", [](MotionRecord& r) { r.has_midpoints = true; });
  check("footholds", [](MotionRecord& r) { r.footholds.resize(1, 1); });
}

TEST_CASE("multipliers come back from NumPy files, and are refused where their rows do not fit") {
  const TemporaryDirectory directory;
  const ShortSquat squat;
  MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  CHECK(record.multipliers.penalty == 0);
  const auto write = [&] {
    writeNpz(directory / "t.npz", record);
    return directory / "t.npz";
  };
  CHECK(areEqual(readRecord(write()).multipliers, Multipliers()));
  const size_t nodes = static_cast<size_t>(record.time.size());
  for (size_t k = 0; k < nodes; ++k)
    record.multipliers.values.push_back(VectorXd::LinSpaced(static_cast<Eigen::Index>(k % 3), -1.0 / 3, 7));
  record.multipliers.penalty = 0.1;
  CHECK(areEqual(readRecord(write()).multipliers, record.multipliers));
  MotionRecord other = record;
  other.multipliers.values[2][1] = std::nextafter(other.multipliers.values[2][1], 1e9);
  CHECK_FALSE(areEqual(other.multipliers, record.multipliers));  // the comparison sees the last bit

  record.multipliers.values[2][1] = std::numeric_limits<double>::infinity();
  CHECK_THAT(getErrorOfReading(write()), Catch::Contains("'multipliers': it contains numbers that are not finite"));
  record.multipliers.values.pop_back();
  CHECK_THAT(getErrorOfReading(write()), Catch::Contains("number of multipliers of each node"));
  record.multipliers.values.assign(nodes, VectorXd(0));
  record.multipliers.penalty = std::numeric_limits<double>::infinity();
  CHECK_THAT(getErrorOfReading(write()), Catch::Contains("penalty"));
}

TEST_CASE("predicted footholds come back from NumPy files, and are refused where their shape does not fit") {
  const TemporaryDirectory directory;
  const ShortSquat squat;
  MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  const auto write = [&] {
    writeNpz(directory / "t.npz", record);
    return directory / "t.npz";
  };
  CHECK(readRecord(write()).footholds.size() == 0);
  const Eigen::Index columns = MotionRecord::kFootholdEntries * static_cast<int>(record.contact_names.size());
  REQUIRE(columns > 0);
  record.footholds = RowMatrixXd::Random(record.time.size(), columns);
  CHECK(areEqual(readRecord(write()).footholds, record.footholds));
  record.footholds(1, 1) = std::numeric_limits<double>::quiet_NaN();  // none there
  CHECK(std::isnan(readRecord(write()).footholds(1, 1)));
  NpyArrays arrays = readArchive(write());
  arrays["footholds"].shape.front() = arrays["footholds"].shape.front() * arrays["footholds"].shape[1];
  arrays["footholds"].shape[1] = 1;
  writeTextFile(directory / "t.npz", formatArchive(arrays));
  CHECK_THAT(getErrorOfReading(directory / "t.npz"), Catch::Contains("'footholds': its shape does not match"));
}

TEST_CASE("what a cycle is comes back from NumPy files, and is refused where it is none") {
  const TemporaryDirectory directory;
  const ShortSquat squat;
  MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  const auto write = [&] {
    writeNpz(directory / "t.npz", record);
    return directory / "t.npz";
  };
  CHECK(readRecord(write()).cycle.size() == 0);
  record.cycle = Eigen::Vector4d(0.8, 0.4, -0.1, 1.0 / 3);
  CHECK(readRecord(write()).cycle == record.cycle);
  record.cycle[2] = std::numeric_limits<double>::infinity();
  CHECK_THAT(getErrorOfReading(write()), Catch::Contains("'cycle'"));
  record.cycle.conservativeResize(3);
  CHECK_THAT(getError([&] { write(); }), Catch::Contains("record, array 'cycle'"));
}

TEST_CASE("midpoint steps are recorded with the points to which their accelerations belong") {
  const TemporaryDirectory directory;
  ShortSquat squat(StepRule::Midpoint);
  const MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  REQUIRE(record.has_midpoints);
  RobotEvaluator evaluator(*squat.motion.problem);
  for (int k = 0; k < squat.motion.problem->numStages(); ++k) {
    const RobotEvaluation& at = evaluator.evaluate(k, squat.motion.guess.xs[k], squat.motion.guess.us[k]);
    CHECK(record.q_mid.row(k).transpose() == at.q_mid);
    CHECK(record.v_mid.row(k).transpose() == at.v_mid);
    CHECK((record.q_mid.row(k) - record.q.row(k)).norm() > 1e-6);
  }
  writeNpz(directory / "t.npz", record);
  checkEqual(readRecord(directory / "t.npz"), record);

  const MotionResult result = makeResult({"bipetto", "/r.urdf", {}}, {squat.motion, squat.motion.guess, {}});
  writeResult(directory / "", result);
  CHECK(readSummary(directory / "").step == StepRule::Midpoint);
}

TEST_CASE("a robot without closures, motors or feet gives files that can be read back") {
  const TemporaryDirectory directory;
  MotionRecord record;
  record.q_names = record.v_names = {"pendulum"};
  record.time = VectorXd::LinSpaced(2, 0, 1);
  record.q = record.v = RowMatrixXd::Constant(2, 1, 0.5);
  record.a = RowMatrixXd::Constant(1, 1, 0.25);
  record.u = record.closure_wrenches = record.contact_wrenches = RowMatrixXd(1, 0);
  record.com = RowMatrixXd::Zero(2, 3);
  record.gap = RowMatrixXd::Zero(2, 2);
  writeNpz(directory / "t.npz", record);
  checkEqual(readRecord(directory / "t.npz"), record);
}

TEST_CASE("Python reads the NumPy archive and finds the numbers of the CSV, to the last bit") {
  const TemporaryDirectory directory;
  const MotionRecord record = makeHardRecord(GENERATE(StepRule::Euler, StepRule::Midpoint));
  writeCsv(directory / "t.csv", record);
  writeNpz(directory / "t.npz", record);
  const auto compare = [&] {
    const std::string command = std::string(BIELLE_PYTHON) + " " + BIELLE_SOURCE_DIR +
                                "/tests/compare_trajectories.py " + (directory / "t.csv") + " " +
                                (directory / "t.npz") + " > /dev/null 2>&1";
    return std::system(command.c_str());
  };
  CHECK(compare() == 0);
  MotionRecord poisoned = record;
  poisoned.contact_wrenches(2, 7) = std::nextafter(poisoned.contact_wrenches(2, 7), 1e9);
  writeNpz(directory / "t.npz", poisoned);
  CHECK(compare() != 0);
}

TEST_CASE("files of OpenSim have the rows and columns that their header tells, and no empty cell") {
  const ShortSquat squat;
  MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  record.u_names[0] = "two words\tand more";
  const auto nodes = static_cast<size_t>(record.time.size());
  const auto split = [](const std::string& text, char mark) {
    std::vector<std::string> parts;
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, mark);) parts.push_back(part);
    return parts;
  };
  for (bool all : {false, true}) {
    const std::vector<std::string> lines = split((all ? formatSto(record) : formatMot(record)).text, '\n');
    const size_t columns = 1 + record.q_names.size() +
                           (all ? 2 * record.v_names.size() + record.u_names.size() + 6 * record.closure_names.size() +
                                      6 * record.contact_names.size() + 5
                                : 0);
    REQUIRE(lines.size() == 7 + nodes);
    CHECK(lines[2] == "nRows=" + std::to_string(nodes));
    CHECK(lines[3] == "nColumns=" + std::to_string(columns));
    CHECK(lines[4] == "inDegrees=no");
    CHECK(lines[5] == "endheader");
    const std::vector<std::string> labels = split(lines[6], '\t');
    REQUIRE(labels.size() == columns);
    CHECK(labels[0] == "time");
    for (size_t k = 0; k < nodes; ++k) {
      const std::vector<std::string> cells = split(lines[7 + k], '\t');
      REQUIRE(cells.size() == columns);
      CHECK(std::stod(cells[0]) == record.time[k]);
      for (size_t i = 1; i <= record.q_names.size(); ++i) CHECK(std::stod(cells[i]) == record.q(k, i - 1));
      if (!all) continue;
      const auto motor = std::find(labels.begin(), labels.end(), "u." + record.u_names[1]) - labels.begin();
      CHECK(labels[motor - 1] == "u.two_words_and_more");
      CHECK(std::stod(cells[motor]) == record.u(std::min<Eigen::Index>(k, record.u.rows() - 1), 1));
    }
  }
}

TEST_CASE("files of OpenSim have times that increase: of nodes before and after an impact the later one") {
  const ShortSquat squat;
  MotionRecord record = makeRecord(squat.motion, squat.motion.guess);
  CHECK(formatMot(record).warnings.empty());
  const Eigen::Index impact = 3;
  for (Eigen::Index k = impact + 1; k < record.time.size(); ++k)
    record.time[k] -= record.time[impact + 1] - record.time[impact];
  record.time[impact + 1] = record.time[impact];
  record.q(impact, 0) = 5, record.q(impact + 1, 0) = 7;
  for (const OpensimText& table : {formatMot(record), formatSto(record)}) {
    std::istringstream lines(table.text);
    std::vector<double> times, first;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream cells(line);
      double time = 0, q = 0;
      if (cells >> time >> q) times.push_back(time), first.push_back(q);
    }
    REQUIRE(times.size() + 1 == static_cast<size_t>(record.time.size()));
    CHECK(table.text.find("nRows=" + std::to_string(times.size()) + "\n") != std::string::npos);
    for (size_t k = 1; k < times.size(); ++k) CHECK(times[k] > times[k - 1]);
    CHECK(first[impact] == 7);
    REQUIRE(table.warnings.size() == 1);
    CHECK_THAT(table.warnings[0], Catch::Contains("1 node(s) before impacts"));
  }
}

TEST_CASE("files that are no trajectories are refused with the file and the place") {
  const TemporaryDirectory directory;
  const ShortSquat squat;
  writeNpz(directory / "good.npz", makeRecord(squat.motion, squat.motion.guess));
  const std::string npz = readFile(directory / "good.npz");

  CHECK_THAT(getErrorOfReading(directory / "none.npz"), Catch::Contains("none.npz: file: it cannot be read"));
  writeCsv(directory / "t.csv", makeRecord(squat.motion, squat.motion.guess));
  CHECK_THAT(getErrorOfReading(directory / "t.csv"), Catch::Contains("t.csv: file: it cannot be read"));
  for (size_t size : {size_t(0), size_t(100), npz.size() / 2, npz.size() - 1}) {
    writeText(directory / "a.npz", npz.substr(0, size));
    CHECK_THAT(getErrorOfReading(directory / "a.npz"), Catch::Contains("a.npz: "));
  }
}
