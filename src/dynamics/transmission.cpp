// The transmission of a linkage: Eqs. (2) and (3) of linkage.h.
#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "dynamics/idle_spins.h"
#include "dynamics/linkage_workspace.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr double kIdle = 1e-7;  // of motors and output in a unit motion: what is left of gaps

// Bodies of the cluster that carry other joints or soles; if there are none of these, frames, but on what spins.
std::vector<int> findCarriers(const Model& model, const ReducedCluster& cluster) {
  std::vector<int> carriers = listCarriers(model, cluster.joints);
  if (carriers.empty()) {
    std::vector<int> spinning;
    for (const IdleSpin& spin : cluster.spins)
      for (const int b : spin.bodies) spinning.push_back(cluster.joints[b - 1]);
    for (const Frame& frame : model.frames())
      if (contains(cluster.joints, frame.body) && !contains(carriers, frame.body) && !contains(spinning, frame.body) &&
          model.findMotor(model.joints()[frame.body].name) < 0)
        carriers.push_back(frame.body);
  }
  std::sort(carriers.begin(), carriers.end());
  return carriers;
}

// Takes bodies as the output.
void setBodies(const Model& model, const std::vector<int>& bodies, ConstVectorRef q_reference, Linkage& linkage) {
  const ReducedCluster& cluster = *linkage.cluster;
  VectorXd q(cluster.model.nq());
  gatherConfiguration(model, cluster, q_reference, q);
  Workspace ws(cluster.model);
  updatePositions(cluster.model, ws, q);
  for (auto* list : {&linkage.joints, &linkage.joint_dofs, &linkage.joint_positions}) list->clear();
  linkage.joint_names.clear();
  std::vector<std::string> names;
  double size = 0;
  for (int body : bodies) {
    names.push_back(model.bodies()[body].name);
    const auto found = std::find(cluster.joints.begin(), cluster.joints.end(), body);
    Closure twist;
    twist.kind = ClosureKind::Weld6D;
    twist.body1 = static_cast<int>(found - cluster.joints.begin()) + 1;  // the first one is the root
    twist.dofs = cluster.model.supportDofs(twist.body1);
    twist.signs.assign(twist.dofs.size(), 1);
    for (int b = 1; b < cluster.model.numBodies(); ++b)
      size = std::max(size, (ws.X_WB[b].p - ws.X_WB[twist.body1].p).norm());
    linkage.bodies.push_back(std::move(twist));
  }
  linkage.length = size > 0 ? size : 1;
  linkage.output = listItems(names);
}

void scaleLengths(const Linkage& linkage, MatrixXd& rows) {
  for (size_t i = 0; i < linkage.bodies.size(); ++i)
    rows.middleRows<3>(6 * static_cast<Eigen::Index>(i)) /= linkage.length;
}

template <typename Out>
void takeRows(const MatrixXd& all, const std::vector<int>& rows, Out& out) {
  for (size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = all.row(rows[i]);
}

const ReducedCluster& getCluster(const Linkage& linkage, const LoopBases* bases) {
  return bases ? bases->getCluster(linkage.index) : *linkage.cluster;
}

// Positions of the cluster about its root, by those of the robot. \param q  of the cluster
void loadPositions(const ReducedCluster& cluster, ConstVectorRef q, const Workspace& robot, Workspace& ws) {
  ws.q = q;
  const SE3& X_WR = robot.X_WB[cluster.root];
  for (size_t i = 0; i < cluster.joints.size(); ++i) ws.X_WB[i + 1] = X_WR.inverseTimes(robot.X_WB[cluster.joints[i]]);
  ws.stage = WorkspaceStage::Placement;
  updateColumns(cluster.model, ws);
}

// Positions and basis of the cluster at s.q: the robot's and the given one, or by itself.
bool updateBasis(const Linkage& linkage, LinkageWorkspace& s, const Workspace* robot, const LoopBases* bases) {
  const ReducedCluster& cluster = getCluster(linkage, bases);
  if (bases) {
    s.basis = &bases->getBasis(linkage.index);
    loadPositions(cluster, s.q, *robot, s.point.workspace());
  } else {
    if (!s.point.update(cluster, s.q)) return false;
    s.basis = &s.point.basis();
  }
  updateOutput(linkage, s.point.workspace(), s.O);
  return true;
}

// Then T and Q of Eq. (2); false at a dead point of the motors.
bool updateTangent(const Linkage& linkage, LinkageWorkspace& s) {
  const MatrixXd& N = selectMoving(linkage, s, s.basis->N);
  takeRows(N, linkage.motor_dofs, s.N_M);
  s.inverse = s.N_M.inverse();
  s.T.noalias() = N * s.inverse;
  if (linkage.joints.empty()) {
    s.Q.noalias() = s.O * s.T;
  } else {
    takeRows(s.T, linkage.joint_dofs, s.Q);
  }
  return s.Q.allFinite();
}

double calcDeterminant(const LinkageWorkspace::Small& square) {
  switch (square.rows()) {
    case 1:
      return square(0, 0);
    case 2:
      return Eigen::Matrix2d(square).determinant();
    case 3:
      return Matrix3d(square).determinant();
    default:
      return square.determinant();
  }
}

// rho of Eq. (2); of O N instead of Q, rho times det N_M.
double evaluate(const Linkage& linkage, const MatrixXd& Q) {
  LinkageWorkspace::Small square(linkage.size(), linkage.size());
  if (!linkage.joints.empty()) {
    square = Q;
    return calcDeterminant(square) / linkage.reference_volume;
  }
  square = linkage.reference.transpose().lazyProduct(Q);
  const double sign = calcDeterminant(square) < 0 ? -1 : 1;
  square = Q.transpose().lazyProduct(Q);
  return sign * std::sqrt(std::max(0.0, calcDeterminant(square))) / linkage.reference_volume;
}

// The same by the volumes of Eq. (1), which need no inverse. \param basis  of all closed motions
double evaluateByVolumes(const Linkage& linkage, LinkageWorkspace& s, const MatrixXd& basis) {
  const MatrixXd& N = selectMoving(linkage, s, basis);
  takeRows(N, linkage.motor_dofs, s.N_M);
  if (linkage.joints.empty()) {
    s.Q.noalias() = s.O * N;
  } else {
    takeRows(N, linkage.joint_dofs, s.Q);
  }
  const double output = evaluate(linkage, s.Q), motors = calcDeterminant(s.N_M);
  if (motors == 0) return output == 0 ? 0 : std::numeric_limits<double>::infinity();
  return output / motors;
}

// Eq. (3) at the configuration of the last updateTangent(), by the dofs of the cluster.
void updateDerivative(const Linkage& linkage, LinkageWorkspace& s, const ReducedCluster& cluster) {
  const int m = linkage.size();
  const double rho = evaluate(linkage, s.Q);
  // z = (Q^+ O - P_M)^T: by columns the y_j before J^+.
  if (linkage.joints.empty()) {
    s.N_M.noalias() = s.Q.transpose() * s.Q;
    s.inverse = s.N_M.inverse();
    s.Q_inverse.noalias() = s.inverse * s.Q.transpose();
    s.z.noalias() = s.O.transpose() * s.Q_inverse.transpose();
  } else {
    s.N_M = s.Q;
    s.inverse = s.N_M.inverse();
    s.z.setZero();
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < m; ++j) s.z(linkage.joint_dofs[i], j) += s.inverse(j, i);
  }
  for (int j = 0; j < m; ++j) s.z(linkage.motor_dofs[j], j) -= 1;
  s.z.array().colwise() *= cluster.inverse_metric.array();
  s.y.noalias() = s.basis->J * s.z;
  solveGram(*s.basis, s.y);
  s.derivative.setZero();
  for (int j = 0; j < m; ++j) {
    updateDrift(linkage, s, s.T.col(j));
    for (int i = 0; i < cluster.rank; ++i)
      s.derivative.noalias() -= rho * s.y(i, j) * s.drift.row(s.basis->rows[i]).transpose();
    if (linkage.joints.empty()) s.derivative.noalias() += rho * (s.turn.transpose() * s.Q_inverse.row(j).transpose());
  }
}

// s.both: how the columns of a basis move motors and output.
void updateRows(const Linkage& linkage, LinkageWorkspace& s, const MatrixXd& basis) {
  s.both.resize(s.both.rows(), basis.cols());
  takeRows(basis, linkage.motor_dofs, s.both);
  auto output = s.both.bottomRows(s.Q.rows());
  if (linkage.joints.empty()) {
    output.noalias() = s.O * basis;
  } else {
    takeRows(basis, linkage.joint_dofs, output);
  }
}

// Whether no more than as many closed motions as there are motors move motors or output, at the reference.
bool isDetermined(const Model& model, ConstVectorRef q_reference, const Linkage& linkage) {
  if (linkage.cluster->size == linkage.size()) return true;
  LinkageWorkspace s(linkage);
  gatherConfiguration(model, *linkage.cluster, q_reference, s.q);
  if (!updateBasis(linkage, s, nullptr, nullptr)) return false;
  updateRows(linkage, s, s.basis->N);
  s.svd.compute(s.both);
  // Where there are fewer rows than closed motions, the rest of these is idle anyway.
  const VectorXd& values = s.svd.singularValues();
  return values.tail(values.size() - linkage.size()).maxCoeff() < kIdle;
}

// At the reference, where Q_0 may be zero or infinite.
void setReference(const Model& model, ConstVectorRef q_reference, Linkage& linkage) {
  LinkageWorkspace s(linkage);
  gatherConfiguration(model, *linkage.cluster, q_reference, s.q);
  linkage.reference.setZero(s.Q.rows(), s.Q.cols());
  if (updateBasis(linkage, s, nullptr, nullptr) && updateTangent(linkage, s)) linkage.reference = s.Q;
  linkage.reference_volume = evaluate(linkage, linkage.reference);
}

// Gives a linkage its output and its reference. Returns why it has no transmission; "" if it has one.
std::string complete(const Model& model, ConstVectorRef q_reference, Linkage& linkage) {
  const int motors = linkage.size(), mobility = linkage.cluster->size;
  const int spins = static_cast<int>(linkage.cluster->spins.size());
  const std::string counts =
      std::to_string(motors) + (motors == 1 ? " motor" : " motors") + " for a mobility of " + std::to_string(mobility);
  linkage.idle = mobility + spins - motors;
  if (motors == 0 || mobility < motors) return counts;
  if (motors > kMostLinkageMobility) return counts + ", over " + std::to_string(kMostLinkageMobility);
  const bool moves_bodies = static_cast<int>(linkage.joint_dofs.size()) != motors;
  if (moves_bodies) {
    const std::vector<int> bodies = findCarriers(model, *linkage.cluster);
    if (bodies.empty()) return "no serial joints, and nothing on its bodies";
    setBodies(model, bodies, q_reference, linkage);
  }
  if (!isDetermined(model, q_reference, linkage)) return counts;
  setReference(model, q_reference, linkage);
  if (moves_bodies && !hasReference(linkage)) return "what it carries stands still at the start";
  return "";
}

}  // namespace

bool hasReference(const Linkage& linkage) {
  constexpr double kSingular = 1e-9;
  const double volume = std::abs(linkage.reference_volume);
  return volume > kSingular && volume < 1 / kSingular;
}

std::vector<Linkage> listLinkagesAnywhere(const Model& model, ConstVectorRef q_reference) {
  std::vector<Linkage> out;
  if (model.closures().empty()) return out;
  for (Linkage& linkage : selectLinkages(model, makeReduction(model, q_reference)))
    if (complete(model, q_reference, linkage).empty()) out.push_back(std::move(linkage));
  return out;
}

std::vector<LinkageLeftOut> listLinkagesLeftOut(const Model& model, ConstVectorRef q_reference) {
  std::vector<LinkageLeftOut> out;
  if (model.closures().empty()) return out;
  for (Linkage& linkage : selectLinkages(model, makeReduction(model, q_reference))) {
    if (linkage.cluster->size == 0) continue;  // nothing moves
    const std::string name = linkage.joints.empty()
                                 ? "closure " + model.closures()[linkage.cluster->closure_indices.front()].name
                                 : linkage.output;
    const std::string why = complete(model, q_reference, linkage);
    if (!why.empty()) out.push_back({name, why, linkage.size() > 0});
  }
  return out;
}

std::vector<Linkage> listLinkages(const Model& model, ConstVectorRef q_reference) {
  std::vector<Linkage> out = listLinkagesAnywhere(model, q_reference);
  for (const Linkage& linkage : out)
    if (!hasReference(linkage))
      throw InputError(model.name(), "linkage of joint '" + model.joints()[linkage.cluster->joints.front()].name + "'",
                       "the given posture is a dead point", "give another posture");
  return out;
}

LinkageWorkspace::LinkageWorkspace(const Linkage& linkage)
    : point(*linkage.cluster),
      q(linkage.cluster->model.nq()),
      T(linkage.cluster->dofs.size(), linkage.size()),
      z(T),
      y(linkage.cluster->rank, linkage.size()),
      drift(linkage.cluster->numRows(), linkage.cluster->dofs.size()),
      O(MatrixXd::Zero(6 * static_cast<Eigen::Index>(linkage.bodies.size()), T.rows())),
      turn(O),
      Q(linkage.bodies.empty() ? T.cols() : O.rows(), T.cols()),
      Q_inverse(Q.cols(), Q.rows()),
      both(T.cols() + Q.rows(), linkage.size() + linkage.idle),
      N(T),
      derivative(T.rows()),
      N_M(T.cols(), T.cols()),
      inverse(N_M) {
  if (linkage.idle > 0) svd = Eigen::JacobiSVD<MatrixXd>(both.rows(), both.cols(), Eigen::ComputeThinV);
}

LinkageWorkspace& LinkageWorkspaces::get(const Linkage& linkage) {
  for (const auto& [cluster, workspace] : all_)
    if (cluster == linkage.cluster) return *workspace;
  return *all_.emplace_back(linkage.cluster, std::make_unique<LinkageWorkspace>(linkage)).second;
}

double calcTransmission(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model, ConstVectorRef q) {
  LinkageWorkspace& s = memory.get(linkage);
  gatherConfiguration(model, *linkage.cluster, q, s.q);
  return updateBasis(linkage, s, nullptr, nullptr) ? evaluateByVolumes(linkage, s, s.basis->N) : 0;
}

double calcTransmission(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model, const Workspace& robot,
                        const LoopBases* bases) {
  if (!bases) return calcTransmission(linkage, memory, model, robot.q);
  LinkageWorkspace& s = memory.get(linkage);
  if (linkage.joints.empty()) {  // joints need no kinematics
    gatherConfiguration(model, *linkage.cluster, robot.q, s.q);
    updateBasis(linkage, s, &robot, bases);
  }
  return evaluateByVolumes(linkage, s, bases->getBasis(linkage.index).N);
}

double calcTransmission(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model, ConstVectorRef q,
                        VectorRef gradient) {
  LinkageWorkspace& s = memory.get(linkage);
  gatherConfiguration(model, *linkage.cluster, q, s.q);
  gradient.setZero();
  if (!updateBasis(linkage, s, nullptr, nullptr)) return 0;
  if (!updateTangent(linkage, s)) return evaluateByVolumes(linkage, s, s.basis->N);
  updateDerivative(linkage, s, *linkage.cluster);
  for (int j = 0; j < linkage.size(); ++j) gradient[linkage.motors[j]] = s.derivative.dot(s.T.col(j));
  return evaluate(linkage, s.Q);
}

double calcTransmission(const Linkage& linkage, const Model& model, ConstVectorRef q) {
  LinkageWorkspaces memory;
  return calcTransmission(linkage, memory, model, q);
}

double calcTransmissionJacobian(const Linkage& linkage, LinkageWorkspaces& memory, const Model& model,
                                const Workspace& robot, MatrixRef row, const LoopBases* bases) {
  LinkageWorkspace& s = memory.get(linkage);
  gatherConfiguration(model, *linkage.cluster, robot.q, s.q);
  const std::vector<int>& dofs = linkage.cluster->dofs;
  for (int dof : dofs) row(0, dof) = 0;
  if (!updateBasis(linkage, s, &robot, bases)) return 0;
  if (!updateTangent(linkage, s)) return std::numeric_limits<double>::infinity();
  updateDerivative(linkage, s, getCluster(linkage, bases));
  for (size_t k = 0; k < dofs.size(); ++k) row(0, dofs[k]) = s.derivative[static_cast<Eigen::Index>(k)];
  return evaluate(linkage, s.Q);
}

const MatrixXd& selectMoving(const Linkage& linkage, LinkageWorkspace& s, const MatrixXd& basis) {
  if (basis.cols() == linkage.size()) return basis;
  updateRows(linkage, s, basis);
  s.svd.compute(s.both);  // what is idle is its null space
  s.N.noalias() = basis * s.svd.matrixV().leftCols(linkage.size());
  return s.N;
}

void updateOutput(const Linkage& linkage, const Workspace& ws, MatrixXd& O) {
  for (size_t i = 0; i < linkage.bodies.size(); ++i)
    calcClosureJacobian<double>(ws, linkage.bodies[i], O.middleRows(6 * static_cast<Eigen::Index>(i), 6));
  scaleLengths(linkage, O);
}

void updateDrift(const Linkage& linkage, LinkageWorkspace& s, ConstVectorRef v) {
  Workspace& ws = s.point.workspace();
  updateDrift(*linkage.cluster, ws, v, s.drift);
  for (size_t i = 0; i < linkage.bodies.size(); ++i)
    calcClosureVelocityDerivative(ws, linkage.bodies[i], s.turn.middleRows(6 * static_cast<Eigen::Index>(i), 6));
  scaleLengths(linkage, s.turn);
}

}  // namespace bielle
