#!/usr/bin/env python3
"""Processor and wall time of what people wait for, from clean clones of one or more revisions, in turn.

  benchmarks/wait.py REVISION... [--what demo test ci change pip] [--directory DIR] [-o FILE.json]

  demo    scripts/demo.sh
  test    scripts/test.sh
  ci      .ci/run
  change  src/motion/squat.cpp changed in the tree of `test`: its test built and run
  pip     pip install . in a fresh virtual environment

Debian packages must be installed beforehand (run scripts/test.sh once). No compiler cache is used. Processor time is user
and system time of all processes, in seconds; it varies less than the clock when the machine has other work.
"""
import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


def environment():
    kept = {name: value for name, value in os.environ.items() if name != "BIELLE_ROBOTS" and not name.startswith("CCACHE")}
    return {**kept, "CCACHE_DISABLE": "1", "CMAKE_CXX_COMPILER_LAUNCHER": ""}


def measure(command, directory, log):
    """Runs a command; returns its exit status and its processor and wall time [s]."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    with open(log, "w") as output:
        status = subprocess.run(command, cwd=directory, env=environment(), stdin=subprocess.DEVNULL, stdout=output,
                                stderr=subprocess.STDOUT).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {"status": status, "processor": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1),
            "wall": round(time.monotonic() - start, 1), "log": str(log)}


def change_and_test(clone):
    """The command that builds and runs the test of squats after src/motion/squat.cpp has been changed."""
    source = clone / "src/motion/squat.cpp"
    source.write_text(source.read_text() + "\nnamespace { [[maybe_unused]] const int changed = 1; }\n")
    targets = subprocess.run(["ninja", "-C", "build/test", "-t", "targets", "all"], cwd=clone, text=True,
                             stdout=subprocess.PIPE, check=True).stdout
    target = "test_squat" if "test_squat:" in targets else "motion_tests"
    return ["bash", "-ec", f"cmake --build build/test --target {target}; ctest --test-dir build/test --output-on-failure -R '^squat'"]


def commands(what, clone, scratch):
    if what == "demo":
        return ["scripts/demo.sh"]
    if what == "test":
        return ["scripts/test.sh"]
    if what == "ci":
        return ["bash", ".ci/run"]
    if what == "change":
        return change_and_test(clone)
    return ["bash", "-ec", f"python3 -m venv --system-site-packages {scratch}/venv; {scratch}/venv/bin/pip install --no-build-isolation ."]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revisions", nargs="+")
    parser.add_argument("--what", nargs="+", default=["demo", "test", "ci", "change", "pip"],
                        choices=["demo", "test", "ci", "change", "pip"])
    parser.add_argument("--directory", help="where to clone to and to keep logs (default: a temporary directory)")
    parser.add_argument("-o", "--output", help="JSON file of the times, written after each measurement")
    arguments = parser.parse_args()
    directory = pathlib.Path(arguments.directory or tempfile.mkdtemp(prefix="bielle-wait-"))
    directory.mkdir(parents=True, exist_ok=True)
    times = {}
    for what in arguments.what:
        for revision in arguments.revisions:
            clone = directory / revision / "clone"
            if not clone.exists():
                subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
                subprocess.run(["git", "checkout", "-q", revision], cwd=clone, check=True)
            print(f"{revision} {what} ...", file=sys.stderr, flush=True)
            measured = measure(commands(what, clone, clone.parent), clone, clone.parent / f"{what}.log")
            times.setdefault(what, {})[revision] = measured
            print(f"{revision} {what}: {measured['processor']} s of processor time, {measured['wall']} s by the clock, "
                  f"exit status {measured['status']}", flush=True)
            if arguments.output:
                pathlib.Path(arguments.output).write_text(json.dumps(times, indent=2) + "\n")


if __name__ == "__main__":
    main()
