"""Results of several arrays, by name. With N states every array has an axis of N in front."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Dynamics(NamedTuple):
    """Accelerations and constraint forces. Where they could not be computed they are NaN."""

    a: Array  #: (nv,)
    forces: Array  #: (rows,), each on body 1 in frame 1 of its closure, N and N m
    status: Array  #: a NumericalStatus as a number, 0: ok; results are NaN unless OK or CONTRADICTORY


class DynamicsDerivatives(NamedTuple):
    """Derivatives of accelerations (nv, ..) and forces (rows, ..) by the tangent of q, by v and by u."""

    da_dq: Array
    da_dv: Array
    da_du: Array
    dforces_dq: Array
    dforces_dv: Array
    dforces_du: Array
    status: Array  #: as in Dynamics


class InverseDynamicsDerivatives(NamedTuple):
    """Derivatives of generalized forces (nv, nv) by the tangent of q, by v and by a (the mass matrix)."""

    dq: Array
    dv: Array
    da: Array


class Impact(NamedTuple):
    """A rigid impact."""

    v: Array  #: velocity after it (nv,)
    impulses: Array  #: (rows,), N s and N m s
    status: Array  #: as in Dynamics


class ImpactDerivatives(NamedTuple):
    """Derivatives of an impact by the tangent of q and by v."""

    dv_dq: Array
    dv_dv: Array
    dimpulses_dq: Array
    dimpulses_dv: Array
    status: Array  #: as in Dynamics


class WorldState(NamedTuple):
    """Of a world, or of several."""

    time: Array  #: since reset, s
    q: Array  #: (nq,)
    v: Array  #: (nv,)
    ok: Array  #: bool; False: the integration failed, and the state is the last finite one


class Readings(NamedTuple):
    """SensorReadings of many worlds; each has an axis of worlds in front."""

    time: Array  #: s
    motor_positions: Array  #: (nu,), rad or m
    motor_torques: Array  #: (nu,), those that acted last, N m or N
    angular_velocity: Array  #: of the IMU in its frame (3,), rad/s
    specific_force: Array  #: acceleration minus gravity in its frame (3,), m/s^2


class WorldParameters(NamedTuple):
    """By which worlds differ from their model; each has an axis of worlds in front."""

    mass_factors: Array  #: mass and inertia of bodies over those of the model (bodies,), the world first
    armatures: Array  #: of motors (nu,), kg m^2 or kg
    effort_limits: Array  #: (nu,), N m or N
    friction: Array  #: of the ground
    delays: Array  #: from step() until its torques act, s
    torque_constants: Array  #: of windings (nu,), N m/A; 0: none
    resistances: Array  #: (nu,), ohm
    voltages: Array  #: of the supply (nu,), V
    currents: Array  #: most of each motor (nu,), A
    rod_changes: Array  #: by how much the rods that closures end are longer (closures,), m


class Books(NamedTuple):
    """Energies of a world at present, and work and losses since its reset, J. Their changes balance:
    kinetic + potential + elastic = start + motor_work + push_work - contact_loss - stop_loss - other_loss."""

    kinetic: float
    potential: float  #: of gravity and of the springs of joints
    elastic: float  #: of the springs of contacts and stops
    motor_work: float
    push_work: float
    contact_loss: float
    stop_loss: float
    other_loss: float  #: dampers and friction of joints
