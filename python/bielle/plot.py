"""Figures with matplotlib, which this module alone needs. Every function draws into `axes`, or into new ones, and returns
them.

>>> bielle.plot.torques(squat, ["motor_knee_left"])
"""

import importlib
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from ._bielle import Model, Record, Result, Solution, Summary, sweep_ratio

Array = npt.NDArray[np.float64]
Recorded = Union[Result, Record]


def torques(result: Recorded, names: Optional[Sequence[str]] = None, axes: Any = None) -> Any:
    """Motor torques [N m] over time [s], one line each.

    names: of motors; default: of a Result the four with the largest torques, else all
    """
    record = _get_record(result)
    if names is None:
        names = list(result.peak_torques)[:4] if isinstance(result, Result) else record.u_names
    return _draw(_get_steps(record), record.u, record.u_names, names, "torque [N m]", axes)


def coordinates(result: Recorded, names: Sequence[str], axes: Any = None) -> Any:
    """Coordinates q [rad or m] over time [s], by name (Record.q_names)."""
    record = _get_record(result)
    return _draw(record.time, record.q, record.q_names, names, "q [rad or m]", axes)


def velocities(result: Recorded, names: Sequence[str], axes: Any = None) -> Any:
    """Velocities v [rad/s or m/s] over time [s], by name (Record.v_names)."""
    record = _get_record(result)
    return _draw(record.time, record.v, record.v_names, names, "v [rad/s or m/s]", axes)


def com(result: Recorded, axes: Any = None) -> Any:
    """The centre of mass [m] over time [s]: ahead, to the left, up."""
    record = _get_record(result)
    return _draw(record.time, record.com, ("x", "y", "z"), ("x", "y", "z"), "centre of mass [m]", axes)


def loads(result: Recorded, axes: Any = None) -> Any:
    """Normal forces of the contacts [N] over time [s]."""
    record = _get_record(result)
    names = record.contact_names
    normal = record.contact_wrenches.reshape(len(record.u), len(names), 6)[:, :, 2]
    return _draw(_get_steps(record), normal, names, names, "normal force [N]", axes)


def convergence(solved: Union[Result, Solution, Summary], axes: Any = None) -> Any:
    """What the solver drives to zero, over its iterations: gaps, violation of constraints, gradient."""
    summary = solved.solver if isinstance(solved, Result) else solved.summary if isinstance(solved, Solution) else solved
    axes = _make_axes(axes)
    iterations = [line.iteration for line in summary.log]
    for name in ("gap", "violation", "gradient"):
        values = np.array([getattr(line, name) for line in summary.log])
        axes.semilogy(iterations, np.where(values > 0, values, np.nan), ".-", label=name)  # zeros have no logarithm
    axes.set(xlabel="iteration")
    axes.legend(fontsize="small")
    return axes


def ratio(model: Model, joint: str, q: npt.ArrayLike, largest: float = 20.0, axes: Any = None) -> Any:
    """Speed of the first motor over that of a joint, along the motion of the joint [rad or m] from q (nq,).

    largest: ratios above it, near dead points, are left out
    """
    samples = [sample for sample in sweep_ratio(model, joint, q).samples if np.isfinite(sample.ratio.R).all()]
    ratios = np.array([sample.ratio.R[0, 0] for sample in samples])
    axes = _make_axes(axes)
    axes.plot([sample.joints[0] for sample in samples], np.where(np.abs(ratios) <= largest, ratios, np.nan), label=model.name)
    axes.set(xlabel=f"{joint} [rad or m]", ylabel="speed of motor over joint")
    axes.grid(True)
    return axes


def _get_record(result: Recorded) -> Record:
    return result.record if isinstance(result, Result) else result


def _get_steps(record: Record) -> Array:
    """When what is constant during a step begins (N,)."""
    return record.time[:-1]


def _make_axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    try:
        pyplot = importlib.import_module("matplotlib.pyplot")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError("bielle.plot needs matplotlib (Debian: python3-matplotlib)") from error
    return pyplot.subplots(figsize=(6, 3))[1]


def _draw(time: Array, rows: Array, known: Tuple[str, ...], names: Sequence[str], label: str, axes: Any) -> Any:
    """Columns of a table by name."""
    unknown = set(names) - set(known)
    if unknown:
        raise ValueError(f"'{sorted(unknown)[0]}' is not among {', '.join(known)}")
    axes = _make_axes(axes)
    for name in names:
        axes.plot(time, rows[:, list(known).index(name)], label=name)
    axes.set(xlabel="time [s]", ylabel=label)
    axes.legend(fontsize="small")
    axes.grid(True)
    return axes
