#pragma once
// What the page of a design run shows: data for report/designs.js.
#include <string>
#include <utility>
#include <vector>

#include "design/shown_designs.h"
#include "results/json_text.h"

namespace bielle {

// Corners of what a motor can give, speed and torque, counter-clockwise; `most_speed` and `most_torque` stand where it has no limit.
std::vector<std::pair<double, double>> listEnvelopeCorners(const Motor& motor, double most_speed, double most_torque);

// {"title", "axes", "columns", "designs"}; see designs.js.
Json describeDesignRun(const DesignEvaluator& evaluator, const DesignRun& run, const std::vector<ShownDesign>& designs);

// The drawing of a robot and the distances of its pivots: {"svg", "distances": [[link, from, to, mm]]}.
Json describeMechanism(const Model& model);

// Points of a motor over a motion in its envelope: {"name", "envelope", "limited", "points": [[speed, torque]]}.
Json describeCloud(const Motor& motor, const std::vector<std::pair<double, double>>& points);

}  // namespace bielle
