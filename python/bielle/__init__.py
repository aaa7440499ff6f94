"""Bielle: motions of legged robots whose joints are driven through linkages.

>>> import bielle
>>> squat = bielle.solve_squat("bipetto", depth=0.7)
>>> squat.record.q.shape
(201, 61)
"""

from ._bielle import *
from . import named, residuals
from .errors import ModelError
from .motions import *
from .motions import FUNCTIONS as _FUNCTIONS
from .named import Dynamics, DynamicsDerivatives, Impact, ImpactDerivatives, InverseDynamicsDerivatives
from .residuals import Residual

globals().update(_FUNCTIONS)
