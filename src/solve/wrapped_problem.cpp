#include "solve/wrapped_problem.h"

namespace bielle {

namespace {

WrappedScratch& getScratch(ProblemScratch* memory) { return static_cast<WrappedScratch&>(*memory); }

}  // namespace

StageModel& WrappedScratch::takeModel(const ShootingProblem& problem, int node) {
  const bool running = node < problem.numStages();
  const int ndx = problem.tangentSize(node), nu = running ? problem.controlSize(node) : 0;
  const int ndx_next = running ? problem.tangentSize(node + 1) : 0;
  StageModel& out = models.take([=](const StageModel& model) { return model.hasSizes(ndx, nu, ndx_next); },
                                [=](StageModel& model) { model.resize(ndx, nu, ndx_next); });
  out.setRows(problem.constraintSize(node));
  return out;
}

std::unique_ptr<NodeEvaluation> WrappedProblem::makeEvaluation() const {
  auto out = std::make_unique<WrappedEvaluation>();
  out->inner = inner_.makeEvaluation();
  return out;
}

std::unique_ptr<ProblemScratch> WrappedProblem::makeScratch() const {
  auto out = std::make_unique<WrappedScratch>(inner_);
  const int size = batchSize();
  out->evaluations.reserve(size);
  out->linearizations.reserve(size);
  out->integrations.reserve(size);
  out->differences.reserve(size);
  for (int k = 0; k <= inner_.numStages(); ++k) {  // a whole batch of each size
    out->models.takeBack();
    out->vectors.takeBack();
    for (int i = 0; i < size; ++i) {
      out->takeModel(inner_, k);
      out->takeVector(inner_.tangentSize(k));
      out->takeVector(inner_.stateSize());
    }
  }
  return out;
}

void WrappedProblem::evaluate(EvaluateTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<EvaluateTask>& inner = scratch.evaluations;
  inner.clear();
  for (int i = 0; i < count; ++i) {
    const EvaluateTask& task = tasks[i];
    auto& at = static_cast<WrappedEvaluation&>(*task.out);
    at.x = *task.x;
    if (task.node < numStages()) at.u = *task.u;
    if (task.node < before_) continue;
    at.inner->x = at.x.head(inner_.stateSize());
    if (task.node < numStages()) setControls(task.node, at);
    inner.push_back({task.node - before_, &at.inner->x, &at.inner->u,
                     task.node > before_ ? getInner(task.previous) : nullptr, at.inner.get()});
  }
  inner_.evaluate(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  for (int i = 0; i < count; ++i) {
    auto& at = static_cast<WrappedEvaluation&>(*tasks[i].out);
    if (tasks[i].node >= before_) {
      at.status = at.inner->status;
      at.failure = at.inner->failure;
      at.cost = at.inner->cost;
      at.constraints = at.inner->constraints;
    }
    finish(tasks[i].node, at, scratch.inner.get());
  }
}

void WrappedProblem::linearize(LinearizeTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<LinearizeTask>& inner = scratch.linearizations;
  inner.clear();
  scratch.models.takeBack();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node < before_) continue;
    LinearizeTask task;
    task.node = tasks[i].node - before_;
    task.at = getInner(tasks[i].at);
    task.next = getInner(tasks[i].next);
    task.rows = tasks[i].rows;
    task.out = &scratch.takeModel(inner_, task.node);
    inner.push_back(task);
  }
  inner_.linearize(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  auto done = inner.begin();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node < before_) {
      setModel(tasks[i], nullptr, scratch.inner.get());
      continue;
    }
    tasks[i].status = done->status;
    tasks[i].failure = done->failure;
    if (done->status == NumericalStatus::Ok) setModel(tasks[i], done->out, scratch.inner.get());
    ++done;
  }
}

void WrappedProblem::integrate(const IntegrateTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<IntegrateTask>& inner = scratch.integrations;
  inner.clear();
  scratch.vectors.takeBack();
  for (int i = 0; i < count; ++i) {
    const int node = tasks[i].node - before_;
    if (node < 0) continue;
    VectorXd& dx = scratch.takeVector(inner_.tangentSize(node));
    dx = tasks[i].dx->head(dx.size());
    inner.push_back({node, getInner(tasks[i].at), &dx, &scratch.takeVector(inner_.stateSize())});
  }
  inner_.integrate(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  auto done = inner.begin();
  for (int i = 0; i < count; ++i) {
    VectorXd& x = *tasks[i].x_out;
    if (tasks[i].node < before_) {
      x = start_;
      continue;
    }
    x << *done++->x_out, tasks[i].at->x.tail(added_);
    if (tasks[i].node > 0) x.tail(added_) += tasks[i].dx->tail(added_);
  }
}

void WrappedProblem::difference(const DifferenceTask* tasks, int count, ProblemScratch* memory) const {
  WrappedScratch& scratch = getScratch(memory);
  std::vector<DifferenceTask>& inner = scratch.differences;
  inner.clear();
  scratch.vectors.takeBack();
  for (int i = 0; i < count; ++i) {
    const int node = tasks[i].node - before_;
    if (node < 0) continue;
    VectorXd& x1 = scratch.takeVector(inner_.stateSize());
    x1 = tasks[i].x1->head(x1.size());
    inner.push_back({node, getInner(tasks[i].at), &x1, &scratch.takeVector(inner_.tangentSize(node))});
  }
  inner_.difference(inner.data(), static_cast<int>(inner.size()), scratch.inner.get());
  auto done = inner.begin();
  for (int i = 0; i < count; ++i) {
    if (tasks[i].node < before_) continue;
    const VectorXd& dx = *done++->dx;
    tasks[i].dx->head(dx.size()) = dx;
    if (tasks[i].node > 0) tasks[i].dx->tail(added_) = tasks[i].x1->tail(added_) - tasks[i].at->x.tail(added_);
  }
}

}  // namespace bielle
