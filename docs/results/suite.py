#!/usr/bin/env python3
"""Writes docs/results/suite.md, docs/images/suite.svg and suite_parts.svg: the suite of problems, and the protocol of docs/suite.md.

    docs/results/suite.py                                 the page from the tables in docs/results/data
    docs/results/suite.py --record DIR RUNS.jsonl ...     first takes them from the suite's data set and adds runs of the
                                                          protocol, which replace earlier runs of the same guesses
    docs/results/suite.py --record-work RUNS.jsonl ...    what the iterations of runs of the protocol consist of
    docs/results/suite.py --record-ipopt DIR RUNS.jsonl   the same of runs of IPOPT, and of ours beside them, into a table of
                                                          their own; nothing else changes

`--quick` exports a small problem, has it read, and prints the page.
"""
import collections
import csv
import json
import math
import pathlib
import statistics
import subprocess
import sys

import common
from common import show

DATA = common.HERE / "data"
IMAGE = common.SOURCE / "docs/images/suite.svg"
PARTS_IMAGE = common.SOURCE / "docs/images/suite_parts.svg"
PARTS = ["evaluate", "linearize", "sweep", "rollout", "search", "rest"]
READER = common.SOURCE / "suite/problem.py"
SUCCESS = 0.01  # over the least cost
PROBLEMS = ["problem", "bodies", "velocities", "rows", "stages", "duration", "cost", "violation", "iterations", "reader"]
RUNS = ["problem", "variant", "seed", "guess", "converged", "cost", "violation", "iterations", "seconds", "end"]
OTHER, LIMIT, LONG = "IPOPT", 20, 200  # variants that begin so; s of the protocol, and of a few guesses
COLLOCATION = "IPOPT, collocation"  # likewise, of other steps than ours
OTHER_RUNS = ["limit", *RUNS, "optimum"]
COUNTS = ["linearizations", "sweeps", "rollouts", "searches"]
WORK = ["problem", "guess", "iterations", "seconds", *COUNTS, *PARTS[:-1]]


def write_table(name, run, columns, rows, data=DATA):
    with open(data / f"{name}.csv", "w", encoding="utf-8", newline="") as file:
        file.write(f"# {run}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def read_table(name):
    with open(DATA / f"{name}.csv", encoding="utf-8", newline="") as file:
        return file.readline()[1:].strip(), list(csv.DictReader(file))


def record(directory, runs, run):
    sys.path.insert(0, str(READER.parent))
    import problem as reader
    directory, rows = pathlib.Path(directory), []
    for line in (directory / "index.jsonl").read_text(encoding="utf-8").splitlines():
        entry = json.loads(line)
        if not entry["good"]:
            sys.exit(f"{entry['name']} is not good")
        problem = json.loads((directory / entry["files"]["problem"]).read_text(encoding="utf-8"))
        summary = json.loads((directory / "motions" / entry["name"] / "motion/summary.json").read_text(encoding="utf-8"))
        found = reader.check(directory / entry["files"]["problem"])[2]
        if not all(value <= bound for _, value, bound in found):
            sys.exit(f"{entry['name']}: the reader disagrees: {found}")
        mechanism, sizes = problem["mechanism"], {"6d": 6, "5d": 5, "3d": 3, "coupler": 1}
        rows.append([entry["name"], len(mechanism["bodies"]) - 1, mechanism["nv"],
                     sum(sizes[closure["kind"]] for closure in mechanism["closures"]), len(problem["stages"]) - 1,
                     f"{entry['duration_s']:.4g}", f"{summary['cost']:.10g}",
                     f"{summary['constraints']['largest_violation']:.1e}", summary["iterations"],
                     f"{max(value for _, value, bound in found if bound == reader.TOLERANCE):.1e}"])
    write_table("suite_problems", run, PROBLEMS, rows)
    add_runs("suite_runs", run, RUNS, 4, read_lines(runs))


def record_work(runs, run):
    """What converged runs did, without a judgement of them."""
    add_runs("suite_work", run, WORK, 2, [{**line, **line["work"], **line["work"]["seconds"], "seconds": line["seconds"]}
                                          for line in read_lines(runs) if line["converged"]])


def read_lines(runs):
    return [json.loads(line) for path in runs for line in pathlib.Path(path).read_text(encoding="utf-8").splitlines()]


def record_other(directory, runs, run):
    """Runs of IPOPT, and ours beside them, with the costs of our optima of the same problems."""
    optima = {}
    for line in (pathlib.Path(directory) / "index.jsonl").read_text(encoding="utf-8").splitlines():
        summary = pathlib.Path(directory) / "motions" / json.loads(line)["name"] / "motion/summary.json"
        optima[json.loads(line)["name"]] = json.loads(summary.read_text(encoding="utf-8"))["cost"]
    add_runs("suite_ipopt", run, OTHER_RUNS, 5, [{**line, "optimum": optima[line["problem"]]} for line in read_lines(runs)])


def add_runs(name, run, columns, keys, lines):
    """Runs to those of a table; they replace those with the same first entries."""
    if not lines:
        return
    before, known = read_table(name) if (DATA / f"{name}.csv").exists() else (run, [])
    rows = [[row[key] for key in columns] for row in known] + [[show_entry(line[key]) for key in columns] for line in lines]
    rows = {tuple(map(str, row[:keys])): row for row in rows}
    write_table(name, before if run in before else f"{before}; {run}", columns, rows.values())


def show_entry(value):
    return "" if value is None else f"{value:.9g}" if isinstance(value, float) else value


def keep_complete(runs):
    """The guesses from which every variant of ours has tried all problems, and the variants that have tried all of these; variants
    of ours that have done so from none do not count."""
    problems = {run["problem"] for run in runs}
    complete = collections.defaultdict(set)
    for (variant, guess), count in collections.Counter((run["variant"], run["guess"]) for run in runs).items():
        if count == len(problems):
            complete[variant].add(guess)
    shared = set.intersection(*(guesses for variant, guesses in complete.items() if not variant.startswith(OTHER)))
    return [run for run in runs if run["guess"] in shared and complete[run["variant"]] >= shared]


def judge(runs):
    """Adds `success` and numbers to the runs."""
    least = {}
    for run in runs:
        run["converged"] = run["converged"] == "True"
        for key in ("cost", "violation", "seconds"):
            run[key] = float(run[key]) if run[key] else math.inf
        key = run["problem"], run["variant"]
        holds = run["converged"] and run["violation"] <= 1e-8
        least[key] = min(least.get(key, math.inf), run["cost"] if holds else math.inf)
    for run in runs:
        run["success"] = (run["converged"] and run["violation"] <= 1e-8 and
                          run["cost"] <= (1 + SUCCESS) * least[run["problem"], run["variant"]])


def make_profiles(runs):
    """{variant: sorted ratios of successful runs to the fastest variant of the same problem and guess}, and the number of pairs."""
    fastest = {}
    for run in runs:
        if run["success"]:
            key = run["problem"], run["guess"]
            fastest[key] = min(fastest.get(key, math.inf), run["seconds"])
    variants = list(dict.fromkeys(run["variant"] for run in runs))
    return {variant: sorted(run["seconds"] / fastest[run["problem"], run["guess"]] for run in runs
                            if run["variant"] == variant and run["success"])
            for variant in variants}, len({(run["problem"], run["guess"]) for run in runs})


def draw(profiles, count):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "suite", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot, ticker
    figure, axes = pyplot.subplots(figsize=(7.2, 3.6))
    end = 1.1 * max(ratios[-1] for ratios in profiles.values() if ratios)
    for variant, ratios in profiles.items():
        axes.step([1, *ratios, end], [sum(x <= 1 for x in ratios) / count, *((i + 1) / count for i in range(len(ratios))),
                                      len(ratios) / count], where="post", lw=1.3, label=variant)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(ticker.ScalarFormatter())
    axes.xaxis.set_minor_formatter(ticker.ScalarFormatter())
    axes.set_xlim(1, end)
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("time over that of the fastest variant, τ")
    axes.set_ylabel("share of the runs solved within τ")
    axes.grid(True, which="both", lw=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.tight_layout()
    figure.savefig(IMAGE, metadata={"Date": None})
    pyplot.close(figure)


def show_problem(name):
    return "`" + name + "`"


def draw_parts(works, problems):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "suite", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7.2, 3.6))
    names = [row["problem"] for row in problems]
    left = [0] * len(names)
    for part in PARTS:
        widths = [statistics.fmean(work[part] for work in works if work["problem"] == name) for name in names]
        axes.barh(names, widths, 0.7, left, label=part)
        left = [a + b for a, b in zip(left, widths)]
    axes.tick_params(axis="y", labelsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("processor time of a solve [s]")
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(PARTS_IMAGE, metadata={"Date": None})
    pyplot.close(figure)


def add_work(page, problems, figure):
    """What the iterations of converged runs consist of."""
    origin, table = read_table("suite_work")
    works = []
    for row in table:
        work = {key: float(row[key]) for key in WORK[2:]}
        works.append({**work, "problem": row["problem"], "rest": work["seconds"] - sum(work[part] for part in PARTS[:-1])})
    page.heading("What an iteration does")
    page.add(f"""Of the first five guesses by *exact loops*, where these converge ({origin}), per iteration, in the mean:
linearizations of a node, sweeps over all nodes, rollouts of a step in segments, searches of several steps in one piece, and what
these take [ms] by the clock, on a machine with other work. *Rest* is the processor time less these: reading, writing, the guess,
multipliers. Where there is more than one sweep, rows were held, multipliers renewed or a regularization raised
([solver](../solver.md)).""")
    rows = []
    for row in problems:
        ours = [work for work in works if work["problem"] == row["problem"]]

        def find_mean(key, by=1):
            return statistics.fmean(work[key] / work["iterations"] for work in ours) / by

        rows.append([show_problem(row["problem"]), f"{find_mean('linearizations', int(row['stages'])):.2f}",
                     *(f"{find_mean(key):.2f}" for key in COUNTS[1:]), *(f"{1000 * find_mean(part):.1f}" for part in PARTS)])
    page.table(["problem", *COUNTS, *PARTS], rows)
    if figure:
        draw_parts(works, problems)
        page.lines += ["", "![processor time of a solve by its parts](../images/suite_parts.svg)"]


def make_page(figure):
    run, problems = read_table("suite_problems")
    origin, known = read_table("suite_runs")
    others = [run for run in read_table("suite_ipopt")[1] if run["variant"].startswith(OTHER) and run["limit"] == str(LIMIT)]
    runs = keep_complete(known + others)
    judge(runs)
    profiles, count = make_profiles(runs)
    page = common.Page(__file__, "The suite of problems with closed chains", run)
    page.add("""[The suite](../suite.md) has the problems, their files and the protocol. Each optimum is that of one solve on one
thread from the guess of its archive. *Reader*: the largest of all relative differences and residuals that `suite/problem.py` finds
in the files, of costs, constraints, equations of motion, steps, loops and URDF; it shares no code with Bielle.""")
    page.table(["problem", "bodies", "velocities", "closure rows", "stages", "duration [s]", "cost", "largest violation",
                "iterations", "reader"], [[show_problem(row["problem"]), *(row[key] for key in PROBLEMS[1:])] for row in problems])
    guesses = len({run["guess"] for run in runs})
    page.heading("From perturbed guesses")
    page.add(f"""{guesses} guesses of seed 0 for each problem, one thread, ended after 20 s of processor time at the latest
({origin}). Times are processor times of the command, reading and writing included. A run succeeds if it converges, holds its
constraints and costs at most one per cent more than the best one of its variant. *Solved within twice the time*: of the fastest
variant for the same problem and guess, with success. *Failed*: the dynamics cannot be computed; with Euler steps, some guesses
have no first iteration, because a loop does not close. Only *exact loops* are of this program and these problems: for the others,
guesses were not mended, and every linkage had the same margin.""")
    rows = []
    for variant, ratios in profiles.items():
        ours = [run for run in runs if run["variant"] == variant]
        good = [run for run in ours if run["success"]]
        rows.append([variant, f"{len(good)} of {len(ours)}", f"{sum(x <= 2 for x in ratios)} of {len(ours)}",
                     show(statistics.median(int(run["iterations"]) for run in good) if good else None, "{:.0f}"),
                     show(statistics.median(run["seconds"] for run in good) if good else None, "{:.2f}"),
                     ", ".join(f"{sum(run['end'] == end and not run['success'] for run in ours)} {end.replace('_', ' ')}"
                               for end in dict.fromkeys(run["end"] for run in ours if not run["success"])) or "–"])
    page.table(["variant", "success", "solved within twice the time", "median of the iterations", "median of the time [s]",
                "ends of the others"], rows)
    if figure:
        draw(profiles, count)
        page.lines += ["", "![performance profiles](../images/suite.svg)"]
    page.add("""In turn on one machine (commit 1fb9baff, 2026-12-01, AMD EPYC, 2 cores, with other work), the first eight guesses of each
problem with the margins of 3bf0e583: that solves 85 of 96, this program 95. Where both do, the median time is 1.31 and 0.83 s, a
ratio of 0.63; of the pairs, 0.71 in the median, half of them between 0.58 and 0.85. Stairs take 0.62 of the time, the walk at 1 m/s
0.58.""")
    page.add("""All guesses once more, while other programs ran (commit aa5d1b21, 2026-12-01, AMD EPYC, 2 cores): iterations are the same
within one in the median, but 57 instead of 52 on stairs, and take 1.65 times as long, so that 20 s end more runs. With costs at most one
per cent above the best of both commits 1158 succeed, 83 of the stairs, where 1166 and 88 did.""")
    page.heading("By problem")
    page.add("Successes, and the median time of these [s].")
    variants = list(profiles)
    rows = []
    for problem in problems:
        cells = []
        for variant in variants:
            ours = [run for run in runs if (run["problem"], run["variant"]) == (problem["problem"], variant)]
            good = [run["seconds"] for run in ours if run["success"]]
            cells.append(f"{len(good)}" + (f", {statistics.median(good):.2f}" if good else ""))
        rows.append([show_problem(problem["problem"]), *cells])
    page.table(["problem", *variants], rows)
    add_late(page, problems, runs)
    add_work(page, problems, figure)
    add_other(page, problems)
    return page


def add_late(page, problems, runs):
    """What became of the runs that were too late at the older commit."""
    before, now = ({(run["problem"], run["guess"]): run for run in runs if run["variant"] == variant}
                   for variant in ("exact loops, 9b83832c", "exact loops"))
    late = [key for key, run in before.items() if run["end"] == "too late"]
    rows = []
    for row in problems:
        these = [now[key] for key in late if key[0] == row["problem"]]
        good = [run for run in these if run["success"]]
        others = [f"guess {run['guess']}: {run['end'].replace('_', ' ')}"
                  + (f", {float(run['iterations']):.0f} iterations" if run["iterations"] else "")
                  for run in these if not run["success"]]
        if these:
            rows.append([show_problem(row["problem"]), str(len(these)), str(len(good)),
                         show(statistics.median(run["seconds"] for run in good) if good else None, "{:.2f}"), "; ".join(others)])
    page.add(f"What became of the {len(late)} runs of 9b83832c that were too late:")
    page.table(["problem", "too late", "succeed", "median time [s]", "the others"], rows)


STARTS = {"optimum": "our optimum", "unperturbed": "the unperturbed guess"}


def show_end(run):
    """What a run came to, beside the cost of our optimum."""
    if not run["cost"]:
        return run["end"]
    ratio, violation = float(run["cost"]) / float(run["optimum"]) - 1, float(run["violation"])
    cost = "the same" if abs(ratio) <= 1e-6 else f"{100 * ratio:+.2g} %" if ratio < 1 else f"{ratio + 1:.0f} times the cost"
    return (f"{run['end'].replace('_', ' ')}, {run['iterations']} iterations, {float(run['seconds']):.1f} s, {cost}"
            + (f", violation {violation:.0e}" if violation > 1e-8 else ""))


def add_other(page, problems):
    origin, runs = read_table("suite_ipopt")
    page.heading("IPOPT")
    page.add(f"""The same problems by IPOPT, as [the suite](../suite.md#ipopt) describes it, one thread, on a machine with other work
({origin}; collocation is of 9e31f15f, {LONG} s from five guesses of 1fb5ed63). Problems and optima are those of the commit of a run,
and may have changed. Costs are told over our optimum of the same problem; *the same* is within 1e-6. Of iterates that violate a
constraint or leave a gap of more than 1e-8 the violation is told, too: their costs say little.""")
    add_long(page, problems, [run for run in runs if is_long(run)])
    for start, limit in dict.fromkeys((run["guess"], run["limit"]) for run in runs if not is_long(run)):
        these = {(run["problem"], run["variant"]): run for run in runs if (run["guess"], run["limit"]) == (start, limit)}
        variants = list(dict.fromkeys(variant for _, variant in these))
        page.add(f"From {STARTS.get(start, f'guess {start}')}, ended after {limit} s:")
        rows = []
        for row in problems:
            cells = [these.get((row["problem"], variant)) for variant in variants]
            if any(cells):
                rows.append([show_problem(row["problem"]), *(show_end(run) if run else "not measured" for run in cells)])
        page.table(["problem", *variants], rows)
    converged = [run for run in runs if run["variant"].startswith(OTHER) and run["converged"] == "True"]
    shot = [run for run in converged if not run["variant"].startswith(COLLOCATION)]
    ours = [float(run["cost"]) / float(run["optimum"]) - 1 for run in shot]
    better = sorted({run["problem"] for run, ratio in zip(shot, ours) if ratio < -1e-6})
    page.add(f"""Of the {len(shot)} runs of multiple shooting that converged, {sum(abs(ratio) <= 1e-6 for ratio in ours)} ended at our
optimum and {sum(ratio < -1e-6 for ratio in ours)} at a better one{": " + ", ".join(map(show_problem, better)) if better else ""}.
{describe_collocation(runs)} Not measured: collocation of most problems.""")


def is_long(run):
    """Whether it is one of five guesses that have ten times the time of the protocol."""
    return run["guess"] not in STARTS and run["limit"] == str(LONG)


def add_long(page, problems, runs):
    variants = list(dict.fromkeys(run["variant"] for run in runs))
    page.add(f"""From the first five guesses, ended after {LONG} s or 300 iterations: how many converged, holding every constraint to 1e-8, and
where: at our optimum of the problem, or at one that costs more or less; of these, the medians of iterations and of the time [s].""")
    rows = []
    for row in problems:
        cells = []
        for variant in variants:
            these = [run for run in runs if (run["problem"], run["variant"]) == (row["problem"], variant)]
            good = [run for run in these if run["converged"] == "True" and float(run["violation"]) <= 1e-8]
            ratios = [float(run["cost"]) / float(run["optimum"]) - 1 for run in good]
            places = [("at it", sum(abs(ratio) <= 1e-6 for ratio in ratios)), ("costs less", sum(ratio < -1e-6 for ratio in ratios)),
                      ("costs more", sum(ratio > 1e-6 for ratio in ratios))]
            cells += [f"{len(good)} of {len(these)}", ", ".join(f"{count} {place}" for place, count in places if count) or "–",
                      show(statistics.median(int(run["iterations"]) for run in good) if good else None, "{:.0f}"),
                      show(statistics.median(float(run["seconds"]) for run in good) if good else None, "{:.1f}")]
        rows.append([show_problem(row["problem"]), *cells])
    page.table(["problem", *(head for variant in variants for head in (variant, "where", "iterations", "time [s]"))], rows)
    counts = {variant: sum(run["converged"] == "True" and float(run["violation"]) <= 1e-8 for run in runs if run["variant"] == variant)
              for variant in variants}
    page.add("In all, of " + str(len(runs) // len(variants)) + " runs of each: "
             + ", ".join(f"{count} by *{variant}*" for variant, count in counts.items()) + ".")


def describe_collocation(runs):
    """Collocation has other steps, so that its optima cost something else; only those that differ by more are other motions."""
    collocated = [run for run in runs if run["variant"].startswith(COLLOCATION)]
    ratios = [float(run["cost"]) / float(run["optimum"]) - 1 for run in collocated if run["converged"] == "True"]
    return (f"""Collocation has steps of its own, whose optima cost more or less by the square of the step: of its {len(collocated)} runs
{len(ratios)} converged""" + (f", to costs that differ from ours by {100 * min(ratios):+.2g} to {100 * max(ratios):+.2g} %" if ratios else "")
            + ".")


def run_quick(runner):
    result = runner.solve("squat", "bipetto", ["--depth", 0.9, "--duration", 0.6, "--set", "settle=0", "--set", "time_step=0.02"])
    runner.run("export", result.directory, "--format", "problem", allowed=(0,))
    read = subprocess.run([sys.executable, str(READER), str(result.directory / "problem.json")], capture_output=True, text=True)
    print(read.stdout)
    if read.returncode:
        sys.exit(read.stderr or 1)
    make_page(figure=False).write(True)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--record", nargs="+", metavar="PATH", help="take the tables from a data set and files of runs")
    parser.add_argument("--record-work", nargs="+", metavar="PATH", help="take what iterations consist of from files of runs")
    parser.add_argument("--record-ipopt", nargs="+", metavar="PATH", help="take the runs of IPOPT from a data set and files of runs")
    arguments = parser.parse_args()
    if arguments.quick:
        run_quick(common.Runner(arguments.bielle))
        return
    if arguments.record:
        record(arguments.record[0], arguments.record[1:], common.describe_run(arguments.commit))
    if arguments.record_work:
        record_work(arguments.record_work, common.describe_run(arguments.commit))
    if arguments.record_ipopt:
        record_other(arguments.record_ipopt[0], arguments.record_ipopt[1:], common.describe_run(arguments.commit))
    make_page(figure=True).write(False)


if __name__ == "__main__":
    main()
