// Robots out into every format that is also read, and in again, with the same loops and numbers. Random mechanisms,
// and plane four-bars and parallelograms of hinges anywhere in space, whose rows are redundant.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/closure.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "formats/drake.h"
#include "formats/mjcf.h"
#include "formats/sdf.h"
#include "formats/usd.h"
#include "math/settled.h"
#include "math/so3.h"
#include "mechanisms.h"
#include "model/number_text.h"
#include "own_robots.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

// A plane four-bar in any plane, closed by a hinge whose five rows leave its motion three of them: crank, coupler and rocker on
// random bars (Grashof or not), with random masses. \param is_parallelogram  whose pins stay in line with its bars
Mechanism makeFourBarInSpace(std::mt19937& rng, bool is_parallelogram) {
  std::uniform_real_distribution<double> length(0.1, 0.5), angle(0.4, 2.4);
  const Vector3d normal = randomVector(rng, 3).normalized();
  const Matrix3d R = makeAxisRotation(randomVector(rng, 3).normalized(), angle(rng));
  const Vector3d u = normal.unitOrthogonal(), w = normal.cross(u), start = randomVector(rng, 3);
  double crank = 0, coupler = 0, rocker = 0, ground = 0, turn = 0, reach = 0;
  do {
    crank = length(rng), ground = length(rng), turn = angle(rng);
    coupler = is_parallelogram ? ground : length(rng), rocker = is_parallelogram ? crank : length(rng);
    reach = std::sqrt(crank * crank + ground * ground - 2 * crank * ground * std::cos(turn));
  } while (!(reach < 0.95 * (coupler + rocker) && reach > 1.05 * std::abs(coupler - rocker)));
  const auto place = [&](double x, double y) { return Vector3d(start + R * (x * u + y * w)); };
  const Vector3d A = place(0, 0), D = place(ground, 0), B = place(crank * std::cos(turn), crank * std::sin(turn));
  const double along = (reach * reach + coupler * coupler - rocker * rocker) / (2 * reach);
  const double across = std::sqrt(std::max(0.0, coupler * coupler - along * along));
  const Vector3d way = (D - B).normalized(), axis = R * normal;
  const Vector3d side = (is_parallelogram ? -1 : 1) * way.cross(axis);
  const Vector3d C = is_parallelogram ? Vector3d(B + D - A) : Vector3d(B + along * way + across * side);
  ModelBuilder builder("four_bar");
  // Each link in a frame of its own, turned at random; all angles are zero where they are drawn.
  std::map<std::string, SE3> X;
  const auto add = [&](const std::string& link, const std::string& parent, const Vector3d& pivot) {
    X[link] = {exp3(Vector3d(randomVector(rng, 3))), pivot};
    Joint joint;
    joint.name = link + "_joint";
    joint.kind = JointKind::Revolute;
    joint.X_PJ = parent == "world" ? X[link] : X[parent].inverse() * X[link];
    joint.axis = X[link].R.transpose() * axis;
    builder.addLink(link, parent, joint, randomInertia(rng));
  };
  add("crank", "world", A), add("coupler", "crank", B), add("rocker", "world", D);
  const SE3 X_pin(exp3(Vector3d(randomVector(rng, 3))), C);
  builder.addFrame("pin_1", "coupler", X["coupler"].inverse() * X_pin);
  builder.addFrame("pin_2", "rocker", X["rocker"].inverse() * X_pin);
  builder.addClosure("pin", ClosureKind::Hinge5D, "pin_1", "pin_2", X_pin.R.transpose() * axis);
  builder.addMotor({"crank_joint", 0, 0, 1e-3, 10 * length(rng), 7, {}, 1e9, {}});
  builder.addSerialJoint("rocker_joint");
  const Model model = builder.build();
  return {model, VectorXd::Zero(model.nv())};
}

Mechanism makeAny(std::mt19937& rng, int i) {
  const std::vector<MechanismKind>& kinds = listMechanismKinds();
  const MechanismKind& kind = kinds[static_cast<size_t>(i / 4) % kinds.size()];
  if (i % 4 == 0) return makeFourBarInSpace(rng, false);
  if (i % 4 == 1) return makeFourBarInSpace(rng, true);
  if (i % 4 == 2) return makeRandomMechanism(rng, kind.joint, kind.closure, kind.base);
  return makeSprungMechanism(rng, kind.joint, kind.closure, kind.base);
}

double calcGap(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  return calcLargestGap(ws, makeConstraintSet(model));
}

// Lengths, masses and limits of two models: a writer of fewer digits rounds once and never again, so that texts do not tell.
void checkLengths(const Model& a, const Model& b) {
  for (int i = 1; i < a.numBodies(); ++i) {
    const Joint& joint = a.joints()[static_cast<size_t>(i)];
    CAPTURE(joint.name);
    const int j = b.findJoint(joint.name);
    REQUIRE(j > 0);
    const Joint& other = b.joints()[static_cast<size_t>(j)];
    const Inertia &own = a.bodies()[static_cast<size_t>(i)].inertia, &back = b.bodies()[static_cast<size_t>(j)].inertia;
    CHECK(other.X_PJ.p == joint.X_PJ.p);
    CHECK((other.X_PJ.R - joint.X_PJ.R).cwiseAbs().maxCoeff() < kSettled);
    CHECK(back.mass == own.mass);
    CHECK(back.com == own.com);
    for (int r = 0; r < 3; ++r)  // one half, which may differ from the other by rounding
      for (int c = r; c < 3; ++c) CHECK(back.I_com(r, c) == own.I_com(r, c));
  }
  REQUIRE(a.closures().size() == b.closures().size());
  for (size_t c = 0; c < a.closures().size(); ++c) {
    const Closure &own = a.closures()[c], &back = b.closures()[c];
    CHECK((back.X_B1.p == own.X_B1.p && back.X_B2.p == own.X_B2.p && back.offset == own.offset));
  }
}

}  // namespace

TEST_CASE(
    "robots of any kind come back from URDF and YAML: they close, and every number but rotations is the same bits",
    "[sweep]") {
  const int count = std::getenv("BIELLE_SWEEP") ? 1000 : 30;
  int refused = 0, redundant = 0;
  for (int i = 0; i < count; ++i) {
    CAPTURE(i);
    std::mt19937 rng(static_cast<unsigned>(i));
    const Mechanism mechanism = makeAny(rng, i);
    RobotText text;
    try {
      text = formatRobot(mechanism.model);
    } catch (const InputError&) {  // a universal joint that files cannot express
      ++refused;
      continue;
    }
    const RobotDirectory directory;
    const Model model = loadRobot(directory.writeRobot(text.urdf, text.yaml)).model;
    REQUIRE(model.nq() == mechanism.model.nq());
    CHECK(calcGap(model, mechanism.q_closed) < 1e-11);
    checkLengths(mechanism.model, model);
    const Mobility mobility = calcMobility(model, mechanism.q_closed);
    redundant += mobility.rank < mobility.rows;
    if (i % 10 == 0) CHECK(findClosedConfiguration(model).status == NumericalStatus::Ok);
  }
  CHECK(redundant >= count / 2 - 1);
  CHECK(refused <= count / 3);
}

TEST_CASE("four-bars in any plane come back from MJCF, Drake's URDF and SDF with their motion", "[sweep]") {
  const int count = std::getenv("BIELLE_SWEEP") ? 200 : 8;
  for (int i = 0; i < count; ++i) {
    std::mt19937 rng(static_cast<unsigned>(i));
    const Mechanism mechanism = makeFourBarInSpace(rng, i % 2 == 1);
    const Model& model = mechanism.model;
    const RobotDirectory directory;
    for (const std::string& file : {directory.write("mjcf/robot.xml", formatMjcf(model, mechanism.q_closed).xml),
                                    directory.write("drake/robot.urdf", formatDrake(model).urdf),
                                    directory.write("sdf/robot.sdf", formatSdf(model, mechanism.q_closed).xml)}) {
#ifndef BIELLE_READS_SDF
      if (file.rfind(".sdf") != std::string::npos) continue;
#endif
      CAPTURE(i, file);
      const Model back = loadRobot(file).model;
      const AssemblyResult closed = findClosedConfiguration(back);
      REQUIRE(closed.status == NumericalStatus::Ok);
      CHECK(calcMobility(back, closed.q).mobility == (back.hasFreeFlyer() ? 7 : 1));
      CHECK(back.mass() == Approx(model.mass()).epsilon(1e-15));
    }
  }
}

namespace {

// How far centres of mass and moments of inertia of two models are apart where joints of the same names are at the same coordinates,
// over the size of the robot and over themselves: independent of the frames that a format gives to bodies. Masses are the same bits.
struct Deviation {
  double place = 0, inertia = 0;
};

// Where the file counts its coordinates from: ours, the posture that it is written in, or those of its keyframe.
enum class Origin { Neutral, Posture, Keyframe };

// Empty where a joint is several in the file, or has another name. A free base may stand elsewhere.
std::optional<Deviation> compareBodies(const Model& a, ConstVectorRef q, const Model& b, Origin origin) {
  VectorXd q_back = b.makeNeutral();
  for (int i = 1; i < a.numBodies(); ++i) {
    const Joint& from = a.joints()[static_cast<size_t>(i)];
    const int j = b.findJoint(from.name);
    if (j < 0 || b.joints()[static_cast<size_t>(j)].nq != from.nq) return {};
    const Joint& to = b.joints()[static_cast<size_t>(j)];
    if (origin == Origin::Neutral) q_back.segment(to.idx_q, to.nq) = q.segment(from.idx_q, from.nq);
    if (origin != Origin::Keyframe) continue;
    const std::vector<double>& given = b.references().front().joints.at(from.name);
    q_back.segment(to.idx_q, to.nq) = VectorXd::Map(given.data(), to.nq);
  }
  Workspace own(a), back(b);
  updatePositions(a, own, q);
  updatePositions(b, back, q_back);
  const auto get = [](const Model& model, const Workspace& ws, int body) {
    return model.bodies()[static_cast<size_t>(body)].inertia.transformed(getPlacement(ws, body, SE3()));
  };
  SE3 moved;
  if (a.hasFreeFlyer())
    moved = getPlacement(own, 1, SE3()) * getPlacement(back, b.findJoint(a.joints()[1].name), SE3()).inverse();
  double size = 0;
  for (int i = 1; i < a.numBodies(); ++i) size = std::max(size, get(a, own, i).com.norm());
  Deviation out;
  for (int i = 1; i < a.numBodies(); ++i) {
    const int j = b.findJoint(a.joints()[static_cast<size_t>(i)].name);
    const Inertia x = get(a, own, i), y = get(b, back, j).transformed(moved);
    CHECK(x.mass == y.mass);
    out.place = std::max(out.place, (x.com - y.com).norm() / size);
    out.inertia = std::max(out.inertia, (x.I_com - y.I_com).norm() / x.I_com.norm());
  }
  return out;
}

}  // namespace

TEST_CASE("robots of any kind come back from MJCF, Drake's URDF, SDF and USD to rounding, and their masses to the bit",
          "[sweep]") {
  constexpr double kRounding =
      2e-14;  // of frames and principal axes that are composed with others: a hundred units in the last place
  const int count = std::getenv("BIELLE_SWEEP") ? 300 : 40;
  std::map<std::string, int> compared;
  for (int i = 0; i < count; ++i) {
    std::mt19937 rng(static_cast<unsigned>(i));
    const Mechanism mechanism = makeAny(rng, i);
    const Model& model = mechanism.model;
    const VectorXd& q = mechanism.q_closed;
    const RobotDirectory directory;
    const auto check = [&](const std::string& format, Origin origin, const auto& write) {
      CAPTURE(i, format);
      std::string file;
      try {
        file = write();
      } catch (const InputError&) {  // a joint or closure that the format does not have
        return;
      }
      const auto deviation = compareBodies(model, q, loadRobot(file).model, origin);
      if (!deviation) return;
      ++compared[format];
      CHECK(deviation->place < kRounding);
      CHECK(deviation->inertia < kRounding);
    };
    check("mjcf", Origin::Keyframe, [&] { return directory.write("mjcf/robot.xml", formatMjcf(model, q).xml); });
    check("drake", Origin::Neutral, [&] { return directory.write("drake/robot.urdf", formatDrake(model).urdf); });
    check("usd", Origin::Neutral, [&] { return directory.write("usd/robot.usda", formatUsd(model, q).usda); });
#ifdef BIELLE_READS_SDF
    check("sdf", Origin::Posture, [&] { return directory.write("sdf/robot.sdf", formatSdf(model, q).xml); });
#endif
  }
  for (const auto& [format, robots] : compared) {
    CAPTURE(format);
    CHECK(robots > 0.6 * count);
  }
  CHECK(compared.size() >= 3);
}

namespace {

const std::string kBetween = "\n<!-- YAML -->\n";  // of two files in one text

struct Format {
  const char *name, *file;  // and the file that is read
  std::function<std::string(const Model&)> write;
};

std::vector<Format> listFormats() {
  const auto close = [](const Model& model) { return findClosedConfiguration(model).q; };
  return {{"bielle", "robot.urdf",
           [](const Model& model) {
             const RobotText text = formatRobot(model);
             return text.urdf + kBetween + text.yaml;
           }},
          {"urdf", "robot.urdf", [](const Model& model) { return formatUrdf(model).urdf; }},
          {"drake", "robot.urdf", [](const Model& model) { return formatDrake(model).urdf; }},
          {"mjcf", "robot.xml", [=](const Model& model) { return formatMjcf(model, close(model)).xml; }},
#ifdef BIELLE_READS_SDF
          {"sdf", "robot.sdf", [=](const Model& model) { return formatSdf(model, close(model)).xml; }},
#endif
          {"usd", "robot.usda", [=](const Model& model) { return formatUsd(model, close(model)).usda; }}};
}

Model readBack(const Format& format, const std::string& text) {
  const RobotDirectory directory;
  const size_t between = text.find(kBetween);
  if (between != std::string::npos)
    return loadRobot(directory.writeRobot(text.substr(0, between), text.substr(between + kBetween.size()))).model;
  return loadRobot(directory.write(format.file, text)).model;
}

// The first line of two texts that differs.
std::string findDifference(const std::string& a, const std::string& b) {
  std::istringstream one(a), other(b);
  std::string x, y;
  while (std::getline(one, x))
    if (!std::getline(other, y) || x != y) return x + "\nand\n" + y;
  return std::getline(other, y) ? "the end and\n" + y : "";
}

}  // namespace

// The second file, since formats that have no name for a frame of a loop, or other joints, are written with those that their readers
// make; from then on nothing changes. A format that loses nothing of these robots has the same bytes from the first file on.
TEST_CASE("what is read and written, and then read and written again, is the same to the byte in every format",
          "[sweep]") {
  const int count = std::getenv("BIELLE_SWEEP") ? 1000 : 30;
  std::vector<Model> models;
  for (const char* robot : {"bipetto", "cleobot", "belt_biped", "rsu_biped", "fivebar", "delta", "spring_leg"})
    models.push_back(loadOwn(robot).model);
  for (int i = 0; i < count; ++i) {
    std::mt19937 rng(static_cast<unsigned>(i));
    models.push_back(makeAny(rng, i).model);
  }
  for (const Format& format : listFormats()) {
    int written = 0;
    for (size_t i = 0; i < models.size(); ++i) {
      CAPTURE(format.name, i, models[i].name());
      std::string first;
      try {
        first = format.write(models[i]);
      } catch (const InputError&) {  // a joint or closure that the format does not have
        continue;
      }
      ++written;
      const std::string second = format.write(readBack(format, first));
      CHECK(findDifference(second, format.write(readBack(format, second))) == "");
      if (format.name == std::string("bielle")) CHECK(findDifference(first, second) == "");
    }
    CAPTURE(format.name);
    CHECK(written > static_cast<int>(models.size()) / 3);
  }
}
