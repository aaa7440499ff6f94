#pragma once
// Counts allocations: the linker redirects malloc (Eigen) and operator new (the standard library) of the tests to these counters
// (count_allocations.cpp).
#include <atomic>

extern std::atomic<long> num_allocations;
extern thread_local long num_allocations_here;  // by this thread
