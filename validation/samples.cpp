#include "samples.h"

#include <algorithm>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/largest.h"

namespace bielle::validation {

SampleSource::SampleSource(const Model& model, const ValidationOptions& options)
    : model_(model), options_(options), rng_(options.seed) {
  const AssemblyResult start =
      options.start.size() > 0 ? closeConfiguration(model, options.start) : findClosedConfiguration(model);
  if (start.status != NumericalStatus::Ok) failure = "no closed configuration was found: " + start.message;
  q_ref_ = start.q;
}

Sample SampleSource::draw() {
  Sample sample;
  sample.q = q_ref_;
  double scale = options_.perturbation;
  for (int attempt = 0; attempt < 8; ++attempt, scale /= 2) {
    const AssemblyResult result = closeConfiguration(model_, model_.integrate(q_ref_, random(model_.nv(), scale)));
    if (result.status != NumericalStatus::Ok) continue;
    sample.q = result.q;
    break;
  }
  Workspace ws(model_);
  updatePositions(model_, ws, sample.q);
  for (int c = 0; c < static_cast<int>(model_.contacts().size()); ++c) {
    const ContactFrame& contact = model_.contacts()[c];
    if (random(1, 1)[0] > 0) sample.contacts.push_back({c, getPlacement(ws, contact.body, contact.X_BF), 0, 0});
  }
  const ConstraintSet set = makeConstraintSet(model_, sample.contacts);
  sample.v = projectVelocity(model_, ws, set, sample.q, random(model_.nv(), options_.velocity));
  updateMassMatrix(model_, ws);
  // A link of milligrams under a force for kilograms would accelerate so much that only rounding is compared.
  constexpr double kLargestAcceleration = 1e5;
  const VectorXd force = (kLargestAcceleration * ws.M.diagonal()).cwiseMin(options_.force);
  sample.tau = random(model_.nv(), 1).cwiseProduct(force);
  sample.a = random(model_.nv(), options_.force);
  return sample;
}

VectorXd SampleSource::random(int n, double scale) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  return VectorXd::NullaryExpr(n, [&](Eigen::Index) { return uniform(rng_); });
}

void addDifference(ValidationReport& report, const std::string& quantity, const MatrixXd& ours, const MatrixXd& theirs,
                   double floor, double tolerance) {
  if (theirs.size() == 0) return;
  auto row = std::find_if(report.rows.begin(), report.rows.end(),
                          [&](const ValidationRow& r) { return r.quantity == quantity; });
  if (row == report.rows.end()) row = report.rows.insert(row, {quantity, 0, tolerance, 0});
  double difference = (ours - theirs).cwiseAbs().maxCoeff() / std::max(theirs.cwiseAbs().maxCoeff(), floor);
  if (!ours.allFinite() || !theirs.allFinite()) difference = std::numeric_limits<double>::infinity();
  row->difference = getLarger(row->difference, difference);
  row->tolerance = std::max(row->tolerance, tolerance);
  ++row->samples;
}

}  // namespace bielle::validation
