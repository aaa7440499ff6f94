#include "formats/mjcf_softness.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr double kLeastWeight = 1e-15;  // mjMINVAL

class WeightCalculator {
 public:
  WeightCalculator(const Model& model, const MjcfSoftness& file) : model_(model), file_(file), ws_(model) {
    VectorXd q = model.makeNeutral();
    for (const Joint& joint : model.joints())
      if (const auto start = file.start.find(joint.name); start != file.start.end())
        q.segment(joint.idx_q, joint.nq) = Eigen::Map<const VectorXd>(start->second.data(), joint.nq);
    updatePositions(model, ws_, q);
    updateVelocities(model, ws_, VectorXd::Zero(model.nv()));
    updateMassMatrix(model, ws_);
    // What the file has no coordinate for follows others.
    std::vector<int> all(model.nv());
    for (int k = 0; k < model.nv(); ++k) all[k] = k;
    std::vector<SoftEquality> soft(file.equalities.size());
    for (size_t i = 0; i < soft.size(); ++i) {
      soft[i].closure = model.closures()[model.findClosure(file.equalities[i].closure)];
      soft[i].weight = soft[i].scale = VectorXd::Ones(getRows(soft[i].closure.kind));
    }
    const MatrixXd Z = SoftLoops(model, soft, file.step).makeDirections(q, all);
    const MatrixXd reduced = Z.transpose() * ws_.M * Z;
    const Eigen::LLT<MatrixXd> factors(reduced);
    inverse_ = Z * MatrixXd(factors.solve(MatrixXd(Z.transpose())));
  }

  VectorXd calc(const MjcfEquality& equality, const Closure& closure, MujocoVersion version) const {
    VectorXd weight = VectorXd::Zero(getRows(closure.kind));
    if (closure.kind == ClosureKind::Distance) {
      MatrixXd row = MatrixXd::Zero(1, model_.nv());
      calcClosureResidualJacobian(ws_, closure, row);
      weight << (row * inverse_ * row.transpose()).value();
    } else if (closure.kind == ClosureKind::Coupler) {
      for (const std::map<std::string, double>& sum : equality.sums) weight.array() += calcSum(sum);
    } else {
      for (const std::string& link : equality.links) {
        const Eigen::Vector2d side = calcBody(link, version);
        weight.head<3>().array() += side[0];
        if (weight.size() == 6) weight.tail<3>().array() += side[version == MujocoVersion::Two ? 0 : 1];
      }
    }
    return weight;
  }

 private:
  // Of translations and of rotations.
  Eigen::Vector2d calcBody(const std::string& link, MujocoVersion version) const {
    const auto found = file_.bodies.find(link);
    if (found == file_.bodies.end()) return {0, 0};  // the world
    const Frame& frame = model_.frames()[model_.findFrame(link)];
    if (found->second.slides && version != MujocoVersion::Two) return {1 / model_.bodies()[frame.body].inertia.mass, 0};
    const MatrixXd J =
        calcFrameJacobian(model_, ws_, frame.body, frame.X_BF * SE3(Matrix3d::Identity(), found->second.centre));
    const VectorXd diagonal = (J * inverse_ * J.transpose()).diagonal();
    return {diagonal.head<3>().mean(), diagonal.tail<3>().mean()};
  }

  double calcSum(const std::map<std::string, double>& sum) const {
    VectorXd row = VectorXd::Zero(model_.nv());
    for (const auto& [joint, coefficient] : sum) row[model_.joints()[model_.findJoint(joint)].idx_v] = coefficient;
    return row.dot(inverse_ * row);
  }

  const Model& model_;
  const MjcfSoftness& file_;
  Workspace ws_;
  MatrixXd inverse_;  // of the mass matrix
};

}  // namespace

SoftLoops makeSoftLoops(const Model& model, const MjcfSoftness& file, MujocoVersion version) {
  const WeightCalculator weights(model, file);
  std::vector<SoftEquality> equalities;
  for (const MjcfEquality& equality : file.equalities) {
    SoftEquality soft;
    soft.name = equality.name;
    soft.settings = equality.settings;
    soft.closure = model.closures()[model.findClosure(equality.closure)];
    Closure& closure = soft.closure;
    if (closure.kind == ClosureKind::Hinge5D) {
      closure.kind = ClosureKind::Ball3D;
      closure.X_B1.p = closure.X_B1.act(equality.lever * closure.axis);
      closure.X_B2.p = closure.X_B2.act(equality.lever * closure.axis);
    }
    soft.weight = weights.calc(equality, closure, version).cwiseMax(kLeastWeight);
    soft.has_bias = version == MujocoVersion::ThreeSeven &&
                    (closure.kind == ClosureKind::Ball3D || closure.kind == ClosureKind::Weld6D);
    soft.scale = VectorXd::Ones(soft.weight.size());
    if (closure.kind == ClosureKind::Weld6D) soft.scale.tail<3>().setConstant(0.5);
    equalities.push_back(std::move(soft));
  }
  return {model, std::move(equalities), file.step};
}

}  // namespace bielle
