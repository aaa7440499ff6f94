#pragma once
/// \file The user asks for the end of a program, which then writes what it has.
#include <atomic>

namespace bielle {

/// From this call on the first SIGINT or SIGTERM sets `isInterrupted()`; the second one has its usual effect. System calls
/// that are waiting go on.
void watchInterrupts();

/// Lives as long as the program.
const std::atomic<bool>& isInterrupted();

}  // namespace bielle
