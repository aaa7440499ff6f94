"""Bielle's programs from Python: checks against Simbody, executed motions, campaigns, designs."""

import json
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple, Union

from ._bielle import Result, Robot, load_robot

Setting = Union[bool, float, str, Path]
Directory = Union[str, Path]


def find_program(name: str) -> str:
    """A program of Bielle: from the build that contains this package, else from the PATH."""
    built = Path(__file__).absolute().parents[2] / "bin" / name
    found = str(built) if built.is_file() else shutil.which(name)
    if found is None:
        raise FileNotFoundError(f"{name} is not on the PATH; install Bielle")
    return found


def run_program(name: str, arguments: List[str], progress: bool = False, statuses: Tuple[int, ...] = (0,)) -> str:
    """The output of a program. With `progress`, its standard error is shown.

    Raises RuntimeError with its message unless it ends with one of the statuses. An exception in Python, such as Ctrl-C,
    interrupts the program, which then ends by itself.
    """
    errors = []
    # A session of its own, so that Ctrl-C in a terminal does not reach it twice; a file, as a pipe could fill up unread.
    with tempfile.TemporaryFile("w+") as printed, subprocess.Popen(
        [find_program(name), *arguments], stdout=printed, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        assert process.stderr is not None
        try:
            for line in process.stderr:
                errors.append(line)
                if progress:
                    sys.stderr.write(line)
        except BaseException:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
        process.wait()
        printed.seek(0)
        output = printed.read()
    if process.returncode not in statuses:
        raise RuntimeError("".join(errors).strip() or f"{name} failed with status {process.returncode}")
    return output


def check(result: Union[Directory, Result]) -> Dict[str, Any]:
    """Checks a Result, or the directory of one, against Simbody, as `bielle check --json` does.

    Returns its table as a dictionary; "pass" is true if every row passes.
    """
    if isinstance(result, Result):
        with tempfile.TemporaryDirectory() as directory:
            result.write(directory)
            return check(directory)
    table: Dict[str, Any] = json.loads(run_program("bielle", ["check", "--json", str(result)], statuses=(0, 1)))
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
    """Executes a motion in a physics simulation with contact, or lets a robot move freely, as `bielle simulate` does.
    Returns its summary as a dictionary; of a free motion in several worlds, the summaries by world.

    result: a Result, or the directory of one; for a commanded walk, the name of the motion; for a free motion, a robot
    directory: for the trajectory, the summary and the report; None: nothing is kept
    options: those of the command, e.g. world="mujoco", control="gains", push="t=1,impulse=5,direction=90,duration=0.1"
    """
    if isinstance(result, Result):
        with tempfile.TemporaryDirectory() as plan:
            result.write(plan)
            return simulate(plan, directory, progress, **options)
    if directory is None:
        with tempfile.TemporaryDirectory() as output:
            return simulate(result, output, progress, **options, summary_only=True)
    arguments = ["simulate", str(result), "-o", str(directory), *make_arguments(options)]
    run_program("bielle", arguments, progress, statuses=(0, 1, 3))  # 1: it fell; 3: not decided
    worlds = str(options.get("world", "")).split(",")
    if len(worlds) > 1:
        return {world: json.loads((Path(directory) / world / "summary.json").read_text()) for world in worlds}
    summary: Dict[str, Any] = json.loads((Path(directory) / "summary.json").read_text())
    return summary


def campaign(spec: Directory, directory: Directory, jobs: int = 2, progress: bool = True) -> Dict[str, Any]:
    """Executes motions many times, as `bielle campaign` does. Returns its summary as a dictionary.

    Finished runs in the directory are not repeated.
    """
    run_program("bielle", ["campaign", str(spec), "-o", str(directory), "--jobs", str(jobs)], progress)
    summary: Dict[str, Any] = json.loads((Path(directory) / "summary.json").read_text())
    return summary


def design(spec: Directory, directory: Directory, jobs: int = 2) -> Robot:
    """Chooses lengths of a robot by optimization over its motions, as `bielle design` does. Returns the best robot.

    design.md and figures are in the directory. Evaluations in its logs are not repeated.
    """
    run_program("bielle", ["design", str(spec), "-o", str(directory), "--jobs", str(jobs)])
    return load_robot(str(Path(directory) / "best"))
