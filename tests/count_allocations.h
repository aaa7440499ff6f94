#pragma once
// Counts allocations: the linker redirects malloc (Eigen) and operator new (the standard library) to these counters.
// Include in one source of an executable linked with -Wl,--wrap=malloc -Wl,--wrap=_Znwm.
#include <atomic>
#include <cstddef>

static std::atomic<long> num_allocations{0};
static thread_local long num_allocations_here = 0;  // by this thread
extern "C" void* __real_malloc(size_t size);
extern "C" void* __wrap_malloc(size_t size) {
  ++num_allocations;
  ++num_allocations_here;
  return __real_malloc(size);
}
extern "C" void* __real__Znwm(size_t size);
extern "C" void* __wrap__Znwm(size_t size) {
  ++num_allocations;
  ++num_allocations_here;
  return __real__Znwm(size);
}
