#include "design/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace bielle {

void doInParallel(size_t count, int threads, const std::function<void(size_t)>& work) {
  std::atomic<size_t> next{0};
  std::mutex mutex;
  std::exception_ptr error;
  std::vector<std::thread> team;
  for (size_t t = 0; t < std::min(count, static_cast<size_t>(std::max(1, threads))); ++t)
    team.emplace_back([&] {
      try {
        for (size_t i = next++; i < count; i = next++) work(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!error) error = std::current_exception();
        next = count;
      }
    });
  for (std::thread& member : team) member.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace bielle
