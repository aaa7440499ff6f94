#include "solve/team.h"

#include <sched.h>

#include <algorithm>
#include <cstdlib>

#include "solve/stopwatch.h"

namespace bielle {
namespace {

constexpr double kPatience = 2e-3;  // after which a helper sleeps although a shift lasts, s
constexpr int kPolite = 10000;      // looks at helpers that still work, after which others may have the processor

void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

}  // namespace

int getDefaultThreads() {
  if (const char* wanted = std::getenv("OMP_NUM_THREADS"))
    if (const int threads = std::atoi(wanted); threads > 0) return threads;
  cpu_set_t processors;
  if (sched_getaffinity(0, sizeof(processors), &processors) == 0) return std::max(1, CPU_COUNT(&processors));
  return std::max(1u, std::thread::hardware_concurrency());
}

Team::Shift::Shift(Team& team, int threads) : team_(team) {
  team_.shift_.store(true);
  team_.start(threads);
  team_.wake();  // they take a while
}

Team::Shift::~Shift() { team_.shift_.store(false); }

Team::~Team() {
  ends_.store(true);
  run_.fetch_add(kNumber);
  wake();
  for (std::thread& helper : helpers_) helper.join();
}

void Team::start(int threads) {
  while (static_cast<int>(helpers_.size()) < threads - 1)
    helpers_.emplace_back([this, index = static_cast<int>(helpers_.size()) + 1] { help(index); });
}

void Team::wake() {
  if (asleep_.load() == 0) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  called_.notify_all();
}

void Team::run(int threads, Call call, const void* data) {
  if (threads <= 1) return call(data, 0);
  start(threads);
  call_ = call;
  data_ = data;
  threads_ = threads;
  done_.store(0, std::memory_order_relaxed);
  const std::uint64_t number = (run_.load(std::memory_order_relaxed) & ~(kOpen | kJoined)) + kNumber;
  run_.store(number | kOpen);
  wake();
  call(data, 0);
  const int joined = static_cast<int>(run_.fetch_and(~kOpen) & kJoined);
  for (int i = 0; done_.load(std::memory_order_acquire) < joined; ++i) {
    if (i < kPolite)
      pause();
    else
      std::this_thread::yield();
  }
}

void Team::help(int index) {
  std::uint64_t seen = 0;  // the number of the last run that was looked at
  while (!ends_.load()) {
    std::uint64_t now = run_.load(std::memory_order_acquire);
    const std::uint64_t number = now & ~(kOpen | kJoined);
    if (number == seen) {
      awaitChange(seen);
      continue;
    }
    // Only a run that is open can be joined, and while one is joined, what it consists of does not change.
    bool joined = false;
    while ((now & kOpen) != 0 && (now & ~(kOpen | kJoined)) == number && !joined)
      joined = run_.compare_exchange_weak(now, now + 1);
    seen = number;
    if (!joined) continue;
    if (index < threads_) call_(data_, index);
    done_.fetch_add(1, std::memory_order_release);
  }
}

void Team::awaitChange(std::uint64_t seen) {
  const auto changed = [&] { return (run_.load() & ~(kOpen | kJoined)) != seen; };
  const Clock::time_point begin = Clock::now();
  do {
    for (int i = 0; i < 32; ++i) {
      if (changed()) return;
      pause();
    }
  } while (shift_.load(std::memory_order_relaxed) && calcSecondsSince(begin) < kPatience);
  std::unique_lock<std::mutex> lock(mutex_);
  ++asleep_;
  const bool shift = shift_.load();  // of the one that begins now it must hear, too
  called_.wait(lock, [&] { return changed() || (!shift && shift_.load()); });
  --asleep_;
}

}  // namespace bielle
