#!/usr/bin/env python3
"""Writes docs/results/loops.md and docs/images/loops_*.svg: benchmarks with loops in every engine.

    docs/results/loops.py                       writes the page from the tables in docs/results/data
    docs/results/loops.py --measure             measures everything first (a quarter of an hour)
    docs/results/loops.py --measure bricard     measures these problems, `long` or `cost`

`--engines` measures only these, one after the other, and leaves the rows of the others as they are. DART and ODE are measured
where they are installed, MuJoCo 3 where $BIELLE_NODE_MODULES has @mujoco/mujoco. `--limit` is the processor time after which a trial ends. `--quick` measures a second of two problems and prints the page.
"""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys

import common
from common import show

DATA = common.HERE / "data"
IMAGES = common.SOURCE / "docs/images"
COST, LONG = "cost", "long"
COUNTS = (1, 2, 5, 10, 20, 40, 100, 1000)
LONG_COUNTS = (1, 5, 10, 20, 40)
COLUMNS = ["engine", "setting", "cpu", "gap", "drift", "until", "end", "errors"]
PATIENCE = 90  # with a trial and the making of its world, s
GOALS = (1e-3, 1e-6, 1e-9)
COLORS = {"manifold": "#d62728", "bielle": "#ff7f0e", "simbody": "#1f77b4", "simbody3": "#17becf",
          "mujoco": "#98df8a", "mujoco_euler": "#c5b0d5", "mujoco3": "#2ca02c", "mujoco3_discrete": "#bcbd22",
          "dart": "#9467bd", "ode": "#8c564b"}

PROBLEMS = {
    "fourbars_2": """Two parallelograms side by side, three vertical and two horizontal thin rods of 1 kg and 1 m, thrown over
from upright at 1 m/s (A02 of the IFToMM library, N = 2). Whenever the rods lie in a line, twice per turn, the mobility jumps
from 1 to 3 and the rank of the closures falls from 4 to 2. Each closure is a ball, whose row out of the plane is redundant. A method that
steps over the posture does not see it; one that lands on it has no unique acceleration. Simbody leaves
the motion there, or breaks off; Bielle's leapfrog breaks off where a short step comes too close. Gravity along -y.""",
    "squeezer": """Andrews' squeezer, seven bodies and three loops in a plane, 0.05 s (A03). All three closures are balls at the
point E; out of the plane their rows are redundant, 9 rows of rank 6. Steps are 200 times shorter than named for the
other problems. No gravity.""",
    "bricard": """Bricard's mechanism, five rods and six hinges, released from rest (A04). A hinge closes it: five rows of rank
four. It swings between two rests half a period, 2.495855756843 s, apart. Gravity along -y.""",
    "slider_crank": """The spatial slider-crank: the universal joint at the slider has its first axis along x, fixed in the
slider, and its second in the rod. Gravity along -z.""",
    "spatial_fourbar": """Fourbar1 of Modelica's library: crank about x, slider along x, and a rod with a ball at the crank and
hinges about y and z at the slider; three independent rows. Gravity along -y.""",
    "governor": """The stiff flyball governor (A05): no loops, but springs of 8e5 N/m with dampers of 4e4 N s/m where couplers
would be, with a time constant of 0.12 ms. The shaft is vertical, along y, and turns at 2 pi rad/s; the rods start 30 degrees below
the horizontal and the slider at 0.5 m, so that the springs are at rest. Dampers between points
are explicit in every engine: fixed steps of more than 0.1 to 0.2 ms diverge. What should stay is the momentum about the shaft.""",
}


# Tables are files of comma-separated values below comments that say where they are from: a line for each run, with the engines that
# it measured if there are several.

def write_data(name, run, columns, rows):
    with open(DATA / f"loops_{name}.csv", "w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {line}\n" for line in run.split("\n"))
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def read_data(name):
    """(comments, rows as dictionaries); (None, []) without measurements."""
    try:
        with open(DATA / f"loops_{name}.csv", encoding="utf-8", newline="") as file:
            lines = file.read().splitlines()
        comments = [line[1:].strip() for line in lines if line.startswith("#")]
        return "\n".join(comments), list(csv.DictReader(lines[len(comments):]))
    except FileNotFoundError:
        return None, []


# Measurements

class Loops:
    """The program `bielle-loops` beside the command."""

    def __init__(self, bielle):
        place = pathlib.Path(bielle).resolve().parent if os.path.dirname(bielle) else None
        self.program = str(place / "bielle-loops") if place else "bielle-loops"

    def run(self, *arguments, patience=None):
        command = [self.program, *map(str, arguments)]
        print(" ".join(command), file=sys.stderr, flush=True)
        run = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=patience)
        if run.returncode:
            sys.exit(f"{' '.join(command)}\nexit status {run.returncode}")
        return run.stdout

    def list(self):
        return json.loads(self.run("list"))

    def trials(self, *arguments, patience=None):
        return [json.loads(line) for line in self.run("run", *arguments, patience=patience).splitlines()]


def measure_problem(loops, name, options):
    rows = []
    for trial in loops.trials(name, *options):
        errors = " ".join(f"{time}:{'nan' if error is None else f'{error:.3g}'}" for time, error in trial["errors"].items())
        rows.append([trial["engine"], f"{trial['setting']:.3g}", f"{trial['cpu']:.4g}", show(trial["gap"], "{:.2g}"),
                     show(trial["drift"], "{:.2g}"), f"{trial['until']:.6g}", trial["end"], errors])
    return COLUMNS, rows


def measure_cost(loops, counts=COUNTS):
    """Processor time of 0.5 s of N four-bars, at settings that are usual for the engine."""
    rows = []
    for engine in [engine["name"] for engine in loops.list()["engines"]]:
        setting = 1e-3 if engine in ("bielle", "mujoco", "mujoco_euler") else 1e-6
        for count in counts:
            try:
                trial, = loops.trials(f"fourbars_{count}", "--engine", engine, "--setting", setting, "--duration", 0.5,
                                      "--limit", 30, patience=PATIENCE)
            except subprocess.TimeoutExpired:
                break
            rows.append([engine, setting, count, f"{trial['cpu']:.4g}", f"{trial['until']:.6g}", trial["end"]])
            if trial["cpu"] > 10 or trial["end"]:
                break
    return ["engine", "setting", "count", "cpu", "until", "end"], rows


def measure_long(loops):
    """Errors of N four-bars in motion."""
    rows = []
    for engine, setting in (("manifold", 1e-10), ("bielle", 1e-3), ("simbody", 1e-8), ("mujoco", 1e-3)):
        if engine not in [known["name"] for known in loops.list()["engines"]]:
            continue
        for count in LONG_COUNTS:
            try:
                trial, = loops.trials(f"fourbars_{count}", "--engine", engine, "--setting", setting, "--limit", 20,
                                      patience=PATIENCE)
            except subprocess.TimeoutExpired:
                break
            errors = " ".join(f"{time}:{error}" for time, error in trial["errors"].items())
            rows.append([engine, setting, count, f"{trial['cpu']:.4g}", f"{trial['until']:.6g}", trial["end"], errors])
    return ["engine", "setting", "count", "cpu", "until", "end", "errors"], rows


def merge(name, run, engines, columns, rows, listed):
    """Rows of other engines stay, with where they are from."""
    comment, old = read_data(name)
    if not engines or not comment:
        return run, columns, rows
    kept = [[row[column] for column in columns] for row in old if row["engine"] not in engines]
    rows = sorted(kept + rows, key=lambda row: listed.index(row[0]))  # stable
    known = dict.fromkeys(engines, run)
    runs = {}
    for engine in dict.fromkeys(row[0] for row in rows):
        runs.setdefault(known.get(engine) or find_run(comment, engine), []).append(engine)
    if len(runs) == 1:
        return run, columns, rows
    return "\n".join(f"{', '.join(names)}: {where}" for where, names in runs.items()), columns, rows


def find_run(comment, engine):
    """The line of the engine, or the one without names."""
    lines = [line.rpartition(": ") for line in comment.split("\n")]
    return next(run for names, _, run in sorted(lines, reverse=True) if not names or engine in names.split(", "))


# The page

def tell_run(comment, engines):
    """Where a table is from."""
    told = []
    for line in comment.split("\n"):
        names, _, run = line.rpartition(": ")
        who = ", ".join(engines.get(name, name) for name in names.split(", ")) + ": " if names else ""
        told.append(f"*{who}{run}.*")
    return " ".join(told)


def read_errors(row):
    return {float(time): float(error) for time, error in (pair.split(":") for pair in row["errors"].split())}


def judge(row, times):
    """The largest error at the times; None if it did not reach them."""
    errors = read_errors(row)
    found = [errors.get(time, math.nan) for time in times]
    return None if row["end"] or any(math.isnan(error) for error in found) else max(found)


def tell_error(row, time):
    error = read_errors(row).get(time)
    return "–" if error is None else "not finite" if math.isnan(error) else f"{error:.1e}"


def tell_end(row):
    """Why and when a trial ended early; empty if it did not."""
    if not row["end"]:
        return ""
    why = "a step of the integrator failed" if "Integrator step failed" in row["end"] else row["end"].split(":")[0]
    if "rank of its loops" in row["end"]:
        why = "its loops lost rank"
    return f"{why} (at {float(row['until']):.3g} s)"


def draw(name, problem, engines, rows):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": name, "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7.2, 3.6))
    for engine, title in engines.items():
        points = [(float(row["cpu"]), judge(row, problem["times"])) for row in rows if row["engine"] == engine]
        points = [point for point in points if point[1] is not None]
        if points:
            axes.loglog(*zip(*points), "o-", ms=3, lw=1.2, color=COLORS.get(engine, "#7f7f7f"), label=title)
    axes.set_xlabel("processor time [s]")
    axes.set_ylabel("largest error [m, rad]")
    axes.grid(True, which="major", lw=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.tight_layout()
    figure.savefig(IMAGES / f"loops_{name}.svg", metadata={"Date": None})
    pyplot.close(figure)


def choose(rows):
    """Every other setting of an engine, with the finest one."""
    return [row for i, row in enumerate(rows) if (len(rows) - 1 - i) % 2 == 0]


def tell_time(seconds):
    return f"{seconds:.2g} s" if seconds < 100 else f"{seconds:.0f} s"


def add_goals(page, problem, engines, rows):
    lines = []
    for engine, title in engines.items():
        found = [(float(row["cpu"]), judge(row, problem["times"])) for row in rows if row["engine"] == engine]
        if not found:
            continue
        errors = [error for _, error in found if error is not None]
        cells = []
        for goal in GOALS:
            times = [cpu for cpu, error in found if error is not None and error <= goal]
            cells.append(tell_time(min(times)) if times else "missed")
        lines.append([title, *cells, f"{min(errors):.1e}" if errors else "none"])
    page.table(["", *(f"within {goal:.0e}" for goal in GOALS), "least error"], lines)


def add_problem(page, problem, engines, comment, rows, figures):
    page.heading(problem["title"])
    page.add(PROBLEMS[problem["name"]])
    page.add(f"""{problem['bodies']} bodies, {problem['velocities']} velocities, {problem['rows']} closure rows;
{problem['duration']:g} s. The error is the largest of {', '.join(problem['judged'])} at {', '.join(f'{t:g}' for t in problem['times'])}
s. {tell_run(comment, engines)}""")
    if figures:
        draw(problem["name"], problem, engines, rows)
        page.lines += ["", f"![error over processor time](../images/loops_{problem['name']}.svg)"]
    page.add("Processor time of the cheapest setting that is so near the true motion at all these times:")
    add_goals(page, problem, engines, rows)
    lines = []
    for engine, title in engines.items():
        for row in choose([row for row in rows if row["engine"] == engine]):
            lines.append([title, row["setting"], *(tell_error(row, time) for time in problem["times"]),
                          tell_time(float(row["cpu"])), row["gap"], row["drift"], tell_end(row)])
    page.lines += ["", "<details><summary>All figures, every other setting</summary>"]
    page.table(["", "setting", *(f"error at {time:g} s" for time in problem["times"]), "processor time", "opening [m]",
                f"drift of the {problem['invariant']}", ""], lines)
    page.lines += ["", "</details>"]


def add_cost(page, engines):
    comment, rows = read_data(COST)
    if not rows:
        return
    page.heading("The cost of many loops")
    page.add(f"""Processor time of the first 0.5 s of N four-bars [s]: 2 N + 1 bodies, N loops that share rods, one freedom. Fixed
steps are of 1 ms, others have an accuracy of 1e-6. A dash: the case before took more than 10 s, or this one 90 s
with the making of its world. {tell_run(comment, engines)}""")
    counts = list(dict.fromkeys(row["count"] for row in rows))
    lines = []
    for engine, title in engines.items():
        cells = {row["count"]: (f"{float(row['cpu']):.2g}" if not row["end"] else tell_end(row)) for row in rows
                 if row["engine"] == engine}
        if cells:
            lines.append([title, *(cells.get(count, "–") for count in counts)])
    page.table(["N", *counts], lines)


def add_long(page, engines):
    comment, rows = read_data(LONG)
    if not rows:
        return
    page.heading("N four-bars, in full")
    page.add(f"""Errors of B0 [m] after 1, 5 and 10 s and processor time; a trial that ended early has no later errors. {tell_run(comment, engines)}""")
    lines = []
    for row in rows:
        errors = [tell_error(row, time) for time in (1, 5, 10)]
        lines.append([engines[row["engine"]], row["setting"], row["count"], *errors, tell_time(float(row["cpu"])), tell_end(row)])
    page.table(["", "setting", "N", "1 s", "5 s", "10 s", "processor time", ""], lines)


def add_overview(page, problems, engines, data):
    page.heading("Overview")
    page.add("""The least error of any setting tried, and the processor time of the cheapest one that stays within 1e-6 of the true motion
at all times compared [m, rad].""")
    lines = []
    for engine, title in engines.items():
        cells = []
        for problem in problems:
            found = [(judge(row, problem["times"]), float(row["cpu"])) for row in data(problem["name"])[1]
                     if row["engine"] == engine]
            found = [(error, cpu) for error, cpu in found if error is not None]
            near = [cpu for error, cpu in found if error <= GOALS[1]]
            cells.append((f"{min(found)[0]:.0e}" if found else "none") + ", " + (tell_time(min(near)) if near else "missed"))
        lines.append([title, *cells])
    page.table(["", *(problem["title"] for problem in problems)], lines)
    page.add("""How many times sooner Bielle's order 8 comes within 1e-6 than the next engine of the same run. The goal is ten times on
every problem. The governor misses it: its springs are stiff, every method that comes so near is explicit in them, and stability alone
sets the number of steps.""")
    page.table([problem["title"] for problem in problems],
               [[tell_lead(problem, engines, *data(problem["name"])) for problem in problems]])


def tell_lead(problem, engines, comment, rows):
    times = {}
    for row in rows:
        error = judge(row, problem["times"])
        if error is not None and error <= GOALS[1]:
            times[row["engine"]] = min(times.get(row["engine"], math.inf), float(row["cpu"]))
    own = times.get("manifold", math.inf)
    others = {name: time for name, time in times.items()
              if name not in ("manifold", "bielle") and find_run(comment, name) == find_run(comment, "manifold")}
    if not others:
        return "alone"
    next_one = min(others, key=others.get)
    lead = others[next_one] / own
    return f"{lead:.0f} ({engines[next_one]})" if lead >= 10 else f"{lead:.1f} ({engines[next_one]})"


def add_published(page, loops):
    page.heading("What is published, and what is right")
    page.add("""Published figures that are not exact, or not enough, and why.""")
    page.add("""**Andrews' squeezer.** The angles at 0.03 s that Hairer and Wanner print with sixteen digits (*Solving Ordinary
Differential Equations II*, VII.7) are right to 1.4e-9 rad, and their errors are of one kind: all seven are those of the true motion
1.0e-12 s later, as if an integration had gone so much too far. The printed velocities are right to 6e-7 rad/s and the accelerations to
0.06 rad/s² (of 6e5): the latter do not solve the equations of motion at the printed angles and velocities. What is printed for
the start, accelerations and forces, is right in all digits. A page on the same problem in OpenSim has +0.03635 for the x of B, with
which the mechanism does not close (by 73 mm), and 0.02372 for m3.""")
    page.add("""**Spatial slider-crank.** Six published solutions disagree with each other: 0.240761815 m for x at 5 s, and 54.114,
51.507 and 51.575 rad for the crank. The universal joint about another axis, or a rod that does not spin, moves x at 5 s by 2e-2
m: a benchmark needs the axes of its joints.""")
    page.add("""**Governor.** No reference digits are public, nor how the 30 degrees are measured; with the slider at 0.5 m and springs of
0.5 m from the middles of the rods, they are measured from the horizontal if the springs are at rest.""")
    page.add("""**Prices.** *MBS benchmarks in OpenSim* has 0.455 s for four-bars, 0.384 s for the squeezer, 0.258 s for Bricard's mechanism
and 0.233 s for the governor, by OpenSim 3.2 (Simbody) at accuracies of 1e-6, 1e-8, 1e-7 and 1e-6 on a desktop of 3.2 GHz. These are the
orders of magnitude found here with Simbody.""")


def make_page(loops, data, run, figures=True, until=math.inf):
    listed = loops.list()
    for problem in listed["problems"]:
        problem["times"] = [time for time in problem["times"] if time <= until]
    engines = {engine["name"]: engine["title"] for engine in listed["engines"]}
    page = common.Page(__file__, "Benchmarks with loops", run)
    page.add("""The multibody field has a library of mechanisms that programs are compared with (González, Dopico, Lugrís and
Cuadrado, "A benchmarking system for MBS simulation software: problem standardization and performance measurement", 2006). Those
with loops, and two more, are `validation/loops`: `bielle-loops run PROBLEM` carries one out in every engine. All are smooth,
without contact, friction or control: what remains is how exactly an engine holds loops and integrates, and at what price.""")
    page.add("""Errors are differences to the true motion, not to another engine. A mechanism of one freedom without losses has it in closed form:
its energy gives the time as an integral over its coordinate, to 1e-12 and better. The governor has three freedoms by its symmetry; its
true motion comes from their equations, extrapolated to the same accuracy. Neither uses Bielle's dynamics. Axes are as published, because gravity is part of a model.
`bielle-loops robot PROBLEM` writes a mechanism as a robot for `bielle`.""")
    page.add("""Simbody is version 3.7, MuJoCo version 2.2.2. Simbody's accuracy is the relative error of a step, a tenth of which is the tolerance of its constraints in metres. MuJoCo's closures are
soft; their time constant is twice the step, the least that it takes. MuJoCo 3 is 3.14, as npm has it: WebAssembly in node, which is
said to take 1.1 to 1.6 times as long as its native library; the steps of its `discrete` integrator are implicit in springs and
dampers. DART is version 6.12 with the least force mixing that it takes (1e-9), ODE version 0.16 as it comes, which breaks off on the four-bars,
whose thin rods have no moment of inertia about their axis; both have steps of first order, and DART, ODE and MuJoCo 3 run in programs of their own, which time themselves.
*Opening*: the largest distance of points that a closure
ties. *Drift*: the largest change of the energy, less the work of motors, over the largest kinetic energy.""")
    page.add("""Every engine is stopped twenty times a motion and at the times compared, to be looked at. Errors do not depend on the load of the machine.
Processor times are those of engines that ran one after the other; *among other programs* they hold beside those of the same run alone.
Engines are given up where a setting takes too long: finer ones may be nearer.""")
    problems = [problem for problem in listed["problems"] if data(problem["name"])[1]]
    add_overview(page, problems, engines, data)
    for problem in problems:
        comment, rows = data(problem["name"])
        if rows:
            add_problem(page, problem, engines, comment, rows, figures)
    if figures:
        add_long(page, engines)
        add_cost(page, engines)
    add_published(page, loops)
    return page


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--measure", nargs="*", metavar="PROBLEM", help="what to measure first; all without a name")
    parser.add_argument("--engines", nargs="+", default=[], metavar="ENGINE", help="measure only these")
    parser.add_argument("--limit", type=float, default=20, help="processor time of a trial, s")
    arguments = parser.parse_args()
    loops = Loops(arguments.bielle)
    run = common.describe_run(arguments.commit)
    if os.getloadavg()[0] > os.cpu_count():
        run += ", among other programs"
    if arguments.quick:
        options = ["--duration", 1, "--limit", 0.3]
        quick = {}
        for name in ("fourbars_2", "spatial_fourbar"):
            columns, rows = measure_problem(loops, name, options)
            quick[name] = [dict(zip(columns, row)) for row in rows]
        make_page(loops, lambda name: (run, quick.get(name, [])), run, figures=False, until=1).write(True)
        return
    known = [*PROBLEMS, LONG, COST]
    for name in (arguments.measure or known) if arguments.measure is not None else []:
        if name not in known:
            parser.error(f"--measure {name}: expected one of {', '.join(known)}")
        if name == COST:
            write_data(name, run, *measure_cost(loops))
        elif name == LONG:
            write_data(name, run, *measure_long(loops))
        else:
            only = [option for engine in arguments.engines for option in ("--engine", engine)]
            columns, rows = measure_problem(loops, name, ["--limit", arguments.limit, *only])
            write_data(name, *merge(name, run, arguments.engines, columns, rows,
                                    [engine["name"] for engine in loops.list()["engines"]]))
    make_page(loops, read_data, run).write(False)


if __name__ == "__main__":
    main()
