#pragma once
// Threads that work together within a solve, and sleep between solves.
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace bielle {

// The number of threads that OMP_NUM_THREADS asks for, or else of processors that this process may use.
int getDefaultThreads();

// The thread that calls run() works itself, helped by the threads of the team, which start when they are first wanted. A
// predictive controller calls run() several times per millisecond: while a Shift lives, helpers look for work without sleeping.
// Nobody waits for a helper that has not begun, for instance because another program holds its processor; the others do its
// share. One thread at a time may call run().
class Team {
 public:
  Team() = default;
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  // Calls work(0), and at the same time work(i) for any of 0 < i < threads whose helper is there. Work must take its tasks from
  // a common counter, and must not throw.
  template <class Work>
  void run(int threads, Work&& work) {
    using Type = std::remove_reference_t<Work>;
    run(
        threads, [](const void* data, int i) { (*static_cast<Type*>(const_cast<void*>(data)))(i); }, &work);
  }

  // A time in which run() is called often: helpers stay awake.
  class Shift {
   public:
    Shift(Team& team, int threads);
    ~Shift();
    Shift(const Shift&) = delete;
    Shift& operator=(const Shift&) = delete;

   private:
    Team& team_;
  };

 private:
  using Call = void (*)(const void*, int);
  void run(int threads, Call call, const void* data);
  void start(int threads);
  void wake();
  void help(int index);
  void awaitChange(std::uint64_t seen);

  // The present run: its number, whether one may still join, and how many have joined.
  static constexpr std::uint64_t kJoined = 0xffff, kOpen = 0x10000, kNumber = 0x20000;
  std::atomic<std::uint64_t> run_{0};
  std::atomic<int> done_{0};  // of those who have joined
  std::atomic<bool> shift_{false}, ends_{false};
  std::atomic<int> asleep_{0};
  int threads_ = 0;  // wanted in the present run
  Call call_ = nullptr;
  const void* data_ = nullptr;

  std::mutex mutex_;
  std::condition_variable called_;
  std::vector<std::thread> helpers_;
};

}  // namespace bielle
