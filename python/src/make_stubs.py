"""make_stubs.py DIRECTORY: writes the stubs _bielle.pyi and motions.pyi from the module itself.

What pybind11 cannot know, because an argument takes or a function returns several types, stands in the tables below.
"""

import inspect
import re
import sys
from pathlib import Path

import bielle
from bielle import _bielle

# Arguments and results that are any object to C++, by name; "" is the result.
ARGUMENTS = {
    "contacts": "Contacts", "callback": "Optional[Callable[[Iteration], Optional[bool]]]", "gravity": "ArrayLike",
    "torque_loss": "Optional[float]", "count": "Optional[int]", "play": "Mapping[str, float]", "rod_frictions": "Sequence[RodFriction]", "other": "object", "warm_start": "Union[None, Trajectory, Solution, Record]",
    "objective": "Callable[[Array], Union[float, Tuple[float, ArrayLike]]]",
}  # fmt: skip
RESULTS = {
    "Model.forward_dynamics": "Dynamics", "Model.forward_dynamics_derivatives": "DynamicsDerivatives",
    "Model.inverse_dynamics_derivatives": "InverseDynamicsDerivatives", "Model.impact": "Impact",
    "Model.impact_derivatives": "ImpactDerivatives", "Model.mobility": "Dict[str, Any]", "Controller.counts": "Dict[str, int]",
    "Controller.reference": "Tuple[Array, Array]", "World.reset": "WorldState", "World.step": "WorldState",
    "World.books": "Books", "World.parameters": "WorldParameters", "Sensors.read": "Any", "World.integration": "Dict[str, Any]",
    "World.count": "Optional[int]", "generators": "Dict[str, Dict[str, Dict[str, Any]]]", "motions": "Dict[str, Dict[str, Any]]",
    "Motion.goals": "Tuple[Goal, ...]", "Motion.options": "Dict[str, Union[bool, int, float, str]]",
    "Model.shape_pairs": "List[Tuple[int, int, bool]]", "Model.joint_forces": "Tuple[JointForce, ...]", "Model.point_springs": "Tuple[PointSpring, ...]",
    "Motion.request": "Optional[Request]", "Robot.info": "Dict[str, Any]",
    "Parametrization.variables": "Tuple[DesignVariable, ...]", "Estimator.contacts": "Dict[str, bool]", "Motion.costs": "Dict[str, float]", "Solution.gains": "Tuple[Gains, ...]", "LibraryResidual.origin": "Optional[Tuple[str, Tuple[Any, ...]]]",
}  # fmt: skip
SAMPLES = {"Model": lambda: bielle.load_robot("bipetto").model}

HEADER = '''"""Written by make_stubs.py."""

from typing import Any, Callable, ClassVar, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .named import Books, Dynamics, DynamicsDerivatives, Impact, ImpactDerivatives, InverseDynamicsDerivatives, WorldParameters, WorldState
from .residuals import Residual

Array = npt.NDArray[np.float64]
Contacts = Union["ConstraintSet", Sequence[Union[str, "ContactTarget"]]]
'''


def widen(kind):
    """The type of an argument whose result has a type: what converts to it is welcome. What is called gets the type itself."""
    if kind.startswith("Callable"):
        return kind
    kind = re.sub(r"\bArray\b", "ArrayLike", kind)
    kind = re.sub(r"Tuple\[(.*), \.\.\.\]", r"Sequence[\1]", kind)
    return kind.replace("Dict[", "Mapping[")


def translate(kind, name, owner):
    """A type in the words of pybind11 as one of the stubs."""
    kind = kind.replace("bielle.", "").replace("numpy.ndarray[numpy.float64]", "Array").replace("numpy.ndarray", "Array")
    if kind in ("object", "handle", "function"):
        kind = RESULTS.get(owner, "Any") if name == "" else ARGUMENTS.get(name, "ArrayLike")
    elif kind == "dict":
        kind = RESULTS[owner]
    elif kind == "tuple":
        kind = RESULTS.get(owner, "Tuple[Any, ...]") if name == "" else "ArrayLike"
    kind = re.sub(r"\b(List|Dict|Optional)\[", r"\1[", kind)
    return widen(re.sub(r"^List\[(.*)\]$", r"Sequence[\1]", kind)) if name else kind


def split(arguments):
    """Arguments at the commas outside of brackets."""
    parts, depth, part = [], 0, ""
    for letter in arguments:
        depth += letter in "[(<"
        depth -= letter in "])>"
        if letter == "," and depth == 0:
            parts, part = parts + [part], ""
        else:
            part += letter
    return [p.strip() for p in parts + [part] if p.strip()]


def make_function(name, function, owner="", indent=""):
    """The stub of a function of the module, from the signature in its docstring."""
    match = re.match(r"\w+\((.*?)\) -> ([^\n]*)(?:\n|$)", function.__doc__, re.S)
    qualified = f"{owner}.{name}" if owner else name
    arguments = []
    for i, argument in enumerate(split(match[1])):
        if argument.startswith("*"):
            arguments.append(re.sub(r":.*", "", argument) + ": Any")
            continue
        key, kind = re.match(r"(\w+): ([^=]*?)(?: = .*)?$", argument, re.S).groups()
        default = " = ..." if " = " in argument else ""
        is_self = owner and i == 0 and key == "self"
        arguments.append("self" if is_self else f"{key}: {translate(kind.strip(), key, qualified)}{default}")
    result = translate(match[2], "", qualified)
    if name in ("__eq__", "__ne__"):
        arguments, result = ["self", "other: object"], "bool"
    is_static = owner and (not arguments or arguments[0] != "self")
    body = make_doc(function.__doc__.split("\n", 2)[-1], indent + "    ") if "\n" in function.__doc__ else []
    lines = [indent + "@staticmethod"] if is_static else []
    lines.append(f"{indent}def {name}({', '.join(arguments)}) -> {result}:" + ("" if body else " ..."))
    return lines + body + ([indent + "    ..."] if body else [])


def make_doc(text, indent):
    text = inspect.cleandoc(text or "")
    text += " " if text.endswith('"') else ""
    if not text:
        return []
    lines = text.splitlines()
    if len(lines) == 1:
        return [f'{indent}"""{lines[0]}"""']
    return [f'{indent}"""{lines[0]}'] + [(indent + line).rstrip() for line in lines[1:]] + [f'{indent}"""']


def name_type(value):
    """The type of an attribute, from a sample."""
    if isinstance(value, tuple):
        return f"Tuple[{name_type(value[0])}, ...]"
    return {"ndarray": "Array"}.get(type(value).__name__, type(value).__name__)


def make_property(name, attribute, owner, fields, sample):
    qualified = f"{owner}.{name}"
    if name in fields:
        kind = fields[name]
    elif qualified in RESULTS:
        kind = RESULTS[qualified]
    elif sample is not None:
        kind = name_type(getattr(sample, name))
    else:
        signature = (attribute.fget.__doc__ or "").strip().splitlines()
        kind = translate(signature[0].split(" -> ")[-1], "", qualified) if signature else "Any"
    lines = ["    @property", f"    def {name}(self) -> {kind}:"] + make_doc(attribute.__doc__, "        ") + ["        ..."]
    if attribute.fset:
        lines += [f"    @{name}.setter", f"    def {name}(self, value: {kind}) -> None: ..."]
    return lines


def make_enum(name, kind):
    lines = [f"class {name}:"] + [f"    {member}: ClassVar[{name}]" for member in kind.__members__]
    lines += ["    __members__: ClassVar[Dict[str, " + name + "]]", "    def __init__(self, value: int) -> None: ...",
              "    def __int__(self) -> int: ...", "    @property", "    def name(self) -> str: ...",
              "    @property", "    def value(self) -> int: ..."]  # fmt: skip
    return lines


HIDDEN = ("__init__", "__repr__", "__str__", "__getstate__", "__setstate__", "__reduce__", "__copy__", "__deepcopy__", "replace")


def make_class(name, kind):
    if hasattr(kind, "__members__"):
        return make_enum(name, kind)
    fields = getattr(kind, "_fields", {})
    sample = SAMPLES[name]() if name in SAMPLES else None
    doc = (kind.__doc__ or "").split("\n\nFields:")[0]
    lines = [f"class {name}:"] + make_doc(doc, "    ")
    arguments = "".join(f", {key}: {widen(value)} = ..." for key, value in fields.items())
    if fields:
        lines += [f"    def __init__(self{arguments}) -> None: ..."]
        lines += [f"    def replace(self, *{arguments}) -> {name}: ..."]
    elif "__init__" in vars(kind) and "__init__(" in (kind.__init__.__doc__ or ""):
        lines += make_function("__init__", kind.__init__, name, "    ")
    for key, attribute in vars(kind).items():
        if isinstance(attribute, property):
            lines += make_property(key, attribute, name, fields, sample)
        elif (not key.startswith("__") or key in ("__matmul__", "__add__", "__eq__")) and key != "_fields":
            function = attribute.__func__ if isinstance(attribute, staticmethod) else attribute
            if inspect.isfunction(function) and key not in HIDDEN:  # added in Python
                lines += [f"    def {key}(self) -> {inspect.signature(function).return_annotation.__name__}: ..."]
            elif key not in HIDDEN and callable(function):
                lines += make_function(key, function, name, "    ")
    return lines


def make_module():
    lines = HEADER.splitlines()
    for name, member in vars(_bielle).items():
        if name.startswith("_"):
            continue
        lines.append("")
        lines += make_class(name, member) if inspect.isclass(member) else make_function(name, member)
    lines += ["", "class _residuals:", '    """Residuals of the library."""']
    for name, member in vars(_bielle._residuals).items():
        if not name.startswith("_"):
            lines += make_function(name, member, "_residuals", "    ")
    return "\n".join(lines) + "\n"


COMMON = (
    "problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., "
    "callback: Optional[Callback] = ..."
)


def make_motions():
    names = ["FUNCTIONS", "motions", "solve_request", "solve_sequence", *bielle.FUNCTIONS]
    lines = ['"""Written by make_stubs.py."""', "", "from typing import Callable, Dict, Iterable, Mapping, Optional, Union", "",
             "from ._bielle import Iteration, ProblemOptions, Record, Request, Result, Robot, SolverOptions, motions", "",
             "Callback = Callable[[Iteration], Optional[bool]]", "WarmStart = Union[str, Record, Result]",
             "FUNCTIONS: Dict[str, Callable[..., Result]]", f"__all__ = {names!r}", "",
             f"def solve_request(robot: Union[str, Robot], request: Request, {COMMON}) -> Result: ...",
             "def solve_sequence(robot: Union[str, Robot], sequence: Iterable[str], options: Mapping[str, Union[bool, float, str]] = ..., "
             f"{COMMON}) -> Result: ..."]  # fmt: skip
    for name, motion in bielle.motions().items():
        function = getattr(bielle, "solve_" + name.replace("-", "_"))
        options = [f"{key}: {type(o['default']).__name__} = ..." for key, o in motion["options"].items()
                   if key not in motion["files"]]
        options += [f"{key}: str" for key in motion["files"]]
        lines += ["", f"def {function.__name__}(robot: Union[str, Robot], *, {', '.join(options)}, {COMMON}) -> Result:"]
        lines += make_doc(function.__doc__, "    ") + ["    ..."]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    target = Path(sys.argv[1])
    (target / "_bielle.pyi").write_text(make_module())
    (target / "motions.pyi").write_text(make_motions())
