#pragma once
// A run of a case as a task.
#include "tasks/cases.h"

namespace bielle::tasks {

// For workers elsewhere, the robot goes with it, and its argument is its place there.
tasks::Task makeStepTask(const Case& one, int step, const std::string& directory, const std::string& program,
                         bool is_remote);

// What is wrong with what a worker has returned; empty if nothing is. Summaries and trajectories have to be whole, their
// numbers finite.
std::string findProblem(const tasks::Task& task, int status);

// Results of workers name the robot, the program and the directories as they were there: makes them those that a run here
// would have named.
void bringHome(const Case& one, const std::string& directory, const std::string& program);

}  // namespace bielle::tasks
