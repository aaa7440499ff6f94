#!/usr/bin/python3
"""worker_scaling.py BIELLE [--workers 64] [--nap 1 0.1] [--rounds 20]: how busy workers of `bielle campaign` are.

All of them run on this machine, and evaluations nap: what is measured is what it costs to hand tasks out and to take results,
by the real command, its checks and its log. The share of time that is busy is the sum of all naps over the time from the
begin of the first to the end of the last, times the number of workers; and the same without begin and end. Workers keep
their files in memory.
"""
import argparse
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

# In the place of bielle-simulate: as small as a process can be, for the cores are shared by all workers.
NAP = r"""
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_REALTIME, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}
int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    if (!strcmp(argv[i], "--dry-run")) return 0;
  const double seconds = atof(getenv("NAP")), start = now();
  struct timespec nap = {(time_t)seconds, (long)(1e9 * (seconds - (time_t)seconds))};
  nanosleep(&nap, NULL);
  char path[4096], line[64];
  mkdir(argv[3], 0755);
  snprintf(path, sizeof path, "%s/summary.json", argv[3]);
  FILE* file = fopen(path, "w");
  fputs("{\"outcome\": \"stood\", \"outcome_message\": \"\", \"duration\": 1, \"distance\": 0, \"mean_speed\": 0,"
        "\"largest_deviation\": 0, \"largest_slip\": 0, \"largest_gap\": 0, \"energy_balance\": 0, \"saturated_share\": 0}",
        file);
  fclose(file);
  const int record = open(getenv("RECORD"), O_WRONLY | O_APPEND);
  const int length = snprintf(line, sizeof line, "%.6f %.6f\n", start, now());
  return write(record, line, length) != length;
}
"""


def read_lines(path):
    with open(path, encoding="utf-8") as file:
        return file.read().splitlines()


def get_seconds(pid):
    """Processor time of a process."""
    with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def find_child(pid):
    with open(f"/proc/{pid}/task/{pid}/children", encoding="utf-8") as file:
        return int(file.read().split()[0])


def calc_busy(naps, workers, rounds):
    """The share of busy time from the first nap to the last, and in its middle: without the time in which workers join and
    the one in which there is no more for all of them."""
    first, last = min(start for start, _ in naps), max(end for _, end in naps)
    whole = sum(end - start for start, end in naps) / workers / (last - first)
    starts = sorted(start for start, _ in naps)
    begin, end = starts[min(4, rounds // 4) * workers], starts[-workers]
    middle = sum(max(0, min(b, end) - max(a, begin)) for a, b in naps) / workers / (end - begin)
    return last - first, whole, middle


def measure(program, workers, nap, rounds, port, scratch):
    count = workers * rounds
    with open("spec.yaml", "w", encoding="utf-8") as file:
        file.write("motions: [squat]\noptions: {seed: [%s]}\n" % ", ".join(map(str, range(count))))
    open("record", "w").close()
    environment = {**os.environ, "NAP": str(nap), "RECORD": os.path.abspath("record")}
    # Dry runs of all values take a while; workers come when there is something to do.
    with open("manager.log", "w", encoding="utf-8") as log:
        manager = subprocess.Popen([program, "campaign", "spec.yaml", "-o", f"out-{nap}", "--workers", str(port)],
                                   stderr=log, stdout=log)
    while "motion" not in "".join(os.listdir(f"out-{nap}/running") if os.path.isdir(f"out-{nap}/running") else []):
        time.sleep(0.05)
    joined = [subprocess.Popen(["work_queue_worker", "--cores", "1", "--disk", "100", "--memory", "100", "-s", scratch,
                                "localhost", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               start_new_session=True, env=environment) for _ in range(workers)]
    spent = [0, 0]
    try:
        while manager.poll() is None:
            try:
                spent = [get_seconds(manager.pid), get_seconds(find_child(manager.pid))]
            except (FileNotFoundError, IndexError):
                pass
            time.sleep(0.1)
    finally:
        for worker in joined:
            os.killpg(worker.pid, signal.SIGKILL)
            worker.wait()
    assert manager.returncode == 0, "\n".join(read_lines("manager.log")[-5:])
    naps = [tuple(map(float, line.split())) for line in read_lines("record")]
    assert len(naps) == count, (len(naps), count)
    return count, *calc_busy(naps, workers, rounds), spent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bielle", help="path of the command")
    parser.add_argument("--workers", type=int, nargs="+", default=[64])
    parser.add_argument("--nap", type=float, nargs="+", default=[1, 0.1], help="s")
    parser.add_argument("--rounds", type=int, default=20, help="tasks per worker")
    parser.add_argument("--port", type=int, default=9345)
    arguments = parser.parse_args()
    built = os.path.abspath(arguments.bielle)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(65536, resource.getrlimit(resource.RLIMIT_NOFILE)[1]),) * 2)
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        os.makedirs("bin")
        for name in ("bielle", "bielle-workers"):
            shutil.copy(os.path.join(os.path.dirname(built), name), "bin")
        with open("nap.c", "w", encoding="utf-8") as file:
            file.write(NAP)
        subprocess.run(["cc", "-O2", "-static", "nap.c", "-o", "bin/bielle-simulate"], check=True)
        subprocess.run([built, "solve", "squat", "--robot", "bipetto", "--depth", "0.9", "-o", "squat", "--quiet",
                        "--no-report", "--no-check"], check=True, stdout=subprocess.DEVNULL)
        scratch = tempfile.mkdtemp(dir="/dev/shm" if os.path.isdir("/dev/shm") else place)
        print("| workers | nap [s] | tasks | time [s] | busy, whole | middle | command, per task [ms] | bielle-workers [ms] |")
        print("|---|---|---|---|---|---|---|---|")
        for workers in arguments.workers:
            for nap in arguments.nap:
                shutil.rmtree(f"out-{nap}", ignore_errors=True)
                count, seconds, whole, middle, spent = measure(os.path.abspath("bin/bielle"), workers, nap, arguments.rounds,
                                                               arguments.port, scratch)
                print(f"| {workers} | {nap:g} | {count} | {seconds:.1f} | {100 * whole:.0f} % | {100 * middle:.0f} % | "
                      f"{1e3 * spent[0] / count:.2f} | {1e3 * spent[1] / count:.2f} |", flush=True)
        shutil.rmtree(scratch)
        os.chdir("/")


if __name__ == "__main__":
    sys.exit(main())
