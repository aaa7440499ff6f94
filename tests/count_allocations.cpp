#include "count_allocations.h"

#include <cstddef>

std::atomic<long> num_allocations{0};
thread_local long num_allocations_here = 0;

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
