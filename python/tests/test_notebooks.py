"""The notebooks are kept without outputs; they run, and print what notebook_outputs.json says. Cells whose metadata have
`small`, a line that comes after theirs, run at that size: what is printed is then the beginning of what is printed
without it.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))
OUTPUTS = json.loads((Path(__file__).resolve().parent / "notebook_outputs.json").read_text())
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?")


def list_left(notebook):
    """What running a notebook leaves in it: outputs, counts and times of its cells."""
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    left = [cell["outputs"] or cell["execution_count"] or cell["metadata"].get("execution") for cell in cells]
    return [what for what in left if what]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_is_kept_without_outputs(notebook):
    left = list_left(json.loads(notebook.read_text()))
    assert not left, "clear its outputs: jupyter nbconvert --clear-output --inplace"
    assert not re.search(r"[\"'(;&= ]/(?:home|root|tmp|work|usr|build)/", notebook.read_text())  # paths of a machine


def list_texts(path):
    """What every cell prints or returns as text, and which kinds of output it has."""
    texts = []
    for cell in json.loads(path.read_text())["cells"]:
        for output in cell.get("outputs", []):
            assert output["output_type"] != "error", output
            text = output.get("text", output.get("data", {}).get("text/plain", []))
            texts.append((output["output_type"], sorted(output.get("data", {})), "".join(text)))
    return texts


def make_small(path, directory):
    """The notebook at the size of the tests, and whether that is smaller."""
    notebook = json.loads(path.read_text())
    small = [cell for cell in notebook["cells"] if "small" in cell["metadata"]]
    for cell in small:
        cell["source"] += ["\n", cell["metadata"]["small"]]
    (directory / path.name).write_text(json.dumps(notebook))
    return directory / path.name, bool(small)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(notebook, tmp_path):
    pytest.importorskip("nbconvert")
    pytest.importorskip("ipykernel")
    (tmp_path / "small").mkdir()
    small, is_smaller = make_small(notebook, tmp_path / "small")
    run = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--log-level", "ERROR"]
    done = subprocess.run(run + ["--output-dir", tmp_path, small], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True)  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert list_left(json.loads((tmp_path / notebook.name).read_text()))  # would the test above see one?
    expected, again = OUTPUTS[notebook.stem], list_texts(tmp_path / notebook.name)
    assert expected and len(expected) == len(again)
    for output, (kind, data, other_text) in zip(expected, again):
        assert (output["type"], output["data"]) == (kind, data)
        text = "".join(output["text"])
        if is_smaller and kind == "stream":
            lines = other_text.splitlines(keepends=True)
            assert lines and len(lines) <= len(text.splitlines())
            text = "".join(text.splitlines(keepends=True)[: len(lines)])
        assert NUMBER.sub("#", text) == NUMBER.sub("#", other_text)
        for number, other in zip(NUMBER.findall(text), NUMBER.findall(other_text)):
            assert float(number) == pytest.approx(float(other), rel=1e-3, abs=1e-3)
