#pragma once
// The files that tasks take along to machines that do not have them.
#include <string>
#include <vector>

#include "tasks/engine.h"

namespace bielle::tasks {

// The directories with the files of a robot, by its name or path: its own and, if it completes one that is published, that.
std::vector<std::string> listRobotDirectories(const std::string& robot);

// The path of a robot's file for a task that takes these directories along.
std::string getShippedRobot(const std::string& robot);

// A task with the input "motion", a directory that `bielle solve` wrote. For machines that do not have it, its files
// go without those that nobody reads there, and with a summary in `place` whose robot is that of the task.
tasks::Task shipMotion(const std::string& motion, const std::string& place, bool is_remote);

// Arguments that are files of this machine become inputs; a robot after --robot is taken along.
void shipFiles(tasks::Task& task);

}  // namespace bielle::tasks
