// Every row can fail: motions altered so that one of them does, and NaN.
#include "bielle/model/builder.h"
#include "check_rows.h"
#include "simbody_bridge.h"
#include "test_motions.h"

using namespace bielle;
using namespace bielle::testing;
using namespace bielle::validation;

namespace {

bool fails(const CheckReport& report, const std::string& row) { return getFailures(report).count(row) == 1; }

// The squat, falsely recorded as standing on one foot in its middle.
CheckedMotion makeLifted() {
  CheckedMotion lifted = getSquat().checked;
  const auto stances = lifted.summary.phases[0].stances;
  const double h = lifted.getTimeStep(0);
  lifted.summary.phases = {
      {"both", 0, 40, h, stances}, {"one", 40, 20, h, {stances[0]}}, {"both", 60, lifted.numStages() - 60, h, stances}};
  return lifted;
}

// Moves the base at a node by the twist d in its own frame.
void moveBase(CheckedMotion& motion, int node, const Vector6d& d) {
  VectorXd dq = VectorXd::Zero(motion.model.nv());
  dq.head<6>() = d;
  motion.record.q.row(node) = motion.model.integrate(motion.record.q.row(node).transpose(), dq);
}

// All tables of a trajectory, by name.
std::vector<std::pair<std::string, RowMatrixXd*>> listTables(MotionRecord& record) {
  return {{"q", &record.q},
          {"v", &record.v},
          {"a", &record.a},
          {"u", &record.u},
          {"closure_wrenches", &record.closure_wrenches},
          {"contact_wrenches", &record.contact_wrenches},
          {"com", &record.com},
          {"gap", &record.gap}};
}

}  // namespace

TEST_CASE("check: a value that fails is printed with the digits that tell it from its bound") {
  CheckReport report{"squat", "robot", 1, {}};
  report.rows.push_back({"over", CheckRow::Kind::AtMost, 1.0000001, 1, "1", ""});
  report.rows.push_back({"under", CheckRow::Kind::AtMost, 0.9999999, 1, "1", ""});
  report.rows.push_back({"aside", CheckRow::Kind::Goal, 0.70001, 0.7, "1", "", 1e-6});
  std::ostringstream out;
  printReport(out, report);
  CHECK_THAT(out.str(), Catch::Contains("1.0000001  <= 1.0000000 1           FAIL") &&
                            Catch::Contains("1.0000  <= 1.0000   1           pass") &&
                            Catch::Contains("0.70001  == 0.70000  1           MISS"));
}

TEST_CASE("check: shapes of the files are judged, those fitted to visuals inform") {
  const CheckedMotion good = getSquat().checked;
  const Model& model = good.model;
  const char* const legs = "shapes: between the legs";
  const char* const ground = "shapes: from the ground";
  const CheckReport fitted = checkMotion(good);
  for (const char* row : {legs, ground}) {
    CAPTURE(row);
    REQUIRE(fitted.findRow(row));
    CHECK(fitted.findRow(row)->kind == CheckRow::Kind::Note);
    CHECK(fitted.findRow(row)->value);
  }
  const auto check = [&](double radius) {
    CheckedMotion motion = good;
    ModelParts parts = takeParts(model);
    for (const char* joint : {"knee_left", "knee_right"}) {
      Shape ball;
      ball.body = model.findJoint(joint);
      ball.radius = radius;
      parts.shapes.push_back(ball);
    }
    motion.model = ModelBuilder::restore(parts);
    return checkMotion(motion);
  };
  const CheckReport narrow = check(0.01);
  CHECK(narrow.passed());
  for (const char* row : {legs, ground}) CHECK(narrow.findRow(row)->kind == CheckRow::Kind::AtLeast);
  const CheckReport wide = check(0.16);  // the knees are 0.283 m apart and stay 0.178 m over the ground
  CHECK(getFailures(wide) == Names{legs});
  CHECK(*wide.findRow(legs)->value == Approx(*narrow.findRow(legs)->value - 2 * (0.16 - 0.01)));
  CHECK(getFailures(check(0.5)) == Names{legs, ground});
}

TEST_CASE("check: a number that is none fails in every column, and one that overflows in what is made of it") {
  const CheckedMotion good = getSquat().checked;
  CheckedMotion motion = good;
  for (const auto& [name, table] : listTables(motion.record))
    for (Eigen::Index column = 0; column < table->cols(); ++column) {
      CAPTURE(name, column);
      const Eigen::Index row = (7 * column + 3) % table->rows();
      const double kept = (*table)(row, column);
      (*table)(row, column) = std::nan("");
      CHECK(getFailures(checkMotion(motion)) == Names{"numbers not finite"});
      (*table)(row, column) = kept;
    }
  motion.record.time[17] = std::nan("");
  CHECK(fails(checkMotion(motion), "numbers not finite"));

  // Squares of 1e200 are infinite: a resulting NaN reaches the table, or Simbody throws.
  const auto passes = [](const CheckedMotion& altered) {
    try {
      return checkMotion(altered).passed();
    } catch (const std::exception&) {
      return false;
    }
  };
  CheckedMotion swing = makeFourBarMotion(5e-3, Formulation::Full);
  for (const auto& [name, table] : listTables(swing.record)) {
    if (name == "gap") continue;  // for the reader: the check takes gaps from q
    for (Eigen::Index column = 0; column < table->cols(); ++column) {
      CAPTURE(name, column);
      const double kept = (*table)(2, column);
      (*table)(2, column) = 1e200;
      CHECK_FALSE(passes(swing));
      (*table)(2, column) = kept;
    }
  }
}

TEST_CASE("check: the worst of many keeps what is not a number") {
  const double nan = std::nan("");
  for (const CheckRow::Kind kind : {CheckRow::Kind::AtMost, CheckRow::Kind::AtLeast})
    for (const std::vector<double>& values : {std::vector<double>{nan, 1, 2}, {1, nan, 2}, {2, 1, nan}}) {
      Worst worst(kind);
      for (size_t i = 0; i < values.size(); ++i) worst.add(values[i], static_cast<int>(i), "");
      CHECK(std::isnan(worst.value()));
      const CheckRow row = worst.makeRow("row", "m", 0, makePendulumMotion(0.01, false));
      CHECK_FALSE(row.passed());
      CHECK_THAT(row.note, Catch::Contains("node " + std::to_string(std::find_if(values.begin(), values.end(),
                                                                                 [](double x) { return x != x; }) -
                                                                    values.begin())));
    }
  Worst least(CheckRow::Kind::AtLeast);
  for (int i : {3, 1, 2}) least.add(i, i, "");
  CHECK(least.value() == 1);
}

TEST_CASE("check: accelerations that no stabilisation explains fail by themselves") {
  // The loop is pulled softly to a place 20 um beside its own: gaps stay small, equations and steps hold.
  const auto pull = [](double offset) {
    return [offset](Closure& closure) {
      closure.X_B2.p.x() += offset;
      closure.kp = 1e4;
      closure.kd = 200;
    };
  };
  const CheckReport held = checkMotion(makeFourBarMotion(5e-4, Formulation::Full, pull(0)));
  INFO(print(held));
  CHECK(held.passed());
  const CheckReport pulled = checkMotion(makeFourBarMotion(5e-4, Formulation::Full, pull(2e-5)));
  INFO(print(pulled));
  CHECK(getFailures(pulled) == Names{"accelerations, against Simbody's"});
}

TEST_CASE("check: velocities that are far from accelerations fail") {
  const CheckReport report = checkMotion(makePendulumMotion(0.1, true));
  INFO(print(report));
  CHECK(fails(report, "finite differences of the velocity"));
  CHECK_FALSE(fails(report, "accelerations, against Simbody's"));
}

TEST_CASE("check: an energy a few times what a step may lose is seen, in an interval and over the motion") {
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    const CheckedMotion good = getSquat(formulation).checked;
    const MotionTrace trace = traceMotion(good);
    double mean = 0;
    for (const StageTrace& stage : trace.stages) mean += stage.energy_scale / trace.stages.size();
    // A torque of the motor that moves most takes this energy from an interval.
    const auto take = [&](CheckedMotion& motion, int k, double energy) {
      const VectorXd moved = motion.getTimeStep(k) / 2 * (motion.record.v.row(k) + motion.record.v.row(k + 1));
      int best = 0;
      for (int m = 0; m < motion.model.nu(); ++m)
        if (std::abs(moved[motion.model.motors()[m].dof]) > std::abs(moved[motion.model.motors()[best].dof])) best = m;
      const double way = moved[motion.model.motors()[best].dof];
      if (std::abs(way) > 1e-9) motion.record.u(k, best) -= energy / way;
    };
    CheckedMotion once = good, always = good;
    take(once, 30, 4 * (trace.stages[30].energy_scale + mean));
    const CheckReport interval = checkMotion(once);
    INFO(print(interval));
    CHECK(fails(interval, "energy, one interval"));
    CHECK_FALSE(fails(interval, "energy, whole motion"));
    for (int k = 0; k < always.numStages(); ++k) take(always, k, 4 * trace.stages[k].energy_scale);
    const CheckReport whole = checkMotion(always);
    INFO(print(whole));
    CHECK(fails(whole, "energy, whole motion"));
  }
}

TEST_CASE("check: feet that land hard, turn, stand askew or go under the ground fail") {
  CheckedMotion landing = makeLifted();
  landing.record.v(60, 2) += 0.2;
  CHECK_FALSE(fails(checkMotion(makeLifted()), "landing velocity"));
  CHECK(fails(checkMotion(landing), "landing velocity"));

  CheckedMotion turning = getSquat().checked;
  for (int k = 0; k <= turning.numStages(); ++k) moveBase(turning, k, 2e-4 * k * Vector6d::Unit(5));
  const CheckReport turned = checkMotion(turning);
  CHECK(fails(turned, "standing feet: slip, angle"));
  CHECK(getValue(turned, "standing feet: slip, angle") == Approx(2e-4 * turning.numStages()).epsilon(0.1));

  // On the edges of its soles, which touch the ground.
  CheckedMotion askew = getSquat().checked;
  for (int k = 0; k <= askew.numStages(); ++k) moveBase(askew, k, 0.03 * Vector6d::Unit(4));
  double lowest = 1e9;
  const auto trace = traceMotion(askew);
  for (const SE3& foot : trace.nodes[0].feet)
    for (double x : {-0.05, 0.05}) lowest = std::min(lowest, foot.act(Vector3d(x, 0, 0)).z());
  askew.summary.ground.height = lowest;
  const CheckReport tilted = checkMotion(askew);
  CHECK(fails(tilted, "standing feet: off the ground"));
  CHECK(getValue(tilted, "standing feet: off the ground") == Approx(0.1 * 0.03).epsilon(0.1));

  CheckedMotion raised = makeLifted();
  raised.summary.ground.height += 3e-3;
  CHECK_FALSE(fails(checkMotion(makeLifted()), "swinging feet: least height"));
  CHECK(fails(checkMotion(raised), "swinging feet: least height"));
  CHECK_FALSE(fails(checkMotion(raised), "bodies: least height"));
  raised.summary.ground.height += 0.3;
  CHECK(fails(checkMotion(raised), "bodies: least height"));
}

TEST_CASE("check: a centre of mass that was recorded elsewhere") {
  CheckedMotion elsewhere = getSquat().checked;
  elsewhere.record.com(30, 2) += 1e-6;
  CHECK(getFailures(checkMotion(elsewhere)) == Names{"centre of mass, as recorded"});
}

TEST_CASE("check: velocities after a rigid landing are those of the impact, whose impulses stay inside the cone") {
  // The squat's first node and itself, with an impact between: feet that rise are held back by pulling.
  const CheckedMotion& squat = getSquat().checked;
  const auto make = [&](double rise) {
    CheckedMotion motion = squat;
    MotionRecord& record = motion.record;
    for (const auto& [name, table] : listTables(record)) {
      const bool nodes = table->rows() == squat.numStages() + 1;
      *table = RowMatrixXd(nodes ? RowMatrixXd(table->row(0).replicate(2, 1)) : RowMatrixXd::Zero(1, table->cols()));
    }
    record.time = VectorXd::Zero(2);
    motion.summary.goals.clear();
    motion.summary.phases = {{"impact", 0, 1, 0, squat.summary.phases[0].stances}};
    SimbodyBridge simbody(motion.model, makeConstraintSet(motion.model, motion.getContacts(0)).closures);
    record.v.row(0).setZero();
    record.v(0, 2) = rise;
    simbody.setState(record.q.row(0).transpose(), record.v.row(0).transpose(), VectorXd::Zero(motion.model.nv()));
    record.v.row(1) = simbody.solveImpact(VectorXd::Zero(simbody.calcConstraintJacobian().rows())).a;
    return motion;
  };
  const CheckReport falling = checkMotion(make(-0.1)), rising = checkMotion(make(0.1));
  INFO(print(falling) << print(rising));
  CHECK(getValue(falling, "impact: least normal impulse") > 0);
  CHECK_FALSE(fails(falling, "impact: least normal impulse"));
  CHECK(getFailures(rising).count("impact: least normal impulse") == 1);
  CHECK(getFailures(rising).count("impact: wrench cone of the sole") == 1);
  for (const Formulation formulation : {Formulation::Reduced, Formulation::Full}) {
    CheckedMotion motion = make(-0.1);
    motion.summary.formulation = formulation;
    CHECK(getFailures(checkMotion(motion)).count("steps of the velocity") == 0);
    motion.record.v(1, 0) += 1e-4;  // the momentum that the ground took is another one; the loops move along
    CHECK(getFailures(checkMotion(motion)).count("steps of the velocity") == 1);
  }
}
