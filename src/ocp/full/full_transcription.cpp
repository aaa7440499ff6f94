// The full formulation, x = (q, v) of the spanning tree: steps (full_step.h), impacts, dq+ = dq, dv+ = D_q dq + D_v dv
// (dynamics/impact.h), and costs.
#include "dynamics/linkage_workspace.h"
#include "math/lane_product.h"
#include "model/joint.h"
#include "ocp/full/full_state_cost.h"
#include "ocp/full/full_step.h"

namespace bielle {
namespace {

struct FullScratch : ProblemScratch {
  FullScratch(const Model& model, int most_constraint_rows) : step(model, most_constraint_rows) {}
  FullStepScratch step;
  LinkageWorkspaces linkages;
  ResidualJacobians jacobians;
  CountedRows counted;
  VectorXd difference;      // nv
  MatrixXd Rx, Ru, scaled;  // total derivatives of the residuals; those times the second derivatives
  VectorXd Rs;              // those by the time scale
  VectorXd no_squares;      // gradient of what is no sum of squares
  // All with room for the residuals of any node.
};

class FullTranscription : public Transcription {
 public:
  FullTranscription(const Model& model, const NodeList& nodes) : Transcription(model, nodes) {}

  int tangentSize() const override { return 2 * model_.nv(); }
  int batchSize() const override { return 1; }

  std::unique_ptr<RobotEvaluation> makeEvaluation() const override { return std::make_unique<FullEvaluation>(model_); }

  std::unique_ptr<ProblemScratch> makeScratch() const override {
    const auto [rows, blocks, constraint_rows] = sizes_;
    auto out = std::make_unique<FullScratch>(model_, constraint_rows);
    out->difference.setZero(model_.nv());
    for (MatrixXd* m : {&out->jacobians.q, &out->jacobians.v}) m->setZero(rows, model_.nv());
    out->jacobians.lambda.setZero(rows, constraint_rows);
    for (MatrixXd* m : {&out->jacobians.u, &out->jacobians.speeds}) m->setZero(rows, model_.nu());
    out->jacobians.s.setZero(rows);
    out->counted.reserve(blocks, rows);
    for (MatrixXd* m : {&out->Rx, &out->scaled}) m->setZero(rows, 2 * model_.nv());
    out->Ru.setZero(rows, model_.nu());
    out->Rs.setZero(rows);
    out->no_squares.setZero(model_.nu() + 1 + 2 * model_.nv());
    return out;
  }

  void evaluate(EvaluateTask* tasks, int count, ProblemScratch* scratch) const override {
    for (int i = 0; i < count; ++i) evaluate(tasks[i], static_cast<FullScratch&>(*scratch));
  }
  void linearize(LinearizeTask* tasks, int count, ProblemScratch* scratch) const override {
    for (int i = 0; i < count; ++i) linearize(tasks[i], static_cast<FullScratch&>(*scratch));
  }
  void integrate(const IntegrateTask* tasks, int count, ProblemScratch*) const override {
    const int nq = model_.nq(), nv = model_.nv();
    for (const IntegrateTask* task = tasks; task != tasks + count; ++task) {
      const VectorXd& x = task->at->x;
      const auto dx = task->dx->tail(2 * nv);
      model_.integrate(x.head(nq), dx.head(nv), task->x_out->head(nq));
      task->x_out->segment(nq, nv) = x.segment(nq, nv) + dx.tail(nv);
    }
  }
  void difference(const DifferenceTask* tasks, int count, ProblemScratch*) const override {
    for (int i = 0; i < count; ++i) calcDifference(tasks[i].at->x, *tasks[i].x1, tasks[i].dx->tail(2 * model_.nv()));
  }
  void mapGains(const RobotEvaluation&, const RowMatrixXd& K, RowMatrixXd& gains) const override {
    gains = K.rightCols(2 * model_.nv());
  }

 private:
  void evaluate(EvaluateTask& task, FullScratch& scratch) const;
  NumericalStatus updateImpactStep(int node, FullEvaluation& at) const;

  void linearize(LinearizeTask& task, FullScratch& scratch) const;
  void setImpact(const FullEvaluation& at, StageModel& out) const;
  void setResiduals(int node, const FullEvaluation& at, const std::vector<char>* wanted, FullScratch& scratch,
                    StageModel& out) const;
  void addSpeedResiduals(int node, const FullEvaluation& at, FullScratch& scratch) const;
  void setControlResiduals(int node, const FullEvaluation& at, FullScratch& scratch, StageModel& out) const;
  void setScaleResiduals(int node, const FullEvaluation& at, FullScratch& scratch, StageModel& out) const;

  void calcDifference(const VectorXd& x0, const VectorXd& x1, VectorRef dx) const {
    const int nq = model_.nq(), nv = model_.nv();
    model_.difference(x0.head(nq), x1.head(nq), dx.head(nv));
    dx.tail(nv) = x1.segment(nq, nv) - x0.segment(nq, nv);
  }
};

void FullTranscription::evaluate(EvaluateTask& task, FullScratch& scratch) const {
  auto& at = static_cast<FullEvaluation&>(*task.out);
  const int node = task.node;
  if (!startEvaluation(task, at)) return;
  if (isRunning(node)) {
    const NumericalStatus status =
        isImpact(node) ? updateImpactStep(node, at) : updateFullStep(model_, specs_[node], scratch.step, at);
    if (status != NumericalStatus::Ok) {
      at.status = status;
      at.failure = getMessage(status);
      return;
    }
    if (!at.x_next.allFinite()) return;
  } else {
    updateNode(model_, at.x, at.ws);
  }
  if (specs_[node].state.weight != 0)
    at.state_cost = calcStateCost(model_, specs_[node].state, at.ws.q, at.ws.v, scratch.difference);
  if (costs_[node].needsSpeeds()) updateSpeeds(model_, at);
  costs_[node].calc(
      {model_, at.ws, specs_[node].constraints, at.u, at.lambda, at.time_scale, &at.speeds, nullptr, &scratch.linkages},
      at);
  finishEvaluation(node, at);
}

NumericalStatus FullTranscription::updateImpactStep(int node, FullEvaluation& at) const {
  if (!at.impact) at.impact = std::make_unique<ImpactWorkspace>(model_);
  updateNode(model_, at.x, at.ws);
  const NumericalStatus status = updateImpact(model_, *at.impact, specs_[node].constraints, at.ws.q, at.ws.v);
  if (status != NumericalStatus::Ok) return status;
  at.lambda = at.impact->impulse;
  at.a.setZero();
  at.x_next.head(model_.nq()) = at.ws.q;
  at.x_next.segment(model_.nq(), model_.nv()) = at.impact->v_plus;
  return status;
}

void FullTranscription::linearize(LinearizeTask& task, FullScratch& scratch) const {
  auto& at = static_cast<FullEvaluation&>(*task.at);
  const int node = task.node;
  const TimeScalePlace& place = nodes_.places[node];
  StageModel& out = *task.out;
  task.status = NumericalStatus::Failed;
  task.failure.clear();
  if (isRunning(node)) {
    const NumericalStatus status =
        isImpact(node) ? updateImpactDerivatives(model_, *at.impact, specs_[node].constraints)
                       : updateFullStepDerivatives(model_, specs_[node], place.isFree(), scratch.step, at);
    if (status != NumericalStatus::Ok) {
      task.status = status;
      task.failure = getMessage(status);
      return;
    }
    if (costs_[node].needsSpeeds() && specs_[node].step == StepRule::Midpoint)
      updateSpeedDerivatives(model_, place.isFree(), scratch.step, at);
    auto gap = out.gap.tail(2 * model_.nv());
    calcDifference(task.next->x, at.x_next, gap);
    if (isImpact(node))
      setImpact(at, out);
    else
      setFullStep(model_, specs_[node], place.isFree(), at, gap, scratch.step, out);
    setNextTimeScale(place, at, task.next->x, out);
  }
  out.cost = at.cost;
  setResiduals(node, at, task.rows, scratch, out);
  MatrixMap lxx = out.lxx();
  addStateCost(model_, specs_[node].state, costs_[node].getScale(at), at.ws.q, at.ws.v, scratch.difference,
               out.lx.tail(2 * model_.nv()), lxx.bottomRightCorner(2 * model_.nv(), 2 * model_.nv()));
  if (isRunning(node)) costs_[node].addControlCost(at, out);
  if (place.isFree()) addTimeScaleCost(countLeading(model_, place), at, scratch.no_squares, out);
  if (isFinite(out)) task.status = NumericalStatus::Ok;
}

void FullTranscription::setImpact(const FullEvaluation& at, StageModel& out) const {
  const int nv = model_.nv();
  RowMatrixMap Fx = out.Fx();
  out.Fu().setZero();
  Fx.topRows(nv).setZero();
  Fx.bottomLeftCorner(nv, nv) = at.impact->dv_dq;
  Fx.bottomRightCorner(nv, nv) = at.impact->dv_dv;
  for (const Joint& joint : model_.joints()) {
    if (joint.nv == 0) continue;
    JointMatrix Jdiff(joint.nv, joint.nv);
    calcJointDifferenceJacobian(joint, out.gap.segment(joint.idx_v, joint.nv), Jdiff);
    Fx.block(joint.idx_v, joint.idx_v, joint.nv, joint.nv) = Jdiff;
  }
}

// Gauss-Newton terms, whatever `out` held; at a running stage forces and controls take part.
void FullTranscription::setResiduals(int node, const FullEvaluation& at, const std::vector<char>* wanted,
                                     FullScratch& scratch, StageModel& out) const {
  const int nv = model_.nv();
  costs_[node].selectRows(at, wanted, scratch.counted);
  const int rows = scratch.counted.rows;
  out.lx.setZero();
  out.lu.setZero();
  out.hessian().setZero();
  scratch.no_squares.setZero();
  if (rows == 0) return;
  ResidualJacobians& jacobians = scratch.jacobians;
  for (MatrixXd* m : {&jacobians.q, &jacobians.v, &jacobians.lambda, &jacobians.u, &jacobians.speeds})
    m->topRows(rows).setZero();
  jacobians.s.head(rows).setZero();
  costs_[node].differentiate(
      {model_, at.ws, specs_[node].constraints, at.u, at.lambda, at.time_scale, &at.speeds, nullptr, &scratch.linkages},
      scratch.counted, jacobians);
  if (costs_[node].needsSpeeds()) addSpeedResiduals(node, at, scratch);
  const auto gradient = scratch.counted.gradient.head(rows), hessian = scratch.counted.hessian.head(rows);
  const auto by_forces = jacobians.lambda.topLeftCorner(rows, specs_[node].constraints.rows);
  auto Rx = scratch.Rx.topRows(rows);
  auto scaled = scratch.scaled.topRows(rows);
  Rx.leftCols(nv) = jacobians.q.topRows(rows);
  Rx.rightCols(nv) = jacobians.v.topRows(rows);
  if (isRunning(node) && isImpact(node)) {
    Rx.leftCols(nv).noalias() += by_forces * at.impact->dimpulse_dq;
    Rx.rightCols(nv).noalias() += by_forces * at.impact->dimpulse_dv;
  } else if (isRunning(node)) {
    Rx.leftCols(nv).noalias() += by_forces * at.cws.dlambda_dq;
    Rx.rightCols(nv).noalias() += by_forces * at.cws.dlambda_dv;
  }
  scratch.counted.visitConstraints(out, [&](int row, double unit, auto column) {
    column.setZero();
    column.tail(2 * nv) = Rx.row(row).transpose() / unit;
  });
  scaled = hessian.asDiagonal() * Rx;
  out.lx.tail(2 * nv).noalias() = Rx.transpose() * gradient;
  out.lxx().bottomRightCorner(2 * nv, 2 * nv).noalias() = Rx.transpose() * scaled;
  if (!isRunning(node) || (isImpact(node) && !costs_[node].needsControls())) return;
  setControlResiduals(node, at, scratch, out);
  if (nodes_.places[node].isFree()) setScaleResiduals(node, at, scratch, out);
}

// Derivatives by speeds of motors become those by q, v, u and s.
void FullTranscription::addSpeedResiduals(int node, const FullEvaluation& at, FullScratch& scratch) const {
  ResidualJacobians& jacobians = scratch.jacobians;
  const auto by_speeds = jacobians.speeds.topRows(scratch.counted.rows);
  if (specs_[node].step == StepRule::Euler) {
    for (int m = 0; m < model_.nu(); ++m)
      jacobians.v.col(model_.motors()[m].dof).head(by_speeds.rows()) += by_speeds.col(m);
    return;
  }
  const FullEvaluation::Midpoint& mid = *at.midpoint;
  jacobians.q.topRows(by_speeds.rows()).noalias() += by_speeds * mid.speeds_q;
  jacobians.v.topRows(by_speeds.rows()).noalias() += by_speeds * mid.speeds_v;
  jacobians.u.topRows(by_speeds.rows()).noalias() += by_speeds * mid.speeds_u;
  jacobians.s.head(by_speeds.rows()).noalias() += by_speeds * mid.speeds_s;
}

// The part of the controls, after that of the state.
void FullTranscription::setControlResiduals(int node, const FullEvaluation& at, FullScratch& scratch,
                                            StageModel& out) const {
  const int nv = model_.nv(), nu = model_.nu(), rows = scratch.counted.rows;
  const auto gradient = scratch.counted.gradient.head(rows), hessian = scratch.counted.hessian.head(rows);
  auto Ru = scratch.Ru.topRows(rows);
  auto scaled = scratch.scaled.topRows(rows);
  auto scaled_Ru = scaled.leftCols(nu);
  Ru = scratch.jacobians.u.topRows(rows);
  if (!isImpact(node))  // motors have no say in an impact
    Ru.noalias() += scratch.jacobians.lambda.topLeftCorner(rows, specs_[node].constraints.rows) * at.cws.dlambda_du;
  scratch.counted.visitConstraints(
      out, [&](int row, double unit, auto column) { column.head(nu) = Ru.row(row).transpose() / unit; });
  out.lu.head(nu).noalias() = Ru.transpose() * gradient;
  out.lux().topRightCorner(nu, 2 * nv).noalias() = Ru.transpose() * scaled;
  scaled_Ru = hessian.asDiagonal() * Ru;
  out.luu().topLeftCorner(nu, nu).noalias() = Ru.transpose() * scaled_Ru;
}

// The part of the time scale at a fixed factor of the cost: g_s of robot_problem.h Eq. (6).
void FullTranscription::setScaleResiduals(int node, const FullEvaluation& at, FullScratch& scratch,
                                          StageModel& out) const {
  const int nv = model_.nv(), nu = model_.nu(), rows = scratch.counted.rows;
  const auto hessian = scratch.counted.hessian.head(rows);
  auto Rs = scratch.Rs.head(rows);
  Rs = scratch.jacobians.s.head(rows);
  const auto by_forces = scratch.jacobians.lambda.topLeftCorner(rows, specs_[node].constraints.rows);
  if (specs_[node].step == StepRule::Midpoint) Rs.noalias() += by_forces * at.midpoint->lambda_s;
  scratch.counted.visitConstraints(out, [&](int row, double unit, auto column) { column[nu] = Rs[row] / unit; });
  const auto Rx = scratch.Rx.topRows(rows);
  const auto Ru = scratch.Ru.topRows(rows);
  for (const CountedRows::Block& block : scratch.counted.blocks) {
    if (block.square) continue;
    const auto g = scratch.counted.gradient.segment(block.row, block.size);
    VectorXd& no_squares = scratch.no_squares;
    no_squares.head(nu).noalias() += Ru.middleRows(block.row, block.size).transpose() * g;
    no_squares[nu] += Rs.segment(block.row, block.size).dot(g);
    no_squares.tail(2 * nv).noalias() += Rx.middleRows(block.row, block.size).transpose() * g;
  }
  double& gradient = nodes_.places[node].in_controls ? out.lu[nu] : out.lx[0];
  gradient = Rs.dot(scratch.counted.gradient.head(rows));
  MatrixMap H = out.hessian();
  H(nu, nu) = Rs.cwiseAbs2().dot(hessian);
  Rs.array() *= hessian.array();
  H.row(nu).head(nu).noalias() = Rs.transpose() * Ru;
  H.col(nu).tail(2 * nv).noalias() = Rx.transpose() * Rs;
}

std::unique_ptr<Transcription> makeFullTranscription(const Model& model, const NodeList& nodes) {
  return std::make_unique<FullTranscription>(model, nodes);
}

}  // namespace
}  // namespace bielle

extern "C" const bool bielle_full = [] {
  bielle::getFullTranscriptionMaker() = &bielle::makeFullTranscription;
  return true;
}();
