#pragma once
/// \file The result of a solve as three files in a directory, its record (motion/record.h) as a file, and its electrical energy.
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/linkage.h"
#include "bielle/formats/reader.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/motion/lift.h"
#include "bielle/motion/record.h"
#include "bielle/motion/serial_model.h"
#include "bielle/motion/solve.h"

namespace bielle {

/// Eq. (1) of motion/problem_options.h, without smoothing, as a sum over the steps.
struct ElectricalEnergy {
  VectorXd by_motor;             ///< nu, J
  double total = 0;              ///< J
  double regeneration = 0;       ///< share of the regenerated energy that is subtracted
  int num_assumed = 0;           ///< motors without a known loss, for which kDefaultTorqueLoss is assumed
  double distance = 0;           ///< of the centre of mass on the ground, from start to end, m
  double cost_of_transport = 0;  ///< total divided by weight and distance; NaN for less than kLeastDistance

  static constexpr double kLeastDistance = 0.2;  ///< m
};

/// Root mean squares over the time of the motion of the torques c u, c of MotorDrive Eq. (1): what heats the windings (nu), N m
/// or N.
VectorXd calcRmsEfforts(const Model& model, const MotionRecord& record);

/// \param regeneration  within 0 .. 1
ElectricalEnergy calcElectricalEnergy(const Model& model, const MotionRecord& record, double regeneration);

/// One row per node under one header: time, q.<name>, v.<name>, a.<name>, u.<motor>, closure.<name>.<entry>,
/// contact.<name>.<entry>, com.x, com.y, com.z, gap.position, gap.angle and, of midpoint steps, q_mid.<name> and
/// v_mid.<name>. No stage starts at the last node: its cells of a, u, q_mid, v_mid and of the wrenches are empty.
/// Numbers are the shortest that read back to the same bits. Footholds and multipliers are left out. It is for other
/// programs; Bielle reads the archive below.
void writeCsv(const std::string& path, const MotionRecord& record);

/// NumPy archive of the members above by the same names; wrenches are N x closures x 6 and N x contacts x 6, footholds, if there
/// are any, N + 1 x contacts x 8; `cycle` of motions that repeat. Multipliers, if known, are `multipliers` (node after node), `multiplier_rows` (N + 1, how many
/// each node has) and `multiplier_penalty` (1).
void writeNpz(const std::string& path, const MotionRecord& record);

/// Reads an archive that writeNpz() wrote.
/// \throws InputError naming the file and what is wrong with it, as the writers do when they cannot write
MotionRecord readRecord(const std::string& path);

/// What the two write.
std::string formatCsv(const MotionRecord& record);
std::string formatNpz(const MotionRecord& record);

/// The record in a directory written by writeResult().
/// \throws InputError naming the file and why it cannot be read
MotionRecord readResultRecord(const std::string& directory);

/// The request that led to a motion.
struct RunInfo {
  std::string robot;                 ///< name or path, as given
  std::string robot_file;            ///< its .urdf, absolute
  std::vector<std::string> command;  ///< the command line, or empty
  Belief model = Belief::Closed;     ///< or Serial: the robot's linkages were frozen (motion/serial_model.h)
  std::string serial_armature{};     ///< of the serial model, as requested (parseSerialArmature)
  RobotText mechanism{};             ///< the robot itself, without its meshes; empty where formatRobot() refuses it
};

/// With the text of the robot.
/// \param name  or path, as given
RunInfo makeRunInfo(const std::string& name, const LoadedRobot& robot, const std::vector<std::string>& command = {},
                    Belief model = Belief::Closed, const std::string& serial_armature = "");

/// Sixteen hexadecimal digits, FNV-1a of both texts, the URDF first; empty for no text. A summary.json has it as
/// `robot_fingerprint`.
std::string calcFingerprint(const RobotText& text);

/// What the summary.json of a result tells, and another run reads.
struct MotionFacts {
  RunInfo run;
  std::string motion;
  Formulation formulation = Formulation::Reduced;
  StepRule step = StepRule::Euler;
  ObjectiveOptions objective;
  OptionValues options;              ///< every option of the motion by name
  std::vector<GoalOutcome> goals;    ///< requested and achieved values
  std::vector<PhaseTiming> timings;  ///< of the phases of free duration
  Ground ground;
};

/// Of a motion that repeats.
struct CycleFigures {
  double closing_error = 0;  ///< largest entry of its last state (-) its first one, moved; rad, m, rad/s, m/s
  std::optional<double> floquet_multiplier{};  ///< Solution::floquet_multiplier
};

struct MotionResult : MotionFacts {
  ContactSchedule schedule;  ///< with the final time steps
  FddpSummary solver;
  MotionRecord record;

  std::vector<std::pair<std::string, double>> peak_torques;        ///< largest |u| by motor, largest first, N m or N
  std::vector<std::pair<std::string, double>> rms_torques;         ///< calcRmsEfforts() by motor, N m or N
  std::vector<std::pair<std::string, double>> continuous_torques;  ///< thermal limits, where known, N m or N
  ElectricalEnergy energy;
  double gap_position = 0, gap_angle = 0;    ///< largest closing error of the motion, m and rad
  double slip_position = 0, slip_angle = 0;  ///< largest displacement of a foot from its touchdown, m and rad
  double com_start = 0, com_lowest = 0;      ///< height of the centre of mass, m
  std::vector<DeadPointTrace> dead_points;   ///< how near each linkage comes to one
  std::optional<CycleFigures> cycle{};

  bool converged() const { return solver.termination == FddpTermination::Converged; }
  bool interrupted() const { return solver.termination == FddpTermination::Interrupted; }
};

/// Sets what follows from the record and the objective: torques, electrical energy, gaps, heights of the centre of mass,
/// distances of linkages from dead points.
void setFigures(const Model& model, MotionResult& result);

MotionResult makeResult(const RunInfo& run, const Solution& solution);

/// The motion as the summary.json of a result describes it; without the command line of its run.
struct MotionSummary : MotionFacts {
  struct Stance {
    std::string contact;
    SE3 X_WT;  ///< desired placement of its frame
  };
  struct Phase {
    std::string name;
    int start_node = 0, nodes = 0;
    double time_step = 0;  ///< s; 0: a rigid impact
    std::vector<Stance> stances;
  };
  std::string file;  ///< the file that was read
  bool converged = false;
  std::vector<Phase> phases;
};

/// \throws InputError naming the file, the entry and what is wrong with it: a motion carried out is no plan
MotionSummary readSummary(const std::string& directory);

/// The robot of a result of any kind, the closed one: of its file while that is as it was when the motion was solved, else of
/// mechanism.urdf and mechanism.yaml in the directory. Its warnings tell that the file has changed, and nothing else. Without a
/// fingerprint in summary.json the file, or another of this name, is believed.
/// \throws InputError when there is no robot, or the one in the directory was changed
LoadedRobot loadRobotOf(const std::string& directory);

/// The request recorded in a result, without limits, which are part of the problem and not of the motion.
/// \throws InputError when there is no such motion or option
MotionRequest remakeRequest(const MotionSummary& summary);

/// Creates the directory with its parents and verifies that files can be written there.
/// \throws InputError naming the directory and the reason
void makeOutputDirectory(const std::string& directory);

/// Writes trajectory.csv, trajectory.npz and summary.json to temporary files, which are renamed when all are complete,
/// summary.json last, and the robot as mechanism.urdf and mechanism.yaml beside them. Returns the paths of the first three. \throws InputError naming the file and the reason
std::vector<std::string> writeResult(const std::string& directory, const MotionResult& result);
/// Writes summary.json alone.
void writeSummary(const std::string& directory, const MotionResult& result);

/// Versions of this library, of Eigen and of the compiler.
struct BuildInfo {
  std::string bielle, eigen, compiler;
};
BuildInfo getBuildInfo();

// Lifting: reads a serial motion and writes its lift to the closed model.

/// The input of lift() from a record of a motion of the serial model.
/// \param motion  the same request made again, for the active contacts of every stage
/// \throws InputError when the record does not belong to that motion
SerialTrajectory makeSerialTrajectory(const Motion& motion, const MotionRecord& record);

/// The lifted part of the motion in the form of a solved one: converged if it was lifted entirely; its cost is the mean
/// per node of the cost of (1) of lift.h. At least one stage must have been lifted.
MotionResult makeLiftedResult(const RunInfo& run, const Model& closed, const Motion& serial, const LiftResult& lifted,
                              double seconds);

/// Writes lift.json: the outcome, and per node status, errors, margin and evaluations; given a result, also
/// trajectory.csv, trajectory.npz and summary.json. Returns the paths. \throws InputError naming the file and the
/// reason
std::vector<std::string> writeLift(const std::string& directory, LiftMethod method, const LiftResult& lifted,
                                   const MotionResult* result);

}  // namespace bielle
