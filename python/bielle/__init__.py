"""Bielle: motions of legged robots whose joints are driven through linkages.

>>> import bielle
>>> squat = bielle.solve_squat("bipetto", depth=0.7)
>>> squat.record.q.shape
(201, 61)
"""

from ._bielle import *
from . import named as named, plot as plot, residuals as residuals, show as _show
from .programs import campaign as campaign, check as check, design as design, simulate as simulate
from .errors import InputError as InputError
from .motions import *
from .named import (
    Books as Books,
    Dynamics as Dynamics,
    DynamicsDerivatives as DynamicsDerivatives,
    Impact as Impact,
    ImpactDerivatives as ImpactDerivatives,
    InverseDynamicsDerivatives as InverseDynamicsDerivatives,
    Readings as Readings,
    WorldParameters as WorldParameters,
    WorldState as WorldState,
)
from .recorder import Recorder as Recorder
from .residuals import Residual as Residual
from .vector_env import StartStates as StartStates, VectorEnv as VectorEnv
