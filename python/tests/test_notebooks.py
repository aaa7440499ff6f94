"""The notebooks run, and print what they were committed with."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("nbconvert")
pytest.importorskip("ipykernel")
NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]?\d+)?")


def list_texts(path):
    """What every cell prints or returns as text, and which kinds of output it has."""
    texts = []
    for cell in json.loads(path.read_text())["cells"]:
        for output in cell.get("outputs", []):
            assert output["output_type"] != "error", output
            text = output.get("text", output.get("data", {}).get("text/plain", []))
            texts.append((output["output_type"], sorted(output.get("data", {})), "".join(text)))
    return texts


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(notebook, tmp_path):
    run = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--log-level", "ERROR"]
    done = subprocess.run(run + ["--output-dir", tmp_path, notebook], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True)  # fmt: skip
    assert done.returncode == 0, done.stdout
    committed, again = list_texts(notebook), list_texts(tmp_path / notebook.name)
    assert committed and len(committed) == len(again)
    for (kind, data, text), (other_kind, other_data, other_text) in zip(committed, again):
        assert (kind, data) == (other_kind, other_data)
        assert NUMBER.sub("#", text) == NUMBER.sub("#", other_text)
        for number, other in zip(NUMBER.findall(text), NUMBER.findall(other_text)):
            assert float(number) == pytest.approx(float(other), rel=1e-3, abs=1e-3)
