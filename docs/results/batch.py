#!/usr/bin/env python3
"""Writes docs/results/batch.md and docs/images/batch.svg: the speed of many worlds at once, by bielle-batch-speed beside the
command.

    docs/results/batch.py [--bielle build/bin/bielle] [--rounds 9] [--speed] [--quick]

--speed: steps per second alone; other sections of the page stay as they are.

Processor time, each kind of world in turn: other programs on the machine lengthen all alike, more or less.
"""
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys

import common

REGISTERS = {8: "AVX-512, eight numbers", 4: "AVX2, four numbers", 2: "SSE2, two numbers"}
TITLES = {"many": "many at once", "single": "one after the other", "mujoco": "MuJoCo 2.2.2, `mj_step` alone",
          "mujoco3": "MuJoCo {}, WebAssembly"}
IMAGE = common.SOURCE / "docs/images/batch.svg"
ROBOTS = {"Bipetto": ["--robot", common.SOURCE / "robots/bipetto"], "Cleobot": ["--robot", common.SOURCE / "robots/cleobot"],
          "four-bar knees, Digit's ankles": ["--robot", common.SOURCE / "suite/digit_ankles"],
          "16 four-bars in a chain": ["--four-bars", 16]}  # fmt: skip
STEPS = (2.5e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # s
PRECISE = 1e-3  # rad or m
GOALS = {(8, 1e-3): 8, (8, 2.5e-4): 12, (4, 1e-3): 4, (4, 2.5e-4): 6}


MOTIONS = {"stands": [], "walks": ["--walks"], "falls": ["--falls"]}


def measure(program, *options):
    run = subprocess.run([program, *map(str, options)], capture_output=True, text=True, check=True)
    print(run.stderr, file=sys.stderr, end="")
    return json.loads(run.stdout)


def find_newest():
    """The version of npm's MuJoCo, or None."""
    package = pathlib.Path(os.environ.get("BIELLE_NODE_MODULES", "/"), "@mujoco/mujoco/package.json")
    return json.loads(package.read_text(encoding="utf-8"))["version"] if package.exists() and shutil.which("node") else None


def add_table(page, report):
    rows = []
    for step in dict.fromkeys(row["time step [s]"] for row in report["runs"]):
        runs = {row["world"]: row for row in report["runs"] if row["time step [s]"] == step}
        for name, title in TITLES.items():
            if name not in runs:
                continue
            row = runs[name]
            rows.append([f"{1e3 * step:g}", title.format(find_newest()),
                         f"{row['median']:,.0f} ({row['least']:,.0f} to {row['most']:,.0f})",
                         f"{row['median'] / runs['single']['median']:.2f}",
                         f"{row['median'] / runs['mujoco']['median']:.2f}",
                         f"{row['rounds']:.2f}" if name == "many" else "–", f"{row['gap [m]']:.1e}"])
    page.table(["step [ms]", "worlds", "steps per second (least to most)", "over one after the other", "over MuJoCo",
                "rounds of Newton", "closures open by at most [m]"], rows)


def measure_overhead(command, worlds):
    """By the package beside the command; None without it."""
    package = os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(command))), "python")
    if not os.path.isdir(os.path.join(package, "bielle")):
        return None
    paths = os.environ | {"PYTHONPATH": package}
    run = subprocess.run([sys.executable, str(common.HERE / "batch_overhead.py"), str(worlds)], capture_output=True, text=True,
                         env=paths, check=True)
    return json.loads(run.stdout)


def add_overhead(page, report):
    page.heading("From Python")
    page.add(f"""{report['worlds']} limp robots begin in the standing posture and step for 0.1 s: processor time of a step, the least
of five runs. The bindings are what `World.step` does beside physics, the environment is a `VectorEnv` with sensors, rewards and
ends. The goal is less than 5 % of a step for what `World.step` adds.""")
    page.table(["step [ms]", "`World.step` [ms]", "bindings in it", "`VectorEnv.step` [ms]", "more than `World.step`"],
               [[f"{1e3 * row['period [s]']:g}", f"{1e3 * row['world [s]']:.2f}", f"{row['bindings [s]'] / row['world [s]']:.1%}",
                 f"{1e3 * row['environment [s]']:.2f}", f"{row['environment [s]'] / row['world [s]'] - 1:.1%}"]
                for row in report["rows"]])


def add_threads(page, reports):
    page.heading("Two threads")
    page.add("""Wall clock of one thread over that of two, of twice as many worlds as above, in turn; the goal is 1.9. It needs a
machine that does nothing else.""")
    page.table(["robots", "step [ms]", "two threads over one (least to most)"],
               [[name[:-1], f"{1e3 * row['time step [s]']:g}", f"{row['median']:.2f} ({row['least']:.2f} to {row['most']:.2f})"]
                for name, report in reports.items() for row in report["threads"]])


def find_best(runs, world):
    """The fastest run of a world, by the beginning of its name, whose error is small enough; None if there is none."""
    precise = [run for run in runs if run["world"].startswith(world) and (run["error"] or math.inf) <= PRECISE]
    return max(precise, key=lambda run: run["rate"], default=None)


def describe_best(run):
    if run is None:
        return "none"
    integrator = run["world"].partition(", ")[2]
    return f"{run['rate']:.0f} ({', '.join([integrator] * bool(integrator) + [show_step(run)])})"


def show_step(run):
    return f"{1e3 * run['time step [s]']:g} ms"


def draw(reports):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "batch", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(reports), figsize=(3 * len(reports), 3), sharey=True)
    for ax, (name, runs) in zip(axes, reports.items()):
        for world in dict.fromkeys(run["world"] for run in runs):
            line = [run for run in runs if run["world"] == world and run["rate"] > 0 and (run["error"] or math.inf) < 1]
            ax.loglog([run["rate"] for run in line], [run["error"] for run in line], "o-", ms=3, lw=1.2,
                      label=world.replace("many", "many at once").replace("mujoco", "MuJoCo"))
        ax.axhline(PRECISE, color="k", lw=0.6, ls=":")
        ax.set_title(name, fontsize=9)
        ax.set_xlabel("robot-seconds per second")
        ax.grid(True, lw=0.3)
    axes[0].set_ylabel("largest error of a joint [rad]")
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(IMAGE, metadata={"Date": None})
    pyplot.close(figure)


def add_precision(page, program, quick):
    robots = {"2 four-bars": ["--four-bars", 2]} if quick else ROBOTS
    options = ["--worlds", 2 if quick else 16, "--seconds", 0.1 if quick else 1]
    options += [word for step in (STEPS[2:4] if quick else STEPS) for word in ("--time-step", step)]
    reports = {}
    for name, robot in robots.items():
        print(f"precision of {name}", file=sys.stderr, flush=True)
        reports[name] = measure(program, "--precision", *robot, *options)["runs"]
    page.heading("Precision")
    page.add(f"""Springs of 100 N m/rad and dampers of 2 N m s/rad at the motors hold a posture, without control, so that steps may
be as long as one likes, while the first body is pushed for 50 ms, differently in each world. An error is the largest difference of
any joint within a second from the motion by steps of 1/32 ms of the same program. *Best*: robot-seconds per second of processor time
of the setting that is fastest within {PRECISE:g} rad. MuJoCo's closures and contacts are as stiff as the exported file has them, or
its step allows. The goal is 8 times MuJoCo's best for Bipetto, and at 1 ms 6 times MuJoCo's steps for the others.""")
    rows = []
    for name, runs in reports.items():
        own, other = find_best(runs, "many"), find_best(runs, "mujoco")
        at = {run["world"]: run for run in runs if run["time step [s]"] == 1e-3}
        rows.append([name, f"{at['many']['rate'] / at['mujoco, Euler']['rate']:.1f}", describe_best(own), describe_best(other),
                     f"{own['rate'] / other['rate']:.0f}" if own and other else "–", f"{runs[0]['moves']:.3f}",
                     f"{at['mujoco, RK4']['apart']:.1e}"])
    page.table(["robot", "steps at 1 ms over MuJoCo's (Euler)", "best of many at once", "MuJoCo's best", "ratio of the best",
                "joints move by [rad]", "converged motions of both apart [rad]"], rows)
    if not quick:
        draw(reports)
        page.lines += ["", "![error over robot-seconds per second](../images/batch.svg)"]
    for name, runs in reports.items():
        worlds = list(dict.fromkeys(run["world"] for run in runs))
        page.add(f"{name[0].upper() + name[1:]}: errors [rad] and the largest opening of a closure [m] by time step.")
        page.table(["step", *(world.replace("many", "many at once").replace("mujoco", "MuJoCo") for world in worlds)],
                   [[show_step(row), *(show_error(run) for run in runs if run["time step [s]"] == row["time step [s]"])]
                    for row in runs if row["world"] == worlds[0]])


def show_error(run):
    return "breaks off" if run["error"] is None or run["error"] > 1 else f"{run['error']:.1e}, {run['gap [m]']:.1e}"


def describe_goals(motion, report):
    parts = []
    for step in dict.fromkeys(row["time step [s]"] for row in report["runs"]):
        runs = {row["world"]: row["median"] for row in report["runs"] if row["time step [s]"] == step}
        goal, ratio = GOALS.get((report["register"], step)), runs["many"] / runs["mujoco"]
        if goal:
            verdict = "met" if ratio >= goal else "missed"
            parts.append(f"{goal} times MuJoCo's steps at {1e3 * step:g} ms: {ratio:.1f}, {verdict}")
    return f"Goals for a robot that {motion}: " + "; ".join(parts) + "."


def describe_memory(report):
    memory = report["memory [kB]"]
    return f"Memory of 4,096 worlds: {memory:.1f} kB each; the goal is less than 30, {'met' if memory < 30 else 'missed'}."


def describe_walk(report):
    """How far the worlds keep to the plan, so that it is a walk that is measured."""
    worst = {name: max(row["deviation"] for row in report["runs"] if row["world"] == name) for name in ("many", "mujoco")}
    return f"""From the plan, no coordinate is farther than {worst['many']:.3f} rad or m at the end in Bielle's worlds, and
{worst['mujoco']:.3f} in MuJoCo's."""


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--rounds", type=int, default=9, help="runs of each kind of world")
    parser.add_argument("--speed", action="store_true", help="measure steps per second alone, and keep the other sections")
    arguments = parser.parse_args()
    command = shutil.which(arguments.bielle) or arguments.bielle
    program = os.path.join(os.path.dirname(os.path.realpath(command)), "bielle-batch-speed")
    options = ["--rounds", 1, "--worlds", 16, "--seconds", 0.02]
    if not arguments.quick:
        options = ["--rounds", arguments.rounds, "--worlds", 32, "--seconds", 0.2]
    robot = common.SOURCE / "robots/bipetto"
    reports = {motion: measure(program, "--robot", robot, *options, *more) for motion, more in MOTIONS.items()}
    page = common.Page(__file__, "Many worlds at once", common.describe_run(arguments.commit))
    load = os.getloadavg()[0]
    page.add(f"""Steps per second of processor time on one thread, all in turn, medians; `validation/batch` measures them. The
library is compiled for this processor, with registers of {REGISTERS[reports['stands']['register']]}. The load average was {load:.1f}. Torques change every millisecond.
MuJoCo runs the file that `bielle convert --to mjcf` writes, with closures and contacts as soft as its time step allows.""")
    page.add("[Other builds and engines](batch_builds.md) and [where pushed walks end](batch_ends.md) have pages of their own.")
    if load > 1.5:  # it counts itself
        page.add("Other programs ran beside it: these numbers are those of a busy machine, and spread.")
    page.heading("Bipetto stands")
    page.add("""Springs and dampers on its motors hold a posture; pushes of different size at the trunk, for 50 ms, make the
worlds differ. A round of Newton's method is one for all robots of a register, per step.""")
    add_table(page, reports["stands"])
    page.add(describe_goals("stands", reports["stands"]))
    page.add(describe_memory(reports["stands"]))
    page.heading("Bipetto walks")
    page.add(f"""At 0.4 m/s, by the torques and the gains of a plan, each world from another of its instants on, so that in a register
some stand on both feet while others swing one or land. All kinds of worlds carry out the same ones, each with the torques that its
own state asks for. {describe_walk(reports["walks"])}""")
    add_table(page, reports["walks"])
    page.add(describe_goals("walks", reports["walks"]))
    page.heading("Bipetto falls")
    page.add("""Limp robots are dropped from 5 cm with random velocities of the trunk of up to 1 m/s and 1 rad/s. Soles land and
slide, joints run into stops, and steps are halved, at other times in every world: a register goes as slowly as its slowest robot.
MuJoCo's steps are never halved.""")
    add_table(page, reports["falls"])
    if arguments.speed:
        page.keep("Precision", "Two threads", "From Python")
        page.write(arguments.quick)
        return
    add_precision(page, program, arguments.quick)
    add_threads(page, reports)
    if overhead := measure_overhead(command, 8 if arguments.quick else 256):
        add_overhead(page, overhead)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
