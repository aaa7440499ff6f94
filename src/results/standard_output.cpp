#include "results/standard_output.h"

#include <csignal>
#include <cstdio>
#include <iostream>

#include "bielle/model/error.h"

namespace bielle {

void ignoreClosedPipes() { std::signal(SIGPIPE, SIG_IGN); }

void finishStandardOutput() {
  std::cout.flush();
  if (!std::cout || std::fflush(stdout) != 0 || std::ferror(stdout))
    throw InputError("", "standard output", "the output could not be written completely",
                     "check the free space, or the program that reads the output");
}

}  // namespace bielle
