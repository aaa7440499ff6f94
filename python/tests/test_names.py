"""What is public says what it is: docstrings, and stubs for all of it."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import bielle
from bielle import _bielle, plot, programs, residuals

MOTIONS = importlib.import_module("bielle.motions")  # bielle.motions is the function


def list_members(kind):
    """Methods and attributes that people see, by name."""
    for name, member in vars(kind).items():
        if not name.startswith("_"):
            yield name, getattr(member, "__func__", member)


def get_text(function):
    """The docstring, without the signature that pybind11 puts in front."""
    text = inspect.getdoc(function) or ""
    return "\n".join(text.splitlines()[1:]).strip() if re.match(r"\w+\(.*\) -> ", text) else text


def list_undocumented():
    for name, member in vars(bielle).items():
        if name.startswith("_") or inspect.ismodule(member):
            continue
        if not inspect.isclass(member):
            if callable(member) and not get_text(member):
                yield name
            continue
        if not member.__doc__:
            yield name
        if hasattr(member, "__members__") or issubclass(member, tuple):
            continue
        for key, attribute in list_members(member):
            if not get_text(attribute):
                yield f"{name}.{key}"
    for module in (residuals, plot, programs):
        for name, member in vars(module).items():
            if not name.startswith("_") and callable(member) and getattr(member, "__module__", "").startswith("bielle"):
                if not get_text(member):
                    yield f"{module.__name__}.{name}"


def test_everything_has_a_docstring():
    assert list(list_undocumented()) == []
    assert get_text(_bielle.SE3.inverse) == "X_BA of X_AB."


SIZE = r"(?:\d|nq|nv|nu|rows|count|contacts|num bodies|num_closure_rows|N|n)\b"
SHAPE = re.compile(rf"\({SIZE}[^()]*,[^()]*\)|, (?:J|m|kg|N|s)\.")  # or a number and its unit


def test_functions_of_arrays_tell_their_shapes():
    """Derivatives have the shapes of what is differentiated, and fields of their own that tell them."""
    silent = []
    for kind in (bielle.Model, bielle.World, bielle.Controller, bielle.Estimator, bielle.ModelBuilder):
        for name, member in list_members(kind):
            signature = (member.__doc__ or "").splitlines()[0] if callable(member) else ""
            if re.search(r"numpy\.ndarray|\b(?:axis|gravity|[quva]): (?:object|handle)", signature):
                if not SHAPE.search(get_text(member)) and not name.endswith("_derivatives"):
                    silent.append(f"{kind.__name__}.{name}")
    assert silent == []
    assert SHAPE.search("Motor torques (nu,).") and not SHAPE.search("Motor torques (by motor).")


def list_stub_names(path):
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            yield node.name
            if isinstance(node, ast.ClassDef):
                for child in node.body:
                    if isinstance(child, ast.FunctionDef):
                        yield f"{node.name}.{child.name}"
                    elif isinstance(child, ast.AnnAssign):
                        yield f"{node.name}.{child.target.id}"


def test_stubs_have_every_name():
    directory = Path(bielle.__file__).parent
    stubs = {*list_stub_names(directory / "_bielle.pyi"), *list_stub_names(directory / "motions.pyi")}
    names = set()
    for module in (_bielle, MOTIONS):
        for name, member in vars(module).items():
            if name.startswith("_") or module is MOTIONS and name not in MOTIONS.__all__:
                continue
            if inspect.isclass(member) or callable(member):
                names.add(name)
            if inspect.isclass(member) and hasattr(member, "__members__"):
                names |= {f"{name}.{value}" for value in member.__members__}
            elif inspect.isclass(member):
                names |= {f"{name}.{key}" for key, _ in list_members(member)}
    assert len(names) > 500 and names - stubs == set()
