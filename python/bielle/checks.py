"""Checks of motions against Simbody, by the program bielle-check."""

import json
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Dict, Union

from ._bielle import Result


def find_program(name: str) -> str:
    """A program of Bielle: that of the build which this package is part of, else the one on the PATH."""
    built = Path(__file__).absolute().parents[2] / "bin" / name
    found = str(built) if built.is_file() else shutil.which(name)
    if found is None:
        remedy = "build Bielle with -DBIELLE_BUILD_VALIDATION=ON (it needs Simbody)"
        raise FileNotFoundError(f"{name} is not on the PATH; {remedy}")
    return found


def check(result: Union[str, Path, Result]) -> Dict[str, Any]:
    """Checks a Result, or the directory of one, against Simbody, as `bielle check --json` does.

    Returns its table as a dictionary; "pass" tells whether all of it holds.
    """
    if isinstance(result, Result):
        with tempfile.TemporaryDirectory() as directory:
            result.write(directory)
            return check(directory)
    run = subprocess.run([find_program("bielle-check"), "--json", str(result)], stdout=subprocess.PIPE,
                         stderr=subprocess.PIPE, text=True)  # fmt: skip
    if run.returncode not in (0, 1):
        raise RuntimeError(run.stderr.strip() or f"bielle-check broke off with status {run.returncode}")
    table: Dict[str, Any] = json.loads(run.stdout)
    return table
