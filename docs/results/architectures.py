#!/usr/bin/env python3
"""Writes docs/results/architectures.md and docs/images/architectures.svg: 24 legs, each optimized for the same four motions with
either of two motors, and the fastest walk of each.

    docs/results/architectures.py                        the page from docs/results/data/architectures.json
    docs/results/architectures.py --run DIR [--bielle build/bin/bielle] [--jobs 2]
                                                         makes these first, two hours of one core; goes on where it was cut off

`--quick` evaluates two of them as they come and prints the page.
"""
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import common
from common import show

DATA = common.HERE / "data/architectures.json"
IMAGE = common.SOURCE / "docs/images/architectures.svg"
SPECIFICATION = common.SOURCE / "examples/architectures/legs.yaml"
PARTS = {"hip": ["serial", "three_rrs"], "knee": ["serial", "belt", "four_bar", "watt", "pantograph", "parallel_spring_knee"],
         "ankle": ["rsu", "differential"]}
MOTIONS = [("walk", {"speed": 0.5}), ("walk", {"speed": 1.0}), ("stairs", {"height": 0.08, "stairs": 2}), ("jump", {"flight": 0.25})]
TITLES = ["walk, 0.5 m/s", "walk, 1.0 m/s", "stairs", "jump"]
SPEEDS, FASTER = [1.2, 1.4, 1.6], {}  # and further settings of these walks
SEARCHED = ["walk", "walk_2", "stairs", "jump"]  # their directories


def name_case(motion, settings):
    return motion + "".join(f"-{name}-{value:g}" for name, value in settings.items())


def read_search(directory):
    """The best feasible design of every search, best first, with the file of its robot; designs evaluated and feasible."""
    bests, counts = [], [0, 0]
    for path in sorted(directory.glob("search*.jsonl"), key=lambda path: int(re.search(r"\d+", path.name)[0])):
        entries = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()[1:]]
        feasible = [entry for entry in entries if entry["status"] == "feasible"]
        counts[0] += len(entries)
        counts[1] += len(feasible)
        if feasible:
            bests.append(min(feasible, key=lambda entry: entry["value"]))
    bests.sort(key=lambda entry: entry["value"])
    return bests, counts


def list_choices(specification, kinds):
    """Choices in the order of the specification, which numbers them, by part."""
    named = re.search(r"architecture:\s*\[([^]]*)\]", specification)[1].replace("\n", " ")
    names = [name.strip() for name in named.split(",")]
    return {kind: [name for name in names if name in choices or name in [f"{choice}_{kind}" for choice in choices]] or choices
            for kind, choices in kinds.items()}


def read_motion(directory):
    summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
    return {"J": summary["electrical_energy"]["total_J"], "peak_torque": max(summary["peak_torques"].values())}


def compare(bielle, directory, name, robots, motions, jobs):
    """{(robot, motion): row} of `bielle compare`; what it has solved before stays."""
    lines = ["robots:"] + [f"  {robot}: {{robot: {place}}}" for robot, place in robots.items()] + ["motions:"]
    lines += [f"  - {{motion: {motion}, set: {json.dumps(settings)}}}" for motion, settings in motions]
    (directory / f"{name}.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    subprocess.run([bielle, "compare", f"{name}.yaml", "-o", name, "--jobs", str(jobs)], cwd=directory)  # cases may fail
    with open(directory / name / "compare.csv", encoding="utf-8", newline="") as file:
        return {(row["robot"], row["motion"]): row for row in csv.DictReader(file)}


def run(arguments, directory, specification):
    """Searches, then makes motions of the best designs by the usual steps: the content of DATA."""
    bielle = str(pathlib.Path(arguments.bielle).resolve()) if "/" in arguments.bielle else arguments.bielle
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "legs.yaml").write_text(specification, encoding="utf-8")
    subprocess.run([bielle, "design", "legs.yaml", "-o", "search", "--jobs", str(arguments.jobs)], cwd=directory, check=True)
    bests, counts = read_search(directory / "search")
    choices = list_choices(specification, PARTS)
    motors = re.search(r'motor: "\*", choices: \[([^]]*)\]', specification)[1].split(", ")
    open_kinds = [kind for kind in PARTS if len(choices[kind]) > 1]  # variables, before all others
    robots = {}
    for number, best in enumerate(bests, 1):
        parts = [choices[kind][round(best["x"][open_kinds.index(kind)])] if kind in open_kinds else choices[kind][0] for kind in PARTS]
        place = directory / f"search/ranked/{number:02d}"
        if "-".join(parts) not in robots:  # with the better motor
            robots["-".join(parts)] = {"parts": parts, "robot": f"search/ranked/{number:02d}", "solved": [],
                                       "motor": motors[round(best["x"][len(open_kinds)])],
                                       "motions": [read_motion(place / motion) for motion in SEARCHED]}
    subprocess.run([sys.executable, str(common.SOURCE / "examples/better_leg/drive.py"), "ak10-9", "18", "18", "9", "bipetto"],
                   cwd=directory, check=True)
    robots["bipetto"] = {"parts": ["serial", "four-bar", "rods"], "robot": "./bipetto", "motor": "ak10-9", "motions": [],
                         "solved": []}
    solved = [*list(robots)[:-1][:arguments.solve], "bipetto"]
    rows = compare(bielle, directory, "compare", {name: robots[name]["robot"] for name in solved}, MOTIONS, arguments.jobs)
    for name in solved:
        for motion, settings in MOTIONS:
            row = rows[name, name_case(motion, settings)]
            robots[name]["solved"].append({"passed": row["outcome"] == "passed", "J": float(row["electrical_energy_J"] or "nan")})
    walking = list(robots)
    for speed in SPEEDS:  # whoever fails does not try a higher one
        settings = {"speed": speed, **FASTER}
        rows = compare(bielle, directory, f"walks-{speed:g}", {name: robots[name]["robot"] for name in walking},
                       [("walk", settings)], arguments.jobs) if walking else {}
        walking = [name for name in walking if rows[name, name_case("walk", settings)]["outcome"] == "passed"]
        for name in walking:
            robots[name]["speed"] = speed
    for name, robot in robots.items():
        info = subprocess.run([bielle, "info", robot["robot"], "--json"], cwd=directory, check=True, capture_output=True, text=True)
        robot["mass"] = json.loads(info.stdout)["mass"]
    return {"run": common.describe_run(arguments.commit), "designs": counts[0], "feasible": counts[1], "robots": robots}


def shorten(part):
    return re.sub("_(hip|knee|ankle)$", "", part).replace("_", " ")


def calc_total(motions):
    return sum(motion["J"] for motion in motions) if motions else None


def draw(robots, path):
    """Energies of the motions, one bar a robot."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "architectures", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(9.6, 0.24 * len(robots) + 0.8))
    searched = [robot for robot in reversed(robots) if robot["motions"]]
    for place, robot in enumerate(searched):
        left = 0
        for i, motion in enumerate(robot["motions"]):
            axes.barh(place, motion["J"], left=left, color=f"C{i}", label=TITLES[i] if place == 0 else None)
            left += motion["J"]
    axes.set_yticks(range(len(searched)), [", ".join(map(shorten, robot["parts"])) for robot in searched])
    axes.set_xlabel("electrical energy [J]")
    axes.legend(fontsize=8, loc="upper right")
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def make_page(data):
    page = common.Page(__file__, "Twenty-four legs", data["run"])
    page.add(f"""Two hips, six knees and two ankles of [`leg_biped`](../../robots/leg_biped/README.md), in every combination, with the
same trunk and links and one kind of motor, AK80-9 or AK10-9, at every joint: gears of 9 to 18, which weigh and lose what they add,
and lengths are searched by gradients for the least electrical energy of two walks, stairs of 8 cm and a jump of 0.25 s. Torque,
speed and voltage of every motor, its heat, a margin of 0.2 to dead points, 30 kg and 2 mm between bodies are constraints of all
motions. {data['designs']} designs were evaluated, {data['feasible']} are feasible; each of the 48 searches had at most five, so that
more would find better ones. Braking energy is not recovered.""")
    page.lines += ["", "```console", "bielle design examples/architectures/legs.yaml -o legs --jobs 2", "```"]
    page.lines += ["", "![energies of the four motions by robot](../images/architectures.svg)"]
    robots = sorted(data["robots"].values(), key=lambda robot: calc_total(robot["motions"]) or 1e9)
    rows = []
    for robot in robots:
        cells = [shorten(part) for part in robot["parts"]]
        if not robot["motions"]:
            cells = [f"*{cell}*" for cell in cells]
        energies = [show(motion["J"], "{:.0f}") for motion in robot["motions"]] or ["–"] * len(TITLES)
        failed = "" if all(motion["passed"] for motion in robot["solved"]) else "\\*"
        rows.append(cells + [robot["motor"].upper(), f"{robot['mass']:.2f}", show(calc_total(robot["motions"]), "{:.0f}"), *energies,
                             show(max((motion["peak_torque"] for motion in robot["motions"]), default=None), "{:.1f}"),
                             show(calc_total(robot["solved"]), "{:.0f}") + failed, show(robot.get("speed"), "{:.1f}")])
    page.add(f"""Energies are in J, by the Euler steps of the search (20 ms, 10 ms in the jump); *solved* is their sum as `bielle solve`
makes the motions, for the best ones, with an asterisk where one misses a goal or a row of the check. Torques are the largest of any
motor in the four motions, in N m. The *fastest walk* of {", ".join(f"{speed:g}" for speed in SPEEDS)} m/s is the one before the first that fails the check, motors'
limits among its rows, by the usual steps. *Bipetto* has the motors and ratios of [a leg better than it](../../examples/better_leg/README.md),
its masses as published, and was not searched.""")
    page.table(["hip", "knee", "ankle", "motor", "mass [kg]", "sum", *TITLES, "peak torque", "solved", "fastest walk [m/s]"], rows)
    page.heading("By part")
    page.add("Mean energy over all legs that have it, in J.")
    rows = []
    for i, kind in enumerate(PARTS):
        for part in dict.fromkeys(robot["parts"][i] for robot in robots if robot["motions"]):
            having = [robot["motions"] for robot in robots if robot["parts"][i] == part and robot["motions"]]
            means = [sum(motions[m]["J"] for motions in having) / len(having) for m in range(len(TITLES))]
            rows.append([kind, shorten(part), f"{sum(means):.0f}", *(f"{mean:.0f}" for mean in means)])
    page.table(["", "part", "sum", *TITLES], rows)
    return page, robots


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--run", metavar="DIR", type=pathlib.Path, help="search and solve there first")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--solve", type=int, default=6, metavar="COUNT", help="so many of the best by the usual steps, too")
    arguments = parser.parse_args()
    specification = SPECIFICATION.read_text(encoding="utf-8")
    if arguments.quick:
        small = re.sub(r"architecture:\s*\[[^]]*\]", "architecture: [belt, parallel_spring_knee]", specification)
        small = small.replace("slsqp, evaluations: 5", "sbplx, evaluations: 1").replace("knee: four_bar", "knee: belt")
        small = re.sub(r"  - \{name: (hip_middle|knee_crank|knee_arm|knee_middle|ankle_ratio),.*\n", "", small)  # of other parts
        small = re.sub(r"  - \{motion: (walk, set: \{speed: 1|stairs|jump).*\n", "", small)
        small = small.replace("speed: 0.5", "speed: 0.5, steps: 2")
        PARTS.update(hip=["serial"], ankle=["rsu"])
        MOTIONS[:] = [("walk", {"speed": 0.5, "steps": 2})]
        TITLES[1:], SEARCHED[1:], SPEEDS[1:], arguments.solve = [], [], [], 1
        FASTER.update(steps=2, time_step=0.02)
        with tempfile.TemporaryDirectory() as directory:
            page, _ = make_page(run(arguments, pathlib.Path(directory), small))
        page.write(True)
        return
    if arguments.run:
        data = run(arguments, arguments.run.resolve(), specification)
        DATA.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    page, robots = make_page(json.loads(DATA.read_text(encoding="utf-8")))
    draw(robots, IMAGE)
    page.write(False)


if __name__ == "__main__":
    main()
