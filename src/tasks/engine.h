#pragma once
/// \file Tasks: runs of a program, each with the files that it reads and those that it writes, and the engines that do them.
///
/// An engine is given tasks and returns the ends of those that have finished, in any order. What becomes of them, which are
/// done and in which order results are used, is the caller's; nobody may depend on the order of arrival.
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bielle::tasks {

/// A file or a directory that a task reads, by the name that its arguments use.
struct TaskInput {
  std::string name, path;
};

/// In its arguments "@NAME" stands for an input or an output, wherever the task is done; other arguments stay as they are.
struct Task {
  std::vector<std::string> programs;  ///< paths: of the one that runs, then of those that it looks for beside itself
  std::vector<std::string> arguments;
  std::vector<TaskInput> inputs;
  std::vector<std::string> robots;   ///< directories of robots that the program finds by name
  std::vector<std::string> outputs;  ///< names of files or directories
  std::string directory;             ///< of its outputs, and of `log`, what it printed; exists
  std::string log = "log";
};

/// Where the outputs of a task are.
inline std::string getOutput(const Task& task, const std::string& name) { return task.directory + "/" + name; }

struct TaskEnd {
  int id = 0;
  int status = 0;      ///< of the exit, or 128 + the signal that ended it; 127: it could not be started
  double seconds = 0;  ///< that it ran
};

class TaskEngine {
 public:
  virtual ~TaskEngine() = default;
  /// How many tasks are done at a time, as far as is known.
  virtual int width() const = 0;
  /// Whether another task would be done soon. An engine with room for nothing but what it does takes more, too.
  virtual bool hasRoom() const = 0;
  /// Returns the number by which its end will be known. \throws InputError when nothing can be started
  virtual int submit(const Task& task) = 0;
  /// Sleeps until a task ends. Empty if the user asks for the end. Only while tasks are under way.
  /// \throws InputError when the engine itself has broken down
  virtual std::optional<TaskEnd> wait() = 0;
  /// Ends all tasks that are under way. Nothing is submitted afterwards.
  virtual void stop() = 0;
  /// How often a task is tried whose result is none: once where it would be the same again.
  virtual int attempts() const = 0;
  /// Whether tasks are done where files of this machine are out of sight, beyond those that they name.
  virtual bool isRemote() const = 0;
};

/// An argument as it is for a task that runs here.
std::string getLocalArgument(const Task& task, const std::string& argument);
/// And for one in a directory of its own elsewhere, where files have their names. "@NAME" is also a directory of inputs
/// NAME/...
std::string getRemoteArgument(const Task& task, const std::string& argument);

/// The text of a file that a task has written: not larger than `most` bytes, no link, no pipe.
/// \throws InputError naming the file
std::string readOutput(const std::string& path, std::size_t most);

}  // namespace bielle::tasks
