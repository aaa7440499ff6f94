#pragma once
// The linkages of a robot, what sensors they have, and what a log has of these.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bielle/model/wear.h"
#include "identify/geometry.h"
#include "identify/log.h"
#include "identify/log_fit.h"

namespace bielle::cli {

struct LinkageTask {
  std::string name;  // of its serial joints
  std::shared_ptr<const ReducedCluster> cluster;
  VectorXd q;                            // nq of the cluster, closed
  std::vector<LinkageSensor> sensors;    // motors, serial joints and what else is measured
  std::vector<std::string> others;       // coordinates that could be measured as well
  std::vector<GeometryNumber> geometry;  // all of it
  std::vector<LinkagePlay> plays;        // what may have play; sensors are those above
};

struct IdentifyChoice {
  std::vector<std::string> joints;           // only linkages with one of them; empty: all
  std::vector<std::string> sensors;          // measured beside motors and serial joints
  std::vector<std::string> free = {"rods"};  // geometry; * stands for any text
  std::vector<std::string> exact;            // sensors without an offset, likewise
  std::vector<std::string> noise;            // NAME=VALUE, likewise
  std::vector<std::string> plays;            // motors and closures with play, likewise
};

// \param q  nq, closed   \param present  play of the robot   \throws InputError for names that no linkage has
std::vector<LinkageTask> listTasks(const Model& model, ConstVectorRef q, const IdentifyChoice& choice,
                                   const std::vector<Play>& present = {});

// The numbers of a task that are free. \throws InputError for a name that none of the tasks has
std::vector<GeometryNumber> chooseGeometry(const LinkageTask& task, const std::vector<std::string>& free);
void requireKnown(const std::vector<LinkageTask>& tasks, const IdentifyChoice& choice);
bool matches(const std::vector<std::string>& patterns, const std::string& name);

// A task with what the log has of its sensors; or why it is left out.
struct LoggedTask {
  const LinkageTask* task = nullptr;
  std::vector<LinkageSensor> sensors;
  MatrixXd readings;  // K x sensors
  std::string left_out;
};
// \throws InputError for a sensor that stands still while others of its linkage move
LoggedTask matchLog(const LinkageTask& task, const MotionLog& log);

}  // namespace bielle::cli
