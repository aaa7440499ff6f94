"""What Bielle's programs do, from Python: checks against Simbody, motions carried out, campaigns, designs."""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Optional, Union

from ._bielle import Result, Robot, load_robot

Setting = Union[bool, float, str, Path]
Directory = Union[str, Path]


def find_program(name: str) -> str:
    """A program of Bielle: that of the build which this package is part of, else the one on the PATH."""
    built = Path(__file__).absolute().parents[2] / "bin" / name
    found = str(built) if built.is_file() else shutil.which(name)
    if found is None:
        option = {"bielle-check": "VALIDATION", "bielle-simulate": "SIMULATION"}.get(name)
        remedy = f"build Bielle with -DBIELLE_BUILD_{option}=ON (it needs Simbody)" if option else "install Bielle"
        raise FileNotFoundError(f"{name} is not on the PATH; {remedy}")
    return found


def run_program(name: str, arguments: List[str], progress: bool = False) -> str:
    """What a program prints. Its progress goes where Python's errors go, if it is wanted.

    Raises RuntimeError with its message unless it ends with status 0 or 1. Ctrl-C ends it, too.
    """
    with subprocess.Popen([find_program(name), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:  # fmt: skip
        assert process.stdout is not None and process.stderr is not None
        errors = []
        for line in process.stderr:
            errors.append(line)
            if progress:
                sys.stderr.write(line)
        printed = process.stdout.read()
    if process.returncode not in (0, 1):
        raise RuntimeError("".join(errors).strip() or f"{name} broke off with status {process.returncode}")
    return printed


def check(result: Union[Directory, Result]) -> Dict[str, Any]:
    """Checks a Result, or the directory of one, against Simbody, as `bielle check --json` does.

    Returns its table as a dictionary; "pass" tells whether all of it holds.
    """
    if isinstance(result, Result):
        with tempfile.TemporaryDirectory() as directory:
            result.write(directory)
            return check(directory)
    table: Dict[str, Any] = json.loads(run_program("bielle-check", ["--json", str(result)]))
    return table


def make_arguments(options: Dict[str, Setting]) -> List[str]:
    """Options of a command from keywords: `mass_error=0.1` is `--mass-error 0.1`, True an option without a value."""
    arguments = []
    for name, value in options.items():
        if value is False:
            continue
        arguments.append("--" + name.replace("_", "-"))
        if value is not True:
            arguments.append(str(value))
    return arguments


def simulate(
    result: Union[Directory, Result], directory: Optional[Directory] = None, progress: bool = False, **options: Setting
) -> Dict[str, Any]:
    """Carries a motion out in physics with contact, as `bielle simulate` does. Returns its summary as a dictionary.

    result: a Result, or the directory of one; of a walk by command, the name of the motion
    directory: for the trajectory, the summary and the report; None: nothing is kept
    options: those of the command, e.g. world="mujoco", control="mpc", push="t=1,impulse=5,direction=90,duration=0.1"
    """
    if isinstance(result, Result):
        with tempfile.TemporaryDirectory() as plan:
            result.write(plan)
            return simulate(plan, directory, progress, **options)
    if directory is None:
        with tempfile.TemporaryDirectory() as output:
            return simulate(result, output, progress, **options, summary_only=True)
    run_program("bielle-simulate", [str(result), "-o", str(directory), *make_arguments(options)], progress)
    summary: Dict[str, Any] = json.loads((Path(directory) / "summary.json").read_text())
    return summary


def campaign(spec: Directory, directory: Directory, jobs: int = 2, progress: bool = True) -> Dict[str, Any]:
    """Carries motions out many times, as `bielle campaign` does. Returns its summary as a dictionary.

    What is in the directory already is not done again.
    """
    run_program("bielle", ["campaign", str(spec), "-o", str(directory), "--jobs", str(jobs)], progress)
    summary: Dict[str, Any] = json.loads((Path(directory) / "summary.json").read_text())
    return summary


def design(spec: Directory, directory: Directory, jobs: int = 2) -> Robot:
    """Chooses lengths of a robot by optimization over its motions, as `bielle design` does. Returns the best robot.

    design.md and figures are in the directory. What is in its logs already is not done again.
    """
    run_program("bielle", ["design", str(spec), "-o", str(directory), "--jobs", str(jobs)])
    return load_robot(str(Path(directory) / "best"))
