"""`solve_squat`, `solve_walk` and the others: one function per motion, with its options as keywords."""

import inspect
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Union

from ._bielle import (
    Iteration,
    LimitOptions,
    Objective,
    ObjectiveOptions,
    ProblemOptions,
    Record,
    Request,
    Result,
    Robot,
    SolverOptions,
    load_robot,
    motions,
    read_result_record,
    solve,
)

Callback = Callable[[Iteration], Optional[bool]]
WarmStart = Union[str, Record, Result]

_COMMON = """
    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
"""


def solve_request(
    robot: Union[str, Robot],
    request: Request,
    problem: ProblemOptions = ProblemOptions(),
    solver: SolverOptions = SolverOptions(),
    warm_start: Optional[WarmStart] = None,
    callback: Optional[Callback] = None,
) -> Result:
    """Solves a Request as `bielle solve` does; the robot and the warm start may be given by name."""
    if isinstance(robot, str):
        robot = load_robot(robot)
    if isinstance(warm_start, str):
        warm_start = read_result_record(warm_start)
    elif isinstance(warm_start, Result):
        warm_start = warm_start.record
    return solve(robot, request, problem, solver, warm_start, callback)


def solve_sequence(
    robot: Union[str, Robot],
    sequence: Iterable[str],
    options: Mapping[str, Union[bool, float, str]] = {},
    problem: ProblemOptions = ProblemOptions(),
    solver: SolverOptions = SolverOptions(),
    warm_start: Optional[WarmStart] = None,
    callback: Optional[Callback] = None,
) -> Result:
    """Several motions one after the other, as one problem. Options are "walk.speed", "walk2.speed" and so on."""
    request = Request(sequence=tuple(sequence), options=dict(options))
    return solve_request(robot, request, problem, solver, warm_start, callback)


def _make_function(motion: str, described: Dict[str, Any]) -> Callable[..., Result]:
    """The function of a motion from its entry in the registry."""
    files: List[str] = list(described["files"])
    options: Dict[str, Any] = {key: o for key, o in described["options"].items() if key not in files}
    common = ["problem", "solver", "warm_start", "callback"]

    def function(robot: Union[str, Robot], **keywords: Any) -> Result:
        unknown = set(keywords) - set(options) - set(files) - set(common)
        if unknown:
            raise TypeError(f"{name} has no option '{sorted(unknown)[0]}'; it has: {', '.join(options)}")
        request = Request(
            motion=motion,
            options={key: value for key, value in keywords.items() if key in options},
            files={key: str(value) for key, value in keywords.items() if key in files},
        )
        return solve_request(robot, request, **{key: value for key, value in keywords.items() if key in common})

    name = "solve_" + motion.replace("-", "_")
    function.__name__ = function.__qualname__ = name
    function.__module__ = "bielle"
    lines = [f"    {key}: {o['help']} [{_get_kind(o)}], default {_format(o['default'])}" for key, o in options.items()]
    lines += [f"    {key}: path of a file" for key in files]
    function.__doc__ = described["help"] + ".\n" + _COMMON + "\n".join(lines) + "\n"
    keyword = inspect.Parameter.KEYWORD_ONLY
    function.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter("robot", inspect.Parameter.POSITIONAL_OR_KEYWORD)]
        + [inspect.Parameter(key, keyword, default=o["default"]) for key, o in options.items()]
        + [inspect.Parameter(key, keyword) for key in files]
        + [inspect.Parameter(key, keyword, default=None) for key in common]
    )
    return function


def _get_kind(option: Dict[str, Any]) -> str:
    """The unit of a number, or the values of another option."""
    return str(option["unit"]) or " or ".join(option["choices"]) or "bool"


def _format(value: Union[bool, int, float, str]) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


FUNCTIONS: Dict[str, Callable[..., Result]] = {}
for _motion, _described in motions().items():
    _function = _make_function(_motion, _described)
    FUNCTIONS[_function.__name__] = _function
globals().update(FUNCTIONS)
__all__ = ["FUNCTIONS", "motions", "solve_request", "solve_sequence", *FUNCTIONS]
