#pragma once
// What predictive control solves, window by window. One thread at a time may call it.
#include <functional>
#include <limits>

#include "bielle/dynamics/impact.h"
#include "control/window_grid.h"
#include "motion/robot_size.h"
#include "solve/receding.h"
#include "solve/stopwatch.h"
#include "solve/window.h"

namespace bielle {

class WindowPlanner {
 public:
  // What is known when a stage begins, or later in it. update() of the controller copies into it and allocates nothing.
  struct Request {
    int stage = 0;
    double progress = 0;  // the share of the stage that has passed
    bool again = false;   // it is not the first one in this stage
    Measurement measurement;
    VectorXd u;              // nu, required at this instant
    Clock::time_point made;  // when
  };
  // A policy for the stages that follow, and when it is due.
  struct Draft {
    bool solved = false;  // else the policy is none
    int target = 0;       // stage from which on it is in force
    int skipped = 0;      // stages by which an early or late foot brings the motion ahead, the present one with it
    double advance = 0;   // how far such feet have brought the motion ahead of its plan until now, s
    double awaited = -1;  // the instant of the plan with which a late foot is to stand, s; negative: none is late
    double seconds = 0;   // from its request until it was there
    std::vector<Policy::Stage> stages;
    VectorXd u_hold;
  };
  struct Solution : Draft {
    bool early = false, late = false;  // a foot stands early; a foot that should stand is waited for from now on
    PredictiveSolve took;
    std::vector<PredictedFoothold> footholds;
  };
  // Where a draft of the solution goes, by the full step of the solver's models before that is rolled out, and what is then called.
  struct Preview {
    Draft draft;
    std::function<void()> publish;
  };

  WindowPlanner(std::unique_ptr<Horizon> horizon, const PredictiveOptions& options);

  // For the start of the motion.
  Solution makeFirst();
  // From a measurement to its stage, s; infinite where that is the whole stage before.
  static double getLead(const PredictiveOptions& options) {
    return options.lead == 0 ? std::numeric_limits<double>::infinity() : options.lead;
  }

  // Memory for solve(), as large as it needs.
  Solution makeEmpty() const;
  // From the state that is predicted for the end of the stage.
  void solve(const Request& request, Solution& solution, Preview* preview = nullptr);
  // What the solve in the stage that follows can do before its measurement. Without it, the solve does that, too.
  void prepare();

  const Model& model() const { return model_; }
  VectorXd startPosture() const { return problem_.initialState().head(model_.nq()); }
  // By the plan, s. Any thread may ask.
  double getStart(int stage) const { return horizon_->getStart(stage); }

 private:
  const StageSpec& getSpec(int stage) const { return problem_.spec(horizon_->getNode(stage)); }
  bool isImpact(int stage) const { return getSpec(stage).kind == StageKind::Impact; }
  Receding makeSolver(int iterations) const;
  void solveFromRest();
  VectorXd findRest(const Request& request, const RobotEvaluation& step);
  bool predict(const Request& request, Solution& solution);
  bool solveWindow(const Request& request, Solution& solution, Preview* preview);
  bool isPrepared(int first) const;
  void restart(int stage);
  bool move(int first);
  void interpolate(int node, const NodeEvaluation& at, const VectorXd& x, double share, VectorXd& out);
  bool continueState(const WindowGrid::Node& node, size_t k);
  void continueControl(const WindowGrid::Node& node, size_t k);
  void tellTime(const Request& request, Draft& out) const;
  void setWindow();
  void startFromGuess(int stage);
  struct KeptGains {
    int phase = -1;
    RowMatrixXd K;
  };
  bool isNearEnd(int stage) const;
  const RowMatrixXd* findEarlierGains(const Policy::Stage* before, int phase) const;
  void keepGains(int phase, const RowMatrixXd& K);
  int countNodes(int stage, size_t stages) const;
  void makePolicy(const Receding& solver, const ShootingTrajectory& nodes, int stage, Draft& out);

  // window_aims.cpp
  struct AimedLanding {
    int stage = 0, contact = 0;
    StageSpec free;  // as it was made
    // Along x and y of the foothold: s of window_aims.cpp Eq. (1), 1/m, and where the foot lands, m.
    Eigen::Vector2d slope = Eigen::Vector2d::Zero(), off = Eigen::Vector2d::Zero();
  };
  void aimFootholds();
  Eigen::Vector2d findSlope(const AimedLanding& landing);
  void aim(const AimedLanding& landing);
  void walkThrough(std::vector<AimedLanding>& landings);

  // window_feet.cpp
  bool stands(int stage, int contact) const;
  const SE3& getFoothold(int stage, int contact) const;
  bool isOverFoothold(int landing, int contact, ConstVectorRef q);
  int findLanding(int stage, const Measurement& measurement);
  int findLateFoot(int landing, const std::vector<char>& contacts) const;
  void lower(int foot, int landing);
  int chooseNext(const Request& request, Solution& solution);
  void predictFootholds(int stage, Solution& solution);
  static constexpr int kLate = 1;      // stages after its landing at which a foot counts as late
  static constexpr int kLowering = 2;  // stages in which it is then foreseen to land

  const PredictiveOptions options_;
  const std::unique_ptr<Horizon> horizon_;
  RobotProblem& problem_;
  Model model_;
  const RobotSize size_;
  WindowGrid grid_;
  Window window_;
  RobotEvaluator evaluator_;
  std::unique_ptr<ProblemScratch> scratch_;
  ImpactWorkspace impact_;
  Workspace feet_;
  Receding solver_;
  ShootingTrajectory trajectory_, before_;  // of the window, and of that before it
  Foresight foresight_;
  std::vector<VectorXd> past_us_;  // of the stages before the window, as many as it may go back
  double advance_ = 0;  // how far feet that landed early or late have brought the motion ahead of its plan, s
  int checked_ = 0;     // the last stage whose feet were looked for
  // A foot that is waited for, or -1; the stage with which it is to stand; for how long, s.
  struct Late {
    int foot = -1, landing = -1;
    double waited = 0;
  } late_;
  std::unique_ptr<NodeEvaluation> predicted_;  // at x_, if that is its state
  int target_ = -1;                            // of the last solve; negative: it failed, or came late
  bool prepared_ = false;                      // the window for the stage after it
  double prepare_seconds_ = 0;
  bool lowered_ = false;  // stages before the landing of the late foot have been replaced since the window last moved
  // Gains of the last stage of a phase that was far enough from its end; of the present phase and the one before, to which a
  // late foot leads back.
  KeptGains kept_[2];
  VectorXd x_, measured_, u_, dx_;
};

}  // namespace bielle
