// Threads that share out tasks: each task is done once, by whoever is there, however often and by however many.
#include <sched.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <set>

#include "solve/parallel_errors.h"
#include "solve/team.h"

using namespace bielle;

namespace {

// How often each of these tasks was done.
std::vector<int> count(Team& team, int threads, int tasks) {
  std::vector<std::atomic<int>> done(tasks);
  std::atomic<int> next{0};
  team.run(threads, [&](int) {
    for (int i; (i = next.fetch_add(1)) < tasks;) ++done[i];
  });
  return {done.begin(), done.end()};
}

}  // namespace

TEST_CASE("a team does each task once") {
  Team team;
  for (const int threads : {1, 2, 3, 8}) {
    const Team::Shift shift(team, threads);
    for (int run = 0; run < 2000; ++run) {
      const int tasks = run % 7;
      REQUIRE(count(team, threads, tasks) == std::vector<int>(tasks, 1));
    }
  }
}

TEST_CASE("a team that has slept works on") {
  Team team;
  for (int run = 0; run < 20; ++run) {
    REQUIRE(count(team, 4, 3) == std::vector<int>(3, 1));
    std::this_thread::sleep_for(std::chrono::milliseconds(run % 4));
  }
}

TEST_CASE("helpers work at the same time as the one who calls") {
  Team team;
  const Team::Shift shift(team, 2);
  std::atomic<int> there{0};
  std::set<int> indices;
  std::mutex mutex;
  team.run(2, [&](int i) {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      indices.insert(i);
    }
    ++there;
    const auto begin = std::chrono::steady_clock::now();  // nobody is obliged to come, but half a minute is enough
    while (there < 2 && std::chrono::steady_clock::now() - begin < std::chrono::seconds(30)) std::this_thread::yield();
  });
  CHECK(indices == std::set<int>{0, 1});
}

TEST_CASE("an exception of any task reaches the one who calls") {
  Team team;
  ParallelErrors errors;
  std::atomic<int> next{0};
  team.run(3, [&](int) {
    for (int i; (i = next.fetch_add(1)) < 10;)
      errors.run(i, [i] {
        if (i % 4 == 3) throw std::runtime_error(std::to_string(i));
      });
  });
  CHECK_THROWS_WITH(errors.rethrow(), "3");
  CHECK(count(team, 3, 5) == std::vector<int>(5, 1));
}

TEST_CASE("default threads are those that the environment asks for, or the processors of this process") {
  const char* before = std::getenv("OMP_NUM_THREADS");
  const std::string kept = before ? before : "";
  setenv("OMP_NUM_THREADS", "3", 1);
  CHECK(getDefaultThreads() == 3);
  unsetenv("OMP_NUM_THREADS");
  cpu_set_t processors;
  REQUIRE(sched_getaffinity(0, sizeof(processors), &processors) == 0);
  CHECK(getDefaultThreads() == CPU_COUNT(&processors));
  if (before) setenv("OMP_NUM_THREADS", kept.c_str(), 1);
}
