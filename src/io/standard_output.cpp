#include "io/standard_output.h"

#include <csignal>
#include <cstdio>
#include <iostream>

#include "bielle/model/error.h"

namespace bielle {

void ignoreClosedPipes() { std::signal(SIGPIPE, SIG_IGN); }

void finishStandardOutput() {
  std::cout.flush();
  if (!std::cout || std::fflush(stdout) != 0 || std::ferror(stdout))
    throw ModelError("", "standard output", "it was not taken whole",
                     "check the space left where it goes, or the program that reads it");
}

}  // namespace bielle
