#!/usr/bin/env python3
"""Writes docs/results/dataset.md and docs/images/dataset.svg: the motions of examples/dataset/thousand_motions.yaml.

    docs/results/dataset.py                                        the page from the tables in docs/results/data
    docs/results/dataset.py --record DIR --cpu-seconds 9000        takes them from a directory of `bielle dataset` first

`--cpu-seconds` is the processor time of the command and its children. A run that was cut off may be recorded. `--quick`
makes a data set of two motions and prints the page.
"""
import collections
import json
import pathlib
import re
import statistics
import tempfile

import common
from common import show

DATA = common.HERE / "data"
IMAGE = common.SOURCE / "docs/images/dataset.svg"
SPEC = common.SOURCE / "examples/dataset/thousand_motions.yaml"
ASKED = 1000  # motions of it
REASONS = {"rejected": "the request was refused", "no end": "the solver did not converge", "check": "the check did not pass",
           "goal": "a goal was missed", "fell": "it fell when carried out"}
SMALL = """licence: CC-BY-4.0
motions:
  - {solve: squat, robot: bipetto, set: {depth: 0.9, com_weight: [1, 1e5], duration: 0.6, settle: 0, time_step: 0.02}}
"""


def judge(case, outcome):
    """(summary, first thing that is not good, of REASONS, and its details); of a good motion (summary, None, "")."""
    result, execution = case / "motion", case / "carried_out/summary.json"
    if outcome["status"] > 1 or not (result / "summary.json").exists():
        return None, "rejected", outcome["error"]
    summary = json.loads((result / "summary.json").read_text(encoding="utf-8"))
    if not summary["converged"]:
        return summary, "no end", summary["message"]
    check = json.loads((result / "check.json").read_text(encoding="utf-8"))
    if not check["pass"]:
        return summary, "check", ", ".join(row["name"] for row in check["rows"] if not row["pass"])
    missed = [f"{goal['name']} {goal['requested']:.4g} → {goal['achieved']:.4g}" for goal in summary["goals"] if not goal["met"]]
    if missed:
        return summary, "goal", ", ".join(missed)
    if execution.exists():
        carried = json.loads(execution.read_text(encoding="utf-8"))
        summary["duration_s"] = carried["duration"]
        if carried["outcome"] != "stood":
            return summary, "fell", carried["outcome_message"]
    return summary, None, ""


def round_off(value):
    return None if value is None else float(f"{value:.5g}")


def parse(text):
    try:
        return json.loads(text)
    except ValueError:
        return text


def collect(directory):
    """A compact line per finished motion, from its own files: a run that was cut off has no index yet."""
    lines = []
    for case in sorted((pathlib.Path(directory) / "motions").glob("*/case.json")):
        data = json.loads(case.read_text(encoding="utf-8"))
        steps, outcome = data["request"]["steps"], data["outcome"][0]
        step = steps[0]
        robot, _, payload = pathlib.Path(step[step.index("--robot") + 1]).name.partition("_payload_")
        values = dict(step[i + 1].split("=", 1) for i, word in enumerate(step) if word == "--set")
        summary, reason, why = judge(case.parent, outcome)
        line = {"motion": step[1], "robot": robot, "payload_kg": float(payload or 0),
                "set": {name: parse(value) for name, value in values.items()}}
        if len(steps) > 1:
            line["push"] = steps[1][steps[1].index("--push") + 1]
        if summary:
            line.update(goals={goal["name"]: round_off(goal["achieved"]) for goal in summary["goals"]},
                        duration_s=round_off(summary["duration_s"]), iterations=summary["iterations"])
        if reason:
            line.update(failed=reason, why=why)
        lines.append(line)
    return lines


def record(directory, run, cpu, data=DATA):
    head = {"run": run, "cpu_seconds": cpu}
    (data / "dataset_index.jsonl").write_text(
        "".join(json.dumps(line, ensure_ascii=False) + "\n" for line in [head, *collect(directory)]), encoding="utf-8")
    card = pathlib.Path(directory) / "README.md"
    if card.exists():
        (data / "dataset_card.md").write_text(card.read_text(encoding="utf-8"), encoding="utf-8")


def read(data=DATA):
    head, *lines = (json.loads(line) for line in (data / "dataset_index.jsonl").read_text(encoding="utf-8").splitlines())
    return head, lines


def name_motion(line):
    return line["motion"] + (", pushed" if "push" in line else "")


def draw(lines, path):
    """Good motions by robot and motion, and the iterations of each."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "dataset", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    motions = list(dict.fromkeys(name_motion(line) for line in lines))
    robots = list(dict.fromkeys(line["robot"] for line in lines))
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.6, 3.6))
    width = 0.8 / len(robots)
    for i, robot in enumerate(robots):
        places = [k + (i - (len(robots) - 1) / 2) * width for k in range(len(motions))]
        good, asked = ([sum(name_motion(line) == motion and line["robot"] == robot and ("failed" not in line or every)
                            for line in lines) for motion in motions] for every in (False, True))
        left.bar(places, asked, width, color="none", edgecolor="#888888", lw=0.6)
        left.bar(places, good, width, color=f"C{i}", label=robot)
    left.set_xticks(range(len(motions)), motions, rotation=35, ha="right")
    left.set_ylabel("motions: asked for (outlined), good")
    left.legend(fontsize=8)
    for i, robot in enumerate(robots):
        chosen = [line for line in lines if line["robot"] == robot and "failed" not in line]
        right.plot([motions.index(name_motion(line)) + (i - (len(robots) - 1) / 2) * width for line in chosen],
                   [line["iterations"] for line in chosen], ".", ms=4, color=f"C{i}", alpha=0.5)
    right.set_xticks(range(len(motions)), motions, rotation=35, ha="right")
    right.set_ylabel("iterations of the solver")
    right.set_ylim(bottom=0)
    right.grid(True, axis="y", lw=0.3)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def describe_values(line):
    text = ", ".join(f"{name} {value}" for name, value in line["set"].items())
    return text + (f", {line['payload_kg']:g} kg" if line["payload_kg"] else "") + (f", {line['push']}" if "push" in line else "")


def make_page(head, lines, figure):
    page = common.Page(__file__, "A data set of motions", head["run"])
    good = [line for line in lines if "failed" not in line]
    hours = head["cpu_seconds"] / 3600
    made = "" if len(lines) == ASKED else f" {len(lines)} of its {ASKED} motions were made; the run was cut off, before it exported any."
    page.add(f"""`bielle dataset` of `examples/dataset/{SPEC.name}`.{made} Of {len(lines)} motions {len(good)} are
good, {sum(line['duration_s'] for line in good) / 60:.1f} minutes together. They took {hours:.2f} hours of one core, solves,
checks and simulations: {len(lines) / hours:.0f} motions per core-hour. A motion is good if the solver converged, `bielle check`
passes and all goals are met; a pushed one, carried out under predictive control with real sensors, must also stand ([data sets](../datasets.md)). The index is `docs/results/data/dataset_index.jsonl`, one line per motion behind a line
about the run; the motions follow from the specification.""")
    page.lines += ["", "```console", f"bielle dataset examples/dataset/{SPEC.name} -o thousand", "```"]
    if figure:
        page.lines += ["", "![motions and iterations by robot](../images/dataset.svg)"]
    robots = list(dict.fromkeys(line["robot"] for line in lines))
    rows = []
    for motion in dict.fromkeys(map(name_motion, lines)):
        ours = [line for line in lines if name_motion(line) == motion]
        cells = []
        for robot in robots:
            asked = [line for line in ours if line["robot"] == robot]
            cells.append(f"{sum('failed' not in line for line in asked)} of {len(asked)}" if asked else "–")
        iterations = [line["iterations"] for line in ours if "failed" not in line]
        rows.append([motion, *cells, show(statistics.median(iterations) if iterations else None, "{:.0f}")])
    page.heading("Good motions")
    page.table(["", *robots, "median of the iterations"], rows)
    page.heading("What failed, and why")
    failed = [line for line in lines if "failed" in line]
    if not failed:
        page.add("Nothing.")
        return page
    counts = collections.Counter(line["failed"] for line in failed)
    page.add("; ".join(f"{REASONS[reason]}: {count}" for reason, count in counts.most_common()) + ".")
    page.lines += ["", f"<details><summary>All {len(failed)}</summary>"]
    page.table(["robot", "motion", "values", "", "details"],
               [[line["robot"], name_motion(line), describe_values(line), REASONS[line["failed"]],
                 re.sub(r"\s+", " ", line["why"]).replace("|", "/")[:200]] for line in failed])
    page.lines += ["", "</details>"]
    return page


def run_quick(runner, run):
    spec, directory = pathlib.Path(runner.place("small.yaml")), runner.place()
    spec.write_text(SMALL, encoding="utf-8")
    runner.run("dataset", spec, "-o", directory, allowed=(0,))
    with tempfile.TemporaryDirectory() as data:
        record(directory, run, 10.0, pathlib.Path(data))
        head, lines = read(pathlib.Path(data))
    assert {line.get("failed") for line in lines} == {"goal", None}, lines
    make_page(head, lines, figure=False).write(True)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--record", metavar="DIR", help="take the tables from here")
    parser.add_argument("--cpu-seconds", type=float, help="processor time that the data set took")
    arguments = parser.parse_args()
    run = common.describe_run(arguments.commit)
    if arguments.quick:
        run_quick(common.Runner(arguments.bielle), run)
        return
    if arguments.record:
        if arguments.cpu_seconds is None:
            parser.error("--record needs --cpu-seconds")
        record(arguments.record, run, arguments.cpu_seconds)
    head, lines = read()
    draw(lines, IMAGE)
    make_page(head, lines, figure=True).write(False)


if __name__ == "__main__":
    main()
