#include "check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>

#include "check_rows.h"

namespace bielle::validation {
namespace {

// The first number that is not finite, or an empty text.
Worst findNotFinite(const CheckedMotion& motion) {
  const MotionRecord& record = motion.record;
  const std::pair<const char*, const RowMatrixXd*> tables[] = {{"q", &record.q},
                                                               {"v", &record.v},
                                                               {"a", &record.a},
                                                               {"u", &record.u},
                                                               {"closure_wrenches", &record.closure_wrenches},
                                                               {"contact_wrenches", &record.contact_wrenches},
                                                               {"q_mid", &record.q_mid},
                                                               {"v_mid", &record.v_mid},
                                                               {"com", &record.com},
                                                               {"gap", &record.gap}};
  // Not every world tells forces.
  const auto mayBeUnknown = [&](const RowMatrixXd* table) {
    return motion.has_happened && (table == &record.closure_wrenches || table == &record.contact_wrenches);
  };
  Worst worst;
  int count = 0;
  for (const auto& [name, table] : tables)
    for (Eigen::Index k = 0; k < table->rows(); ++k) {
      if (mayBeUnknown(table) && table->row(k).array().isNaN().all()) continue;
      const int bad = static_cast<int>(table->cols() - table->row(k).array().isFinite().count());
      count += bad;
      if (bad > 0) worst.add(count, static_cast<int>(k), name);
    }
  for (Eigen::Index k = 0; k < record.time.size(); ++k)
    if (!std::isfinite(record.time[k])) worst.add(++count, static_cast<int>(k), "time");
  return worst;
}

}  // namespace

std::string formatNumber(double value, int more) {
  char text[64];
  const bool plain = value == 0 || (std::abs(value) >= 1e-3 && std::abs(value) < 1e4);
  std::snprintf(text, sizeof text, plain ? "%.*f" : "%.*e", (plain ? 4 : 2) + more, value);
  return text;
}

int countMoreDigits(double a, double b) {
  constexpr int kMost = 16;
  int more = 0;
  while (a != b && more < kMost && formatNumber(a, more) == formatNumber(b, more)) ++more;
  return more;
}

std::string Worst::describePlace(const CheckedMotion& motion) const {
  char text[64];
  std::snprintf(text, sizeof text, "node %d, %.3f s", node_, motion.record.time[node_]);
  return text + (what_.empty() ? "" : ", " + what_);
}

CheckRow Worst::makeRow(const std::string& name, const std::string& unit, double bound, const CheckedMotion& motion,
                        const std::string& nothing) const {
  CheckRow row{name, judged_, {}, bound, unit, nothing};
  if (empty()) return row;
  row.value = value_;
  row.note = describePlace(motion);
  return row;
}

bool CheckRow::passed() const {
  if (kind == Kind::Note || kind == Kind::Goal || !value) return true;
  return kind == Kind::AtMost ? *value <= bound : *value >= bound;  // false for NaN
}

bool CheckRow::isMissedGoal() const { return kind == Kind::Goal && !(value && std::abs(*value - bound) <= tolerance); }

bool CheckReport::passed() const {
  return std::all_of(rows.begin(), rows.end(), [](const CheckRow& row) { return row.passed(); });
}

const CheckRow* CheckReport::findRow(const std::string& name) const {
  for (const CheckRow& row : rows)
    if (row.name == name) return &row;
  return nullptr;
}

CheckBounds makeBounds(StepRule rule) {
  CheckBounds bounds;
  if (rule == StepRule::Euler) return bounds;
  for (double* bound :
       {&bounds.finite_differences, &bounds.slip, &bounds.slip_angle, &bounds.sole_height, &bounds.below_ground})
    *bound /= 10;
  return bounds;
}

CheckReport checkMotion(const CheckedMotion& motion) {
  const CheckBounds bounds = makeBounds(motion.summary.step);
  checkConsistency(motion);
  CheckReport report{motion.summary.motion, motion.summary.run.robot, static_cast<int>(motion.record.time.size()), {}};
  const Worst not_finite = findNotFinite(motion);
  CheckRow numbers = not_finite.makeRow("numbers not finite", "", 0, motion);
  if (not_finite.empty())
    numbers.value = 0;
  else
    numbers.note += "; nothing else was checked";
  report.rows.push_back(numbers);
  if (!not_finite.empty()) return report;
  const MotionTrace trace = traceMotion(motion);
  CheckContext context{motion, trace, bounds, report.rows};
  if (!motion.has_happened) addDynamicsRows(context);
  addStateRows(context);
  const size_t judged = report.rows.size();
  if (motion.has_happened)
    addWorkRow(context);
  else
    addEnergyRows(context);
  addStanceRows(context);
  addSwingRows(context);
  addShapeRows(context);
  addLinkageRows(context);
  addForceRows(context);
  addLimitRows(context);
  if (motion.has_happened)  // a fall is no error
    for (size_t i = judged; i < report.rows.size(); ++i) report.rows[i].kind = CheckRow::Kind::Note;
  else
    addGoalRows(context);
  return report;
}

namespace {

std::string countRows(std::ptrdiff_t rows, const char* one) {
  return std::to_string(rows) + " " + one + (rows == 1 ? "" : "s");
}

void printRow(std::ostream& out, const CheckRow& row) {
  const bool goal = row.kind == CheckRow::Kind::Goal, judged = row.kind != CheckRow::Kind::Note && row.value;
  const char* relation = goal ? "== " : row.kind == CheckRow::Kind::AtMost ? "<= " : ">= ";
  const bool met = goal ? !row.isMissedGoal() : row.passed();
  const int more = judged && !met ? countMoreDigits(*row.value, row.bound) : 0;
  const char* verdict = goal ? (met ? "met" : "MISS") : (met ? "pass" : "FAIL");
  out << "  " << std::left << std::setw(34) << row.name << std::right << std::setw(9)
      << (row.value ? formatNumber(*row.value, more) : "-") << "  " << std::left << std::setw(12)
      << (judged ? relation + formatNumber(row.bound, more) + " " : "") << std::setw(12) << (row.value ? row.unit : "")
      << std::setw(6) << (judged ? verdict : "") << row.note << "\n";
}

}  // namespace

void printReport(std::ostream& out, const CheckReport& report, CheckPrint print) {
  const auto failed = std::count_if(report.rows.begin(), report.rows.end(), [](const auto& r) { return !r.passed(); });
  const auto missed =
      std::count_if(report.rows.begin(), report.rows.end(), [](const auto& r) { return r.isMissedGoal(); });
  out << "check of " << report.motion << ", " << report.robot << ", " << report.nodes
      << " nodes: " << (failed == 0 ? "passed" : "FAILED: " + countRows(failed, "row"))
      << (missed == 0 ? "" : ", " + countRows(missed, "goal") + " missed") << "\n";
  for (const CheckRow& row : report.rows)
    if (print == CheckPrint::All || !row.passed() || row.isMissedGoal()) printRow(out, row);
}

std::string formatReport(const CheckReport& report) {
  using Json = nlohmann::ordered_json;
  Json rows = Json::array();
  for (const CheckRow& row : report.rows) {
    rows.push_back({{"name", row.name},
                    {"value", row.value ? Json(*row.value) : Json()},
                    {"bound", row.kind == CheckRow::Kind::Note ? Json() : Json(row.bound)},
                    {"unit", row.unit},
                    {"pass", row.passed()},
                    {"note", row.note}});
    if (row.kind != CheckRow::Kind::Goal) continue;
    rows.back()["met"] = !row.isMissedGoal();
    rows.back()["tolerance"] = row.tolerance;
  }
  return Json{{"rows", rows}, {"pass", report.passed()}}.dump(2) + "\n";
}

}  // namespace bielle::validation
