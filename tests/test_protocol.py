"""test_protocol.py BIELLE SOURCE [IPOPT]: suite/protocol.py starts problems from guesses, goes on after a line that was cut off, and refuses
what it cannot do before any run. With bielle-ipopt, IPOPT finds the same optimum instead.

Exit status 77: there is no NumPy."""
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile

if not importlib.util.find_spec("numpy"):
    sys.exit(77)
BIELLE = str(pathlib.Path(sys.argv[1]).absolute())
program = pathlib.Path(sys.argv[2]) / "suite/protocol.py"
VARIANT, *IPOPT = ("IPOPT, Gauss-Newton", "--ipopt", str(pathlib.Path(sys.argv[3]).absolute())) if sys.argv[3:] else ("exact loops",)
RUN = json.dumps({"problem": "walk", "variant": "exact loops", "seed": 0, "guess": 0}) + "\n"

with tempfile.TemporaryDirectory() as directory:
    (pathlib.Path(directory) / "index.jsonl").write_text("")  # a suite without problems: nothing is run
    runs = pathlib.Path(directory) / "runs.jsonl"

    def call(text, *arguments):
        runs.write_text(text)
        return subprocess.run([sys.executable, program, directory, runs, *arguments], capture_output=True, text=True)

    def check(done, status, *words):
        assert done.returncode == status and "Traceback" not in done.stderr, done.stderr
        assert all(word in done.stderr for word in words), done.stderr

    check(call(RUN), 0)
    assert runs.read_text() == RUN
    check(call(RUN + RUN[:12]), 0, "runs.jsonl", "cut off")
    assert runs.read_text() == RUN
    check(call(RUN[:12]), 0, "cut off")
    assert runs.read_text() == ""
    check(call(RUN + RUN[:12] + "\n" + RUN), 1, "runs.jsonl, line 2")
    check(call(RUN + "3\n"), 1, "runs.jsonl, line 2")
    check(call("", "--guesses", "3:1"), 2, "no guess")
    check(call("", "--guesses", "3"), 2, "FIRST:END")
    check(call("", "--until", "25:99"), 2, "23:30")
    check(call("", "--until", "23:59"), 0)

# One problem from one guess: it is solved again, to the same optimum, and not repeated.
with tempfile.TemporaryDirectory() as directory:
    place = pathlib.Path(directory)
    (place / "short.yaml").write_text("formats: [problem]\nmotions: [{solve: squat, robot: rsu_biped, set: {depth: 0.9, duration: 0.6, "
                                      "settle: 0, time_step: 0.02}}]\n")
    subprocess.run([BIELLE, "dataset", "short.yaml", "-o", "short"], cwd=place, check=True, capture_output=True)
    for times in range(2):
        subprocess.run([sys.executable, program, "short", "runs.jsonl", "--bielle", BIELLE, "--guesses", "0:1",
                        "--variants", VARIANT, *IPOPT], cwd=place, check=True, capture_output=True)
        line, = map(json.loads, (place / "runs.jsonl").read_text().splitlines())
    entry, = map(json.loads, (place / "short/index.jsonl").read_text().splitlines())
    cost = json.loads((place / "short/motions" / entry["name"] / "motion/summary.json").read_text())["cost"]
    assert line["converged"] and line["iterations"] > 0 and abs(line["cost"] / cost - 1) < 1e-6, (line, cost)
