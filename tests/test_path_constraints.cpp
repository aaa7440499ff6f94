// Path constraints of a robot's problem: their rows by central differences in tangent space, in both formulations, at steps,
// impacts and the end; what their weights add to a quadratic model; and what does not fit.
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/motion/motion.h"
#include "bielle/robots/robot_loader.h"
#include "check_derivative.h"
#include "weighted_model.h"

using namespace bielle;
using namespace bielle::testing;

namespace {

constexpr double kFree = std::numeric_limits<double>::infinity();

PathConstraint makeConstraint(const std::string& name, std::unique_ptr<Residual> residual, double scale = 1) {
  const int n = residual->size();
  return {name, std::move(residual), VectorXd::Constant(n, -1), VectorXd::Constant(n, kFree),
          VectorXd::LinSpaced(n, scale, 1.5 * scale)};
}

// A step or an impact with both feet on the ground, and a terminal node, with rows that look at q, v and the forces.
RobotProblem makeConstrainedProblem(const Model& model, const VectorXd& q, StageKind kind, Formulation formulation) {
  std::vector<StageSpec> stages(2);
  StageSpec& stage = stages[0];
  stage.kind = kind;
  stage.dt = kind == StageKind::Impact ? 0 : 0.012;
  stage.constraints = makeConstraintSet(model, makeContactTargets(model, q, {0, 1}, 0, 50));
  stage.costs.push_back({"com", 3, Activation::makeQuadratic(Vector3d::Ones()), makeComPosition(Vector3d::Ones())});
  for (int c = stage.constraints.num_loops; c < static_cast<int>(stage.constraints.closures.size()); ++c)
    stage.path_constraints.push_back(
        makeConstraint("cone " + std::to_string(c), makeWrenchCone(stage.constraints, c, 0.05, 0.03, 0.5), 20));
  stage.path_constraints.push_back(makeConstraint("joints", makeJointPosition(model, {7, 9, 10}), 0.3));
  stage.path_constraints.push_back(makeConstraint("speeds", makeJointVelocity({6, 9}), 4));
  stage.path_constraints.push_back(makeConstraint("powers", makeMotorPower(model, {5, 2}), 2));
  stages[1].dt = 0.012;
  stages[1].path_constraints.push_back(makeConstraint("end", makeComPosition(Vector3d::Zero()), 0.1));
  stages[1].path_constraints.push_back(makeConstraint("rest", makeComVelocity(Vector3d::Zero()), 0.2));
  return RobotProblem(model, q, VectorXd::Zero(model.nv()), std::move(stages), formulation);
}

class Node {
 public:
  Node(const RobotProblem& problem, int node, const VectorXd& x, const VectorXd& u)
      : problem_(problem), node_(node), x_(x), u_(u), at_(problem), next_(problem) {
    at_.evaluate(node, x, u);
    REQUIRE(at_.evaluation().status == NumericalStatus::Ok);
    if (node == 0) next_.evaluate(1, at_.evaluation().x_next);
    tangent_ = at_.integrate(VectorXd::Zero(problem.tangentSize(node)));
  }
  int size() const { return problem_.constraintSize(node_); }
  int nu() const { return node_ == 0 ? problem_.controlSize(0) : 0; }
  VectorXd calc(const VectorXd& dx, const VectorXd& du) {
    RobotEvaluator moved(problem_);
    const VectorXd x = at_.integrate(dx), u = u_ + du;
    const RobotEvaluation& out = moved.evaluate(node_, x, u);
    REQUIRE(out.status == NumericalStatus::Ok);
    return out.constraints;
  }
  MatrixXd differentiate() {
    const double h = 1e-5;
    const int ndx = problem_.tangentSize(node_);
    MatrixXd out(size(), ndx + nu());
    for (int j = 0; j < out.cols(); ++j) {
      VectorXd dx = VectorXd::Zero(ndx), du = VectorXd::Zero(u_.size());
      (j < ndx ? dx[j] : du[j - ndx]) = h;
      out.col(j) = (calc(dx, du) - calc(-dx, -du)) / (2 * h);
    }
    return out;
  }
  StageModel linearize(const std::vector<char>& rows) {
    auto at = problem_.makeEvaluation();
    const auto scratch = problem_.makeScratch();
    EvaluateTask step{node_, &x_, &u_, nullptr, at.get()};
    problem_.evaluate(&step, 1, scratch.get());
    StageModel out;
    out.resize(problem_.tangentSize(node_), nu(), node_ == 0 ? problem_.tangentSize(1) : 0, size());
    LinearizeTask task{
        node_, at.get(), node_ == 0 ? &next_.evaluation() : nullptr, &rows, &out, NumericalStatus::Failed, {}};
    problem_.linearize(&task, 1, scratch.get());
    REQUIRE(task.status == NumericalStatus::Ok);
    return out;
  }

 private:
  const RobotProblem& problem_;
  int node_;
  VectorXd x_, u_, tangent_;
  RobotEvaluator at_, next_;
};

MatrixXd getJacobian(const StageModel& model) {
  MatrixXd out(model.Ct().cols(), model.lx.size() + model.lu.size());
  out << model.Ct().bottomRows(model.lx.size()).transpose(), model.Ct().topRows(model.lu.size()).transpose();
  return out;
}

}  // namespace

TEST_CASE("path constraints: rows and their derivatives, at a step, an impact and the end") {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  std::mt19937 rng(5);
  const Formulation formulation = GENERATE(Formulation::Full, Formulation::Reduced);
  const StageKind kind = GENERATE(StageKind::Dynamics, StageKind::Impact);
  const RobotProblem problem = makeConstrainedProblem(model, q, kind, formulation);
  RobotEvaluator standing(problem);
  standing.evaluate(1, problem.initialState());
  const VectorXd x = standing.integrate(randomVector(rng, problem.tangentSize(1), 0.05));
  const VectorXd u = randomVector(rng, model.nu(), 3);
  for (int k : {0, 1}) {
    CAPTURE(getName(formulation), static_cast<int>(kind), k);
    Node node(problem, k, x, u);
    REQUIRE(node.size() == (k == 0 ? 2 * 17 + 3 + 2 + 2 : 6));
    const StageModel model = node.linearize(listRows(problem, k));
    const MatrixXd rows = getJacobian(model);
    checkDerivative(rows, node.differentiate(), "rows");
    if (k == 0 && kind == StageKind::Dynamics) CHECK(rows.rightCols(node.nu()).norm() > 1e-6);
    // Each alone is the same, to rounding, and leaves the cost as it is.
    for (int i = 0; i < node.size(); ++i) {
      std::vector<char> one(node.size(), false);
      one[i] = true;
      const StageModel alone = node.linearize(one);
      CHECK((getJacobian(alone).row(i) - rows.row(i)).norm() < 1e-12 * (1 + rows.row(i).norm()));
      CHECK((alone.lx - model.lx).norm() + (alone.lu - model.lu).norm() < 1e-12 * (1 + model.lx.norm()));
      CHECK((alone.hessian() - model.hessian()).norm() < 1e-12 * (1 + model.hessian().norm()));
    }
  }
}

TEST_CASE("path constraints: scaled bounds and names") {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const RobotProblem problem = makeConstrainedProblem(model, q, StageKind::Dynamics, Formulation::Reduced);
  VectorXd lower(problem.constraintSize(0)), upper(lower.size());
  problem.getConstraintBounds(0, lower, upper);
  CHECK(lower[0] == Approx(-1.0 / 20));
  CHECK(upper[0] == kFree);
  CHECK(lower[34] == Approx(-1 / 0.3));
  CHECK(problem.getConstraintName(0, 35) == "joints, row 1");
  CHECK(problem.getConstraintName(1, 4) == "rest, row 1");
}

namespace {

// Not a number where the base is lower.
struct Root : Residual {
  explicit Root(double height) : limit(height) {}
  int size() const override { return 1; }
  void calc(const NodeView& node, VectorRef r) const override { r[0] = std::sqrt(node.ws.q[2] - limit); }
  void calcJacobian(const NodeView& node, ResidualRows rows) const override {
    rows.q(0, 2) = 0.5 / std::sqrt(node.ws.q[2] - limit);
  }
  double limit;
};

}  // namespace

TEST_CASE("path constraints and costs that are not a number: the node fails, and says of which name") {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const Formulation formulation = GENERATE(Formulation::Full, Formulation::Reduced);
  for (const bool is_cost : {false, true})
    for (const double above : {-0.1, 0.1}) {
      std::vector<StageSpec> stages(3);
      for (StageSpec& stage : stages) {
        stage.dt = 0.01;
        if (&stage != &stages.back())
          stage.constraints = makeConstraintSet(model, makeContactTargets(model, q, {0, 1}, 0, 50));
        stage.path_constraints.push_back(makeConstraint("joint", makeJointPosition(model, {7})));
      }
      auto root = std::make_shared<Root>(q[2] + above);
      if (is_cost)
        stages[2].costs.push_back({"root", 1, Activation::makeQuadratic(VectorXd::Ones(1)), root});
      else
        stages[2].path_constraints.push_back(
            {"root", root, VectorXd::Zero(1), VectorXd::Constant(1, kFree), VectorXd::Ones(1)});
      const RobotProblem problem(model, q, VectorXd::Zero(model.nv()), std::move(stages), formulation);
      RobotEvaluator evaluator(problem);
      const RobotEvaluation& at = evaluator.evaluate(2, problem.initialState());
      CAPTURE(getName(formulation), is_cost, above, at.failure);
      CHECK(at.status == (above > 0 ? NumericalStatus::NotFinite : NumericalStatus::Ok));
      CHECK(at.failure == (above < 0 ? ""
                           : is_cost ? "cost 'root' is not a number"
                                     : "constraint 'root' is not a number"));
      if (above < 0) continue;
      ShootingTrajectory guess{std::vector<VectorXd>(3, problem.initialState()),
                               std::vector<VectorXd>(2, VectorXd::Zero(model.nu()))};
      const FddpSummary summary = solve(problem, std::move(guess)).summary;
      CHECK(summary.termination == FddpTermination::Failed);
      CHECK_THAT(summary.message, Catch::Contains("node 2") && Catch::Contains("'root' is not a number"));
    }
}

TEST_CASE("path constraints that do not fit are refused by name") {
  const Model model = loadRobot(std::string(BIELLE_SOURCE_DIR) + "/robots/bipetto").model;
  const VectorXd q = makeStandingPosture(model);
  const auto make = [&](const std::function<void(std::vector<StageSpec>&)>& change) {
    std::vector<StageSpec> stages(2);
    stages[0].constraints = makeConstraintSet(model, makeContactTargets(model, q, {0, 1}, 0, 50));
    stages[0].path_constraints.push_back(makeConstraint("joint", makeJointPosition(model, {7})));
    change(stages);
    RobotProblem(model, q, VectorXd::Zero(model.nv()), std::move(stages), Formulation::Reduced);
  };
  CHECK_NOTHROW(make([](std::vector<StageSpec>&) {}));
  const auto refuses = [&](const std::string& text, const std::function<void(PathConstraint&)>& change) {
    CHECK_THROWS_WITH(make([&](std::vector<StageSpec>& s) { change(s[0].path_constraints[0]); }),
                      Catch::Contains("path constraint 'joint'") && Catch::Contains(text));
  };
  refuses("size", [](PathConstraint& c) { c.scale.resize(0); });
  refuses("size", [](PathConstraint& c) { c.upper.setConstant(2, 1.0); });
  refuses("scale", [](PathConstraint& c) { c.scale[0] = 0; });
  refuses("exceeds", [](PathConstraint& c) {
    c.lower[0] = kFree;
    c.upper[0] = 1;
  });
  refuses("residual", [](PathConstraint& c) { c.residual.reset(); });
  // Forces at the terminal node, of a constraint and of a cost.
  CHECK_THROWS_WITH(make([](std::vector<StageSpec>& s) {
                      const int c = s[0].constraints.num_loops;
                      s[1].path_constraints.push_back(
                          makeConstraint("late cone", makeWrenchCone(s[0].constraints, c, 0.05, 0.03, 0.5)));
                    }),
                    Catch::Contains("late cone"));
  CHECK_THROWS_WITH(make([](std::vector<StageSpec>& s) {
                      const int c = s[0].constraints.num_loops;
                      s[1].costs.push_back({"late force", 1, Activation::makeQuadratic(Vector6d::Ones()),
                                            makeContactForce(s[0].constraints, c, Vector6d::Zero())});
                    }),
                    Catch::Contains("late force"));
  CHECK_THROWS_WITH(make([&](std::vector<StageSpec>& s) {
                      s[1].path_constraints.push_back(makeConstraint("late power", makeMotorPower(model, {0})));
                    }),
                    Catch::Contains("late power"));
}
