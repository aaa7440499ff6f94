#!/usr/bin/env python3
"""Prints the table of docs/results/checks.md: Bielle's dynamics against Simbody's and MuJoCo's, for every element and robot.

    validation/table.py [--bielle build/bin/bielle] [ROBOT ...]

Every cell is the largest relative difference of its quantities over the states of `bielle validate`. Robots are those that the
command knows by name, then all of validation/elements, then spring_leg with leaves that bend; robots of others that are not at hand
are left out. Exit status 1 if a difference exceeds its tolerance, which a star marks.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ELEMENTS = pathlib.Path(__file__).resolve().parent / "elements"
LEAVES = ["shin_stiffness=1500", "heel_stiffness=1250"]
# Title, engine, and how the names of its quantities begin.
COLUMNS = [
    ("mass matrix, bias", "simbody", ("mass matrix", "bias", "inverse dynamics")),
    ("accelerations, forces", "simbody",
     ("accelerations, with rotors", "constraint forces J'lambda, with", "closure forces, with", "foot forces, with")),
    ("by Simbody's own solver", "simbody",
     ("accelerations, Simbody", "constraint forces J'lambda, Simbody", "closure forces, Simbody", "foot forces, Simbody")),
    ("derivatives", "simbody", ("da/", "dlambda/")),
    ("mass matrix, bias", "mujoco", ("mass matrix", "bias")),
    ("accelerations", "mujoco", ("accelerations, rigid closures, ",)),
]
TITLES = {"simbody": "Simbody", "mujoco": "MuJoCo"}


def validate(bielle, robot, engine, options):
    """The rows of one robot; none where the command was built without the engine."""
    run = subprocess.run([bielle, "validate", robot, "--json", "--engine", engine, *options], capture_output=True, text=True)
    if run.returncode == 2:
        if "--engine" in run.stderr + run.stdout or "MuJoCo has no" in run.stderr:  # built without it; a slider
            return []
        sys.exit(run.stderr)
    report = json.loads(run.stdout)["robots"][0]
    if report["failure"]:
        sys.exit(f"{robot}: {report['failure']}")
    return report["rows"]


def format_cell(rows, beginnings):
    """The largest difference, with a star if a row fails; a dash without rows."""
    found = [row for row in rows if row["quantity"].startswith(beginnings)]
    if not found:
        return "–"
    return f"{max(row['difference'] for row in found):.1e}" + ("" if all(row["passed"] for row in found) else " *")


def list_robots(bielle):
    """Names that the command knows and can load."""
    lines = subprocess.run([bielle, "robots"], capture_output=True, text=True, check=True).stdout.splitlines()
    names = [line.split()[0] for line in lines]
    return [n for n in names if subprocess.run([bielle, "info", n], capture_output=True).returncode == 0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", metavar="ROBOT", help="only these, and the elements")
    parser.add_argument("--bielle", default="bielle", help="the command")
    parser.add_argument("--samples", default="10", help="states of each robot")
    parser.add_argument("--derivatives", default="3", help="states whose derivatives are compared")
    parser.add_argument("--tolerance", help="relative difference allowed, instead of that of `bielle validate`")
    arguments = parser.parse_args()
    options = ["--samples", arguments.samples, *(["--tolerance", arguments.tolerance] if arguments.tolerance else [])]
    with tempfile.TemporaryDirectory() as directory:
        leaves = directory + "/leaves"
        subprocess.run([arguments.bielle, "generate", "spring_leg", "--set", *LEAVES, "-o", leaves], check=True,
                       stdout=subprocess.DEVNULL)
        elements = [(path.stem.replace("_", " "), str(path)) for path in sorted(ELEMENTS.glob("*.yaml"))]
        robots = [(name, name) for name in arguments.robots or list_robots(arguments.bielle)]
        print("| | " + " | ".join(f"{TITLES[engine]}: {title}" for title, engine, _ in COLUMNS) + " |")
        print("|---" * (1 + len(COLUMNS)) + "|")
        passed = True
        for name, robot in robots + elements + [("leaf spring", leaves)]:
            rows = {"simbody": validate(arguments.bielle, robot, "simbody", [*options, "--derivatives", arguments.derivatives]),
                    "mujoco": validate(arguments.bielle, robot, "mujoco", options)}
            passed = passed and all(row["passed"] for engine in rows.values() for row in engine)
            print("| " + " | ".join([name] + [format_cell(rows[engine], names) for _, engine, names in COLUMNS]) + " |", flush=True)
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
