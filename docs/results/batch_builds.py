#!/usr/bin/env python3
"""Writes docs/results/batch_builds.md: the speed of many worlds at once by a build for AVX2, beside the newest MuJoCo, and over an
older version of Bielle. What it measures depends on what it is given:

    docs/results/batch_builds.py [--bielle build/bin/bielle] [--avx2 bielle-batch-speed] [--older DIRECTORY] [--rounds 7] [--quick]

Sections that it is not given anything for stay as the page has them.
--avx2: this program of a build with -DBIELLE_NATIVE=OFF -DBUILD_SHARED_LIBS=OFF -DCMAKE_CXX_FLAGS=-march=x86-64-v3.
--older: the directory `python` of a build of an older version, whose package `bielle` has `World(count=)`; OMP_NUM_THREADS sets its
threads. MuJoCo 3 is npm's @mujoco/mujoco, if $BIELLE_NODE_MODULES is the directory of modules that has it.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys

import batch
import common

GOAL_OTHERS, GOAL_OLDER = 6, 6
WORLDS = 256


def find_beside(command, name):
    return os.path.join(os.path.dirname(os.path.realpath(command)), name)


def add_speed(page, program, options, sentence):
    robot = ["--robot", common.SOURCE / "robots/bipetto"]
    reports = {motion: batch.measure(program, *robot, *options, *more) for motion, more in batch.MOTIONS.items()}
    page.add(f"Registers of {batch.REGISTERS[reports['stands']['register']]}. {sentence} The worlds are those of [the page on speed](batch.md).")
    for motion, report in reports.items():
        page.add(f"Bipetto [{motion}](batch.md#bipetto-{motion}):")
        batch.add_table(page, report)
        if motion != "falls":
            page.add(batch.describe_goals(motion, report))
    return reports


def list_rates(report):
    return [row["median"] for row in report["runs"] if row["world"] == "many"]


def compare_registers(wide, narrow):
    shares = {motion: [b / a for a, b in zip(list_rates(wide[motion]), list_rates(narrow[motion]))] for motion in wide}
    parts = [f"{min(share):.0%} to {max(share):.0%} where Bipetto {motion}" for motion, share in shares.items()]
    return f"Eight worlds take two registers of AVX2: of the steps with those of AVX-512 above, it takes {', '.join(parts)}."


def add_others(page, program, quick):
    robots = {"2 four-bars": ["--four-bars", 2]} if quick else batch.ROBOTS
    rows = []
    for name, robot in robots.items():
        print(f"speed of {name}", file=sys.stderr, flush=True)
        runs = batch.measure(program, "--precision", *robot, "--worlds", 16, "--seconds", 0.02 if quick else 0.2, "--time-step", 1e-3)["runs"]
        rates = {run["world"]: run["rate"] for run in runs}
        ratio = rates["many"] / rates["mujoco, Euler"]
        rows.append([name, f"{1e3 * rates['many']:,.0f}", f"{1e3 * rates['mujoco, Euler']:,.0f}", f"{ratio:.1f}",
                     "–" if name == "Bipetto" else "met" if ratio >= GOAL_OTHERS else "missed"])
    page.add(f"""Held by springs without control while the first body is pushed, as in [work and precision](batch.md#precision), at
1 ms. The goal is {GOAL_OTHERS} times MuJoCo's steps for the robots after Bipetto.""")
    page.table(["robot", "steps per second, many at once", "MuJoCo 2.2.2 (Euler)", "ratio", "goal"], rows)


def stand(package, threads, quick):
    environment = os.environ | {"PYTHONPATH": str(package), "OMP_NUM_THREADS": str(threads)}
    words = [sys.executable, common.HERE / "batch_stand.py", *((16, 20) if quick else (WORLDS, 100))]
    run = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True, env=environment)
    result = json.loads(run.stdout)
    if not result["ok"] or result["moves"] > 0.1:
        sys.exit(f"worlds of {package} do not stand: {run.stdout}")
    return result


def add_older(page, older, newer, rounds, quick):
    page.add(f"""{WORLDS} Bipettos stand in `bielle.World(model, count={WORLDS})` at 1 ms (`docs/results/batch_stand.py`): steps per
second of processor time of both packages in turn, medians of {rounds} rounds, least to most. The goal is {GOAL_OLDER} times as
many.""")
    rows = []
    for threads in (1, 2):
        rates = {}
        for _ in range(rounds):
            for name, package in (("older", older), ("this", newer)):
                rates.setdefault(name, []).append(stand(package, threads, quick)["processor"])
        median = {name: sorted(values)[len(values) // 2] for name, values in rates.items()}
        ratio = median["this"] / median["older"]
        rows.append([str(threads), *(f"{median[name]:,.0f} ({min(rates[name]):,.0f} to {max(rates[name]):,.0f})" for name in rates),
                     f"{ratio:.2f}", "met" if ratio >= GOAL_OLDER else "missed"])
    page.table(["threads", "older", "this one", "ratio", "goal"], rows)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--avx2", help="bielle-batch-speed of a build for AVX2")
    parser.add_argument("--older", help="directory `python` of a build of an older version")
    parser.add_argument("--rounds", type=int, default=7, help="runs of each, in turn")
    arguments = parser.parse_args()
    options = ["--rounds", 1, "--worlds", 16, "--seconds", 0.02]
    if not arguments.quick:
        options = ["--rounds", arguments.rounds, "--worlds", 32, "--seconds", 0.2]
    command = shutil.which(arguments.bielle) or arguments.bielle
    page = common.Page(__file__, "Many worlds at once: other builds and engines", common.describe_run(arguments.commit))
    page.add(f"""Processor time, everything in turn in one run, so that other programs on the machine lengthen all alike, more or
less; the load average was {os.getloadavg()[0]:.1f} at the beginning. [The page on speed](batch.md) tells what is measured.""")
    newest, avx2, over = "Beside the newest MuJoCo", "AVX2", "Over an older version"
    wide = None
    if batch.find_newest():
        page.heading(newest)
        wide = add_speed(page, find_beside(command, "bielle-batch-speed"), options, """MuJoCo 3 is npm's, WebAssembly in node, which is
slower than native code. Its clock runs for a millisecond of steps at a time, between which it talks to the program that measures and
finds its caches cold: steps of 0.25 ms tell more of it than those of 1 ms.""")
    else:
        page.keep(newest)
    os.environ.pop("BIELLE_NODE_MODULES", None)  # once is enough: it takes seconds to begin
    if arguments.avx2:
        page.heading(avx2)
        narrow = add_speed(page, arguments.avx2, options, "MuJoCo is the same library as elsewhere.")
        if wide:
            page.add(compare_registers(wide, narrow))
        add_others(page, arguments.avx2, arguments.quick)
    else:
        page.keep(avx2)
    if arguments.older:
        page.heading(over)
        newer = pathlib.Path(find_beside(command, "")).parent / "python"
        add_older(page, arguments.older, newer, arguments.rounds, arguments.quick)
    else:
        page.keep(over)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
