// bielle eval: the constrained dynamics at one state, and their derivatives.
#include <iostream>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/motion.h"
#include "cli/commands.h"
#include "cli/eval_state.h"
#include "model/number_text.h"
#include "results/json_text.h"

namespace bielle::cli {
namespace {

struct EvalArguments {
  RobotArgument robot;
  std::string state;
  bool derivatives = false, close = false;
};

constexpr double kOpen = 1e-6;  // m or rad, and per s relative above 1: gaps and speeds of opening above it are told

// The dynamics at a state, up to date.
struct Evaluation {
  Evaluation(const Model& model, const EvalState& state)
      : constraints(makeConstraintSet(model, makeContactTargets(model, state.q, state.contacts, 0, 0))), ws(model) {
    status = updateConstrainedDynamics(model, ws, cws, constraints, state.q, state.v, calcMotorForces(model, state.u));
  }
  ConstraintSet constraints;
  Workspace ws;
  ConstrainedWorkspace cws;
  NumericalStatus status;
};

// The loop that opens fastest, m/s or rad/s.
double calcLargestOpening(const Evaluation& at, const VectorXd& v, std::string* worst = nullptr) {
  double largest = 0;
  for (int c = 0; c < at.constraints.num_loops; ++c) {
    const Closure& closure = at.constraints.closures[static_cast<size_t>(c)];
    const double opening =
        (at.cws.J.middleRows(at.constraints.offsets[c], getRows(closure.kind)) * v).cwiseAbs().maxCoeff();
    if (opening <= largest) continue;
    largest = opening;
    if (worst) *worst = closure.name;
  }
  return largest;
}

Json listNumbers(const VectorXd& vector) { return std::vector<double>(vector.begin(), vector.end()); }

Json listRows(const MatrixXd& matrix) {
  Json rows = Json::array();
  for (int i = 0; i < matrix.rows(); ++i) rows.push_back(listNumbers(matrix.row(i)));
  return rows;
}

// Expands rows of forces to six rows per constraint of any kind.
MatrixXd expandForces(const ConstraintSet& constraints, const MatrixXd& rows) {
  MatrixXd wrenches(6 * constraints.closures.size(), rows.cols());
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    for (int i = 0; i < rows.cols(); ++i)
      wrenches.block<6, 1>(6 * c, i) =
          expandRows(closure, rows.col(i).segment(constraints.offsets[c], getRows(closure.kind)));
  }
  return wrenches;
}

Json describe(const Model& model, const EvalState& state, const Evaluation& at) {
  Json accelerations = Json::object(), loops = Json::object(), contacts = Json::object(), residuals = Json::object();
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[i];
    accelerations[joint.name] = listNumbers(at.cws.a.segment(joint.idx_v, joint.nv));
  }
  const MatrixXd wrenches = expandForces(at.constraints, at.cws.lambda);
  for (size_t c = 0; c < at.constraints.closures.size(); ++c) {
    const Closure& closure = at.constraints.closures[c];
    const bool loop = static_cast<int>(c) < at.constraints.num_loops;
    (loop ? loops : contacts)[closure.name] = listNumbers(wrenches.col(0).segment<6>(6 * c));
    if (loop) residuals[closure.name] = listNumbers(calcClosureResidual(at.ws, closure));
  }
  const Mobility mobility = calcMobility(model, state.q);
  return {{"robot", model.name()},
          {"order",
           {{"q", makePositionNames(model)},
            {"v", makeVelocityNames(model)},
            {"u", getNames(model.motors())},
            {"lambda", makeWrenchNames(getNames(at.constraints.closures))}}},
          {"q", listNumbers(state.q)},
          {"v", listNumbers(state.v)},
          {"u", listNumbers(state.u)},
          {"accelerations", accelerations},
          {"closure_wrenches", loops},
          {"contact_wrenches", contacts},
          {"closure_residuals", residuals},
          {"largest_gap", calcLargestGap(at.ws, at.constraints)},
          {"largest_opening_speed", calcLargestOpening(at, state.v)},
          {"rank", mobility.rank},
          {"mobility", mobility.mobility},
          {"constraint_error", at.cws.residual},
          {"mass", model.mass()},
          {"com", listNumbers(calcCom(model, at.ws))},
          {"kinetic_energy", calcKineticEnergy(model, at.ws)},
          {"potential_energy", calcPotentialEnergy(model, at.ws)},
          {"mass_matrix_diagonal", listNumbers(at.ws.M.diagonal())},
          {"bias", listNumbers(at.ws.b)}};
}

void requireOk(NumericalStatus status) {
  if (status != NumericalStatus::Ok) throw std::runtime_error(getMessage(status));
}

int evaluate(const EvalArguments& arguments) {
  const LoadedRobot robot = arguments.robot.load();
  EvalState state = readState(robot.model, arguments.state, robot.model.makeNeutral());
  const std::string file = arguments.state == "-" ? "standard input" : arguments.state;
  if (arguments.close) {
    closeState(robot.model, file, state);
    closeMotion(robot.model, file, state);
  }
  Evaluation at(robot.model, state);
  requireOk(at.status);
  std::string worst;
  if (const double gap = calcLargestGap(at.ws, at.constraints, &worst); gap > kOpen)
    std::cerr << "bielle: warning: " << file << ": closure '" << worst << "' is open by " << formatNumber(gap, "%.3g")
              << " (m or rad): the robot cannot be in this state; give one whose loops are closed, or --close\n";
  else if (const double opening = calcLargestOpening(at, state.v, &worst);
           opening > kOpen * (1 + state.v.lpNorm<Eigen::Infinity>()))
    std::cerr << "bielle: warning: " << file << ": closure '" << worst << "' opens at " << formatNumber(opening, "%.3g")
              << " (m/s or rad/s): the robot cannot move so; give velocities that keep its loops closed, or --close\n";
  Json json = describe(robot.model, state, at);
  if (arguments.derivatives) {
    requireOk(updateConstrainedDerivatives(robot.model, at.ws, at.cws, at.constraints));
    const ConstrainedWorkspace& cws = at.cws;
    json["da_dq"] = listRows(cws.da_dq);
    json["da_dv"] = listRows(cws.da_dv);
    json["da_du"] = listRows(cws.da_du);
    json["dlambda_dq"] = listRows(expandForces(at.constraints, cws.dlambda_dq));
    json["dlambda_dv"] = listRows(expandForces(at.constraints, cws.dlambda_dv));
    json["dlambda_du"] = listRows(expandForces(at.constraints, cws.dlambda_du));
  }
  std::cout << formatJson(json) << "\n";
  return kOk;
}

}  // namespace

void addEval(CLI::App& command, Action& action) {
  const auto arguments = std::make_shared<EvalArguments>();
  addRobot(command, arguments->robot);
  command.add_option("--state", arguments->state, "JSON file with the state; - for the standard input")->required();
  command.add_flag("--derivatives", arguments->derivatives, "add the derivatives with respect to q, v and u");
  command.add_flag("--close", arguments->close,
                   "close the loops first: joints that the state gives stay as they are and move, if they can");
  addRobotFlags(command, arguments->robot);
  command.footer(std::string(kStateHelp) +
                 "The output is JSON: accelerations by joint (rates of v); wrenches of closures and contacts\n"
                 "(fx fy fz nx ny nz, N and N m, in frame 1, on body 1; for a contact: from the ground on the foot); "
                 "closure residuals; rank and\n"
                 "mobility of the closures; mass, com, energies, the diagonal of the mass matrix and the bias; with "
                 "--derivatives row-major\n"
                 "matrices. Rows and columns are named by `order`: da_* has rows v, dlambda_* rows lambda; *_dq has "
                 "columns v (the tangent of q),\n"
                 "*_du columns u. Without --close the state is taken as it is; largest_gap is the largest residual of "
                 "a loop (m or rad),\nlargest_opening_speed that of its rate. Where closures are redundant, forces "
                 "have the least norm.\n"
                 "Examples:\n"
                 "  bielle eval bipetto --state state.json --derivatives\n"
                 "  echo '{\"torques\": {\"crank_joint\": 1}}' | bielle eval fourbar --state -");
  command.callback([&action, arguments] { action = [arguments] { return evaluate(*arguments); }; });
}

}  // namespace bielle::cli
