#!/usr/bin/env python3
"""Writes docs/results/checks.md: Bielle's dynamics against Simbody's and MuJoCo's, by quantity, robot and element.

    docs/results/checks.py [--bielle build/bin/bielle] [--quick]

The last table is that of validation/table.py. Takes about two minutes on one core.
"""
import json
import subprocess
import sys

import common


def validate(runner, engine, robots, options=()):
    """{robot: {quantity: difference}}"""
    print(f"validate --engine {engine} {' '.join(robots)}", file=sys.stderr, flush=True)
    run = runner.run("validate", *robots, "--engine", engine, "--json", *options, allowed=(0, 1, 2))
    if run.returncode == 2:
        return {}  # the command was built without this engine
    return {report["robot"]: {row["quantity"]: row["difference"] for row in report["rows"]}
            for report in json.loads(run.stdout)["robots"]}


def add_quantities(page, found):
    quantities = list(dict.fromkeys(quantity for rows in found.values() for quantity in rows))
    page.table(["", *found], [[quantity, *(common.show(rows.get(quantity), "{:.1e}") for rows in found.values())]
                              for quantity in quantities])


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "Dynamics against Simbody and MuJoCo", common.describe_run(arguments.commit))
    page.add("""Largest relative differences over ten random closed states; derivatives over three. A dash marks a
quantity that a robot does not have, or that is not unique because its loops have redundant rows.""")
    few = ["--samples", 2, "--derivatives", 1]
    page.heading("By quantity, Simbody")
    robots = ["fourbar"] if arguments.quick else ["bipetto", "fivebar", "fourbar"]
    options = few if arguments.quick else ["--derivatives", 3]
    add_quantities(page, validate(runner, "simbody", robots, [*options, "--motion", 0]))
    found = validate(runner, "mujoco", ["fourbar"] if arguments.quick else ["bipetto", "cleobot", "fourbar", "delta"],
                     few[:2] if arguments.quick else [])
    if found:
        page.heading("By quantity, MuJoCo")
        page.add("""MuJoCo's closures are soft. Its accelerations are compared as it gives them, with closures
stiffened to their limit, and with dJ/dt v added, which its equality constraints leave out.""")
        add_quantities(page, found)
    if not arguments.quick:
        page.heading("By robot and element")
        page.add("""A cell is the largest difference of the quantities named above it. The last six rows are robots
with one element each: couplers beside loops; Coulomb and viscous friction; joint springs; motors with ratio and
rotor; springs between points; leaf springs. Simbody has no rotors: accelerations are compared with rotors by its
terms, and without by its solver. MuJoCo's accelerations are those with rigid closures and dJ/dt v, and at rest.""")
        table = common.SOURCE / "validation/table.py"
        print(table, file=sys.stderr, flush=True)
        run = subprocess.run([sys.executable, table, "--bielle", runner.bielle], cwd=runner.directory.name,
                             capture_output=True, text=True)
        if run.returncode:
            sys.exit(f"{table}: exit status {run.returncode}\n{run.stdout}{run.stderr}")
        page.add(run.stdout.strip())
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
