"""What the scripts of docs/results share: options, runs of the command, and pages with commit, machine and date.

A script measures, fills a Page and ends with write(). `--quick` measures a few rows only and prints them: the page
stays.
"""
import argparse
import csv
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[1]


def make_parser(description):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bielle", default="bielle", help="the command; its companions are beside it")
    parser.add_argument("--commit", help="commit of the command, if it was not built from this tree")
    parser.add_argument("--quick", action="store_true", help="measure a few rows and print them; the page stays")
    return parser


def describe_commit():
    command = ["git", "describe", "--always", "--tags", "--dirty"]
    try:
        return subprocess.run(command, cwd=SOURCE, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):  # an archive of the source
        return "unknown"


def describe_machine():
    """Processor and number of cores."""
    name = "unknown processor"
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        for line in file:
            if line.startswith("model name"):
                name = line.split(":")[1].strip()
                break
    return f"{name}, {len(os.sched_getaffinity(0))} cores"


def describe_run(commit=None):
    return f"commit {commit or describe_commit()}, {datetime.date.today().isoformat()}, {describe_machine()}"


class Runner:
    """Runs the command in a directory of its own."""

    def __init__(self, bielle):
        self.bielle = os.path.abspath(bielle) if os.path.dirname(bielle) else bielle
        self.directory = tempfile.TemporaryDirectory()
        self.count = 0

    def place(self, name=None):
        self.count += 1
        return os.path.join(self.directory.name, name or f"run{self.count}")

    def run(self, *arguments, allowed=(0, 1)):
        command = [self.bielle, *map(str, arguments)]
        run = subprocess.run(command, cwd=self.directory.name, capture_output=True, text=True)
        if run.returncode not in allowed:
            sys.exit(f"{' '.join(command)}\nexit status {run.returncode}\n{run.stdout}{run.stderr}")
        return run

    def has_robot(self, robot):
        """Robots whose files are published elsewhere may be missing."""
        return self.run("info", robot, allowed=(0, 1, 2)).returncode == 0

    def solve(self, motion, robot, options=(), directory=None):
        """Solves and checks a motion on one thread. Returns its Result."""
        directory = directory or self.place()
        print(f"solve {motion} --robot {robot} {' '.join(map(str, options))}", file=sys.stderr, flush=True)
        self.run("solve", motion, "--robot", robot, *options, "--threads", 1, "--quiet", "--no-report", "-o", directory)
        return Result(directory)


class Result:
    """The files of a solved motion: summary.json and check.json, and the columns of trajectory.csv."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        self.summary = json.loads((self.directory / "summary.json").read_text(encoding="utf-8"))
        check = self.directory / "check.json"
        self.check = json.loads(check.read_text(encoding="utf-8")) if check.exists() else {"rows": [], "pass": False}

    def row(self, name):
        """Value of a row of the check; None if it does not apply."""
        return next((row["value"] for row in self.check["rows"] if row["name"] == name), None)

    def goals(self):
        """[(name, requested, achieved, unit), ...], achieved as the check measures it."""
        beginning = "goal: "
        return [(row["name"][len(beginning):], row["bound"], row["value"], row["unit"])
                for row in self.check["rows"] if row["name"].startswith(beginning)]

    def torque(self, part=""):
        """Largest torque of the motors whose names contain the text, N m."""
        return max(value for name, value in self.summary["peak_torques"].items() if part in name)

    def outcome(self):
        """The verdict of the check, and whether the solver did not converge."""
        failed = [row["name"] for row in self.check["rows"] if not row["pass"]]
        verdict = "fails: " + "; ".join(failed) if failed else "passes"
        return verdict if self.summary["converged"] else "not converged; " + verdict

    def columns(self, prefix):
        """{name: [value, ...]} of the columns of trajectory.csv that begin so."""
        with open(self.directory / "trajectory.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        return {name: [float(row[i]) for row in rows[1:] if row[i]]
                for i, name in enumerate(rows[0]) if name.startswith(prefix)}


def show(value, form="{:.3g}", scale=1.0):
    """A number for a table; a dash for None."""
    return "–" if value is None else form.format(value * scale)


def fill(text):
    """Wraps a paragraph, but no code within it."""
    blank = "\0"
    text = re.sub("`[^`]*`", lambda code: code[0].replace(" ", blank), " ".join(text.split()))
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False).replace(blank, " ")


class Page:
    def __init__(self, script, title, run):
        self.path = HERE / (pathlib.Path(script).stem + ".md")
        self.lines = [f"# {title}", "", f"*{run}. Written by `docs/results/{pathlib.Path(script).name}`; do not edit.*"]

    def add(self, *paragraphs):
        for text in paragraphs:
            self.lines += ["", text if text.startswith("|") else fill(text)]

    def heading(self, text):
        self.add("## " + text)

    def table(self, columns, rows):
        self.lines += ["", "| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
        self.lines += ["| " + " | ".join(row) + " |" for row in rows]

    def keep(self, *headings):
        """Sections as the page has them, where this run does not measure them again; each says which run did."""
        if not self.path.exists():
            return
        old = self.path.read_text(encoding="utf-8").splitlines()
        run = old[2].strip("*").partition(". Written by")[0]
        for heading in headings:
            if f"## {heading}" not in old:
                continue
            start = old.index(f"## {heading}")
            end = next((k for k in range(start + 1, len(old)) if old[k].startswith("## ")), len(old))
            section = "\n".join(old[start + 1 : end]).strip()
            self.heading(heading)
            if not section.startswith("*Of "):
                self.add(f"*Of {run}.*")
            self.lines += ["", section]

    def write(self, quick):
        text = "\n".join(self.lines) + "\n"
        if quick:
            print(text)
            return
        self.path.write_text(text, encoding="utf-8")
        print(self.path)
