#include "motion/kinematic_guess.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"

namespace bielle {
namespace {

enum class Soles { AsPlanned, Tilted };

SE3 getBase(const VectorXd& q) {
  return {Eigen::Quaterniond(Eigen::Vector4d(q.segment<4>(3))).toRotationMatrix(), q.head<3>()};
}

class FeetPlacer {
 public:
  FeetPlacer(const Model& model, const Stance& stance)
      : model_(model), stance_(stance), ws_(model), closures_(makeConstraintSet(model)) {
    for (const Transmission& transmission : listTransmissions(model, stance.q))
      transmissions_.push_back(makeTransmission(transmission));
    const SE3 base = getBase(stance.q);
    for (int i = 0; i < 2; ++i) {
      lengths_[i] = base.p.z() - stance.feet[i].p.z();
      hips_[i] = base.inverse().act(stance.feet[i].p + lengths_[i] * Vector3d::UnitZ());
    }
    options_.step = AssemblyStep::Shortest;
    options_.max_iterations = 15;
    options_.continuation_steps = 0;
  }

  VectorXd place(const PlannedPosture& planned, const VectorXd& before) {
    VectorXd base = planned.q.head<7>();
    base[2] -= calcLowering(planned);
    for (const auto& [start, soles] : {std::pair(&before, Soles::AsPlanned), std::pair(&stance_.q, Soles::AsPlanned),
                                       std::pair(&stance_.q, Soles::Tilted)})
      if (const std::optional<VectorXd> q = assemble(base, planned, *start, soles)) return *q;
    VectorXd q = stance_.q;
    q.head<7>() = base;
    return q;
  }

 private:
  // Legs as struts between the feet and points over them, as high as the base in the stance.
  double calcLowering(const PlannedPosture& planned) const {
    constexpr double kLowest = 0.5;  // of the height of the base in the stance
    double lowering = 0;
    for (int i = 0; i < 2; ++i) {
      const Vector3d strut = getBase(planned.q).act(hips_[i]) - planned.feet[i].p;
      const double reach = std::sqrt(std::max(0.0, lengths_[i] * lengths_[i] - strut.head<2>().squaredNorm()));
      lowering = std::max(lowering, strut.z() - std::max(reach, kLowest * lengths_[i]));
    }
    return lowering;
  }

  std::optional<VectorXd> assemble(const VectorXd& base, const PlannedPosture& planned, const VectorXd& start,
                                   Soles soles) {
    AssemblyProblem problem;
    problem.q_ref = start;
    problem.q_ref.head<7>() = base;
    problem.frames.push_back({"base", 1, SE3(), getBase(base)});
    for (int i = 0; i < 2; ++i) {
      const ContactFrame& contact = model_.contacts()[stance_.contacts[i]];
      problem.frames.push_back({contact.name, contact.body, contact.X_BF, planned.feet[i]});
      if (soles == Soles::Tilted || contact.kind != ContactKind::Surface6D)
        problem.frames.back().mask.tail<3>().setConstant(false);
    }
    AssemblyResult result = bielle::assemble(model_, problem, options_);
    if (result.status != AssemblyStatus::Closed || !keepsBranches(result.q)) return {};
    return std::move(result.q);
  }

  bool keepsBranches(const VectorXd& q) {
    updatePositions(model_, ws_, q);
    const VectorXd none;
    VectorXd value(1);
    for (const std::unique_ptr<Residual>& transmission : transmissions_) {
      transmission->calc({model_, ws_, closures_, none, none}, value);
      if (!(value[0] > kLeastTransmission && value[0] * kLeastTransmission < 1)) return false;
    }
    return true;
  }

  const Model& model_;
  const Stance& stance_;
  Workspace ws_;
  ConstraintSet closures_;
  std::vector<std::unique_ptr<Residual>> transmissions_;
  std::array<Vector3d, 2> hips_;   // in the base
  std::array<double, 2> lengths_;  // of the struts, m
  AssemblyOptions options_;
};

}  // namespace

std::vector<VectorXd> placeFeet(const Model& model, const Stance& stance, const std::vector<PlannedPosture>& postures) {
  FeetPlacer placer(model, stance);
  std::vector<VectorXd> qs;
  for (const PlannedPosture& planned : postures) qs.push_back(placer.place(planned, qs.empty() ? stance.q : qs.back()));
  return qs;
}

}  // namespace bielle
