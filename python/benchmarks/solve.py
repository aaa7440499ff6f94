"""solve.py COMMAND: what a solve costs from Python, over the command, and with a cost written in Python.

Times of the solver alone, with one thread, of both in turn; the least of several runs, because other load lengthens all of them.
"""

import json
import subprocess
import sys
import tempfile
import time
from typing import Dict

import numpy as np
import numpy.typing as npt

import bielle

RUNS = 5


class ComHeight(bielle.Residual):
    """Height of the centre of mass minus a reference, m."""

    size = 1
    depends_on = ("q",)

    def calc(self, node: bielle.Node) -> npt.ArrayLike:
        return node.com[2:] - 0.4

    def calc_jacobian(self, node: bielle.Node) -> Dict[str, npt.ArrayLike]:
        return {"q": node.com_jacobian[2:]}


def run_command(command: str) -> float:
    with tempfile.TemporaryDirectory() as directory:
        subprocess.run([command, "solve", "walk", "--robot", "bipetto", "--threads", "1", "--quiet", "--no-check",
                        "--no-report", "-o", directory], check=True, stdout=subprocess.DEVNULL)  # fmt: skip
        with open(directory + "/summary.json") as file:
            return float(json.load(file)["seconds"])


def run_python() -> float:
    return bielle.solve_walk("bipetto", solver=bielle.SolverOptions(threads=1)).solver.seconds


def run_own_cost(own: bool) -> float:
    """CPU time per iteration of a squat with one more cost, written in Python or of the library."""
    model = bielle.load_robot("bipetto").model
    plan = bielle.Motion.plan(model, bielle.Request(motion="squat"))
    library = bielle.residuals.com_position([0, 0, 0.4])
    cost = bielle.Cost("height", 1, bielle.Activation.quadratic([1] if own else [0, 0, 1]), ComHeight() if own else library)
    stages = [stage.replace(costs=[*stage.costs, cost]) for stage in plan.stages]
    motion = bielle.Motion(model, plan.replace(stages=stages))
    start = time.process_time()
    summary = motion.solve(bielle.SolverOptions(threads=1)).summary
    return (time.process_time() - start) / summary.iterations


if __name__ == "__main__":
    turns = [(run_command(sys.argv[1]), run_python()) for _ in range(RUNS)]
    command, python = (float(least) for least in np.min(turns, axis=0))
    print(f"walk: {command:.3f} s by the command, {python:.3f} s from Python, {100 * (python / command - 1):+.1f} %")
    library, own = (float(np.min([run_own_cost(own) for _ in range(RUNS)])) for own in (False, True))
    print(f"squat, per iteration: {1e3 * library:.2f} ms, with a cost in Python {1e3 * own:.2f} ms, {own / library:.2f} times")
