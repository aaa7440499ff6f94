#include "bielle/dynamics/closing.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/linkage_workspace.h"
#include "model/joint.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr int kMostClosingSteps = 300;
constexpr double kMet = 1e-11;           // of held coordinates, rad or m
constexpr double kLongestMove = 0.3;     // of a step, over all coordinates of the linkage, rad or m
constexpr double kShortestMove = 1e-11;  // likewise
constexpr double kLeastDamping = 1e-13, kFirstDamping = 1e-6, kMostDamping = 1e6;  // lambda; N is orthonormal
constexpr double kLeastMotion = 0.02;  // the least that held coordinates move in a unit motion of a regular linkage
constexpr double kOpen = 1e-8;         // m or rad
constexpr double kWithin = 2e-5;       // of the largest value, or rad or m: several of the last digits that are told

struct HeldJoint {
  const Joint* own;  // in the model of the linkage
  int joint;         // in the model
  int value;         // first entry of what gives its coordinates
};

// Coordinates of one linkage.
struct Coordinates {
  std::vector<HeldJoint> joints;
  std::vector<int> dofs;    // of the linkage: entries of v
  std::vector<int> owners;  // of each of them, in the model

  int size() const { return static_cast<int>(dofs.size()); }
  void add(const ReducedCluster& cluster, int joint, int value) {
    const auto at = std::find(cluster.joints.begin(), cluster.joints.end(), joint) - cluster.joints.begin();
    const Joint& own = cluster.model.joints()[static_cast<size_t>(at) + 1];  // the first one is the root
    joints.push_back({&own, joint, value});
    for (int k = 0; k < own.nv; ++k) {
      dofs.push_back(own.idx_v + k);
      owners.push_back(joint);
    }
  }
};

// From q to what is asked for, in tangent coordinates (nv); quaternions there may be rounded.
void calcHeldGap(const Joint& joint, ConstVectorRef q, ConstVectorRef asked, VectorRef gap) {
  Eigen::Matrix<double, 7, 1> to;
  to.head(joint.nq) = asked;
  if (joint.kind == JointKind::Spherical || joint.kind == JointKind::FreeFlyer) to.segment<4>(joint.nq - 4).normalize();
  calcJointDifference(joint, q, to.head(joint.nq), gap);
}

// A linkage that follows coordinates, by Eq. (1).
class HeldLinkage {
 public:
  explicit HeldLinkage(std::shared_ptr<const ReducedCluster> cluster)
      : cluster_(std::move(cluster)),
        scratch_(*cluster_),
        last_(*cluster_),
        state_(*cluster_),
        next_(*cluster_),
        A_(MatrixXd::Zero(cluster_->size, cluster_->size)),
        ldlt_(MatrixXd::Identity(cluster_->size, cluster_->size)),  // copies read what only a factorization writes
        z_(VectorXd::Zero(cluster_->size)),
        d_(VectorXd::Zero(cluster_->model.nv())) {}

  const ReducedCluster& cluster() const { return *cluster_; }
  const VectorXd& q() const { return state_.basis.q; }
  std::vector<Coordinates> sets;  // that can be held

  void prepare() {
    for (const Coordinates& set : sets)
      if (set.size() > gap_.size()) gap_.resize(set.size()), trial_.resize(set.size());
    kept_.resize(cluster_->model.nq());
    for (const Coordinates& set : sets) {
      N_X_.push_back(MatrixXd::Zero(set.size(), cluster_->size));
      svds_.emplace_back(set.size(), cluster_->size);
    }
  }

  bool reset(const Model& model, ConstVectorRef q) {
    gatherConfiguration(model, *cluster_, q, next_.basis.q);
    if (!updateClusterState<double>(*cluster_, scratch_, VectorXd(next_.basis.q), state_)) return false;
    last_ = state_;
    return true;
  }

  // The configuration into q. What is held stays as it is to the last bit if it `is_met`.
  void write(const Model& model, bool is_met, VectorRef q) {
    for (const HeldJoint& held : sets[0].joints)
      kept_.segment(held.own->idx_q, held.own->nq) = q.segment(held.value, held.own->nq);
    scatterConfiguration(model, *cluster_, state_.basis.q, q);
    if (!is_met) return;
    for (const HeldJoint& held : sets[0].joints)
      q.segment(held.value, held.own->nq) = kept_.segment(held.own->idx_q, held.own->nq);
  }

  HeldResult follow(size_t which, ConstVectorRef values) {
    const Coordinates& set = sets[which];
    const int n = set.size();
    HeldResult result;
    if (n == 0) return result;
    state_ = last_;
    double error = updateGap(set, state_, values, gap_);
    double damping = kLeastDamping;
    for (int i = 0; i < kMostClosingSteps && error > 0 && gap_.head(n).cwiseAbs().maxCoeff() > kMet; ++i) {
      if (!takeStep(which, damping)) break;
      const bool is_closed = closeCluster<double>(*cluster_, scratch_, state_.basis, d_, no_guess_, next_);
      const double there = is_closed ? updateGap(set, next_, values, trial_) : error;
      if (is_closed && there < error) {
        std::swap(state_, next_);
        gap_.head(n) = trial_.head(n);
        error = there;
        damping = std::max(0.1 * damping, kLeastDamping);
      } else {
        damping = std::max(8 * damping, kFirstDamping);
        if (damping > kMostDamping) break;
      }
    }
    Eigen::Index worst = 0;
    const double largest = gap_.head(n).cwiseAbs().maxCoeff(&worst);
    const double motion = calcMotion(which);
    if (largest > kMet) {
      result = {NumericalStatus::NotClosed, largest, set.owners[static_cast<size_t>(worst)]};
    } else if (motion < kLeastMotion) {
      result.status = NumericalStatus::NearDeadPoint;
    } else {
      last_ = state_;
    }
    return result;
  }

 private:
  // Half the squared distance.
  static double updateGap(const Coordinates& set, const ClusterState& state, ConstVectorRef values, VectorXd& gap) {
    int row = 0;
    for (const HeldJoint& held : set.joints) {
      const Joint& own = *held.own;
      calcHeldGap(own, state.basis.q.segment(own.idx_q, own.nq), values.segment(held.value, own.nq),
                  gap.segment(row, own.nv));
      row += own.nv;
    }
    return 0.5 * gap.head(row).squaredNorm();
  }

  // d of Eq. (1). False if it is nothing.
  bool takeStep(size_t which, double damping) {
    const Coordinates& set = sets[which];
    const MatrixXd& N = state_.basis.N;
    A_.setZero();
    z_.setZero();
    for (int i = 0; i < set.size(); ++i) {
      const int row = set.dofs[static_cast<size_t>(i)];
      for (Eigen::Index c = 0; c < A_.cols(); ++c) {
        z_[c] += N(row, c) * gap_[i];
        for (Eigen::Index r = c; r < A_.rows(); ++r) A_(r, c) += N(row, r) * N(row, c);
      }
    }
    A_.diagonal().array() += damping;
    ldlt_.compute(A_);
    ldlt_.solveInPlace(z_);
    d_.setZero();
    for (Eigen::Index c = 0; c < z_.size(); ++c)
      for (Eigen::Index k = 0; k < d_.size(); ++k) d_[k] += N(k, c) * z_[c];
    double move = 0;
    for (Eigen::Index k = 0; k < d_.size(); ++k) move = std::max(move, std::abs(d_[k]));
    if (!(move > kShortestMove)) return false;
    if (move > kLongestMove) d_ *= kLongestMove / move;
    return true;
  }

  // The least that what is held moves in a unit motion, of those that move it if there are more freedoms.
  double calcMotion(size_t which) {
    const Coordinates& set = sets[which];
    MatrixXd& N_X = N_X_[which];
    for (int i = 0; i < set.size(); ++i) N_X.row(i) = state_.basis.N.row(set.dofs[static_cast<size_t>(i)]);
    svds_[which].compute(N_X);
    return svds_[which].singularValues().minCoeff();
  }

  std::shared_ptr<const ReducedCluster> cluster_;
  ClusterScratch scratch_;
  ClusterState last_, state_, next_;  // last_ is regular
  MatrixXd A_;                        // of Eq. (1)
  Eigen::LDLT<MatrixXd> ldlt_;
  VectorXd z_, d_, gap_, trial_, kept_, no_guess_;
  std::vector<MatrixXd> N_X_;
  std::vector<Eigen::JacobiSVD<MatrixXd>> svds_;
};

std::vector<HeldLinkage> makeHeldLinkages(const Model& model, ConstVectorRef q) {
  const Reduction reduction = makeReduction(model, q);
  std::vector<HeldLinkage> linkages;
  for (const ReducedCluster& cluster : reduction.clusters) linkages.emplace_back(makeUnweighted(cluster));
  return linkages;
}

int findHeldJoint(const Model& model, const std::string& name) {
  const int index = model.findJoint(name);
  std::vector<std::string> known;
  for (const Joint& joint : model.joints())
    if (joint.nv > 0) known.push_back(joint.name);
  if (index < 0)
    throw InputError(model.name(), "joint '" + name + "'", "there is no such joint",
                     "choose some of: " + listItems(known));
  return index;
}

void addWorst(const HeldResult& one, HeldResult& all) {
  if (one.status == NumericalStatus::NotClosed && !(one.gap <= all.gap))
    all = one;
  else if (all.status == NumericalStatus::Ok)
    all.status = one.status;
}

bool isOpen(const Model& model, ConstVectorRef q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  return !(calcLargestGap(ws, makeConstraintSet(model)) < kOpen);
}

bool resetAll(const Model& model, ConstVectorRef q, std::vector<HeldLinkage>& linkages) {
  if (isOpen(model, q)) return false;
  for (HeldLinkage& linkage : linkages)
    if (!linkage.reset(model, q)) return false;
  return true;
}

}  // namespace

struct LoopCloser::Data {
  Model model;
  std::vector<HeldLinkage> linkages;
};

LoopCloser::LoopCloser(const Model& model, ConstVectorRef q, const std::vector<std::string>& held)
    : data_(std::make_unique<Data>(Data{model, makeHeldLinkages(model, q)})) {
  std::vector<int> joints;
  for (const std::string& name : held) joints.push_back(findHeldJoint(model, name));
  for (HeldLinkage& linkage : data_->linkages) {
    linkage.sets.resize(1);
    for (int joint : joints)
      if (contains(linkage.cluster().joints, joint))
        linkage.sets[0].add(linkage.cluster(), joint, model.joints()[static_cast<size_t>(joint)].idx_q);
    linkage.prepare();
    linkage.reset(model, q);
  }
}
LoopCloser::~LoopCloser() = default;
LoopCloser::LoopCloser(LoopCloser&&) noexcept = default;
LoopCloser& LoopCloser::operator=(LoopCloser&&) noexcept = default;

HeldResult LoopCloser::close(VectorRef q) {
  HeldResult result;
  if (!q.allFinite()) return {NumericalStatus::NotFinite, 0, -1};
  for (HeldLinkage& linkage : data_->linkages) {
    if (linkage.sets[0].size() == 0) continue;
    const HeldResult one = linkage.follow(0, q);
    linkage.write(data_->model, one.status != NumericalStatus::NotClosed, q);
    addWorst(one, result);
  }
  return result;
}

bool LoopCloser::reset(ConstVectorRef q) { return resetAll(data_->model, q, data_->linkages); }

struct LinkageMap::Data {
  Model model;
  std::vector<HeldLinkage> linkages;
  std::vector<int> joints;                  // by motor
  std::vector<std::pair<int, int>> direct;  // motors on joints outside loops: indices of both
  VectorXd q;
};

LinkageMap::LinkageMap(const Model& model, ConstVectorRef q)
    : data_(std::make_unique<Data>(Data{model, makeHeldLinkages(model, q), {}, {}, q})) {
  std::vector<int> joints;
  const auto findLinkage = [this](int joint) {
    return std::find_if(data_->linkages.begin(), data_->linkages.end(),
                        [joint](const HeldLinkage& linkage) { return contains(linkage.cluster().joints, joint); });
  };
  for (int joint : model.serialJoints())
    if (const auto linkage = findLinkage(joint); linkage != data_->linkages.end()) joints.push_back(joint);
  for (const Motor& motor : model.motors())
    if (findLinkage(motor.joint) == data_->linkages.end()) joints.push_back(motor.joint);
  std::sort(joints.begin(), joints.end());
  data_->joints = joints;
  for (HeldLinkage& linkage : data_->linkages) {
    linkage.sets.resize(2);
    const ReducedCluster& cluster = linkage.cluster();
    for (size_t i = 0; i < joints.size(); ++i)
      if (contains(cluster.joints, joints[i])) linkage.sets[0].add(cluster, joints[i], static_cast<int>(i));
    for (int m = 0; m < model.nu(); ++m)
      if (const int joint = model.motors()[static_cast<size_t>(m)].joint; contains(cluster.joints, joint))
        linkage.sets[1].add(cluster, joint, m);
    const std::vector<HeldJoint>& listed = linkage.sets[0].joints;
    const bool are_single =
        std::all_of(listed.begin(), listed.end(), [](const HeldJoint& held) { return held.own->nv == 1; });
    if (listed.size() != linkage.sets[1].joints.size() || !are_single)
      throw InputError(model.name(), "closure '" + cluster.closures.closures.front().name + "'",
                       "its linkage has " + std::to_string(linkage.sets[1].size()) + " motor(s) and " +
                           std::to_string(listed.size()) + " serial joint(s)" +
                           (listed.empty() ? ": no joint is told for what it moves, which may be a body"
                            : are_single   ? ""
                                           : ", of several coordinates"),
                       "list as many of its joints of one coordinate under `serial_joints` as it has motors; where "
                       "motors move a body, as the platform of a delta, close the loops while they are held "
                       "(LoopCloser), and take the place of that body");
    linkage.prepare();
    linkage.reset(model, q);
  }
  for (int m = 0; m < model.nu(); ++m) {
    const int joint = model.motors()[static_cast<size_t>(m)].joint;
    if (findLinkage(joint) != data_->linkages.end()) continue;
    data_->direct.emplace_back(m, static_cast<int>(std::find(joints.begin(), joints.end(), joint) - joints.begin()));
  }
}
LinkageMap::~LinkageMap() = default;
LinkageMap::LinkageMap(LinkageMap&&) noexcept = default;
LinkageMap& LinkageMap::operator=(LinkageMap&&) noexcept = default;

const std::vector<int>& LinkageMap::joints() const { return data_->joints; }
const VectorXd& LinkageMap::q() const { return data_->q; }

namespace {

// From the set `held` of every linkage to the other one.
HeldResult mapAll(const Model& model, std::vector<HeldLinkage>& linkages, size_t held, ConstVectorRef given,
                  VectorRef wanted, VectorXd& q) {
  HeldResult result;
  for (HeldLinkage& linkage : linkages) {
    if (linkage.sets[held].size() == 0) continue;
    addWorst(linkage.follow(held, given), result);
    scatterConfiguration(model, linkage.cluster(), linkage.q(), q);
    const Coordinates& out = linkage.sets[1 - held];
    for (const HeldJoint& joint : out.joints) wanted[joint.value] = linkage.q()[joint.own->idx_q];
  }
  return result;
}

}  // namespace

HeldResult LinkageMap::calcMotors(ConstVectorRef joints, VectorRef motors) {
  Data& d = *data_;
  if (!joints.allFinite()) return {NumericalStatus::NotFinite, 0, -1};
  for (const auto& [motor, joint] : d.direct) {
    motors[motor] = joints[joint];
    d.q[d.model.joints()[static_cast<size_t>(d.joints[static_cast<size_t>(joint)])].idx_q] = joints[joint];
  }
  return mapAll(d.model, d.linkages, 0, joints, motors, d.q);
}

HeldResult LinkageMap::calcJoints(ConstVectorRef motors, VectorRef joints) {
  Data& d = *data_;
  if (!motors.allFinite()) return {NumericalStatus::NotFinite, 0, -1};
  for (const auto& [motor, joint] : d.direct) {
    joints[joint] = motors[motor];
    d.q[d.model.joints()[static_cast<size_t>(d.joints[static_cast<size_t>(joint)])].idx_q] = motors[motor];
  }
  return mapAll(d.model, d.linkages, 1, motors, joints, d.q);
}

bool LinkageMap::reset(ConstVectorRef q) {
  if (!resetAll(data_->model, q, data_->linkages)) return false;
  data_->q = q;
  return true;
}

namespace {

// Of the linkage that is farthest from what is asked of it. Values in reach are told from a little within, so that they can be held
// although they are rounded; those of joints of several coordinates, which may have nothing but a surface in reach, by most digits.
// \param nearest  with the values in reach   \param start  closed
std::string describeUnheld(const Model& model, ConstVectorRef q, const VectorXd& nearest,
                           const std::vector<std::string>& held, const VectorXd& start, const HeldResult& closed) {
  const auto getLinkage = [&model](const Joint& joint) {
    const auto has = [&](const LoopCluster& cluster) { return contains(cluster.dofs, joint.idx_v); };
    return std::find_if(model.clusters().begin(), model.clusters().end(), has) - model.clusters().begin();
  };
  const auto linkage = getLinkage(model.joints()[static_cast<size_t>(closed.joint)]);
  const auto get = [](const Joint& joint, ConstVectorRef all) { return VectorXd(all.segment(joint.idx_q, joint.nq)); };
  const auto format = [](const VectorXd& values) {
    std::string text;
    for (const double value : values)
      text += (text.empty() ? "" : ", ") + formatNumber(value, values.size() > 1 ? "%.13g" : "%.6g");
    return values.size() > 1 ? "(" + text + ")" : text;
  };
  std::vector<std::pair<const Joint*, VectorXd>> joints;  // and how far beyond what is asked for
  double squares = 0, largest = 1;
  for (const std::string& name : held) {
    const Joint& joint = model.joints()[static_cast<size_t>(model.findJoint(name))];
    VectorXd gap(joint.nv);
    calcHeldGap(joint, get(joint, nearest), get(joint, q), gap);
    if (getLinkage(joint) != linkage || gap.cwiseAbs().maxCoeff() <= kMet) continue;
    joints.emplace_back(&joint, -gap);
    squares += gap.squaredNorm();
    largest = std::max(largest, get(joint, nearest).cwiseAbs().maxCoeff());
  }
  std::vector<std::string> names, alone;
  std::string asked, found;
  for (const auto& [joint, gap] : joints) {
    VectorXd within = get(*joint, nearest);
    if (joint->nv == 1) within[0] += kWithin * largest / std::sqrt(squares) * gap[0];
    asked += (names.empty() ? "" : ", ") + format(get(*joint, q));
    found += (names.empty() ? "" : ", ") + format(within);
    names.push_back(joint->name);
    VectorXd only = start;
    only.segment(joint->idx_q, joint->nq) = get(*joint, q);
    if (LoopCloser(model, start, {joint->name}).close(only).status != NumericalStatus::NotClosed)
      alone.push_back(joint->name);
  }
  if (names.size() == 1)
    return "joint '" + names[0] + "' cannot be held at " + asked + ": the nearest value in reach is " + found + ", " +
           formatNumber(closed.gap) + " (rad or m) from it";
  return "joints " + listItems(names) + " cannot be held at " + asked + " together: the nearest values in reach are " +
         found + " (rad or m)" + (alone.empty() ? "" : "; alone, " + listItems(alone) + " can be held where asked");
}

}  // namespace

AssemblyResult closeConfiguration(const Model& model, ConstVectorRef q, const std::vector<std::string>& held,
                                  const AssemblyOptions& options) {
  // The start: near what is held, whatever else has to move.
  AssemblyProblem problem;
  problem.q_ref = q;
  if (!held.empty()) problem.weights = VectorXd::Constant(model.nv(), 1e-3);
  for (const std::string& name : held) {
    const Joint& joint = model.joints()[static_cast<size_t>(findHeldJoint(model, name))];
    problem.weights.segment(joint.idx_v, joint.nv).setOnes();
  }
  AssemblyResult result = assemble(model, problem, options);
  if (result.status != NumericalStatus::Ok || held.empty()) return result;
  const VectorXd start = result.q;
  LoopCloser closer(model, start, held);
  for (const std::string& name : held) {
    const Joint& joint = model.joints()[static_cast<size_t>(model.findJoint(name))];
    result.q.segment(joint.idx_q, joint.nq) = q.segment(joint.idx_q, joint.nq);
  }
  const HeldResult closed = closer.close(result.q);
  if (closed.status != NumericalStatus::NotClosed) return result;
  result.status = NumericalStatus::NotClosed;
  result.worst = "joint '" + model.joints()[static_cast<size_t>(closed.joint)].name + "'";
  result.message = describeUnheld(model, q, result.q, held, start, closed);
  return result;
}

}  // namespace bielle
