"""Residuals of costs and constraints: those of the library, and the base class of user-defined ones."""

from typing import Any, Dict, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _bielle
from ._bielle import LibraryResidual, Model, MotionPlan, Node, ProblemOptions, Request, _residuals

center_of_pressure = _residuals.center_of_pressure
com_position = _residuals.com_position
com_velocity = _residuals.com_velocity
contact_force = _residuals.contact_force
electrical_power = _residuals.electrical_power
frame_placement = _residuals.frame_placement
frame_rotation = _residuals.frame_rotation
frame_translation = _residuals.frame_translation
frame_velocity = _residuals.frame_velocity
joint_position = _residuals.joint_position
joint_velocity = _residuals.joint_velocity
motor_power = _residuals.motor_power
motor_voltage = _residuals.motor_voltage
sole_clearance = _residuals.sole_clearance
wrench_cone = _residuals.wrench_cone

Array = npt.NDArray[np.float64]


class Residual:
    """A user-defined residual r for costs and constraints.

    The solver calls `calc` and `calc_jacobian` from all its threads, one at a time. They must depend only on the node,
    so that results do not depend on the number of threads. Exceptions they raise leave the solve unchanged.

    size: number of rows n.
    depends_on: what r depends on, of "q", "v", "forces", "controls", "speeds", "time_scale".
    """

    size: int
    depends_on: Sequence[str] = ("q", "v")

    def calc(self, node: Node) -> npt.ArrayLike:
        """r (n,)."""
        raise NotImplementedError

    def calc_jacobian(self, node: Node) -> Dict[str, npt.ArrayLike]:
        """Derivatives of r by each entry of `depends_on`: by the tangent of q and by v (n, nv), by the forces (n, rows),
        by controls and speeds (n, nu), by the time scale (n,). Without this function they are central differences, which
        call `calc` twice per coordinate.
        """
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        """By class and attributes, so that stages compare and their pickled twins are equal."""
        if type(self) is not type(other):
            return NotImplemented
        mine, others = vars(self), vars(other)
        return mine.keys() == others.keys() and all(np.array_equal(value, others[key]) for key, value in mine.items())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{key}={value!r}' for key, value in vars(self).items())})"


class Recipe(NamedTuple):
    """What the library makes a plan or, with options, a motion from. Unpickled, it is the list of the residuals
    that the library puts there.
    """

    model: Model
    made_of: Union[Request, MotionPlan]
    options: Optional[ProblemOptions]

    def __reduce__(self) -> Tuple[Any, ...]:
        return make_residuals, tuple(self)


def make_residuals(model: Model, made_of: Union[Request, MotionPlan], options: Optional[ProblemOptions]) -> Any:
    """The residuals of a recipe."""
    return _bielle._make_residuals(model, made_of, options)  # type: ignore[attr-defined]


def make(function: str, arguments: Sequence[Any]) -> LibraryResidual:
    """A residual of the library by the name of its function: what pickle calls."""
    residual: LibraryResidual = getattr(_residuals, function)(*arguments)
    return residual
