// Verdicts of a study, from handwritten results.
#include <catch2/catch.hpp>

#include "paper/claims.h"

using namespace bielle;
using namespace bielle::paper;

namespace {

// A height at which the closed model climbs and the serial motion cannot be lifted, for want of the linkage of a joint.
Comparison makeFailure(const std::string& joint, const std::string& message) {
  Comparison entry;
  entry.value = 0.06;
  entry.closed.success = entry.serial.success = true;
  entry.closed.knee.peak = entry.closed.ankle.peak = 30;
  entry.lifted.lift.at_linkage = true;
  entry.lifted.lift.joint = joint;
  entry.lifted.lift.message = message;
  return entry;
}

std::vector<Verdict> judgeStairs(const Comparison& entry) {
  StudyResult result;
  result.study.name = "stairs";
  result.comparisons = {entry};
  std::vector<Verdict> verdicts;
  for (const Claim& claim : judgeClaims(result, Model())) verdicts.push_back(claim.verdict);
  return verdicts;
}

}  // namespace

TEST_CASE("claims: a linkage that cannot follow is identified by its joint, not by its message") {
  const std::vector<Verdict> knee = {Verdict::Agrees, Verdict::Differs}, ankle = {Verdict::Differs, Verdict::Agrees};
  CHECK(judgeStairs(makeFailure("knee_left", "out of reach")) == knee);
  CHECK(judgeStairs(makeFailure("ankley_right", "out of reach")) == ankle);
  CHECK(judgeStairs(makeFailure("ankley_right", "joint 'ankley_right' is held back by 'knee_right'")) == ankle);
  CHECK(judgeStairs(makeFailure("", "joint 'knee_right'")) == std::vector<Verdict>(2, Verdict::Differs));
}
