"""test_determinism.py BIELLE [rest]: the same command writes the same bytes, with one thread or two, now or later, here or elsewhere.
The first two commands, or the rest of them."""
import os
import subprocess
import sys
import tempfile
import time

program = os.path.abspath(sys.argv[1])
SHORT = ["--set", "duration=0.6", "--set", "settle=0.1", "--set", "time_step=0.02"]
COMMANDS = {
    "squat": ["squat", "--depth", "0.8", *SHORT],
    "walk": ["walk", "--speed", "0.4", "--steps", "2"],
    "squat full": ["squat", "--depth", "0.8", "--formulation", "full", *SHORT],
    "limited": ["squat", "--depth", "0.8", "--limit", "motor_knee_left=22", "--velocity-limit", "motor_knee_left=3", *SHORT],
    "serial": ["squat", "--depth", "0.8", "--model", "serial", *SHORT],
    "jump": ["jump", "--flight", "0.2", "--set", "time_step=0.01"],
    "stairs stopped": ["stairs", "--height", "0.04", "--stairs", "1", "--max-iterations", "3"],
}
CHOSEN = list(COMMANDS)[2:] if "rest" in sys.argv else list(COMMANDS)[:2]
NAMES = ("trajectory.csv", "trajectory.npz")


def solve(arguments, threads, directory, **environment):
    result = subprocess.run([program, "solve", *arguments, "--robot", "bipetto", "--threads", str(threads), "--quiet",
                             "--no-check", "--no-report", "-o", directory], stdout=subprocess.DEVNULL,
                            env={**os.environ, **environment})
    assert result.returncode in (0, 1), result
    files = []
    for name in NAMES:
        with open(os.path.join(directory, name), "rb") as file:
            files.append(file.read())
    return result.returncode, files


def main():
    with tempfile.TemporaryDirectory() as place:
        results = {}
        for name in CHOSEN:
            results[name] = solve(COMMANDS[name], 1, os.path.join(place, name))
        time.sleep(2.1)  # the resolution of times in archives
        for name in CHOSEN:
            for run, (threads, environment) in enumerate([(2, {"TZ": "Asia/Tokyo"}), (7, {"LC_ALL": "C"})]):
                again = solve(COMMANDS[name], threads, os.path.join(place, f"{name} {run}"), **environment)
                assert again[0] == results[name][0], name
                for file, first, second in zip(NAMES, results[name][1], again[1]):
                    assert first == second, f"{name}, {file}: {threads} threads {environment}: other bytes"
            print(f"{name}: {len(results[name][1][0])} bytes of CSV, the same three times")
        # The comparison notices a change of a millionth.
        if "squat" in results:
            changed = solve(["squat", "--depth", "0.8000001", *SHORT], 1, os.path.join(place, "changed"))
            assert changed[1][0] != results["squat"][1][0] and changed[1][1] != results["squat"][1][1]


main()
