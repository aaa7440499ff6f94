#include <Eigen/LU>

#include "firmware/c_text.h"
#include "firmware/languages.h"
#include "firmware/printer.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle::firmware {
namespace {

using Eigen::Index;

class CWriter {
 public:
  CWriter(const Maps& maps, bool is_single, bool is_cpp)
      : maps_(maps), is_single_(is_single), is_cpp_(is_cpp), formulas_(maps) {
    style_.declare = "const REAL ";
    style_.suffix = is_single ? "f" : "";
    style_.is_single = is_single;
  }

  std::map<std::string, std::string> write() {
    const std::string header = maps_.name + (is_cpp_ ? ".hpp" : ".h"), source = maps_.name + (is_cpp_ ? ".cpp" : ".c"),
                      test = maps_.name + (is_cpp_ ? "_test.cpp" : "_test.c");
    const std::string space = "namespace " + maps_.name + " {\n", end = "}  // namespace " + maps_.name;
    std::string about;
    for (const std::string& line : describe(maps_, is_single_)) about += "   " + line + "\n";
    if (maps_.mechanism.ignored_offset > 1e-4)
      about += "   Centres of mass of rods are taken on the lines of their ends, from which they are up to " +
               formatNumber(1e3 * maps_.mechanism.ignored_offset, "%.2g") + " mm away.\n";
    const size_t others = maps_.mechanism.coordinates.size() - 2 * static_cast<size_t>(maps_.size());
    std::map<std::string, std::string> out;
    out[header] =
        finish(kHeaderText,
               {{"@guard@", maps_.name + (is_cpp_ ? "_HPP" : "_H")},
                {"@open@", is_cpp_ ? space : "#ifdef __cplusplus\nextern \"C\" {\n#endif\n"},
                {"@close@", is_cpp_ ? end : "#ifdef __cplusplus\n}\n#endif"},
                {"@sizes@", is_cpp_ ? "constexpr int SIZE = " + count(maps_.size()) + ";  /* joints, and motors */"
                                    : "#define SIZE " + count(maps_.size()) + " /* joints, and motors */"},
                {"@passive@", others ? "\n  REAL passive[" + std::to_string(others) + "];" : ""},
                {"@guess@", maps_.inverse.isClosedForm() && maps_.direct.isClosedForm()
                                ? "Closed forms do not need it."
                                : "It saves nothing, but keeps Newton's method near."},
                {"@held@",
                 "The bodies that a serial model has are not among them, nor are springs on the joints themselves."}},
               {{"@about@", about + "   Neither damping nor friction is in the torques."}, {"@base@", maps_.base}});
    out[source] = finish(kSourceText, listParts(space, end),
                         {{"@include@", (is_single_ ? kUnfusedText : "") + ("#include \"" + header + "\"")}});
    out[test] = finish(kTestText, listTest(source, test), {{"@include@", "#include \"" + header + "\""}});
    return out;
  }

 private:
  static std::string count(int n) { return std::to_string(n); }
  std::string number(double x) const {
    if (std::isinf(x)) return std::string(x < 0 ? "-" : "") + "HUGE_VAL" + (is_single_ ? "F" : "");
    return formatConstant(x, style_);
  }
  template <typename Get>
  std::string list(const Get& get) const {
    std::vector<std::string> out;
    for (int i = 0; i < maps_.size(); ++i) out.push_back(number(get(i)));
    return listItems(out);
  }

  std::string nameInput(int i) const {
    const int m = maps_.size(), n = maps_.mechanism.gravity();
    const auto entry = [](const char* array, int k) { return std::string(array) + "[" + std::to_string(k) + "]"; };
    if (i < m) return entry("at->joint", i);
    if (i < 2 * m) return entry("at->motor", i - m);
    if (i < n) return entry("at->passive", i - 2 * m);
    if (i < maps_.mechanism.velocity()) return entry("gravity", i - n);
    if (i < maps_.mechanism.ratio()) return entry("v", i - maps_.mechanism.velocity());
    const int k = i - maps_.mechanism.ratio();
    return entry("ratio->motor_per_joint", k / m) + "[" + std::to_string(k % m) + "]";
  }
  std::string print(const std::vector<Scalar>& formulas, const std::vector<std::string>& targets) const {
    return print(Program(formulas), targets);
  }
  std::string print(const Program& program, const std::vector<std::string>& targets) const {
    return printProgram(
        program, style_, [this](int i) { return nameInput(i); }, targets);
  }
  static std::string indent(const std::string& text) {
    std::string out;
    for (size_t at = 0; at < text.size();) {
      const size_t end = text.find('\n', at) + 1;
      out += "  " + text.substr(at, end - at);
      at = end;
    }
    return out;
  }

  std::string printSolution(const Solution& s) const {
    std::string out, body;
    bool has_margin = false;
    const auto addClosedForms = [&](const std::vector<std::pair<int, Scalar>>& list, const Scalar& least) {
      if (list.empty()) return;
      std::vector<Scalar> formulas;
      std::vector<std::string> targets;
      for (const auto& [c, formula] : list) formulas.push_back(formula), targets.push_back(nameInput(c));
      if (!least.isConstant()) {
        formulas.push_back(least);
        targets.emplace_back(has_margin ? "margin_after" : "margin");
        has_margin = true;
      }
      body += "  {\n" + indent(print(formulas, targets)) + "  }\n";
    };
    addClosedForms(s.before, s.least_before);
    const bool first = has_margin;
    if (!s.unknowns.empty()) {
      std::vector<std::string> targets, steps;
      std::string kept, moved;
      for (size_t u = 0; u < s.unknowns.size(); ++u) {
        const std::string x = nameInput(s.unknowns[u]), d = "d[" + std::to_string(u) + "]";
        targets.push_back(x);
        steps.push_back(d);
        kept += "    " + x + " = guess" + x.substr(2) + ";\n";
        moved += "    " + x + " += " + d + ";\n";
      }
      const std::string U = std::to_string(s.unknowns.size());
      body += "  if (guess) {\n" + kept + "  } else {\n" + indent(print(s.guesses, targets)) + "  }\n";
      const LoopText loop = printLoop(
          Program(s.steps), style_, [this](int i) { return nameInput(i); }, steps, s.unknowns);
      body += "  {\n" + indent(loop.before) + "  for (n = 0; n < " + std::to_string(s.iterations) +
              "; ++n) {\n    REAL d[" + U + "];\n" + indent(loop.body) + "    last = 0;\n    for (k = 0; k < " + U +
              "; ++k) {\n      d[k] = limit(d[k], " + number(-kLongestStep) + ", " + number(kLongestStep) +
              ");\n      if (fabsFN(d[k]) > last) last = fabsFN(d[k]);\n    }\n" + moved + "  }\n  }\n";
      body += "  if (!(last <= " + number(kSettled) + ")) return 0;\n";
      out += "  REAL last = 0;\n  int n, k;\n";
    } else {
      body = "  (void)guess;\n" + body;
    }
    addClosedForms(s.after, s.least_after);
    const bool second = !s.least_after.isConstant() && !s.after.empty();
    if (first) out += "  REAL margin = 0;\n";
    if (second) out += std::string("  REAL ") + (first ? "margin_after" : "margin") + " = 0;\n";
    body += first || second
                ? std::string("  return margin >= 0") + (first && second ? " && margin_after >= 0" : "") + ";\n"
                : "  return 1;\n";
    return out + body;
  }

  std::vector<std::pair<std::string, std::string>> listParts(const std::string& space, const std::string& end) const {
    const int m = maps_.size();
    std::string reference;
    for (Index c = 0; c < maps_.samples.front().size(); ++c)
      reference += "  " + nameInput(static_cast<int>(c)) + " = " + number(maps_.samples.front()[c]) + ";\n";
    std::vector<std::string> entries, rates;
    for (const char* which : {"ratio->motor_per_joint", "ratio->joint_per_motor"})
      for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j)
          entries.push_back(which + ("[" + std::to_string(i) + "]") + "[" + std::to_string(j) + "]");
    for (int i = 0; i < m * m; ++i) rates.push_back("rate" + entries[static_cast<size_t>(i)].substr(5));
    rates.emplace_back("log_rate");
    entries.emplace_back("det");
    std::vector<std::string> held;
    for (int i = 0; i < m; ++i) held.push_back("held[" + std::to_string(i) + "]");
    const std::string solve_motors = printSolution(maps_.inverse), solve_joints = printSolution(maps_.direct),
                      ratio = print(formulas_.ratio, entries), rate = print(formulas_.ratio_rate, rates),
                      holding = print(formulas_.held, held);
    std::string helpers;
    const std::string all = solve_motors + solve_joints + ratio + rate + holding;
    for (const char* name : {"sine", "arctangent"})
      if (all.find(std::string(name) + "(") != std::string::npos) helpers += getSingleFunction(name) + "\n";
    if (all.find("root(") != std::string::npos)
      helpers += "static REAL root(REAL x) { return x > 0 ? sqrtFN(x) : 0; }\n\n";
    if (all.find("least(") != std::string::npos)
      helpers += "static REAL least(REAL a, REAL b) { return a < b ? a : b; }\n\n";
    std::string check;
    if (maps_.inverse.isClosedForm() && !maps_.direct.isClosedForm())
      check =
          "  if (is_reached) { /* on another branch, these joints would have other motors */\n"
          "    NAME_posture same = *at;\n"
          "    is_reached = solve_motors(NULL, &same);\n"
          "    for (i = 0; i < SIZE; ++i)\n"
          "      if (!(fabsFN(same.motor[i] - at->motor[i]) <= " +
          number(is_single_ ? 1e-2 : 1e-6) + ")) is_reached = 0;\n  }\n";
    bool has_winding = false;
    for (const Motor& motor : maps_.motors)
      has_winding = has_winding || (motor.hasEnvelope() && motor.drive.resistance > 0);
    const auto winding = [&](const auto& get, double without) {
      return list([&](int i) {
        const Motor& motor = maps_.motors[static_cast<size_t>(i)];
        return motor.hasEnvelope() && motor.drive.resistance > 0 ? get(motor) : without;
      });
    };
    return {
        {"@open_source@", is_cpp_ ? space + "\n" : ""},
        {"@close_source@", is_cpp_ ? "\n" + end + "\n" : ""},
        {"@lower@", list([&](int i) { return maps_.lower[i]; })},
        {"@upper@", list([&](int i) { return maps_.upper[i]; })},
        {"@motor_lower@", list([&](int i) { return maps_.motor_lower[i]; })},
        {"@motor_upper@", list([&](int i) { return maps_.motor_upper[i]; })},
        {"@rotor@", list([&](int i) { return maps_.motors[static_cast<size_t>(i)].armature; })},
        {"@effort@", list([&](int i) { return maps_.motors[static_cast<size_t>(i)].effort_limit; })},
        {"@speed@", list([&](int i) { return maps_.motors[static_cast<size_t>(i)].velocity_limit; })},
        {"@winding@",
         has_winding
             ? "/* Of windings: most torque at rest, and its fall with speed. */\nstatic const REAL stall[SIZE] = {" +
                   winding([](const Motor& x) { return x.drive.voltage / x.voltsPerEffort(); }, INFINITY) +
                   "}, fall[SIZE] = {" +
                   winding([](const Motor& x) { return x.voltsPerSpeed() / x.voltsPerEffort(); }, 0) + "};\n"
             : ""},
        {"@with_winding@", has_winding ? "    const REAL loss = fall[i] * motor_velocity[i];\n"
                                         "    low = limit(-stall[i] - loss, -effort[i], effort[i]);\n"
                                         "    high = limit(stall[i] - loss, -effort[i], effort[i]);\n"
                                       : ""},
        {"@no_winding@", has_winding ? "" : "  (void)motor_velocity;\n"},
        {"@helpers@", helpers},
        {"@reference@", reference},
        {"@solve_motors@", solve_motors},
        {"@solve_joints@", solve_joints},
        {"@check@", check},
        {"@near@", maps_.hasNear() ? "  if (status == NAME_OK && NAME_dead_point_distance(at) < " +
                                         number(kNearDeadPoint) + ") status = NAME_NEAR_DEAD_POINT;\n"
                                   : ""},
        {"@branch@",
         "  int i;\n  for (i = 0; i < SIZE; ++i)\n    if (!(at->joint[i] >= lower[i] - @slack@ && at->joint[i] <= "
         "upper[i] + @slack@)) return 0;\n"},
        {"@slack@", number(is_single_ ? 1e-4 : 1e-9)},
        {"@ratio@", "  REAL det;\n  (void)at;\n" + ratio + "  return det;\n"},
        {"@rate@", "  (void)at;\n  (void)ratio;\n  (void)v;\n" + rate},
        {"@held_torque@", "  (void)at;\n  (void)ratio;\n  (void)gravity;\n" + holding},
        {"@cast_huge@", is_single_ ? "F" : ""},
        {"@one@", number(1)},
        {"@zero@", number(0)}};
  }

  std::vector<std::pair<std::string, std::string>> listTest(const std::string& source, const std::string& test) const {
    std::string vectors;
    for (const ExactPosture& x : maps_.vectors) {
      std::vector<std::string> row;
      for (Index i = 0; i < x.joints.size(); ++i) row.push_back(number(x.joints[i]));
      for (Index i = 0; i < x.motors.size(); ++i) row.push_back(number(x.motors[i]));
      for (Index i = 0; i < x.R.rows(); ++i)
        for (Index j = 0; j < x.R.cols(); ++j) row.push_back(number(x.R(i, j)));
      vectors += "    {" + listItems(row) + "},\n";
    }
    // Beyond the errors measured: rounding of the vectors, and by other compilers.
    const double unit = is_single_ ? 1.2e-7 : 2.3e-16, ratio = std::max(1.0, maps_.largest_ratio),
                 inverse = getLargestInverse();
    const int m = maps_.size();
    return {
        {"@build@", "Build: " + std::string(is_cpp_ ? "c++" : "cc -std=c99") + " -O2 " + source + " " + test + " -lm"},
        {"@using@", is_cpp_ ? "using namespace " + maps_.name + ";\n\n" : ""},
        {"@count@", std::to_string(maps_.vectors.size())},
        {"@columns@", std::to_string(2 * m + m * m)},
        {"@vectors@", vectors},
        {"@rates@", is_single_ ? "" : ", rates = 0"},
        {"@rate_check@", is_single_ ? "" : kRateTest},
        {"@rate_condition@", is_single_ ? "" : " && rates <= 1e-3"},
        {"@motor_tolerance@", number(2 * maps_.errors.motors + 32 * unit * ratio)},
        {"@joint_tolerance@", number(2 * maps_.errors.joints + 32 * unit * inverse)},
        {"@ratio_tolerance@", number(2 * maps_.errors.ratio + 64 * unit)},
        {"@power_tolerance@", number(1e3 * unit * ratio * inverse)}};
  }
  // Entry of R^-1 among the vectors.
  double getLargestInverse() const {
    double most = 1;
    for (const ExactPosture& x : maps_.vectors) most = std::max(most, x.R.inverse().cwiseAbs().maxCoeff());
    return most;
  }

  // \param code  with the keys of c_text.h   \param texts  as they are
  std::string finish(const std::string& text, std::vector<std::pair<std::string, std::string>> code,
                     const std::vector<std::pair<std::string, std::string>>& texts) const {
    code.emplace_back("REAL", is_single_ ? "float" : "double");
    code.emplace_back("FN", is_single_ ? "f" : "");
    if (is_cpp_)
      for (const auto& [prefixed, name] : {std::pair("NAME_real", "Real"),
                                           {"NAME_status", "Status"},
                                           {"NAME_posture", "Posture"},
                                           {"NAME_ratio ", "Ratio "},
                                           {"NAME_ratio;", "Ratio;"}})
        code.emplace_back(prefixed, name);
    code.emplace_back("SIZE", is_cpp_ ? "kSize" : "NAME_S_I_Z_E");
    code.emplace_back("S_I_Z_E", "SIZE");
    code.emplace_back("NAMEbare", maps_.name);
    code.emplace_back("NAME_", is_cpp_ ? "" : maps_.name + "_");
    std::string out = fillIn(fillIn(text, code), texts);
    return fillIn(
        out, {{"@title@", maps_.robot + ": " + listItems(maps_.joint_names) + " by " + listItems(maps_.motor_names) +
                              ". Written by `bielle convert --to " + (is_cpp_ ? "cpp" : "c") + "`."}});
  }

  const Maps& maps_;
  bool is_single_, is_cpp_;
  Formulas formulas_;
  Style style_;
};

}  // namespace

std::map<std::string, std::string> writeC(const Maps& maps, bool is_single, bool is_cpp) {
  return CWriter(maps, is_single, is_cpp).write();
}

}  // namespace bielle::firmware
