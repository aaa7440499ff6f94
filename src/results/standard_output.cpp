#include "results/standard_output.h"

#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <iostream>

#include "bielle/model/error.h"

namespace bielle {

namespace {

// A pipe that nobody reads any more.
bool hasReaderLeft() {
  pollfd output = {STDOUT_FILENO, POLLOUT, 0};
  return poll(&output, 1, 0) > 0 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

}  // namespace

void ignoreClosedPipes() { std::signal(SIGPIPE, SIG_IGN); }

void finishStandardOutput() {
  std::cout.flush();
  const bool is_complete = std::cout && std::fflush(stdout) == 0 && !std::ferror(stdout);
  if (!is_complete && !hasReaderLeft())
    throw InputError("", "standard output", "the output could not be written completely",
                     "check the free space, or the program that reads the output");
}

}  // namespace bielle
