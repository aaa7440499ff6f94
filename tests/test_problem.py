"""test_problem.py BIELLE SOURCE: problems as data, read by NumPy alone; changed entries are noticed; guesses are closed.

Ends with status 77 where there is no NumPy.
"""
import json
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
import guesses  # noqa: E402
import mechanism  # noqa: E402
import problem as reader  # noqa: E402

SHORT = ["--set", "time_step=0.024", "--steps", "2"]
MOTIONS = {
    "squat": ["squat", "--robot", "bipetto", "--depth", "0.9", "--duration", "0.6", "--set", "settle=0", "--set", "time_step=0.02"],
    "energy": ["squat", "--robot", "spring_biped", "--depth", "0.95", "--duration", "0.6", "--set", "settle=0",
               "--set", "time_step=0.02", "--objective", "energy"],
    "unlimited": ["squat", "--robot", "bipetto", "--no-limits", "--duration", "0.6", "--set", "settle=0", "--set", "time_step=0.02"],
    "walk": ["walk", "--robot", "cleobot", "--speed", "0.3", *SHORT],
    "stairs": ["stairs", "--robot", "belt_biped", "--height", "0.04", "--stairs", "1"],
}


def run(place, *command, status=0):
    result = subprocess.run([BIELLE, *command], cwd=place, capture_output=True, text=True)
    assert result.returncode == status, f"{command}: {result.stdout}{result.stderr}"
    return result


def find_failures(path):
    return {what for what, value, bound in reader.check(path)[2] if not value <= bound}


def change(path, keys, make):
    """A problem beside the given one with one entry changed."""
    data = json.loads(path.read_text(encoding="utf-8"))
    entry = data
    for key in keys[:-1]:
        entry = entry[key]
    entry[keys[-1]] = make(entry[keys[-1]])
    poisoned = path.with_name("poisoned.json")
    poisoned.write_text(json.dumps(data), encoding="utf-8")
    poisoned.with_suffix(".npz").write_bytes(path.with_suffix(".npz").read_bytes())
    return poisoned


def change_array(path, name, index, step):
    arrays = dict(np.load(path.with_suffix(".npz"), allow_pickle=False))
    arrays[name] = arrays[name].copy()
    arrays[name][index] += step
    poisoned = path.with_name("poisoned.json")
    poisoned.write_bytes(path.read_bytes())
    np.savez(poisoned.with_suffix(".npz"), **arrays)
    return poisoned


def find_kind(path, table, kind):
    entries = json.loads(path.read_text(encoding="utf-8"))[table]
    return next(i for i, entry in enumerate(entries) if entry["residual"]["kind"] == kind)


def check_poisons(path):
    thousandth = lambda x: 1.001 * x
    cost = find_kind(path, "costs", "com_position")
    cone = find_kind(path, "constraints", "wrench_cone")
    linkage = find_kind(path, "constraints", "transmission")
    for keys, make, noticed in (
            (("costs", cost, "weight"), thousandth, "cost"),
            (("costs", cost, "residual", "reference", 2), thousandth, "cost"),
            (("state_costs", 0, "weights", 8), thousandth, "cost"),
            (("constraints", cone, "residual", "matrix", 0, 2), thousandth, "rows of the constraints"),
            (("constraints", linkage, "residual", "reference_volume"), thousandth, "rows of the constraints"),
            (("constraints", linkage, "lower", 0), lambda x: 2, "violation of the constraints"),
            (("effort_limits", 0, 0), lambda x: 1e-3, "torques over their limits"),
            (("initial", "q", 9), lambda x: x + 1e-6, "start"),
            (("mechanism", "bodies", 3, "mass"), thousandth, "equations of motion"),
            (("mechanism", "joints", 2, "p_PJ", 2), lambda x: x + 1e-6, "URDF: places of the links"),
            (("mechanism", "metric", 12), lambda x: 10 * x, "first drift"),
            (("mechanism", "armature", 12), lambda x: x + 1e-3, "equations of motion"),
            (("stages", 3, "dt"), thousandth, "second drift")):
        assert noticed in find_failures(change(path, keys, make)), (keys, find_failures(change(path, keys, make)))
    for name, index, step, noticed in (("u", (4, 1), 1e-3, "equations of motion"), ("q", (5, 12), 1e-6, "closures"),
                                       ("v", (5, 3), 1e-5, "velocity at the end"), ("a", (6, 2), 1e-4, "second drift"),
                                       ("v_mid", (6, 2), 1e-5, "foreseen: equations of motion"),
                                       ("contact_wrenches", (6, 0, 2), 1e-2, "equations of motion"),
                                       ("cost", (7,), 1e-3, "costs of the nodes"),
                                       ("q_mid", (6, 12), np.nan, "entries that are no number")):
        assert noticed in find_failures(change_array(path, name, index, step)), (name, index)


def check_guesses(path):
    problem = reader.Problem(path)
    first, again, other = (guesses.make_guess(problem, trial) for trial in (1, 1, 2))
    assert all((first[key] == again[key]).all() for key in first)
    assert np.abs(first["q"] - other["q"]).max() > 1e-3
    start = problem.read_optimum()
    assert np.abs(first["q"][0] - start["q"][0]).max() < 1e-9
    loops = mechanism.Loops(mechanism.State(problem.mechanism, first["q"], first["v"]))
    assert np.abs(loops.residual).max(initial=0) < 1e-11
    assert np.abs(mechanism.apply(loops.J, first["v"])).max(initial=0) < 1e-9


def check_refusals(place):
    for options, problem in ((["--formulation", "full"], "closed states"), (["--free-timings"], "durations are variables"),
                             (["--max-iterations", "1"], "no optimum")):
        run(place, "solve", *MOTIONS["squat"], *options, "--quiet", "--no-report", "--no-check", "-o", "refused",
            status=1 if "--max-iterations" in options else 0)
        refused = run(place, "export", "refused", "--format", "problem", status=2)
        assert problem in refused.stderr, (options, refused.stderr)
        assert not (place / "refused" / "problem.json").exists()


def main():
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory)
        for name, options in MOTIONS.items():
            run(place, "solve", *options, "--quiet", "--no-report", "--no-check", "-o", name)
            run(place, "export", name, "--format", "problem")
            path = place / name / "problem.json"
            table = reader.check(path)[2]
            assert all(value <= bound for _, value, bound in table), (name, table)
            print(f"{name}: largest {max(value for _, value, bound in table if bound == reader.TOLERANCE):.1e}")
        check_poisons(place / "squat" / "problem.json")
        check_guesses(place / "walk" / "problem.json")
        check_refusals(place)
        program = [sys.executable, str(SOURCE / "suite/problem.py"), str(place / "squat/problem.json")]
        assert subprocess.run(program, capture_output=True).returncode == 0
        program[-1] = str(change(place / "squat" / "problem.json", ("costs", 0, "weight"), lambda x: 2 * x))
        assert subprocess.run(program, capture_output=True).returncode == 1
    print("problems are what the reader finds, and changed entries are noticed")
    return 0


sys.exit(main())
