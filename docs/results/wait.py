"""What a newcomer and a developer wait for: processor time, without a compiler cache, of this commit and of another one.

    docs/results/wait.py --against REVISION [--steps demo edit ...] [--measure REVISION ...] [--build DIRECTORY]

Each step runs in fresh clones, first of this commit, then of the other. Every part that ends adds a line to
docs/results/data/wait.csv; what is there for the same commit is not measured again. All steps of both take four hours of two cores;
the page has the last rows of each step, and the tests of a build of this commit by tier.
"""
import argparse
import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import common

sys.path.append(str(common.SOURCE / "tests"))
from list_tiers import list_tests, list_tiers  # noqa: E402

DATA = common.HERE / "data/wait.csv"
COLUMNS = ("commit", "step", "title", "processor", "clock", "run", "memory")
RELEASE = "cmake --preset release -G Ninja >/dev/null && "
# Some commits also check that sources compile without precompiled headers.
CHECK = "if [ -f scripts/check_includes.sh ]; then scripts/check_includes.sh; fi && "
SANITIZED = "source scripts/setup.sh && eval \"$(sed -n '{}' .ci/run)\""
# Commits before them have one tier of tests.
TIERS = "if [ -f tests/tiers.cmake ]; then source scripts/setup.sh && {}; fi"
# What runs once before and is not counted; what is counted, by its title.
STEPS = {
    # Commits before 94c97371 build the check before they show the squat.
    "demo": ("", {"`scripts/demo.sh` until the squat and its report are there":
                  "sed '/^echo \"Now/,$d' scripts/demo.sh >scripts/squat.sh && bash scripts/squat.sh",
                  "`scripts/demo.sh` after it": "sed -n '/^set/,/^bielle=/p;/^\"$bielle\" [cr]/p' scripts/demo.sh >scripts/rest.sh && "
                  "bash scripts/rest.sh"}),
    "test": ("", {"`scripts/test.sh`, building": "sed '/^run_tests/d' scripts/test.sh >scripts/build.sh && bash scripts/build.sh",
                  "`scripts/test.sh`, testing":
                  "source scripts/setup.sh && eval \"$(sed -n '/^tier=/p;/^run_tests/p' scripts/test.sh)\"",
                  "`scripts/test.sh --all` after it, building": TIERS.format("build build/test --preset release"),
                  "`scripts/test.sh --all` after it, testing": TIERS.format("run_tests build/test --label-regex '^long$'")}),
    "ci": ("", {"`.ci/run` after it: building with sanitizers": CHECK + SANITIZED.format("/^bielle_targets=/,/^build/p"),
                "`.ci/run` after it: testing with sanitizers": SANITIZED.format("/^run_tests build.sanitize/p")}),
    "edit": (RELEASE + "ninja -C build {target}",
             {"one source of `motion` edited, its test built and run":
              "echo '// edited' >> src/motion/walk.cpp && ninja -C build {target} && ctest --test-dir build -R '^walk$'"}),
    "model": (RELEASE + "ninja -C build bielle_command test_files",
              {"`model.h` edited, then `bielle` and the tests of `model` built":
               "echo '// edited' >>include/bielle/model/model.h && ninja -C build bielle_command test_files"}),
    "pip": ("/usr/bin/python3 -m venv --system-site-packages environment",  # Debian's, which has NumPy
            {"`pip install .` in a fresh virtual environment": "environment/bin/pip install ."}),
}
# Steps that are also shown together.
SUMS = {"`scripts/demo.sh`": list(STEPS["demo"][1]), "`scripts/test.sh`": list(STEPS["test"][1])[:2], "`.ci/run`": [*STEPS["test"][1], *STEPS["ci"][1]]}
# Largest ratios that were aimed at, of steps and of sums.
GOALS = {list(STEPS["demo"][1])[0]: 0.42, "`scripts/demo.sh`": 0.5, "model": 0.4, "pip": 0.5, "`scripts/test.sh`": 0.4, "`.ci/run`": 0.5}


def run(command, directory, log):
    """Minutes of processor and clock, and the resident memory of the largest process, MB."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("BIELLE", "CCACHE"))}
    environment.update(CMAKE_CXX_COMPILER_LAUNCHER="", CCACHE_DISABLE="1")
    begin = time.time()
    process = subprocess.Popen(["bash", "-euo", "pipefail", "-c", command], cwd=directory, env=environment, stdout=log,
                               stderr=subprocess.STDOUT)
    _, status, usage = os.wait4(process.pid, 0)  # with all that it waited for
    if status:
        print(f"{command}: exit status {status >> 8} (see {log.name})", file=sys.stderr)
    return (usage.ru_utime + usage.ru_stime) / 60, (time.time() - begin) / 60, usage.ru_maxrss / 1000


def measure(step, revision, directory, log):
    """Yields (title, minutes of processor, of clock, MB), in a fresh clone."""
    before, commands = STEPS[step]
    clone = pathlib.Path(directory) / revision[:12] / "clone"
    if not clone.exists():
        clone.parent.mkdir(parents=True)
        subprocess.run(["git", "clone", "--quiet", str(common.SOURCE), str(clone)], check=True)
    subprocess.run(["git", "checkout", "--quiet", "--force", revision], cwd=clone, check=True)
    subprocess.run(["git", "clean", "-fdxq"], cwd=clone, check=True)
    targets = (clone / "tests" / "CMakeLists.txt").read_text()
    target = "test_motion" if "test_${area}" in targets else "test_walk"
    if before:
        run(before.format(target=target), clone, log)
    for title, command in commands.items():
        yield title, *run(command.format(target=target), clone, log)


def read():
    if not DATA.exists():
        return []
    with open(DATA, encoding="utf-8", newline="") as file:
        return [{**row, "processor": float(row["processor"]), "clock": float(row["clock"])} for row in csv.DictReader(file)]


def record(revision, step, measured):
    is_new = not DATA.exists()
    with open(DATA, "a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(COLUMNS)
        for title, processor, clock, memory in measured:
            writer.writerow((revision[:12], step, title, f"{processor:.2f}", f"{clock:.2f}", common.describe_run(revision[:8]),
                             f"{memory:.0f}"))
            file.flush()
            print(title, f"{processor:.1f}, {clock:.1f} min, {memory:.0f} MB", file=sys.stderr)


def find(chosen):
    """{title: (minutes of processor, of clock, MB or "", run)}, with sums, by the last rows that are chosen."""
    rows = {row["title"]: row for row in read() if chosen(row)}
    out = {title: (row["processor"], row["clock"], row["memory"] or "", row["run"]) for title, row in rows.items()}
    for title, titles in SUMS.items():
        parts = [rows[part] for part in titles if part in rows]
        missing = [part for part in titles if part not in rows and "--all" not in part]  # older rows have one tier
        if not missing and len({row["commit"] for row in parts}) == 1:
            out[title] = (*(sum(row[key] for row in parts) for key in ("processor", "clock")), "", parts[0]["run"])
    return out


def count(revision):
    """Lines of C++, and files of tests."""
    def call(*command):
        return subprocess.run(["git", *command], cwd=common.SOURCE, text=True, check=True,
                              stdout=subprocess.PIPE).stdout.splitlines()
    lines = call("grep", "-c", "", revision, "--", "*.cpp", "*.h")
    return sum(int(line.rsplit(":", 1)[1]) for line in lines), sum(
        name.startswith("tests/test_") for name in call("ls-tree", "--name-only", revision, "tests/"))


def show_sizes(sizes):
    return f"{sizes[0]:,} lines of C++ and {sizes[1]} files of tests"


def show_tiers(page, build):
    """The names of the tests, which the test `tiers` compares with those of CTest."""
    short, long = list_tiers(list_tests("ctest", build))
    for title, names in ((f"`scripts/test.sh` runs {len(short)} tests", short),
                         (f"`scripts/test.sh --all` runs these {len(long)} as well", long)):
        page.heading(title)
        page.add(", ".join(names))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", required=True, metavar="REVISION")
    parser.add_argument("--commit", default="HEAD", metavar="REVISION", help="instead of HEAD")
    parser.add_argument("--measure", nargs="*", metavar="REVISION", help="of these only; none: the page alone")
    parser.add_argument("--steps", nargs="+", choices=STEPS, default=list(STEPS))
    parser.add_argument("--build", default=common.SOURCE / "build/test", help="whose tests are listed; default: build/test")
    arguments = parser.parse_args()

    def parse(name):
        command = ["git", "rev-parse", name]
        return subprocess.run(command, cwd=common.SOURCE, text=True, check=True, stdout=subprocess.PIPE).stdout.strip()

    here, there = parse(arguments.commit), parse(arguments.against)
    with tempfile.TemporaryDirectory(prefix="bielle-wait-") as directory, open("wait.log", "a", encoding="utf-8") as log:
        os.chmod(directory, 0o755)  # a test runs the program as another user
        for step in arguments.steps:
            for revision in (here, there) if arguments.measure is None else map(parse, arguments.measure):
                if not set(STEPS[step][1]) <= {row["title"] for row in read() if row["commit"] == revision[:12]}:
                    record(revision, step, measure(step, revision, directory, log))
    one, other = find(lambda row: row["commit"] != there[:12]), find(lambda row: row["commit"] == there[:12])
    page = common.Page(__file__, "The wait", "Each row names its commit, date and machine")
    page.add("Minutes of processor and of clock on all cores, and the resident memory of the largest process [MB], each in a fresh clone "
             "and without a compiler cache.")
    keys = {title: step for step, (_, commands) in STEPS.items() for title in commands} | {title: title for title in SUMS}
    page.table(("", f"{arguments.against}: processor", "clock", "MB", "here: processor", "clock", "MB", "ratio", "goal", "measured"),
               [(title, *(text for row in (other[title], one[title]) for text in (f"{row[0]:.1f}", f"{row[1]:.1f}", row[2])),
                 f"{one[title][0] / other[title][0]:.2f}", str(GOALS.get(title, GOALS.get(key, ""))), one[title][3])
                for title, key in keys.items() if title in one and title in other])
    sizes = {revision: count(revision) for revision in (there, here)}
    missing = [title for title in keys if title not in SUMS and not (title in one and title in other)]
    if missing:
        page.add(f"Not measured against {arguments.against} yet: {'; '.join(missing)}.")
    page.add(f"""Commits before 94c97371 build the check before they show the squat. Ratios are those of processor times. The tests of 3bf0e583 ran in an hour when
building it took 1.12 times as long as the row shows: in turn, the ratio of testing would be about 0.49, and that of both 0.81.
Goals were set for what {arguments.against} builds and tests, which has
{show_sizes(sizes[there])}; this has {show_sizes(sizes[here])}.""")
    show_tiers(page, arguments.build)
    page.write(False)


main()
