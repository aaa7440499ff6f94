"""test_stationarity.py BIELLE SOURCE: optima are stationary by differences that share no code with Bielle, whose derivatives of
steps are those of whole steps; and what is changed is noticed.

Ends with status 77 where there is no NumPy.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("skipped: no NumPy")
    sys.exit(77)

BIELLE, SOURCE = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
sys.dont_write_bytecode = True
sys.path.insert(0, str(SOURCE / "suite"))
import problem as reader  # noqa: E402
import stationarity  # noqa: E402

# Down and up in a short time: the soles are at the edge of their cones.
MOTION = ["squat", "--robot", "bipetto", "--depth", "0.9", "--duration", "0.3", "--set", "settle=0", "--set", "time_step=0.02"]


def find_failures(problem, t, derivatives):
    return {what.split(": ")[1] for what, value, bound in stationarity.judge(problem, t, derivatives) if not value <= bound}


def check_steps(problem, t):
    """A step from a state of the archive is the one in the archive, and its forces are."""
    q1, v1, read = stationarity.Steps(problem, t).step(t["q"][:-1], t["v"][:-1], t["u"])
    assert np.abs(problem.mechanism.subtract(q1, t["q"][1:])).max() < 1e-11
    assert np.abs(v1 - t["v"][1:]).max() < 1e-9
    for name, value in read.items():
        assert np.abs(value - t[name]).max() < 1e-8 * (1 + np.abs(t[name]).max()), name


def check_poisons(problem, t, derivatives):
    gradient, slack = "gradient by the torques", "y times the distance from its bound"
    y, largest = t["multipliers"], np.abs(t["multipliers"]).argmax()
    assert y[largest] != 0  # or nothing would be tested
    for step in (1e-3 * y[largest], -2 * y[largest]):
        poisoned = {**t, "multipliers": y + step * (np.arange(len(y)) == largest)}
        found = find_failures(problem, poisoned, derivatives)
        assert gradient in found and (step * y[largest] > 0 or slack in found), (step, found)
    states = derivatives.states
    k, motor = np.unravel_index(np.abs(derivatives.cost[:-1, states:]).argmax(), (problem.stages, t["u"].shape[1]))
    largest = np.unravel_index(np.abs(derivatives.rows * y[:, None]).argmax(), derivatives.rows.shape)
    for array, place in ((derivatives.F, np.s_[k, :, states + motor]), (derivatives.cost, np.s_[k, states + motor]),
                         (derivatives.rows, largest)):
        value = array[place].copy()
        array[place] = 1.001 * value
        assert gradient in find_failures(problem, t, derivatives), place
        array[place] = value
    assert not find_failures(problem, t, derivatives)


def main():
    with tempfile.TemporaryDirectory() as place:
        for command in (["solve", *MOTION, "--quiet", "--no-report", "--no-check", "-o", "squat"],
                        ["export", "squat", "--format", "problem"]):
            subprocess.run([BIELLE, *command], cwd=place, check=True, capture_output=True)
        problem = reader.Problem(pathlib.Path(place) / "squat/problem.json")
        t = problem.read_optimum()
        check_steps(problem, t)
        derivatives = stationarity.Derivatives(problem, t)
        table = stationarity.judge(problem, t, derivatives)
        assert all(value <= bound for _, value, bound in table), table
        check_poisons(problem, t, derivatives)
    print(", ".join(f"{what} {value:.1e}" for what, value, _ in table))
    return 0


sys.exit(main())
