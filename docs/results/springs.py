#!/usr/bin/env python3
"""Writes docs/results/springs.md and docs/images/springs.png: a jump of spring_biped with leaf springs and with rigid leaves.

    docs/results/springs.py [--bielle build/bin/bielle] [--quick]

Runs examples/springs/jump.py, which solves both jumps; takes a few minutes on one core.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import common

NUMBER = r"\s+(-?[\d.]+)"


def run_jump(bielle, figure, options):
    environment = {**os.environ, "PATH": f"{pathlib.Path(bielle).resolve().parent}:{os.environ['PATH']}"}
    command = [sys.executable, str(common.SOURCE / "examples/springs/jump.py"), "-o", figure, *options]
    run = subprocess.run(command, capture_output=True, text=True, env=environment)
    if run.returncode != 0:
        sys.exit(f"{' '.join(command)}\nexit status {run.returncode}\n{run.stdout}{run.stderr}")
    return run.stdout


def read_energies(printed):
    """[(motor, rigid electrical, rigid mechanical, springs electrical, springs mechanical), ...]"""
    rows = re.findall(r"^(hip roll|hip yaw|hip pitch|knee|toe \(two\)|all)" + 4 * NUMBER + r"\s*$", printed, re.MULTILINE)
    assert len(rows) == 6, printed
    return rows


def read_springs(printed):
    """[(phase, start, most, time, end), ...]"""
    return re.findall(r"^springs, (\w+)\s*: at its start\s+([\d.]+) J, at most\s+([\d.]+) J at ([\d.]+) s, at its end\s+"
                      r"([\d.]+) J", printed, re.MULTILINE)


def main():
    arguments = common.make_parser(__doc__).parse_args()
    page = common.Page(__file__, "A jump with and without springs", common.describe_run(arguments.commit))
    page.add("""`spring_biped` makes the same jump, 0.3 s in the air, with leaf springs at shins and heels and with rigid leaves
of the same masses: the motion of least electrical energy of the motors, of which nothing is recovered. Both converge, keep their
constraints and pass `bielle check`. Stages last 2.5 ms, because leaves without damping ring at some 40 Hz in flight.""")
    with tempfile.TemporaryDirectory() as place:
        figures = place if arguments.quick else common.SOURCE / "docs/images"
        figure = os.path.join(figures, "springs.png")
        options = ["--objective", "effort", "--time-step", "0.005"] if arguments.quick else []
        printed = run_jump(arguments.bielle, figure, options)
    page.add("![energy of the motors, power of the knees, energy in the springs](../images/springs.png)")
    page.table(["electrical (mechanical) energy of the motors of both legs [J]", "rigid", "springs"],
               [[name, f"{a} ({b})", f"{c} ({d})"] for name, a, b, c, d in read_energies(printed)])
    page.add("Energy in the springs:")
    page.table(["phase", "at its start [J]", "at most [J]", "at [s]", "at its end [J]"],
               [list(row) for row in read_springs(printed)])
    page.add("""The springs take up energy in the push, return it before the take-off, and take up the landing. What is left is
mostly the heat of holding the load, which rests on windings that are our guess (`robots/spring_biped/README.md`). The figures
depend on the weights: these jumps use `--regularization 1`.""")
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
