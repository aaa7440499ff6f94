#!/usr/bin/env python3
"""Writes docs/results/execution.md from the tables in docs/results/data, after measuring or recording some of them.

    docs/results/execution.py                               writes the page
    docs/results/execution.py --measure sensors errors      measures these tables first (minutes each)
    docs/results/execution.py --measure minutes real_time   these take hours and minutes
    docs/results/execution.py --record unknown=DIR          takes a table from a campaign: `bielle campaign SPEC -o DIR`

The campaigns are worlds, pushes, pushes_predictive, pushes_felt, solve_times, cleobot, unknown, worlds_real_time and
pushes_real_time, each from examples/campaign/NAME.yaml; they take hours, those in real time less, but they want a quiet
machine. Every table keeps the commit, the date and the machine of its figures. `--quick` runs and records a small campaign.
"""
import contextlib
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import common
from common import show

DATA = common.HERE / "data"
SPECS = "examples/campaign"
MAP = common.SOURCE / "docs/images/solve_times.svg"
STOOD = "stood"
WORLDS = ("bielle", "mujoco", "simbody")


# Tables are files of comma-separated values below comments that say where they are from.

def write_data(name, run, columns, rows, *remarks, directory=DATA):
    with open(pathlib.Path(directory) / f"{name}.csv", "w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {comment}\n" for comment in (run, *remarks))
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def read_data(name, directory=DATA):
    """(comments, columns, rows)"""
    with open(pathlib.Path(directory) / f"{name}.csv", encoding="utf-8", newline="") as file:
        lines = file.read().splitlines()
    comments = [line[1:].strip() for line in lines if line.startswith("#")]
    columns, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    return comments, columns, rows


# Campaigns

def read_runs(directory):
    with open(pathlib.Path(directory) / "runs.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def count_by(column, key=float):
    def reduce(directory):
        counts = {}
        for run in read_runs(directory):
            stood, runs = counts.get(run[column], (0, 0))
            counts[run[column]] = (stood + (run["outcome"] == STOOD), runs + 1)
        return [column, "stood", "runs"], [[value, *counts[value]] for value in sorted(counts, key=key)]
    return reduce


def list_falls(directory):
    """Seconds until a robot falls, by motion and by world and control; `stands` where it does not."""
    cells = {}
    for run in read_runs(directory):
        time = "stands" if run["outcome"] == STOOD else f"{float(run['duration']):.2f}"
        cells.setdefault(run["motion"], {})[f"{run['world']} {run['control']}"] = time
    columns = list(dict.fromkeys(column for row in cells.values() for column in row))
    rows = [[motion, *(row.get(column, "") for column in columns)] for motion, row in cells.items()]
    return ["motion", *columns], rows


def list_impulses(directory):
    summary = json.loads((pathlib.Path(directory) / "summary.json").read_text(encoding="utf-8"))
    cells = {}
    for found in summary["largest_impulses"]:
        cells.setdefault(found["push phase"], {})[found["push direction"]] = found["survived_Ns"]
    columns = list(next(iter(cells.values())))
    return ["phase", *columns], [[phase, *(row[column] for column in columns)] for phase, row in cells.items()]


def count_impulses(directory):
    """Runs that stand, by the time of a solve and by impulse; the campaign's map becomes the image of the page."""
    counts, runs = {}, read_runs(directory)
    for run in runs:
        row = counts.setdefault(run["solve-time"], {})
        row[run["push impulse"]] = row.get(run["push impulse"], 0) + (run["outcome"] == STOOD)
    shutil.copy(pathlib.Path(directory) / "map.svg", MAP)
    columns = list(next(iter(counts.values())))
    return (["given to a solve [ms]", *(f"{impulse} N s" for impulse in columns), "runs of each"],
            [[time, *row.values(), len(runs) // len(counts) // len(columns)] for time, row in counts.items()])


def tell_failures(directory):
    """Of runs that an error ended, if there are any."""
    runs = read_runs(directory)
    failed = [re.sub("'.*?'", "…", run["outcome_message"]).split(";")[0] for run in runs if run["outcome"] == "failed"]
    if not failed:
        return []
    return [f"broken off, and counted as falls: {len(failed)} of {len(runs)} runs ({'; '.join(sorted(set(failed)))})"]


CAMPAIGNS = {"worlds": list_falls, "pushes": list_impulses, "pushes_predictive": count_by("push time"),
             "pushes_felt": count_by("push time"), "unknown": count_by("friction"),
             "cleobot": count_by("motion", str), "solve_times": count_impulses,
             "worlds_real_time": list_falls, "pushes_real_time": count_by("sensors", str)}


# Measurements

ROBOTS = ("bipetto", "cleobot")
MOTIONS = [(f"{robot}: {title}", robot, motion, options)
           for robot in ROBOTS
           for title, motion, options in [
               ("squat to 0.8", "squat", ["--depth", 0.8]), ("squat to 0.7", "squat", ["--depth", 0.7]),
               *((f"walk at {speed} m/s", "walk", ["--speed", speed]) for speed in (0.2, 0.4, 0.6, 0.8)),
               ("stairs of 5 cm", "stairs", ["--height", 0.05]), ("jump, 0.3 s in the air", "jump", ["--flight", 0.3])]]
WALK = ("walk", "bipetto", ["--speed", 0.4])
GAINS = ("--control", "gains")


def simulate(runner, target, *options):
    """The summary of a motion carried out."""
    directory = runner.place()
    print("simulate", target, *options, file=sys.stderr, flush=True)
    runner.run("simulate", target, "-o", directory, "--summary-only", *options)
    return json.loads((pathlib.Path(directory) / "summary.json").read_text(encoding="utf-8"))


def tell_fall(summary):
    return "stands" if summary["outcome"] == STOOD else f"{summary['duration']:.2f}"


def measure_gains(runner):
    rows = []
    for title, robot, motion, options in MOTIONS:
        result = runner.solve(motion, robot, options)
        for world in WORLDS[:2]:
            s = simulate(runner, result.directory, *GAINS, "--world", world)
            rows.append([title, world, tell_fall(s), f"{1e3 * s['largest_deviation']:.1f}",
                         f"{1e3 * s['largest_slip']:.2f}", f"{1e6 * s['largest_gap']:.1g}"])
    return ["motion", "world", "outcome", "trunk off its plan [mm]", "slip [mm]", "closures open by [µm]"], rows


def measure_sensors(runner):
    rows = []
    for title, robot, motion, options in MOTIONS:
        result = runner.solve(motion, robot, options)
        for world in WORLDS[:2]:
            s = simulate(runner, result.directory, *GAINS, "--world", world, "--sensors", "real")
            e = s["estimator"]
            rows.append([title, world, tell_fall(s), f"{1e3 * e['position_error']['rms']:.1f}",
                         f"{1e3 * e['velocity_error']['rms']:.1f}", show(e["drift_share"], "{:.2f}", 100),
                         f"{100 * e['contact_errors']:.2f}"])
    return ["motion", "world", "outcome", "position [mm]", "velocity [mm/s]", "drift [% of the way]",
            "contacts wrong [% of the time]"], rows


def measure_errors(runner):
    motion, robot, options = WALK
    plan = runner.solve(motion, robot, options).directory
    rows = []
    for error in (["--mass-error", 0.1], ["--rod-error", 0.0005]):
        counts = []
        for more in ([], ["--look-ahead", 36]):
            runs = [simulate(runner, plan, *GAINS, *error, *more, "--seed", seed) for seed in range(1, 6)]
            counts.append(sum(run["outcome"] == STOOD for run in runs))
        rows.append([f"`{' '.join(map(str, error))}`", *counts])
    return ["error", "gains", "gains, look-ahead 36"], rows


def measure_delays(runner):
    delays = (5, 8, 12, 16, 20, 25, 30)
    rows = []
    for robot in ("bipetto", "cleobot"):
        for title, motion, options in (("walk at 0.4 m/s", "walk", ["--speed", 0.4]),
                                       ("squat to 0.8", "squat", ["--depth", 0.8])):
            plan = runner.solve(motion, robot, options).directory
            rows.append([f"{robot}: {title}",
                         *(tell_fall(simulate(runner, plan, *GAINS, "--delay", delay, "--jitter", 1))
                           for delay in delays)])
    return ["motion", *map(str, delays)], rows


# Of the parts of rsu_biped, about 2 and 125 kg.
SMALL = ("{trunk_height: 0.06, hip_height: 0.13, plate_height: 0.03, trunk_mass: 0.6, hip_offset: 0.04, thigh_length: 0.07, "
         "shank_length: 0.075, ankle_height: 0.03, sole_length: 0.06, sole_width: 0.045, sole_offset: 0.005, motor_mass: 0.05, "
         "hip_link_mass: 0.05, link_density: 0.3, foot_mass: 0.05, rod_density: 0.05, pulley_mass: 0.005, armature: 1e-5, "
         "ankle_arm: 0.015, ankle_crank: 0.015, ankle_half_width: 0.018, ankle_housing: 0.01, ankle_motor_height: 0.05}")
LARGE = ("{trunk_height: 0.3, hip_height: 0.88, plate_height: 0.08, trunk_mass: 45, hip_offset: 0.13, thigh_length: 0.45, "
         "shank_length: 0.43, ankle_height: 0.09, sole_length: 0.28, sole_width: 0.14, sole_offset: 0.03, motor_mass: 4.5, "
         "hip_link_mass: 2, link_density: 8, foot_mass: 1.5, rod_density: 1, armature: 0.2, ankle_arm: 0.06, ankle_crank: 0.06, "
         "ankle_half_width: 0.06}")


def measure_sizes(runner):
    rows = []
    for name, robot, speed in (("bipetto", "bipetto", 0.4), ("bipetto", "bipetto", 0.8), ("cleobot", "cleobot", 0.4),
                               ("rsu_biped", "rsu_biped", 0.4), ("legs of 15 cm", SMALL, 0.15), ("legs of 88 cm", LARGE, 0.8),
                               ("rsu_biped on the Moon", "gravity: [0, 0, -1.62]", 0.2)):
        if robot.startswith(("{", "gravity")):
            file = pathlib.Path(runner.place() + ".yaml")
            parts, gravity = (robot, "") if robot.startswith("{") else ("{}", robot)
            file.write_text(f"help: {name}\n{gravity}\ntree: {{biped: {{part: rsu_biped, set: {parts}}}}}\n", encoding="utf-8")
            robot = str(file)
        plan = runner.solve("walk", robot, ["--speed", speed]).directory
        for world in WORLDS[:2]:
            s = simulate(runner, plan, "--control", "mpc", "--threads", 1, "--world", world)
            planned = next(goal["achieved"] for goal in s["plan"]["goals"] if goal["name"] == "speed")
            rows.append([name, world, f"{planned:.3f}", f"{s['steady_speed']:.3f}", f"{100 * s['steady_speed'] / planned:.1f}",
                         f"{1e3 * s['largest_deviation']:.0f}"])
    return ["robot", "world", "planned [m/s]", "walked [m/s]", "[%]", "trunk off its plan [mm]"], rows


def measure_loads(runner):
    loads = (1, 2, 3, 4, 6, 8, 10)
    rows = []
    for robot, link in (("bipetto", "trunk"), ("cleobot", "trunk"), ("rsu_biped", "trunk")):
        plan = runner.solve("walk", robot, ["--speed", 0.4]).directory
        for place, at in (("in the middle", "0,0,0.1"), ("10 cm ahead", "0.1,0,0.1"), ("10 cm to the left", "0,0.1,0.1")):
            for control in ("gains", "mpc"):
                rows.append([robot, place, control,
                             *(tell_fall(simulate(runner, plan, "--control", control, "--threads", 1, "--payload", load,
                                                  "--payload-at", f"{link},{at}")) for load in loads)])
    return ["robot", "load", "control", *(f"{load} kg" for load in loads)], rows


def measure_minutes(runner):
    rows = []
    for robot in ("bipetto", "cleobot"):
        for speed in (0, 0.4, 0.6, 0.8):
            for world in WORLDS:
                s = simulate(runner, "walk", "--robot", robot, "--speed", speed, "--duration", 60, "--control", "mpc",
                             "--threads", 1, "--world", world)
                rows.append([robot, speed, world, tell_fall(s), f"{s['distance']:.1f}",
                             f"{1e3 * s['largest_slip']:.2f}", s["solves"]["failed"]])
    return ["robot", "speed [m/s]", "world", "outcome", "distance [m]", "slip [mm]", "solves that failed"], rows


@contextlib.contextmanager
def run_busily(count):
    """Beside so many processes that never rest."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


PAUSES = """
import time
pauses, last = [], time.perf_counter()
end = last + 60
while last < end:
    now = time.perf_counter()
    if now - last > 1e-3:
        pauses.append(now - last)
    last = now
print(len(pauses), max(pauses, default=0))
"""


def tell_pauses():
    """What the machine takes from programs that do not wait for anything."""
    loops = [subprocess.Popen([sys.executable, "-c", PAUSES], stdout=subprocess.PIPE, text=True)
             for _ in range(os.cpu_count())]
    counts, longest = zip(*(loop.communicate()[0].split() for loop in loops))
    return (f"in the minute after, loops that only read the clock, one on each core, were interrupted {' and '.join(counts)} "
            f"times for longer than 1 ms, at worst for {1e3 * max(map(float, longest)):.1f} ms")


GOAL = ["*goal*", "", "two cores", "stands", 0, 5000, "(12)", "(60)", "(215)", "", "", "", ""]


def measure_real_time(runner):
    unit = 1e-3 * json.loads(runner.run("bench", "--quick", "--json").stdout)["unit [us]"]  # ms
    rows = [GOAL]

    def add(robot, walk, options, condition, *more, busy=0):
        with run_busily(busy):
            s = simulate(runner, "walk", "--robot", robot, *options, "--duration", 60, "--control", "mpc",
                         "--real-time", *more)
        c, update, policy = s["solves"], s["real_time"]["update"], s["real_time"]["new_policy"]
        rows.append([robot, walk, condition, tell_fall(s), c["missed"], c["stages"],
                     *(f"{time:.1f} ({time / unit:.0f})" for time in (
                         c["median_ms"], c["p99_ms"], c["worst_ms"], c["parts"]["prepare"]["median_ms"])),
                     f"{update['p99_ms']:.2f}", f"{policy['median_ms']:.1f}",
                     f"{s['real_time']['peak_memory_MB']:.0f}"])

    def walk_at(speed):
        commands = pathlib.Path(runner.place() + ".yaml")
        commands.write_text(f"commands: [{{time: 0.5, forward: {speed}}}]\n", encoding="utf-8")
        return f"{speed} m/s", ["--command", commands]

    walks = [walk_at(0.4), walk_at(0.8), ("tour", ["--command", common.SOURCE / "examples/tour.yaml"])]
    for robot in ROBOTS:
        for walk, options in walks:
            add(robot, walk, options, "two cores")
        add(robot, *walks[0], "beside two busy processes", busy=2)
    add("bipetto", *walks[0], "one thread", "--threads", 1)
    return ["robot", "walk", "on", "outcome", "stages without a solve", "of", "median [ms (units)]",
            "99 %", "worst", "prepared before", "`update` 99 % [ms]", "to a new policy [ms]", "memory [MB]"], rows, tell_pauses()


MEASUREMENTS = {"gains": measure_gains, "sensors": measure_sensors, "errors": measure_errors, "delays": measure_delays,
                "minutes": measure_minutes, "real_time": measure_real_time, "sizes": measure_sizes, "loads": measure_loads}


# The page

def add_table(page, name, directory=DATA):
    """One table with its origin and how to repeat it."""
    comments, columns, rows = read_data(name, directory)
    page.table(columns, [[cell or "–" for cell in row] for row in rows])
    repeat = f"`docs/results/execution.py --measure {name}`"
    if name in CAMPAIGNS:
        repeat = (f"`bielle campaign {SPECS}/{name}.yaml -o {name}`, then "
                  f"`docs/results/execution.py --record {name}={name}`")
    page.add("*" + "; ".join(comments) + f".* To repeat: {repeat}.")


def count_all(name):
    """(stood, runs) of a table of counts."""
    _, columns, rows = read_data(name)
    stood, runs = columns.index("stood"), columns.index("runs")
    return sum(int(row[stood]) for row in rows), sum(int(row[runs]) for row in rows)


def share(name):
    stood, runs = count_all(name)
    return f"{stood} of {runs} runs stand, {100 * stood / runs:.0f} %"


SECTIONS = [
    ("Feedback by gains", "gains", lambda: """`--control gains`, to the end of the plan and one second more: *stands*,
or the seconds until the robot falls; how far the trunk leaves its plan, the largest slip of a sole since its
touchdown, and the largest opening of a closure. Bielle's world closes loops exactly; in MuJoCo's they are soft."""),
    ("Torques alone, gains and predictive control", "worlds", lambda: """Two robots, eleven motions, three worlds:
seconds until a robot falls by the torques of its plan alone (`open`), by gains and by predictive control (`mpc`). Under
predictive control a swinging foot keeps to its path wherever there are steps, up to where it lands; before, heels came down on
the edge of the step above: Bipetto's turned by up to 0.5 rad, Cleobot's by 0.24. Earlier, Bipetto fell going down (2.25 s in
Bielle's and Simbody's worlds, 3.15 in MuJoCo's) and Cleobot going back (1.07 to 1.10 s) under gains, and Cleobot going down in MuJoCo's world
under predictive control (1.47 s)."""),
    ("Real sensors", "sensors", lambda: """`--sensors real`, seed 1, gains; outcomes as above. Errors are
those of the estimated trunk, root mean squares; drift is that over the ground at the end."""),
    ("Errors of the robot", "errors", lambda: """Bipetto's walk at 0.4 m/s in Bielle's world: how many of five runs
stand, seeds 1 to 5."""),
    ("Loads", "loads", lambda: """Robots that carry what neither plan nor controller knows (`--payload`), on the trunk, 10 cm above
the middle of the hips or beside that place: walks at 0.4 m/s in Bielle's world, *stands*, or seconds until the robot falls."""),
    ("Sizes", "sizes", lambda: """Speed of the steady steps under predictive control, over that of the plan; the same options for all. The goal
is 98 to 102 %, from 2 to 113 kg and from 1.62 to 9.81 m/s²."""),
    ("Delay", "delays", lambda: """Gains in Bielle's world, `--jitter 1`: *stands*, or seconds until the robot falls,
by `--delay` in ms."""),
    ("Pushes under gains", "pushes", lambda: """The largest impulse [N s] that Bipetto survives, walking at 0.4 m/s,
by phase of the plan and direction [°] (0: from behind, 90: to the left), with all smaller ones survived, too. Phases:
5.1, 5.5 and 5.9 are early, half-way and late on the left foot, 6.5 on both feet. A push lasts 0.1 s; impulses are
found by bisection to 0.25 N s."""),
    ("Pushes under predictive control", "pushes_predictive", lambda: f"""Pushes of 10 N s (0.39 N s per kg) from eight
directions at ten instants [s] of one step, true state, measured 4 ms before each stage (`--lead 4`): {share("pushes_predictive")}."""),
    ("Pushes, real sensors and late torques", "pushes_felt", lambda: f"""The same pushes with real sensors and torques
that are 5 ± 1 ms late: {share("pushes_felt")}."""),
    ("What a millisecond is worth", "solve_times", lambda: """Pushes of 5 to 20 N s (0.2 to 0.8 N s per kg) from the same
directions at the same instants, true state: how many runs stand, by the time that a solve is given (`--solve-time`). A
stage takes 12 ms and has as many solves as fit into it."""),
    ("Cleobot, pushed near dead points", "cleobot", lambda: """Cleobot walks at 0.4 m/s and climbs stairs of 5 cm, pushed by
10 and 15 N s from eight directions at three instants, by plans that keep 0.15 of the transmission at the start and by plans
without that margin. It saves one walk of 48 and no climb."""),
    ("Unknown ground", "unknown", lambda: f"""Bipetto walks for 20 s at 0.2 m/s on tiles of 25 cm, up to 2 cm above
and below the planned ground, with masses off by up to 10 %, rods by up to 0.5 mm, and friction as in the table; its
plan assumes 0.4. In real time, two runs at once on two cores: {share("unknown")}. One that was looked at stood
with the middle of a sole on the edge of a tile. Falls are partly a matter of chance: with a friction that differs by 0.002, six of the
nine stand, and so do all of them in MuJoCo's world (in simulated time). At commit 2ae571a6 157 stood. Soles have changed since then:
with those of that time, 25 equal points that bear half of the moment about their normal, 144 stand by today's program (in simulated
time): soles are not what lost them."""),
    ("Motions in real time", "worlds_real_time", lambda: """`--control mpc --real-time`, world and controller on the same
two cores: a solve takes the time that it takes, and the world does not wait. Seconds until a robot falls. At commit b61d0a5a
Bipetto fell going down in MuJoCo's world, in one of six runs."""),
    ("Pushes in real time", "pushes_real_time", lambda: f"""Pushes of 10 N s from eight directions at ten instants of one
step, with `--real-time`, by what the controller knows: the true state, or real sensors.
{share("pushes_real_time")}."""),
    ("Minutes", "minutes", lambda: """`bielle simulate walk --duration 60 --control mpc`, true state, largest slip of
a sole since its touchdown. Takes hours, most of them in Simbody's world."""),
    ("Real time", "real_time", lambda: """`bielle simulate walk --command FILE --duration 60 --control mpc
--real-time`, at a constant speed or by `examples/tour.yaml`, world and controller on the same two cores: 5000 stages of
12 ms. A stage without a solve of its own acts by the policy of an earlier one. A solve counts from its measurement to its
policy. What needs no measurement is *prepared before*, median; where that is late, the solve waits for it, and counts the
wait. Units are those of [`bielle bench`](../speed.md). `update` is what computes torques every millisecond; the time to a
new policy counts from the measurement that it was solved for. The goal is missed where a figure exceeds it. 99 %, the worst
and the stages without a solve depend on how often the machine takes a core away, which is told below the table. Threads are the
default, one core left to world and control: here, the last row is another run of the first. Measured 4 ms before each stage, the
default; before, at commit f7a76308, the whole stage: the first torques came after 12.0 ms, medians were 18 to 27 units, and 99 % 37 to
62 alone and 113 and 162 beside two busy processes, where no stage was without a solve. With as many threads as cores, at commit
e1419068, medians were 33 to 59 units and 99 % 97 to 115. At commit f0939d42, medians were 31 to 40 units, of which a third
is the goal, and 99 % up to 101.

Since this table, the solve after a policy that came late begins at once. Beside two busy processes, in turn for 20 s each, Cleobot's
walk at 0.4 m/s then has 120 and 318 of 1667 stages without a solve, and with `--lead 0` 422 and 195, on a machine that was busier than
for the table; 30 s each, before that change, 270 and 318 of 2500, and 67 and 88. Beside one busy process Bipetto's has none of 1667, in
two runs of each."""),
]


def make_page():
    page = common.Page(__file__, "Motions carried out", "Each table names its commit, date and machine")
    page.add("""[Motions carried out](../execution.md) explains the options and the words. Tables are as old as their
commits; `git log COMMIT..` lists what has changed since. Campaigns under predictive control take hours.""")
    for title, name, describe in SECTIONS:
        if not (DATA / f"{name}.csv").exists():
            continue
        page.heading(title)
        page.add(describe())
        add_table(page, name)
        if name == "solve_times" and MAP.exists():
            page.add(f"![largest impulse without a fall, by direction](../images/{MAP.name})")
    return page


QUICK_SPEC = """motions:
  - {name: squat, solve: squat, robot: bipetto, set: {depth: 0.9}}
options:
  world: bielle
  control: [open, gains]
"""


def run_quick(runner, run):
    spec, directory = runner.place("spec.yaml"), runner.place()
    pathlib.Path(spec).write_text(QUICK_SPEC, encoding="utf-8")
    runner.run("campaign", spec, "-o", directory, allowed=(0,))
    with tempfile.TemporaryDirectory() as data:
        write_data("worlds", run, *list_falls(directory), directory=data)
        page = common.Page(__file__, "A small campaign", run)
        add_table(page, "worlds", data)
    page.write(True)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--measure", nargs="+", default=[], choices=MEASUREMENTS, metavar="TABLE",
                        help="measure these first")
    parser.add_argument("--record", nargs="+", default=[], metavar="NAME=DIR", help="take these from campaigns")
    arguments = parser.parse_args()
    runner, run = common.Runner(arguments.bielle), common.describe_run(arguments.commit)
    if arguments.quick:
        run_quick(runner, run)
        return
    for name in arguments.measure:
        write_data(name, run, *MEASUREMENTS[name](runner))
    for entry in arguments.record:
        name, _, directory = entry.partition("=")
        if name not in CAMPAIGNS or not os.path.isdir(directory):
            parser.error(f"--record {entry}: expected one of {', '.join(CAMPAIGNS)}, and the directory of its campaign")
        write_data(name, run, *CAMPAIGNS[name](directory), *tell_failures(directory))
    make_page().write(False)


if __name__ == "__main__":
    main()
