#!/usr/bin/env python3
"""Writes docs/results/batch_ends.md and docs/images/batch_ends.svg: where 1,000 pushed walks end in Bielle's world, many at once,
and in MuJoCo's, as distributions.

    docs/results/batch_ends.py [--bielle build/bin/bielle] [--campaign DIRECTORY]... [--finer DIRECTORY] [--quick]

Runs the campaign in a directory of its own, or reads those that are given, in which `bielle campaign` has carried out all of the
pushes below or some of them. --finer: a campaign of some of them in MuJoCo's world at 0.25 ms, best of those whose ends differ and
as many others, by which it is told what the differences are due to.
"""
import json
import math
import os
import pathlib
import sys
import tempfile

import common

IMAGE = common.SOURCE / "docs/images/batch_ends.svg"
WORLDS = ("bielle", "mujoco")
TITLES = {"bielle": "Bielle's", "mujoco": "MuJoCo's"}
SPEC = """motions:
  - {name: walk, solve: walk, robot: bipetto, set: {speed: 0.4, steps: 4}}
options:
  world: [bielle, mujoco]
  control: gains
  time-step: 0.001
push:
  time: [%s]
  direction: [%s]
  duration: 0.1
  impulse: [0.5, 1, 1.5, 2, 3]
"""
FULL = SPEC % (", ".join(f"{0.6 + 0.15 * k:g}" for k in range(10)), ", ".join(str(18 * k) for k in range(20)))
QUICK = SPEC % ("0.9", "0, 180")
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def run_campaign(runner, quick):
    directory = runner.place("campaign")
    spec = pathlib.Path(runner.directory.name) / "spec.yaml"
    spec.write_text(QUICK if quick else FULL, encoding="utf-8")
    runner.run("campaign", spec, "-o", directory, "--jobs", os.cpu_count())
    return directory


def read_runs(directories):
    """{push: {world: result}} of those that were carried out."""
    runs = {}
    for directory in directories:
        for line in pathlib.Path(directory, "runs.jsonl").read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            if "result" not in row:
                continue
            words = row["run"].split()
            option = {words[k]: words[k + 1] for k in range(1, len(words) - 1, 2)}
            runs.setdefault(option["--push"], {})[option["--world"]] = row["result"]
    return runs


def compare(a, b):
    """Kolmogorov and Smirnov's distance of two samples, and the probability of one that is larger where both are drawn from the same
    distribution, by the asymptotic series."""
    values, a, b = sorted({*a, *b}), sorted(a), sorted(b)
    i = j = 0
    distance = 0.0
    for value in values:
        while i < len(a) and a[i] <= value:
            i += 1
        while j < len(b) and b[j] <= value:
            j += 1
        distance = max(distance, abs(i / len(a) - j / len(b)))
    size = math.sqrt(len(a) * len(b) / (len(a) + len(b)))
    x = (size + 0.12 + 0.11 / size) * distance
    if x < 0.3:
        return distance, 1.0
    return distance, min(1.0, max(0.0, 2 * sum((-1) ** (k - 1) * math.exp(-2 * (k * x) ** 2) for k in range(1, 101))))


def find_chance(first, second):
    """Of a split of pairs that differ at least as uneven, where either way is as probable (McNemar's exact test)."""
    n = first + second
    return min(1.0, 2 * sum(math.comb(n, k) for k in range(min(first, second) + 1)) / 2**n)


def describe_finer(runs, finer):
    """Whether MuJoCo's world comes to Bielle's ends by shorter steps, where theirs differ and where they do not."""
    falls = lambda run, world: run[world]["outcome"] != "stood"
    count = {True: [0, 0], False: [0, 0]}  # by whether they differ: as in Bielle's world, all
    for push, run in finer.items():
        differ = falls(runs[push], "bielle") != falls(runs[push], "mujoco")
        count[differ][0] += falls(run, "mujoco") == falls(runs[push], "bielle")
        count[differ][1] += 1
    return f"""At 0.25 ms instead, MuJoCo's world ends as Bielle's at 1 ms in {count[True][0]} of {count[True][1]} pushes whose ends
differ at 1 ms, and in {count[False][0]} of {count[False][1]} drawn among the others: where most of these agree, it is MuJoCo's steps
of 1 ms, and closures and contacts that are as soft as these ask for, and not the contact law, that make the difference."""


def get_quantile(values, share):
    values = sorted(values)
    at = share * (len(values) - 1)
    low = int(at)
    return values[low] + (at - low) * (values[min(low + 1, len(values) - 1)] - values[low])


def draw(samples):
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "batch_ends", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(samples), figsize=(3.6 * len(samples), 3), sharey=True)
    for ax, (label, worlds) in zip(axes, samples.items()):
        for world, values in worlds.items():
            values = sorted(values)
            ax.step(values, [(k + 1) / len(values) for k in range(len(values))], where="post", lw=1.2, label=TITLES[world] + " world")
        ax.set_xlabel(label)
        ax.grid(True, lw=0.3)
    axes[0].set_ylabel("share of the walks")
    axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(IMAGE, metadata={"Date": None})
    pyplot.close(figure)


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--campaign", action="append", help="directory of a campaign, whole or in part; several are put together")
    parser.add_argument("--finer", help="directory of a campaign in MuJoCo's world at 0.25 ms")
    arguments = parser.parse_args()
    runner = common.Runner(arguments.bielle)
    runs = read_runs(arguments.campaign or [run_campaign(runner, arguments.quick)])
    common_pushes = [push for push, run in runs.items() if all(world in run for world in WORLDS)]
    pairs = [runs[push] for push in common_pushes]
    alone = [run["bielle"] for run in runs.values() if "bielle" in run]
    if not pairs:
        sys.exit("no push was carried out in both worlds")
    count = lambda name: len({word for push in common_pushes for word in push.split(",") if word.startswith(name + "=")})
    falls = [[run[world]["outcome"] != "stood" for world in WORLDS] for run in pairs]
    only = [falls.count([True, False]), falls.count([False, True])]
    page = common.Page(__file__, "Where pushed walks end", common.describe_run(arguments.commit))
    page.add(f"""Bipetto walks four steps at 0.4 m/s under the gains of its plan at 1 ms, and its trunk is pushed for 0.1 s: at 10
instants, from 20 directions, by 0.5 to 3 N s, 1,000 pushes. Bielle's worlds stand in the lanes of [one batch](batch.md), where
{len(alone)} were carried out: {sum(run['outcome'] != 'stood' for run in alone)} fell. MuJoCo's world on the file that we export
carried out {len(pairs)} of them, at {count("t")} of the instants and from {count("direction")} of the directions; what follows is of
these in both worlds. Contacts and closures differ, and falls are chaotic: what can agree is how the ends are distributed. Both worlds
get the same pushes, so that the samples are no independent ones, and probabilities are too large rather than too small.""")
    page.heading("Falls")
    page.add(f"""{sum(f[0] for f in falls)} walks of {len(pairs)} fall in Bielle's world and {sum(f[1] for f in falls)} in MuJoCo's:
{falls.count([True, True])} in both, {only[0]} in Bielle's alone and {only[1]} in MuJoCo's alone. Were either way as probable, a split
at least as uneven would have the probability {find_chance(*only):.2g} (McNemar's exact test).""")
    groups = {}
    for push, run in zip(common_pushes, pairs):
        groups.setdefault(float(push.rpartition("=")[2]), []).append(run)
    page.table(["impulse [N s]", "pushes", *(f"fall in {TITLES[world]} world" for world in WORLDS)],
               [[f"{impulse:g}", str(len(group)), *(str(sum(run[world]["outcome"] != "stood" for run in group)) for world in WORLDS)]
                for impulse, group in sorted(groups.items())])
    if arguments.finer:
        page.add(describe_finer(runs, read_runs([arguments.finer])))
    page.heading("Those that stand in both")
    standing = [run for run in pairs if all(run[world]["outcome"] == "stood" for world in WORLDS)]
    measures = {"distance walked [m]": "distance", "largest deviation of the trunk [m]": "largest_deviation"}
    samples = {label: {world: [run[world][key] for run in standing] for world in WORLDS} for label, key in measures.items()}
    page.add(f"""{len(standing)} walks: quantiles, and Kolmogorov and Smirnov's distance of the two distributions with the
probability of a larger one where both are the same. The distance is that of the centre of mass over the ground, from the start to the
end.""")
    rows = []
    for label, worlds in samples.items():
        distance, chance = compare(*worlds.values())
        for world, values in worlds.items():
            rows.append([label, TITLES[world], *(f"{get_quantile(values, share):.4f}" for share in QUANTILES),
                         f"{distance:.3f}", f"{chance:.2g}"])
    page.table(["measure", "world", *(f"{share:.0%}" for share in QUANTILES), "K–S distance", "probability"], rows)
    apart = sorted(abs(run["bielle"]["distance"] - run["mujoco"]["distance"]) for run in standing)
    page.add(f"""Push by push, the distances of the two worlds differ by {1e3 * get_quantile(apart, 0.5):.2f} mm in the median and by
{1e3 * apart[-1]:.1f} mm at most.""")
    if not arguments.quick:
        draw(samples)
        page.lines += ["", "![shares of the walks that end within a distance, or deviate by less](../images/batch_ends.svg)"]
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
