#!/usr/bin/env python3
"""The protocol of docs/suite.md: every problem of the suite from perturbed guesses, by Bielle with each ingredient on and off.

    suite/protocol.py DIR RUNS.jsonl [--guesses 0:100] [--seed 0] [--variants NAME ...] [--until HH:MM]
                      [--bielle build/bin/bielle] [--ipopt build/bin/bielle-ipopt] [--seconds 20]

DIR is what `bielle dataset suite/suite.yaml -o DIR` wrote. A run is a line of RUNS.jsonl, appended when it is finished; those that
are there are not repeated. Runs go guess by guess, so that what is cut off has as many guesses of every problem.
"""
import argparse
import datetime
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

import numpy as np

from guesses import make_guess
from problem import Problem

LONGEST = 20     # s of processor time, of a run on one thread, unless told otherwise
ITERATIONS = 300

# Options of `bielle solve`. All but the first change one thing.
VARIANTS = {
    "exact loops": [],
    "full formulation": ["--formulation", "full"],
    "Euler steps": ["--step", "euler"],
    "no multipliers": ["--no-multipliers"],
    "no margin to dead points": ["--dead-point-margin", "0"],
}
# Options of `bielle-ipopt`, which is run where a variant is named.
IPOPT = {
    "IPOPT, Gauss-Newton": ["--hessian", "gauss-newton"],
    "IPOPT, L-BFGS": ["--hessian", "l-bfgs"],
    "IPOPT, collocation, Gauss-Newton": ["--transcription", "collocation", "--hessian", "gauss-newton"],
    "IPOPT, collocation, L-BFGS": ["--transcription", "collocation", "--hessian", "l-bfgs"],
}
KEEP_MARGINS = ["--dead-point-margin", "0.1499999"]  # hardly less than the default: those of linkages then stay as they are
STARTS = ("optimum", "unperturbed")  # besides numbers of guesses: where the archive ends and where it began
NONE = {"converged": False, "cost": None, "violation": None, "iterations": None, "seconds": None}


def parse_guesses(text):
    if text in STARTS:
        return [text]
    match = re.fullmatch(r"(\d+):(\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text} is not FIRST:END, such as 25:50, optimum or unperturbed")
    if int(match[1]) >= int(match[2]):
        raise argparse.ArgumentTypeError(f"{text} has no guess: END is excluded and must be larger than FIRST")
    return range(int(match[1]), int(match[2]))


def parse_time(text):
    try:
        return datetime.datetime.strptime(text, "%H:%M").time()
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is no time of a day, such as 23:30") from None


def read_runs(path):
    """(problem, variant, seed, guess) of every run that is there. A last line that was cut off is taken away: it will run again."""
    content = path.read_bytes()
    whole = content[:content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        print(f"{path}: the last line was cut off; its run is repeated", file=sys.stderr)
        os.truncate(path, len(whole))
    done = set()
    for number, line in enumerate(whole.decode().splitlines(), 1):
        try:
            done.add(tuple(json.loads(line)[key] for key in ("problem", "variant", "seed", "guess")))
        except (ValueError, KeyError, TypeError):
            sys.exit(f"{path}, line {number}: it is no run; delete the line")
    return done


def make_start(problem, trial, seed):
    archive = problem.read_optimum()
    if trial in STARTS:
        return {key: archive[key if trial == "optimum" else f"guess_{key}"] for key in ("q", "v", "u")}
    return make_guess(problem, trial, seed)


def write_guess(directory, solved, guess):
    """A result for --warm-start: the archive of the solved motion with states and torques of the guess, without multipliers."""
    with np.load(solved / "trajectory.npz", allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files if not name.startswith("multiplier")}
    for key in ("q", "v", "u"):
        assert arrays[key].shape == guess[key].shape, key
    shutil.copytree(solved, directory, ignore=shutil.ignore_patterns("trajectory.*"))
    np.savez(directory / "trajectory.npz", **{**arrays, **guess})


def run_limited(command, longest):
    """Exit status, processor time and errors of a command that is ended after `longest` seconds of that time."""
    with tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=errors,
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (longest, longest + 1)))
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        return process.returncode, usage.ru_utime + usage.ru_stime, errors.read()


def run_or_end(command, longest):
    """Exit status, seconds: -SIGXCPU if it was ended; ends with the message of a command that fails."""
    command = list(map(str, command))
    status, seconds, errors = run_limited(command, longest)
    if status not in (0, 1, -signal.SIGXCPU):
        sys.exit(f"{' '.join(command)}\nexit status {status}\n{errors}")
    return status, seconds


def split_margins(options):
    """Options of a motion, and its margins of single linkages."""
    prefix = "dead-point-margin of "
    margins = {name.removeprefix(prefix): value for name, value in options.items() if name.startswith(prefix)}
    return {name: value for name, value in options.items() if not name.startswith("dead-point-margin")}, margins


def run(bielle, entry, solved, start, output, options, longest):
    """What a run leaves of itself: outcome, cost, violation, iterations, seconds, and what these consist of."""
    summary = json.loads((solved / "summary.json").read_text(encoding="utf-8"))
    command = [bielle, "solve", entry["motion"], "--robot", summary["robot_file"], "--warm-start", start, "-o", output,
               "--threads", "1", "--max-iterations", ITERATIONS, "--quiet", "--no-check", "--no-report", *options]
    problem, margins = split_margins(summary["options"])
    for name, value in problem.items():
        command += ["--set", f"{name}={str(value).lower() if isinstance(value, bool) else value}"]
    if "--dead-point-margin" not in options:
        command += KEEP_MARGINS
        for name, value in margins.items():
            command += ["--dead-point-margin-of", f"{name}={value}"]
    status, seconds = run_or_end(command, longest)
    if status == -signal.SIGXCPU:
        return {**NONE, "end": "too late"}
    result = json.loads((output / "summary.json").read_text(encoding="utf-8"))
    if split_margins(result["options"])[0] != problem:
        return {**NONE, "end": "other stages"}  # the solver made them shorter: another problem
    return {"converged": result["converged"], "cost": result["cost"],
            "violation": result["constraints"]["largest_violation"], "iterations": result["iterations"],
            "seconds": round(seconds, 3), "end": result["termination"], "work": result["work"]}


def run_ipopt(ipopt, solved, start, output, options, longest):
    """The same of IPOPT, which looks at the time after an iteration, so that it tells where a late run was."""
    margin = 60  # s, for the last iteration
    command = [ipopt, solved, "--start", start, "-o", output, "--seconds", longest, "--max-iterations", ITERATIONS, "--quiet",
               *options]
    status, seconds = run_or_end(command, longest + margin)
    if status == -signal.SIGXCPU:
        return {**NONE, "end": "too late"}
    result = json.loads((output / "summary.json").read_text(encoding="utf-8"))
    late = seconds > longest
    return {"converged": result["converged"] and not late, "cost": result["cost"],
            "violation": max(result["constraints"]["largest_violation"], result["solver_gap"]),
            "iterations": result["iterations"], "seconds": round(seconds, 3),
            "end": "too late" if late else result["message"].split(":")[0]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("runs", type=pathlib.Path)
    parser.add_argument("--bielle", default="bielle", help="the command")
    parser.add_argument("--ipopt", default="bielle-ipopt", help="the command that solves by IPOPT")
    parser.add_argument("--seconds", type=int, default=LONGEST, help="of processor time that a run may take; 20 by default")
    parser.add_argument("--guesses", type=parse_guesses, default="0:100", metavar="FIRST:END",
                        help="numbers of the guesses of each problem, END excluded; 0:100 by default. Or `optimum`, that of the "
                        "archive, or `unperturbed`, where it began")
    parser.add_argument("--seed", type=int, default=0, help="of the guesses")
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=[*VARIANTS, *IPOPT], metavar="NAME",
                        help="some of: " + "; ".join([*VARIANTS, *IPOPT]) + "; all but those of IPOPT by default")
    parser.add_argument("--until", type=parse_time, metavar="HH:MM", help="begin no run after this time of today, UTC")
    arguments = parser.parse_args()
    lines = (arguments.directory / "index.jsonl").read_text(encoding="utf-8").splitlines()
    entries = [entry for entry in map(json.loads, lines) if entry["good"] and "problem" in entry["files"]]
    done = read_runs(arguments.runs) if arguments.runs.exists() else set()
    with open(arguments.runs, "a", encoding="utf-8") as file:
        for trial in arguments.guesses:
            for entry in entries:
                name = entry["name"]
                missing = [variant for variant in arguments.variants if (name, variant, arguments.seed, trial) not in done]
                if not missing:
                    continue
                solved = arguments.directory / "motions" / name / "motion"
                with tempfile.TemporaryDirectory() as directory:
                    start = pathlib.Path(directory) / "guess"
                    problem = Problem(arguments.directory / entry["files"]["problem"])
                    write_guess(start, solved, make_start(problem, trial, arguments.seed))
                    for i, variant in enumerate(missing):
                        if arguments.until and datetime.datetime.utcnow().time() >= arguments.until:
                            return 0
                        output = pathlib.Path(directory) / str(i)
                        outcome = (run_ipopt(arguments.ipopt, solved, start, output, IPOPT[variant], arguments.seconds)
                                   if variant in IPOPT else
                                   run(arguments.bielle, entry, solved, start, output, VARIANTS[variant], arguments.seconds))
                        line = {"problem": name, "variant": variant, "seed": arguments.seed, "guess": trial, **outcome,
                                "limit": arguments.seconds}
                        file.write(json.dumps(line) + "\n")
                        file.flush()
                        print(f"{trial!s:3} {name:40} {variant:32} {outcome['end']:20} {outcome['iterations'] or 0:4} "
                              f"{outcome['seconds'] or 0:8.2f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
