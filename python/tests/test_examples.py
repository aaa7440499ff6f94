"""Examples and the page docs/python.md run, and mypy is content with all of it."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from bielle import programs

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "python" / "examples").glob("*.py"))


def run(*arguments, cwd=None):
    done = subprocess.run([sys.executable, *map(str, arguments)], cwd=cwd, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True)  # fmt: skip
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.mark.long
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example(example, tmp_path):
    assert run(example, cwd=tmp_path).strip()


def test_page(tmp_path):
    page = (ROOT / "docs" / "python.md").read_text()
    program = "\n".join(re.findall(r"```python\n(.*?)```", page, re.S))
    try:
        programs.find_program("bielle-check")
    except FileNotFoundError:
        program = re.sub(r"bielle.check\(.*", "", program)
    (tmp_path / "page.py").write_text(program)
    assert "requested 0.7, achieved 0.7014" in run("page.py", cwd=tmp_path)


@pytest.mark.long
def test_types():
    pytest.importorskip("mypy")
    import bielle

    run("-m", "mypy", "--strict", "--cache-dir", os.devnull, Path(bielle.__file__).parent, *EXAMPLES)


@pytest.mark.long
def test_types_are_checked(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "wrong.py").write_text("import bielle\nbielle.solve_squat('bipetto', deep=0.7)\nbielle.SE3().p.q\n")
    import bielle

    paths = os.environ | {"MYPYPATH": str(Path(bielle.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull, "wrong.py"], cwd=tmp_path,
                          env=paths, stdout=subprocess.PIPE, text=True)  # fmt: skip
    assert '"deep"' in done.stdout and '"q"' in done.stdout, done.stdout
