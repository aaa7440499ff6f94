#include "paper/claims.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <functional>

#include "results/json_text.h"

namespace bielle::paper {
namespace {

using Comparisons = std::vector<Comparison>;

std::string print(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string print(const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

std::string listValues(const Comparisons& comparisons, const std::function<bool(const Comparison&)>& keep) {
  std::string text;
  for (const Comparison& entry : comparisons)
    if (keep(entry)) text += (text.empty() ? "" : ", ") + print("%.4g", entry.value);
  return text.empty() ? "none" : text;
}

int count(const Comparisons& comparisons, const std::function<bool(const Comparison&)>& keep) {
  return static_cast<int>(std::count_if(comparisons.begin(), comparisons.end(), keep));
}

bool hasClosed(const Comparison& entry) { return entry.closed.success; }
bool hasSerial(const Comparison& entry) { return entry.serial.success; }
bool hasBoth(const Comparison& entry) { return entry.closed.success && entry.lifted.success; }
// Whether there was a serial motion that a linkage could not follow.
bool failsToLift(const Comparison& entry) {
  return entry.serial.success && !entry.lifted.success && entry.lifted.lift.at_linkage;
}
std::string describeFailures(const Comparisons& all) {
  return listValues(all, failsToLift) + "; for lack of accuracy alone: " +
         listValues(all, [](const Comparison& e) { return e.serial.success && !e.lifted.success && !failsToLift(e); }) +
         "; lifted step by step: " +
         listValues(all, [](const Comparison& e) { return e.serial.success && !e.stepped.success; });
}
double calcPeakRatio(const Comparison& entry) { return entry.lifted.knee.peak / entry.closed.knee.peak; }

// Range of the closed model's peak knee torque over the values, "FROM least TO most".
Claim judgeEffort(const char* section, const char* text, const char* from, const char* to, const Comparisons& all) {
  double least = INFINITY, most = 0;
  for (const Comparison& entry : all)
    if (hasClosed(entry))
      least = std::min(least, entry.closed.knee.peak), most = std::max(most, entry.closed.knee.peak);
  if (most == 0) return {section, text, Verdict::Open, "no results"};
  return {section, text, most < 2 * least ? Verdict::Agrees : Verdict::Differs,
          print("%s %.1f %s %.1f N m (agrees: within a factor of two)", from, least, to, most)};
}

Claim judgeConvergence(const char* section, const char* text, const Comparisons& all) {
  const int n = static_cast<int>(all.size()), closed = count(all, hasClosed), serial = count(all, hasSerial);
  const Verdict verdict = closed == n && serial == n ? Verdict::Agrees : Verdict::Differs;
  std::string found = print("closed: %d of %d converge, serial: %d of %d", closed, n, serial, n);
  if (closed < n) found += "; closed fails at " + listValues(all, [](const Comparison& e) { return !hasClosed(e); });
  if (serial < n) found += "; serial fails at " + listValues(all, [](const Comparison& e) { return !hasSerial(e); });
  return {section, text, verdict, found};
}

// Peaks of the lifted over the closed model at the lowest and highest values that have both, and the largest.
std::string describePeakRatios(const Comparisons& all) {
  const Comparison *first = nullptr, *last = nullptr, *most = nullptr;
  for (const Comparison& entry : all) {
    if (!hasBoth(entry)) continue;
    if (!first) first = &entry;
    last = &entry;
    if (!most || calcPeakRatio(entry) > calcPeakRatio(*most)) most = &entry;
  }
  if (!first) return "no value has both";
  return print("%.2f at %.4g, %.2f at %.4g, at most %.2f at %.4g", calcPeakRatio(*first), first->value,
               calcPeakRatio(*last), last->value, calcPeakRatio(*most), most->value);
}

std::vector<Claim> judgeSquat(const StudyResult& result, const Model&) {
  const Comparisons& all = result.comparisons;
  std::vector<Claim> claims = {
      judgeConvergence("V-A.1", "both problems converge to a reasonable squat for targets from 0.5 to 1.2", all)};

  const int failed = count(all, failsToLift);
  claims.push_back({"V-A.1",
                    "the serial motion reaches a singular configuration where the motors cannot give the torques",
                    failed ? Verdict::Agrees : Verdict::Differs, "targets whose lift fails: " + describeFailures(all)});

  double ratio = 0;  // of the lifted part
  for (const Comparison& entry : all)
    if (hasClosed(entry) && entry.lifted.knee.peak > 0) ratio = std::max(ratio, calcPeakRatio(entry));
  claims.push_back(
      {"V-A.1, Fig. controls_vs_com_elevation",
       "for deeper squats the serial motion needs excessive motor torques (here: twice the closed model's "
       "peak; partly: no lift, but no such torque before it fails)",
       ratio > 2    ? Verdict::Agrees
       : failed     ? Verdict::Partly
       : ratio == 0 ? Verdict::Open
                    : Verdict::Differs,
       print("peak knee torque, lifted over closed, where lifted to the end: %s; until a lift fails: at most %.2f",
             describePeakRatios(all).c_str(), ratio)});
  claims.push_back(judgeEffort("V-A.1", "the closed model anticipates and makes an effective movement",
                               "its peak knee torque stays between", "and", all));
  return claims;
}

std::vector<Claim> judgeSpeed(const StudyResult& result, const Model&) {
  const Comparisons& all = result.comparisons;
  std::vector<Claim> claims = {judgeConvergence("V-A.3", "walks from 0 to 1.2 m/s", all)};
  double largest = 0, at = kMissing, slowest = kMissing, fastest = kMissing;
  for (const Comparison& entry : all) {
    if (!hasBoth(entry)) continue;
    const double difference = entry.lifted.com_mean - entry.closed.com_mean;
    if (std::isnan(slowest)) slowest = difference;
    fastest = difference;
    if (std::abs(difference) > std::abs(largest)) largest = difference, at = entry.value;
  }
  const bool open = std::isnan(slowest);
  claims.push_back({"V-A.3", "the heights of the CoM differ only slightly (here: by less than 2 cm)",
                    open                       ? Verdict::Open
                    : std::abs(largest) < 0.02 ? Verdict::Agrees
                                               : Verdict::Differs,
                    open
                        ? "no results"
                        : print("lifted minus closed, mean height: at most %+.1f mm, at %.4g m/s", 1e3 * largest, at)});
  claims.push_back({"V-A.3",
                    "with small steps the serial model walks with a higher CoM; going faster, the heights meet",
                    open                                                   ? Verdict::Open
                    : slowest > 0 && std::abs(fastest) < std::abs(slowest) ? Verdict::Agrees
                    : slowest > 0 || std::abs(fastest) < std::abs(slowest) ? Verdict::Partly
                                                                           : Verdict::Differs,
                    open ? "no results"
                         : print("%+.1f mm at the slowest, %+.1f mm at the fastest walk that both have", 1e3 * slowest,
                                 1e3 * fastest)});
  double ratio = 0;
  for (const Comparison& entry : all)
    if (hasBoth(entry)) ratio = std::max(ratio, calcPeakRatio(entry));
  claims.push_back({"V-A.3, Fig. velocity_compos",
                    "the peak knee torque of the serial model is much larger (here: by half at some speed)",
                    open          ? Verdict::Open
                    : ratio > 1.5 ? Verdict::Agrees
                                  : Verdict::Differs,
                    "lifted over closed: " + describePeakRatios(all)});
  const int early = count(all, [](const Comparison& e) { return failsToLift(e) && e.value < 0.9 - 1e-9; });
  const int late = count(all, [](const Comparison& e) { return failsToLift(e) && e.value > 0.9 - 1e-9; });
  const int late_all = count(all, [](const Comparison& e) { return e.value > 0.9 - 1e-9; });
  claims.push_back({"V-A.3", "the lift fails from 0.9 m/s on, and not below",
                    late_all == 0                    ? Verdict::Open
                    : late == late_all && early == 0 ? Verdict::Agrees
                    : late > 0                       ? Verdict::Partly
                                                     : Verdict::Differs,
                    "speeds whose lift fails: " + describeFailures(all)});
  claims.push_back(judgeEffort("V-A.3", "the closed model's motor effort stays reasonable, independently of the speed",
                               "peak knee torque", "to", all));
  return claims;
}

std::vector<Claim> judgeWalk(const StudyResult& result, const Model& model) {
  const char* feet_text = "feet: the motions of both models look much alike (here: nearer than 3 cm at any time)";
  const char* com_text = "the CoM paths differ by little, most in height";
  const Comparison* both = nullptr;
  for (const Comparison& entry : result.comparisons)
    if (hasBoth(entry)) both = &entry;
  if (!both)
    return {{"V-A.2", feet_text, Verdict::Open, "no results"}, {"V-A.2", com_text, Verdict::Open, "no results"}};
  const MotionRecord &closed = *both->closed.record, &lifted = *both->lifted.record;
  const int nodes = static_cast<int>(std::min(closed.time.size(), lifted.time.size()));
  const auto feet = calcFeet(model, closed), other = calcFeet(model, lifted);
  double distance = 0;
  for (size_t i = 0; i < feet.size(); ++i)
    distance = std::max(distance, (feet[i].topRows(nodes) - other[i].topRows(nodes)).rowwise().norm().maxCoeff());
  const Vector3d com = (closed.com.topRows(nodes) - lifted.com.topRows(nodes)).cwiseAbs().colwise().mean().transpose();
  return {
      {"V-A.2, Fig. flat_walk_foot", feet_text, distance < 0.03 ? Verdict::Agrees : Verdict::Differs,
       print("farthest apart by %.1f mm", 1e3 * distance)},
      {"V-A.2, Fig. flat_walk_com_pos", com_text,
       com.z() >= com.maxCoeff() ? (com.z() < 0.02 ? Verdict::Agrees : Verdict::Partly) : Verdict::Differs,
       print("mean differences: x %.1f mm, y %.1f mm, z %.1f mm", 1e3 * com.x(), 1e3 * com.y(), 1e3 * com.z())},
      {"V-A.2",
       "nothing detrimental for the serial model at 0.5 m/s (here: it lifts, peak knee torque below twice the closed)",
       calcPeakRatio(*both) < 2 ? Verdict::Agrees : Verdict::Differs,
       "peak knee torque, lifted over closed: " + describePeakRatios(result.comparisons)}};
}

// Excessive: twice the closed model's peak of the given motors in the lifted part, or a linkage that cannot follow, of
// a joint whose name has the given prefix.
Claim judgeExcess(const StudyResult& result, const char* text, Load Performance::*load, const std::string& joint) {
  const Comparisons& all = result.comparisons;
  double ratio = 0;
  for (const Comparison& entry : all)
    if (hasClosed(entry) && (entry.lifted.*load).peak > 0)
      ratio = std::max(ratio, (entry.lifted.*load).peak / (entry.closed.*load).peak);
  const auto fails = [&](const Comparison& entry) {
    return failsToLift(entry) && entry.lifted.lift.joint.rfind(joint, 0) == 0;
  };
  const Verdict verdict = std::none_of(all.begin(), all.end(), hasSerial) ? Verdict::Open
                          : ratio > 2 || count(all, fails) > 0            ? Verdict::Agrees
                                                                          : Verdict::Differs;
  return {"V-A.4", text, verdict,
          print("peak torque, lifted over closed: at most %.2f; lifts that fail at a joint '%s...': ", ratio,
                joint.c_str()) +
              listValues(all, fails) + "; all lifts that fail at a linkage: " + describeFailures(all)};
}

std::vector<Claim> judgeStairs(const StudyResult& result, const Model&) {
  return {judgeExcess(result,
                      "the serial motion has excessive knee torques or meets a singularity (here: twice the closed "
                      "model's peak, or a knee linkage that cannot follow)",
                      &Performance::knee, "knee"),
          judgeExcess(result,
                      "on stairs the limits of the ankles are reached too (here: twice the closed model's ankle peak, "
                      "or an ankle linkage that cannot follow)",
                      &Performance::ankle, "ankle")};
}

std::vector<Claim> judgeJump(const StudyResult& result, const Model&) {
  return {judgeExcess(result,
                      "in the serial jump mostly the knee reaches over-extension (here: twice the closed model's peak, "
                      "or a knee linkage that cannot follow)",
                      &Performance::knee, "knee")};
}

std::vector<Claim> judgeRatio(const StudyResult& result, const Model&) {
  const RatioFinding& ratio = result.ratio;
  Claim claim = {
      "IV-A, Fig. reduction_ratio",
      "the reduction ratio of the knee is a highly non-linear function of its angle (here: it more than doubles)",
      Verdict::Open, "no results"};
  if (ratio.ratio.empty()) return {claim};
  const auto [least, most] = std::minmax_element(ratio.ratio.begin(), ratio.ratio.end());
  std::string dead;
  for (const double angle : ratio.joint_dead_points) dead += (dead.empty() ? "" : ", ") + print("%.4f", angle);
  claim.verdict = *most > 2 * *least ? Verdict::Agrees : Verdict::Differs;
  claim.found = print("%s: %.2f at the starting posture, at least %.2f; infinite at %s rad", ratio.joint.c_str(),
                      ratio.start, *least, dead.empty() ? "no angle" : dead.c_str());
  return {claim};
}

}  // namespace

const char* getName(Verdict verdict) {
  switch (verdict) {
    case Verdict::Agrees:
      return "agrees";
    case Verdict::Partly:
      return "partly";
    case Verdict::Differs:
      return "differs";
    case Verdict::Open:
      break;
  }
  return "open";
}

RatioFinding readRatio(const std::string& directory) {
  RatioFinding finding;
  const std::string file = directory + "/ratio.json";
  if (!std::filesystem::exists(file)) return finding;
  readJsonFile(file, "remove its directory to repeat the case", [&finding](const Json& json) {
    finding.joint = json.at("swept");
    for (const Json& sample : json.at("samples")) {
      const double angle = sample.at("joints").at(0);
      if (sample.at("dead") == "joint") finding.joint_dead_points.push_back(angle);
      if (sample.at("branch") != 0 || sample.at("dead") != "" || sample.at("R").size() != 1) continue;
      finding.angle.push_back(angle);
      finding.ratio.push_back(sample.at("R").at(0));
      if (sample.at("s") == 0) finding.start = finding.ratio.back();
    }
  });
  return finding;
}

std::vector<Claim> judgeClaims(const StudyResult& result, const Model& model) {
  const std::string& name = result.study.name;
  if (name == "squat") return judgeSquat(result, model);
  if (name == "speed" || name == "footholds") return judgeSpeed(result, model);
  if (name == "walk") return judgeWalk(result, model);
  if (name == "stairs") return judgeStairs(result, model);
  if (name == "jump") return judgeJump(result, model);
  return judgeRatio(result, model);
}

}  // namespace bielle::paper
