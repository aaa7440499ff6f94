"""What a newcomer and a developer wait for: processor time, without a compiler cache, of this commit and of another one in turn.

    python3 docs/results/wait.py --against REVISION [--steps demo edit ...]

Each step runs in a fresh clone, this commit's and the other's one after the other. All steps of both take two hours of two cores.
"""
import argparse
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import common

RELEASE = "cmake --preset release -G Ninja >/dev/null && "
# What runs once before and is not counted; what is counted, by its title.
STEPS = {
    "demo": ("", {"`scripts/demo.sh`": "scripts/demo.sh"}),
    "test": ("", {"`scripts/test.sh`, building": "sed -i '/^run_tests/d' scripts/test.sh && scripts/test.sh",
                  "`scripts/test.sh`, testing": "source scripts/setup.sh && run_tests build/test"}),
    "edit": (RELEASE + "ninja -C build {target}",
             {"one source of `motion` edited, its test built": "echo '// edited' >> src/motion/walk.cpp && ninja -C build {target}"}),
    "pip": ("python3 -m venv --system-site-packages environment",
            {"`pip install .` in a fresh virtual environment": "environment/bin/pip install --no-build-isolation ."}),
}


def run(command, directory, log):
    """Minutes of processor and clock."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("BIELLE", "CCACHE"))}
    environment.update(CMAKE_CXX_COMPILER_LAUNCHER="", CCACHE_DISABLE="1")
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.time()
    status = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=directory, env=environment, stdout=log,
                            stderr=subprocess.STDOUT).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if status:
        print(f"{command}: exit status {status} (see {log.name})", file=sys.stderr)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / 60, (time.time() - begin) / 60


def measure(step, revision, directory, log):
    """[(title, (minutes of processor, of clock)), ...] in a fresh clone."""
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
    return [(title, run(command.format(target=target), clone, log)) for title, command in commands.items()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", required=True, metavar="REVISION")
    parser.add_argument("--steps", nargs="+", choices=STEPS, default=list(STEPS))
    arguments = parser.parse_args()
    revisions = [subprocess.run(["git", "rev-parse", name], cwd=common.SOURCE, text=True, check=True, stdout=subprocess.PIPE).stdout.strip()
                 for name in ("HEAD", arguments.against)]
    rows = []
    with tempfile.TemporaryDirectory(prefix="bielle-wait-") as directory, open("wait.log", "w", encoding="utf-8") as log:
        for step in arguments.steps:
            for (title, here), (_, there) in zip(*[measure(step, revision, directory, log) for revision in revisions]):
                rows.append((title, *(f"{minutes:.1f}" for minutes in (*there, *here)), f"{here[0] / there[0]:.2f}"))
                print(rows[-1], file=sys.stderr)
    page = common.Page(__file__, "The wait", common.describe_run())
    page.add("Minutes of processor and of clock on all cores, each in a fresh clone and without a compiler cache.")
    page.table(("", f"{arguments.against}: processor", "clock", "this commit: processor", "clock", "ratio of processor times"), rows)
    page.write(False)


main()
