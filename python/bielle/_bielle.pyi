"""Written by make_stubs.py."""

from typing import Any, Callable, ClassVar, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .named import Dynamics, DynamicsDerivatives, Impact, ImpactDerivatives, InverseDynamicsDerivatives, WorldState
from .residuals import Residual

Array = npt.NDArray[np.float64]
Contacts = Union["ConstraintSet", Sequence[Union[str, "ContactTarget"]]]

class SE3:
    """A placement X_AB of a frame B in a frame A: p_A = R p_B + p. `X @ Y` chains placements.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, R: ArrayLike = ..., p: ArrayLike = ...) -> None: ...
    def replace(self, *, R: ArrayLike = ..., p: ArrayLike = ...) -> SE3: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def R(self) -> Array:
        """rotation (3, 3)"""
        ...
    @property
    def p(self) -> Array:
        """position (3,), m"""
        ...
    def __matmul__(self, arg0: SE3) -> SE3: ...
    def inverse(self) -> SE3:
        """X_BA of X_AB."""
        ...
    def act(self, point: ArrayLike) -> Array:
        """Coordinates in A (3,) of a point given in B (3,), m."""
        ...
    @property
    def matrix(self) -> Array:
        """homogeneous (4, 4)"""
        ...
    @property
    def action(self) -> Array:
        """Ad(X) (6, 6), which carries twists (linear part first) from B to A"""
        ...
    def log(self) -> Array:
        """Logarithm, a twist (6,), m and rad."""
        ...
    @staticmethod
    def exp(twist: ArrayLike) -> SE3:
        """Exponential of a twist (6,), linear part first, m and rad."""
        ...

class Inertia:
    """Mass, centre of mass and rotational inertia of a body in a frame.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, mass: float = ..., com: ArrayLike = ..., I_com: ArrayLike = ...) -> None: ...
    def replace(self, *, mass: float = ..., com: ArrayLike = ..., I_com: ArrayLike = ...) -> Inertia: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def mass(self) -> float:
        """kg"""
        ...
    @property
    def com(self) -> Array:
        """centre of mass (3,), m"""
        ...
    @property
    def I_com(self) -> Array:
        """about the centre of mass (3, 3), kg m^2"""
        ...
    def transformed(self, X_AB: SE3) -> Inertia:
        """The same inertia in frame A, this one being in B."""
        ...
    def __add__(self, arg0: Inertia) -> Inertia: ...
    @property
    def matrix(self) -> Array:
        """spatial inertia (6, 6)"""
        ...

class JointKind:
    FIXED: ClassVar[JointKind]
    REVOLUTE: ClassVar[JointKind]
    CONTINUOUS: ClassVar[JointKind]
    PRISMATIC: ClassVar[JointKind]
    SPHERICAL: ClassVar[JointKind]
    UNIVERSAL: ClassVar[JointKind]
    PLANAR: ClassVar[JointKind]
    FREE_FLYER: ClassVar[JointKind]
    __members__: ClassVar[Dict[str, JointKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class ClosureKind:
    WELD_6D: ClassVar[ClosureKind]
    BALL_3D: ClassVar[ClosureKind]
    HINGE_5D: ClassVar[ClosureKind]
    COUPLER: ClassVar[ClosureKind]
    __members__: ClassVar[Dict[str, ClosureKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class ContactKind:
    POINT_3D: ClassVar[ContactKind]
    SURFACE_6D: ClassVar[ContactKind]
    __members__: ClassVar[Dict[str, ContactKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class VisualShape:
    BOX: ClassVar[VisualShape]
    CYLINDER: ClassVar[VisualShape]
    SPHERE: ClassVar[VisualShape]
    MESH: ClassVar[VisualShape]
    __members__: ClassVar[Dict[str, VisualShape]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Joint:
    """A joint between a parent body and the body of the same index as the joint.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., kind: JointKind = ..., X_PJ: SE3 = ..., axis: ArrayLike = ..., axis2: ArrayLike = ..., parent: int = ..., idx_q: int = ..., nq: int = ..., idx_v: int = ..., nv: int = ..., position_importance: float = ..., velocity_importance: float = ...) -> None: ...
    def replace(self, *, name: str = ..., kind: JointKind = ..., X_PJ: SE3 = ..., axis: ArrayLike = ..., axis2: ArrayLike = ..., parent: int = ..., idx_q: int = ..., nq: int = ..., idx_v: int = ..., nv: int = ..., position_importance: float = ..., velocity_importance: float = ...) -> Joint: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """unique"""
        ...
    @property
    def kind(self) -> JointKind:
        """JointKind"""
        ...
    @property
    def X_PJ(self) -> SE3:
        """placement of the joint frame in the parent body"""
        ...
    @property
    def axis(self) -> Array:
        """unit axis (3,); normal of a planar joint; first axis of a universal joint"""
        ...
    @property
    def axis2(self) -> Array:
        """second axis of a universal joint (3,)"""
        ...
    @property
    def parent(self) -> int:
        """index of the parent body; filled by the builder, like the next four"""
        ...
    @property
    def idx_q(self) -> int:
        """first entry in q"""
        ...
    @property
    def nq(self) -> int:
        """entries in q"""
        ...
    @property
    def idx_v(self) -> int:
        """first entry in v"""
        ...
    @property
    def nv(self) -> int:
        """entries in v"""
        ...
    @property
    def position_importance(self) -> float:
        """in the costs of a posture, relative to other joints"""
        ...
    @property
    def velocity_importance(self) -> float:
        """likewise for its velocity"""
        ...

class Body:
    """A rigid body; body i > 0 is carried by joint i, body 0 is the world.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., inertia: Inertia = ...) -> None: ...
    def replace(self, *, name: str = ..., inertia: Inertia = ...) -> Body: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """that of its link"""
        ...
    @property
    def inertia(self) -> Inertia:
        """in the body frame"""
        ...

class Frame:
    """A named frame fixed in a body.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., body: int = ..., X_BF: SE3 = ...) -> None: ...
    def replace(self, *, name: str = ..., body: int = ..., X_BF: SE3 = ...) -> Frame: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """unique among links and frames"""
        ...
    @property
    def body(self) -> int:
        """index"""
        ...
    @property
    def X_BF(self) -> SE3:
        """placement in the body"""
        ...

class Shape:
    """A shape of a body: all points within a radius of a box fixed in it.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, body: int = ..., X_BS: SE3 = ..., half: ArrayLike = ..., radius: float = ..., fitted: bool = ...) -> None: ...
    def replace(self, *, body: int = ..., X_BS: SE3 = ..., half: ArrayLike = ..., radius: float = ..., fitted: bool = ...) -> Shape: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def body(self) -> int:
        """index; filled by the builder"""
        ...
    @property
    def X_BS(self) -> SE3:
        """placement in the body (for the builder: in the link)"""
        ...
    @property
    def half(self) -> Array:
        """half of the edges of the box (3,), m: zero of a sphere, (0, 0, l) of a capsule"""
        ...
    @property
    def radius(self) -> float:
        """m; zero of a box"""
        ...
    @property
    def fitted(self) -> bool:
        """fitted to a visual, because the robot's files give its body no shape"""
        ...

class Visual:
    """A shape drawn for a body.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, shape: VisualShape = ..., body: int = ..., X_BV: SE3 = ..., size: ArrayLike = ..., mesh: str = ..., rgba: ArrayLike = ..., bounds: Optional[Shape] = ...) -> None: ...
    def replace(self, *, shape: VisualShape = ..., body: int = ..., X_BV: SE3 = ..., size: ArrayLike = ..., mesh: str = ..., rgba: ArrayLike = ..., bounds: Optional[Shape] = ...) -> Visual: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def shape(self) -> VisualShape:
        """VisualShape"""
        ...
    @property
    def body(self) -> int:
        """index; filled by the builder"""
        ...
    @property
    def X_BV(self) -> SE3:
        """placement in the body (for the builder: in the link)"""
        ...
    @property
    def size(self) -> Array:
        """(3,) box: edges; cylinder: radius, length, 0; sphere: radius, 0, 0, m; mesh: scale"""
        ...
    @property
    def mesh(self) -> str:
        """file name as written in the URDF"""
        ...
    @property
    def rgba(self) -> Array:
        """colour (4,), 0 to 1"""
        ...
    @property
    def bounds(self) -> Optional[Shape]:
        """shape around a mesh that was read, in the frame of the visual, or None"""
        ...

class JointLimits:
    """Limits of a joint, per dof, or empty for none.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, lower: ArrayLike = ..., upper: ArrayLike = ..., velocity: ArrayLike = ...) -> None: ...
    def replace(self, *, lower: ArrayLike = ..., upper: ArrayLike = ..., velocity: ArrayLike = ...) -> JointLimits: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def lower(self) -> Array:
        """(nv,), rad or m"""
        ...
    @property
    def upper(self) -> Array:
        """(nv,), rad or m"""
        ...
    @property
    def velocity(self) -> Array:
        """(nv,), rad/s or m/s"""
        ...

class CouplerTerm:
    """One summand of a coupler: a coefficient times a coordinate.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, joint: int = ..., coefficient: float = ..., idx_q: int = ..., dof: int = ...) -> None: ...
    def replace(self, *, joint: int = ..., coefficient: float = ..., idx_q: int = ..., dof: int = ...) -> CouplerTerm: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def joint(self) -> int:
        """index"""
        ...
    @property
    def coefficient(self) -> float:
        """dimensionless, or m/rad, .. between units"""
        ...
    @property
    def idx_q(self) -> int:
        """index into q"""
        ...
    @property
    def dof(self) -> int:
        """index into v"""
        ...

class JointForce:
    """Spring, damper and friction on a joint of one coordinate.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, joint: int = ..., idx_q: int = ..., dof: int = ..., stiffness: float = ..., rest: float = ..., preload: float = ..., damping: float = ..., friction: float = ..., friction_speed: float = ...) -> None: ...
    def replace(self, *, joint: int = ..., idx_q: int = ..., dof: int = ..., stiffness: float = ..., rest: float = ..., preload: float = ..., damping: float = ..., friction: float = ..., friction_speed: float = ...) -> JointForce: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def joint(self) -> int:
        """index"""
        ...
    @property
    def idx_q(self) -> int:
        """index into q"""
        ...
    @property
    def dof(self) -> int:
        """index into v"""
        ...
    @property
    def stiffness(self) -> float:
        """N m/rad or N/m"""
        ...
    @property
    def rest(self) -> float:
        """rad or m"""
        ...
    @property
    def preload(self) -> float:
        """N m or N"""
        ...
    @property
    def damping(self) -> float:
        """N m s/rad or N s/m"""
        ...
    @property
    def friction(self) -> float:
        """N m or N"""
        ...
    @property
    def friction_speed(self) -> float:
        """rad/s or m/s"""
        ...

class PointSpring:
    """Spring and damper between two points of two bodies.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., body1: int = ..., body2: int = ..., point1: ArrayLike = ..., point2: ArrayLike = ..., stiffness: float = ..., rest: float = ..., preload: float = ..., damping: float = ..., dofs: Sequence[int] = ..., signs: Sequence[int] = ...) -> None: ...
    def replace(self, *, name: str = ..., body1: int = ..., body2: int = ..., point1: ArrayLike = ..., point2: ArrayLike = ..., stiffness: float = ..., rest: float = ..., preload: float = ..., damping: float = ..., dofs: Sequence[int] = ..., signs: Sequence[int] = ...) -> PointSpring: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """unique"""
        ...
    @property
    def body1(self) -> int:
        """index; filled by the builder, like the next"""
        ...
    @property
    def body2(self) -> int:
        """index"""
        ...
    @property
    def point1(self) -> Array:
        """(3,) in body 1 (for the builder: in frame 1), m"""
        ...
    @property
    def point2(self) -> Array:
        """(3,) in body 2, m"""
        ...
    @property
    def stiffness(self) -> float:
        """N/m"""
        ...
    @property
    def rest(self) -> float:
        """length, m"""
        ...
    @property
    def preload(self) -> float:
        """tension at the rest length, N"""
        ...
    @property
    def damping(self) -> float:
        """N s/m"""
        ...
    @property
    def dofs(self) -> Tuple[int, ...]:
        """that move one point but not the other, increasing"""
        ...
    @property
    def signs(self) -> Tuple[int, ...]:
        """+1 where the dof moves point 1, -1 for point 2"""
        ...

class Closure:
    """Ties frame 1 on body 1 to frame 2 on body 2, or couples coordinates.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., kind: ClosureKind = ..., body1: int = ..., body2: int = ..., X_B1: SE3 = ..., X_B2: SE3 = ..., axis: ArrayLike = ..., kp: float = ..., kd: float = ..., terms: Sequence[CouplerTerm] = ..., offset: float = ..., dofs: Sequence[int] = ..., signs: Sequence[int] = ...) -> None: ...
    def replace(self, *, name: str = ..., kind: ClosureKind = ..., body1: int = ..., body2: int = ..., X_B1: SE3 = ..., X_B2: SE3 = ..., axis: ArrayLike = ..., kp: float = ..., kd: float = ..., terms: Sequence[CouplerTerm] = ..., offset: float = ..., dofs: Sequence[int] = ..., signs: Sequence[int] = ...) -> Closure: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """unique"""
        ...
    @property
    def kind(self) -> ClosureKind:
        """ClosureKind"""
        ...
    @property
    def body1(self) -> int:
        """index"""
        ...
    @property
    def body2(self) -> int:
        """index"""
        ...
    @property
    def X_B1(self) -> SE3:
        """placement of frame 1 in body 1"""
        ...
    @property
    def X_B2(self) -> SE3:
        """placement of frame 2 in body 2"""
        ...
    @property
    def axis(self) -> Array:
        """free axis of a hinge in both frames (3,)"""
        ...
    @property
    def kp(self) -> float:
        """stabilisation, 1/s^2"""
        ...
    @property
    def kd(self) -> float:
        """1/s"""
        ...
    @property
    def terms(self) -> Tuple[CouplerTerm, ...]:
        """terms of a coupler"""
        ...
    @property
    def offset(self) -> float:
        """offset of a coupler"""
        ...
    @property
    def dofs(self) -> Tuple[int, ...]:
        """that move one frame but not the other, increasing"""
        ...
    @property
    def signs(self) -> Tuple[int, ...]:
        """+1 where the dof moves frame 1, -1 for frame 2"""
        ...

class LoopCluster:
    """Closures that share dofs, directly or through other closures.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, closures: Sequence[int] = ..., dofs: Sequence[int] = ..., rows: int = ...) -> None: ...
    def replace(self, *, closures: Sequence[int] = ..., dofs: Sequence[int] = ..., rows: int = ...) -> LoopCluster: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def closures(self) -> Tuple[int, ...]:
        """indices"""
        ...
    @property
    def dofs(self) -> Tuple[int, ...]:
        """union of their dofs, increasing"""
        ...
    @property
    def rows(self) -> int:
        """sum of their scalar constraints"""
        ...

class MotorDrive:
    """Winding and gear of a motor; without torque_constant the winding is not known.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, type: str = ..., ratio: float = ..., rotor_inertia: float = ..., torque_constant: float = ..., resistance: float = ..., voltage: float = ..., current: float = ..., continuous_current: float = ..., efficiency: float = ..., back_efficiency: float = ..., mass: float = ...) -> None: ...
    def replace(self, *, type: str = ..., ratio: float = ..., rotor_inertia: float = ..., torque_constant: float = ..., resistance: float = ..., voltage: float = ..., current: float = ..., continuous_current: float = ..., efficiency: float = ..., back_efficiency: float = ..., mass: float = ...) -> MotorDrive: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def type(self) -> str:
        """name in a catalogue, or empty"""
        ...
    @property
    def ratio(self) -> float:
        """turns of the rotor per turn of the joint; rad/m of a prismatic joint"""
        ...
    @property
    def rotor_inertia(self) -> float:
        """kg m^2"""
        ...
    @property
    def torque_constant(self) -> float:
        """N m/A"""
        ...
    @property
    def resistance(self) -> float:
        """between two terminals, ohm"""
        ...
    @property
    def voltage(self) -> float:
        """voltage of the supply, V"""
        ...
    @property
    def current(self) -> float:
        """most, A"""
        ...
    @property
    def continuous_current(self) -> float:
        """current that the winding can sustain indefinitely, A"""
        ...
    @property
    def efficiency(self) -> float:
        """efficiency of the gear while the motor drives"""
        ...
    @property
    def back_efficiency(self) -> float:
        """efficiency of the gear while the joint drives the motor"""
        ...
    @property
    def mass(self) -> float:
        """kg; 0: not known"""
        ...

class Motor:
    """An actuator on one dof.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., joint: int = ..., dof: int = ..., armature: float = ..., effort_limit: float = ..., velocity_limit: float = ..., torque_loss: Optional[float] = ..., continuous_effort: float = ..., drive: MotorDrive = ...) -> None: ...
    def replace(self, *, name: str = ..., joint: int = ..., dof: int = ..., armature: float = ..., effort_limit: float = ..., velocity_limit: float = ..., torque_loss: Optional[float] = ..., continuous_effort: float = ..., drive: MotorDrive = ...) -> Motor: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """that of its joint"""
        ...
    @property
    def joint(self) -> int:
        """index"""
        ...
    @property
    def dof(self) -> int:
        """index into v"""
        ...
    @property
    def armature(self) -> float:
        """rotor inertia seen at the joint, kg m^2 (kg for a prismatic joint)"""
        ...
    @property
    def effort_limit(self) -> float:
        """N m or N"""
        ...
    @property
    def velocity_limit(self) -> float:
        """rad/s or m/s"""
        ...
    @property
    def torque_loss(self) -> Optional[float]:
        """heat per torque squared, W/(N m)^2 or W/N^2; None: not known"""
        ...
    @property
    def continuous_effort(self) -> float:
        """root mean square that it can sustain indefinitely, N m or N"""
        ...
    @property
    def drive(self) -> MotorDrive:
        """winding and gear"""
        ...

class ContactFrame:
    """A frame of a body that may touch the ground, z along its outward normal.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., body: int = ..., X_BF: SE3 = ..., kind: ContactKind = ..., half_length: float = ..., half_width: float = ...) -> None: ...
    def replace(self, *, name: str = ..., body: int = ..., X_BF: SE3 = ..., kind: ContactKind = ..., half_length: float = ..., half_width: float = ...) -> ContactFrame: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """unique"""
        ...
    @property
    def body(self) -> int:
        """index"""
        ...
    @property
    def X_BF(self) -> SE3:
        """placement in the body"""
        ...
    @property
    def kind(self) -> ContactKind:
        """ContactKind"""
        ...
    @property
    def half_length(self) -> float:
        """half the length of the sole, along x, m"""
        ...
    @property
    def half_width(self) -> float:
        """half the width of the sole, along y, m"""
        ...

class Reference:
    """Targets of a reference configuration.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., joints: Mapping[str, ArrayLike] = ..., height_frame: str = ..., height: float = ..., feet: Mapping[str, ArrayLike] = ...) -> None: ...
    def replace(self, *, name: str = ..., joints: Mapping[str, ArrayLike] = ..., height_frame: str = ..., height: float = ..., feet: Mapping[str, ArrayLike] = ...) -> Reference: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """unique"""
        ...
    @property
    def joints(self) -> Dict[str, Array]:
        """q of joints, by name"""
        ...
    @property
    def height_frame(self) -> str:
        """frame whose height is given; empty: only joints are given"""
        ...
    @property
    def height(self) -> float:
        """over the soles, m"""
        ...
    @property
    def feet(self) -> Dict[str, Array]:
        """positions of the origins of contact frames (3,), by name, m"""
        ...

class ContactTarget:
    """A foot on the ground at a given place.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, contact: int = ..., X_WT: SE3 = ..., kp: float = ..., kd: float = ...) -> None: ...
    def replace(self, *, contact: int = ..., X_WT: SE3 = ..., kp: float = ..., kd: float = ...) -> ContactTarget: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def contact(self) -> int:
        """index into Model.contacts"""
        ...
    @property
    def X_WT(self) -> SE3:
        """where the contact frame belongs; matters only with kp > 0"""
        ...
    @property
    def kp(self) -> float:
        """1/s^2"""
        ...
    @property
    def kd(self) -> float:
        """1/s"""
        ...

class ConstraintSet:
    """The closures in force: those of the model, then contacts.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, closures: Sequence[Closure] = ..., contacts: Sequence[int] = ..., offsets: Sequence[int] = ..., rows: int = ..., num_loops: int = ...) -> None: ...
    def replace(self, *, closures: Sequence[Closure] = ..., contacts: Sequence[int] = ..., offsets: Sequence[int] = ..., rows: int = ..., num_loops: int = ...) -> ConstraintSet: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def closures(self) -> Tuple[Closure, ...]:
        """closures of the model, then contacts as closures to the world"""
        ...
    @property
    def contacts(self) -> Tuple[int, ...]:
        """indices into Model.contacts, in their order"""
        ...
    @property
    def offsets(self) -> Tuple[int, ...]:
        """first row of each closure"""
        ...
    @property
    def rows(self) -> int:
        """scalar constraints"""
        ...
    @property
    def num_loops(self) -> int:
        """the first closures, which are the model's"""
        ...

class ModelParts:
    """The parts of a model.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., gravity: ArrayLike = ..., bodies: Sequence[Body] = ..., joints: Sequence[Joint] = ..., frames: Sequence[Frame] = ..., closures: Sequence[Closure] = ..., motors: Sequence[Motor] = ..., joint_forces: Sequence[JointForce] = ..., point_springs: Sequence[PointSpring] = ..., contacts: Sequence[ContactFrame] = ..., references: Sequence[Reference] = ..., visuals: Sequence[Visual] = ..., shapes: Sequence[Shape] = ..., serial_joints: Sequence[int] = ..., lower_limits: ArrayLike = ..., upper_limits: ArrayLike = ..., velocity_limits: ArrayLike = ..., armature: ArrayLike = ...) -> None: ...
    def replace(self, *, name: str = ..., gravity: ArrayLike = ..., bodies: Sequence[Body] = ..., joints: Sequence[Joint] = ..., frames: Sequence[Frame] = ..., closures: Sequence[Closure] = ..., motors: Sequence[Motor] = ..., joint_forces: Sequence[JointForce] = ..., point_springs: Sequence[PointSpring] = ..., contacts: Sequence[ContactFrame] = ..., references: Sequence[Reference] = ..., visuals: Sequence[Visual] = ..., shapes: Sequence[Shape] = ..., serial_joints: Sequence[int] = ..., lower_limits: ArrayLike = ..., upper_limits: ArrayLike = ..., velocity_limits: ArrayLike = ..., armature: ArrayLike = ...) -> ModelParts: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """name of the robot"""
        ...
    @property
    def gravity(self) -> Array:
        """(3,), m/s^2"""
        ...
    @property
    def bodies(self) -> Tuple[Body, ...]:
        """the world first"""
        ...
    @property
    def joints(self) -> Tuple[Joint, ...]:
        """a placeholder for the world first"""
        ...
    @property
    def frames(self) -> Tuple[Frame, ...]:
        """links among them"""
        ...
    @property
    def closures(self) -> Tuple[Closure, ...]:
        """closures of the loops"""
        ...
    @property
    def motors(self) -> Tuple[Motor, ...]:
        """in the order of u"""
        ...
    @property
    def joint_forces(self) -> Tuple[JointForce, ...]:
        """springs, dampers and friction"""
        ...
    @property
    def point_springs(self) -> Tuple[PointSpring, ...]:
        """springs and dampers between points"""
        ...
    @property
    def contacts(self) -> Tuple[ContactFrame, ...]:
        """frames that may touch the ground"""
        ...
    @property
    def references(self) -> Tuple[Reference, ...]:
        """postures by name"""
        ...
    @property
    def visuals(self) -> Tuple[Visual, ...]:
        """what is drawn"""
        ...
    @property
    def shapes(self) -> Tuple[Shape, ...]:
        """shapes of the bodies, for distances"""
        ...
    @property
    def serial_joints(self) -> Tuple[int, ...]:
        """indices of the joints of the equivalent serial chain"""
        ...
    @property
    def lower_limits(self) -> Array:
        """(nv,)"""
        ...
    @property
    def upper_limits(self) -> Array:
        """(nv,)"""
        ...
    @property
    def velocity_limits(self) -> Array:
        """(nv,)"""
        ...
    @property
    def armature(self) -> Array:
        """(nv,)"""
        ...

class Model:
    """A robot: a spanning tree of bodies and joints, closed by closures. Immutable.

    Functions of states take one state, e.g. q (nq,), or N of them, (N, nq), on all cores; results then have an axis of N in front. SI units; twists and wrenches have their linear part first.
    """
    @property
    def name(self) -> str:
        """name of the robot"""
        ...
    @property
    def nq(self) -> int:
        """size of a configuration q"""
        ...
    @property
    def nv(self) -> int:
        """size of a velocity v, and of tangent vectors"""
        ...
    @property
    def nu(self) -> int:
        """number of motors"""
        ...
    @property
    def num_closure_rows(self) -> int:
        """scalar constraints of all closures"""
        ...
    @property
    def mass(self) -> float:
        """kg, without the world"""
        ...
    @property
    def gravity(self) -> Array:
        """(3,), m/s^2"""
        ...
    @property
    def has_free_flyer(self) -> bool:
        """whether the first joint is one"""
        ...
    @property
    def bodies(self) -> Tuple[Body, ...]:
        """the world first"""
        ...
    @property
    def joints(self) -> Tuple[Joint, ...]:
        """a placeholder for the world first"""
        ...
    @property
    def frames(self) -> Tuple[Frame, ...]:
        """links among them"""
        ...
    @property
    def closures(self) -> Tuple[Closure, ...]:
        """closures of the loops"""
        ...
    @property
    def clusters(self) -> Tuple[LoopCluster, ...]:
        """closures that share dofs"""
        ...
    @property
    def motors(self) -> Tuple[Motor, ...]:
        """in the order of u"""
        ...
    @property
    def joint_forces(self) -> Tuple[JointForce, ...]:
        """springs, dampers and friction on joints"""
        ...
    @property
    def point_springs(self) -> Tuple[PointSpring, ...]:
        """springs and dampers between points"""
        ...
    @property
    def contacts(self) -> Tuple[ContactFrame, ...]:
        """frames that may touch the ground"""
        ...
    @property
    def references(self) -> Tuple[Reference, ...]:
        """postures by name"""
        ...
    @property
    def visuals(self) -> Tuple[Visual, ...]:
        """what is drawn"""
        ...
    @property
    def shapes(self) -> Tuple[Shape, ...]:
        """shapes of the bodies for distances, as boxes with rounded edges"""
        ...
    @property
    def serial_joints(self) -> Tuple[int, ...]:
        """indices of the joints of the equivalent serial chain"""
        ...
    @property
    def lower_limits(self) -> Array:
        """(nv,), -inf if there is none"""
        ...
    @property
    def upper_limits(self) -> Array:
        """(nv,)"""
        ...
    @property
    def velocity_limits(self) -> Array:
        """(nv,), rad/s or m/s"""
        ...
    @property
    def armature(self) -> Array:
        """(nv,), added to the diagonal of the mass matrix"""
        ...
    @property
    def q_names(self) -> Tuple[str, ...]:
        """names of the entries of q"""
        ...
    @property
    def v_names(self) -> Tuple[str, ...]:
        """names of the entries of v"""
        ...
    @property
    def u_names(self) -> Tuple[str, ...]:
        """names of the motors"""
        ...
    def neutral(self) -> Array:
        """Neutral configuration (nq,)."""
        ...
    def standing(self) -> Array:
        """The starting posture of motions (nq,): the reference `half_sitting`, or the only one.

        Raises ModelError when there is none, or it cannot be closed.
        """
        ...
    def integrate(self, q: ArrayLike, dq: ArrayLike) -> Array:
        """q (+) dq (nq,), for q (nq,) and a tangent vector dq (nv,); or for many, (N, ..)."""
        ...
    def difference(self, q0: ArrayLike, q1: ArrayLike) -> Array:
        """The dq (nv,) with q0 (+) dq = q1; or many, (N, nv)."""
        ...
    def constraints(self, contacts: Contacts = ...) -> ConstraintSet:
        """ConstraintSet of all closures and the given contacts, by name or as ContactTargets."""
        ...
    def close(self, q: ArrayLike) -> Array:
        """The closed configuration nearest to q (nq,).

        Raises ModelError when the loops do not close.
        """
        ...
    def posture(self, name: str = ...) -> Array:
        """A reference by name, closed (nq,); without a name some closed configuration.

        Raises ModelError when there is no such reference, or the loops do not close.
        """
        ...
    def mobility(self, q: ArrayLike) -> Dict[str, Any]:
        """Rows and rank of the closures at q (nq,), and the mobility nv - rank."""
        ...
    def __eq__(self, other: object) -> bool: ...
    def mass_matrix(self, q: ArrayLike) -> Array:
        """Mass matrix (nv, nv), armature included."""
        ...
    def bias(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Coriolis, centrifugal and gravity terms b(q, v) (nv,), N m or N."""
        ...
    def com(self, q: ArrayLike) -> Array:
        """Centre of mass in the world (3,), m."""
        ...
    def com_velocity(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Velocity of the centre of mass (3,), m/s."""
        ...
    def com_jacobian(self, q: ArrayLike) -> Array:
        """Derivative of the centre of mass by the tangent of q (3, nv)."""
        ...
    def centroidal_momentum(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Momentum about the centre of mass in world axes (6,), kg m/s and kg m^2/s."""
        ...
    def kinetic_energy(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Kinetic energy of bodies and rotors, J."""
        ...
    def potential_energy(self, q: ArrayLike) -> Array:
        """Potential energy of gravity, zero for a centre of mass at the origin, J."""
        ...
    def closure_residual(self, q: ArrayLike) -> Array:
        """Closing errors of all closures (num_closure_rows,), m and rad; zero if and only if closed."""
        ...
    def closure_jacobian(self, q: ArrayLike) -> Array:
        """Jacobian of the closures' velocities (num_closure_rows, nv), in their frames 1."""
        ...
    def project_velocity(self, q: ArrayLike, v: ArrayLike, contacts: Contacts = ...) -> Array:
        """The velocity (nv,) nearest to v that keeps closures and contacts closed."""
        ...
    def placement(self, q: ArrayLike, frame: str) -> Array:
        """Homogeneous placement (4, 4) of a link, frame or contact in the world."""
        ...
    def placements(self, q: ArrayLike) -> Array:
        """Homogeneous placements of all bodies in the world (num bodies, 4, 4), the world first."""
        ...
    def frame_velocity(self, q: ArrayLike, v: ArrayLike, frame: str) -> Array:
        """Twist of a frame in its own coordinates (6,), m/s and rad/s."""
        ...
    def frame_jacobian(self, q: ArrayLike, frame: str) -> Array:
        """Jacobian of a frame's twist in its own coordinates (6, nv)."""
        ...
    @property
    def shape_pairs(self) -> List[Tuple[int, int, bool]]:
        """Pairs of shapes on bodies that are not neighbours: two indices into `shapes`, and whether they are of two legs."""
        ...
    def shape_distance(self, q: ArrayLike, a: int, b: int) -> Array:
        """Distance of two shapes by their indices, m. Negative where they overlap."""
        ...
    def shape_distance_gradient(self, q: ArrayLike, a: int, b: int) -> Array:
        """Derivative of the distance by the tangent of q (nv,), m/rad or 1."""
        ...
    def forward_dynamics(self, q: ArrayLike, v: ArrayLike, u: ArrayLike, contacts: Contacts = ...) -> Dynamics:
        """Accelerations a (nv,) and forces of closures and contacts (rows,) under motor torques u (nu,).

        contacts: names, ContactTargets, or a ConstraintSet. Forces are those on body 1, in frame 1 of each closure.
        """
        ...
    def forward_dynamics_derivatives(self, q: ArrayLike, v: ArrayLike, u: ArrayLike, contacts: Contacts = ...) -> DynamicsDerivatives:
        """Derivatives of forward_dynamics by the tangent of q, by v and by u: of a (nv, ..) and of the forces (rows, ..)."""
        ...
    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> Array:
        """Generalized forces M a + b of the tree (nv,), closures and contacts apart, N m or N."""
        ...
    def inverse_dynamics_derivatives(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> InverseDynamicsDerivatives:
        """Derivatives of inverse_dynamics by the tangent of q, by v and by a (nv, nv)."""
        ...
    def static_torques(self, q: ArrayLike, contacts: Contacts = ...) -> Array:
        """The smallest motor torques that hold the robot still under closures and contacts (nu,), as far as possible."""
        ...
    def impact(self, q: ArrayLike, v: ArrayLike, contacts: Contacts) -> Impact:
        """Rigid impact: the velocity after it (nv,) and the impulses (rows,), N s and N m s."""
        ...
    def impact_derivatives(self, q: ArrayLike, v: ArrayLike, contacts: Contacts) -> ImpactDerivatives:
        """Derivatives of impact by the tangent of q and by v."""
        ...

class ModelBuilder:
    """Collects bodies, joints, closures, motors and frames, then validates them and makes the model.

    Bodies go by the name of their link; "world" is the ground. Elements must be declared before they are referred to. Errors are ModelErrors that name the element and the remedy.
    """
    def __init__(self, name: str) -> None: ...
    def add_link(self, link: str, parent_link: str, joint: Joint, inertia: Inertia, limits: JointLimits = ...) -> None:
        """A link carried by a Joint, whose X_PJ places it in the parent link; its Inertia in the frame of the link."""
        ...
    def add_inertia(self, link: str, inertia: Inertia) -> None:
        """More inertia on a link, in the frame of that link."""
        ...
    def add_frame(self, name: str, link: str, X_LF: SE3) -> None:
        """A named frame on a link; X_LF is its placement there (SE3, m)."""
        ...
    def add_closure(self, name: str, kind: ClosureKind, frame1: str, frame2: str, axis: ArrayLike = ..., kp: float = ..., kd: float = ...) -> None:
        """Closes a loop: two frames coincide as specified by the ClosureKind.

        axis: (3,), of a hinge, in frame 1; kp [1/s^2], kd [1/s]: Baumgarte stabilization.
        """
        ...
    def add_coupler(self, name: str, coefficients: Mapping[str, float], offset: float = ..., kp: float = ..., kd: float = ...) -> None:
        """A belt or a gear: the sum of coefficients times coordinates is the offset, rad or m.

        coefficients: by name of joint, at least two; kp [1/s^2], kd [1/s]: Baumgarte stabilization.
        """
        ...
    def add_joint_force(self, joint: str, force: JointForce) -> None:
        """Spring, damper and friction (JointForce) on a joint of one coordinate."""
        ...
    def add_point_spring(self, frame1: str, frame2: str, spring: PointSpring) -> None:
        """Spring and damper (PointSpring) between a point of frame 1 and one of frame 2, links or frames."""
        ...
    def add_motor(self, joint: str, armature: float = ..., effort_limit: float = ..., velocity_limit: float = ..., torque_loss: Optional[float] = ...) -> None:
        """A motor on a joint of one dof; they are numbered in the order of their calls.

        armature: kg m^2 or kg; effort_limit: N m or N; velocity_limit: rad/s or m/s; torque_loss: W/(N m)^2, or None if it is not known.
        """
        ...
    def add_contact(self, name: str, frame: str, kind: ContactKind, half_length: float = ..., half_width: float = ...) -> None:
        """A frame that may touch the ground; half_length, half_width of a sole along its x and y, m."""
        ...
    def add_reference(self, reference: Reference) -> None:
        """A posture by name."""
        ...
    def add_shape(self, link: str, shape: Shape) -> None:
        """A shape of a link, for distances."""
        ...
    def add_visual(self, link: str, visual: Visual) -> None:
        """What is drawn of a link."""
        ...
    def add_serial_joint(self, joint: str) -> None:
        """A joint of the equivalent serial chain, for reduction ratios and serial models."""
        ...
    def set_gravity(self, gravity: ArrayLike) -> None:
        """(3,), m/s^2; (0, 0, -9.81) unless it is called."""
        ...
    def set_armature(self, joint: str, armature: float) -> None:
        """Inertia that is added to every dof of a joint, kg m^2 or kg."""
        ...
    def build(self) -> Model:
        """The Model. Raises ModelError naming the faulty element."""
        ...

class Robot:
    """A robot: its model, and where it came from. `load_robot` and `generate_robot` make them.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., model: Model = ..., file: str = ..., directory: str = ..., warnings: Sequence[str] = ...) -> None: ...
    def replace(self, *, name: str = ..., model: Model = ..., file: str = ..., directory: str = ..., warnings: Sequence[str] = ...) -> Robot: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """as requested"""
        ...
    @property
    def model(self) -> Model:
        """Model"""
        ...
    @property
    def file(self) -> str:
        """absolute path of the .urdf, or of the .yaml without a URDF beside it; or empty"""
        ...
    @property
    def directory(self) -> str:
        """where the files are; or empty"""
        ...
    @property
    def warnings(self) -> Tuple[str, ...]:
        """valid but suspicious: "file: element: problem" """
        ...
    def write(self, directory: str) -> None:
        """Writes DIRECTORY/NAME.urdf and .yaml, where NAME is the last component of DIRECTORY."""
        ...
    def info(self) -> Dict[str, Any]:
        """What `bielle info --json` prints: sizes, mobility, joints, closures with their gaps, motors, contacts."""
        ...
    def _repr_html_(self) -> str: ...

def make_view(robot: Robot) -> str:
    """The page that shows a Robot with a slider for each motor; its loops close as they move. Offline. HTML."""
    ...

def load_robot(name: str, base: Optional[str] = ...) -> Robot:
    """Loads a robot by name, by directory, or by .urdf or .yaml file.

    base: 'free' or 'fixed' overrides the robot's own. Raises ModelError, whatever the files contain.
    """
    ...

def generate_robot(name: str, directory: str = ..., **kwargs: Any) -> Robot:
    """Makes a robot from named lengths, angles and masses (see `generators`), with files if a directory is given."""
    ...

def generators() -> Dict[str, Dict[str, Dict[str, Any]]]:
    """Parameters of every generator by name: default, unit, bounds, help, choices."""
    ...

def list_robots() -> List[str]:
    """Names of the robots that can be loaded by name."""
    ...

def robot_directories() -> List[str]:
    """Where robots are looked up by name."""
    ...

class DeadPointKind:
    NONE: ClassVar[DeadPointKind]
    OUTPUT: ClassVar[DeadPointKind]
    MOTORS: ClassVar[DeadPointKind]
    __members__: ClassVar[Dict[str, DeadPointKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class LinkageRatio:
    """Speeds of the motors of a linkage by those of its joints, v_M = R v_J.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, R: ArrayLike = ..., dR: Sequence[ArrayLike] = ..., condition: float = ...) -> None: ...
    def replace(self, *, R: ArrayLike = ..., dR: Sequence[ArrayLike] = ..., condition: float = ...) -> LinkageRatio: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def R(self) -> Array:
        """(m, m), row of the motor, column of the joint"""
        ...
    @property
    def dR(self) -> Tuple[Array, ...]:
        """derivatives of R by each joint, m of (m, m)"""
        ...
    @property
    def condition(self) -> float:
        """largest over smallest singular value of R"""
        ...

class RatioSample:
    """A linkage at one configuration of a sweep.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, s: float = ..., branch: int = ..., joints: ArrayLike = ..., motors: ArrayLike = ..., ratio: LinkageRatio = ..., dead: DeadPointKind = ..., loses_rank: bool = ..., q: ArrayLike = ...) -> None: ...
    def replace(self, *, s: float = ..., branch: int = ..., joints: ArrayLike = ..., motors: ArrayLike = ..., ratio: LinkageRatio = ..., dead: DeadPointKind = ..., loses_rank: bool = ..., q: ArrayLike = ...) -> RatioSample: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def s(self) -> float:
        """length along the curve from the start, rad or m"""
        ...
    @property
    def branch(self) -> int:
        """counted by dead points of the output from the start"""
        ...
    @property
    def joints(self) -> Array:
        """angles of the linkage's joints (m,), rad or m"""
        ...
    @property
    def motors(self) -> Array:
        """angles of its motors (m,), rad or m"""
        ...
    @property
    def ratio(self) -> LinkageRatio:
        """at a dead point of the output: infinite"""
        ...
    @property
    def dead(self) -> DeadPointKind:
        """DeadPointKind"""
        ...
    @property
    def loses_rank(self) -> bool:
        """the loops can continue in several ways"""
        ...
    @property
    def q(self) -> Array:
        """configuration of the cluster; empty for a motor on the joint"""
        ...

class RatioSweep:
    """The reduction ratio of a linkage along the motion of one joint.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, joints: Sequence[str] = ..., motors: Sequence[str] = ..., samples: Sequence[RatioSample] = ..., begin: str = ..., end: str = ..., full_turn: bool = ...) -> None: ...
    def replace(self, *, joints: Sequence[str] = ..., motors: Sequence[str] = ..., samples: Sequence[RatioSample] = ..., begin: str = ..., end: str = ..., full_turn: bool = ...) -> RatioSweep: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def joints(self) -> Tuple[str, ...]:
        """names, the swept one first"""
        ...
    @property
    def motors(self) -> Tuple[str, ...]:
        """names"""
        ...
    @property
    def samples(self) -> Tuple[RatioSample, ...]:
        """in increasing s, dead points included"""
        ...
    @property
    def begin(self) -> str:
        """why the curve begins there"""
        ...
    @property
    def end(self) -> str:
        """why it ends there"""
        ...
    @property
    def full_turn(self) -> bool:
        """both ends are the same configuration"""
        ...

def sweep_ratio(model: Model, joint: str, q: ArrayLike, step: float = ..., length: float = ...) -> RatioSweep:
    """Moves a joint through its range from the closed configuration q (nq,), other joints of its linkage held.

    step: largest along the curve, rad or m. Raises ModelError when no linkage drives the joint.
    """
    ...

class GroundStep:
    """A box on the ground, e.g. a stair. Its axes are those of Rz(yaw) Ry(pitch) Rx(roll).

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, top: ArrayLike = ..., length: float = ..., width: float = ..., yaw: float = ..., pitch: float = ..., roll: float = ...) -> None: ...
    def replace(self, *, top: ArrayLike = ..., length: float = ..., width: float = ..., yaw: float = ..., pitch: float = ..., roll: float = ...) -> GroundStep: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def top(self) -> Array:
        """centre of its top in the world (3,), m"""
        ...
    @property
    def length(self) -> float:
        """along its own x, m"""
        ...
    @property
    def width(self) -> float:
        """along its own y, m"""
        ...
    @property
    def yaw(self) -> float:
        """rad"""
        ...
    @property
    def pitch(self) -> float:
        """rad; positive: its x goes down"""
        ...
    @property
    def roll(self) -> float:
        """rad"""
        ...

class Ground:
    """A plane with boxes on it; the highest one counts.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, height: float = ..., friction: float = ..., steps: Sequence[GroundStep] = ...) -> None: ...
    def replace(self, *, height: float = ..., friction: float = ..., steps: Sequence[GroundStep] = ...) -> Ground: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def height(self) -> float:
        """height of the plane, m"""
        ...
    @property
    def friction(self) -> float:
        """coefficient, 1"""
        ...
    @property
    def steps(self) -> Tuple[GroundStep, ...]:
        """GroundSteps"""
        ...
    def calc_height(self, x: float, y: float) -> float:
        """Height of the ground under a point, m."""
        ...

class ContactPhase:
    """A period with constant contacts.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., nodes: int = ..., dt: float = ..., contacts: Sequence[ContactTarget] = ...) -> None: ...
    def replace(self, *, name: str = ..., nodes: int = ..., dt: float = ..., contacts: Sequence[ContactTarget] = ...) -> ContactPhase: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """e.g. "double support" """
        ...
    @property
    def nodes(self) -> int:
        """number of stages"""
        ...
    @property
    def dt(self) -> float:
        """length of a stage, s; 0: a rigid impact"""
        ...
    @property
    def contacts(self) -> Tuple[ContactTarget, ...]:
        """ContactTargets of the feet on the ground"""
        ...

class ContactSchedule:
    """Which feet stand where and when.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, phases: Sequence[ContactPhase] = ...) -> None: ...
    def replace(self, *, phases: Sequence[ContactPhase] = ...) -> ContactSchedule: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def phases(self) -> Tuple[ContactPhase, ...]:
        """in their order"""
        ...

class ActivationKind:
    QUADRATIC: ClassVar[ActivationKind]
    BARRIER: ClassVar[ActivationKind]
    ENERGY: ClassVar[ActivationKind]
    __members__: ClassVar[Dict[str, ActivationKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Activation:
    """Scalar function of a residual r: 1/2 sum w r^2 (QUADRATIC), the same of what is outside of bounds (BARRIER), or the electrical energy of makeElectricalPower (ENERGY).

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, kind: ActivationKind = ..., weights: ArrayLike = ..., lower: ArrayLike = ..., upper: ArrayLike = ..., losses: ArrayLike = ..., share: float = ..., smoothing: float = ...) -> None: ...
    def replace(self, *, kind: ActivationKind = ..., weights: ArrayLike = ..., lower: ArrayLike = ..., upper: ArrayLike = ..., losses: ArrayLike = ..., share: float = ..., smoothing: float = ...) -> Activation: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def kind(self) -> ActivationKind:
        """ActivationKind"""
        ...
    @property
    def weights(self) -> Array:
        """(n,)"""
        ...
    @property
    def lower(self) -> Array:
        """(n,), barriers only"""
        ...
    @property
    def upper(self) -> Array:
        """(n,), barriers only"""
        ...
    @property
    def losses(self) -> Array:
        """(n/2,), energies only, W/(N m)^2"""
        ...
    @property
    def share(self) -> float:
        """energies only, 0 to 1"""
        ...
    @property
    def smoothing(self) -> float:
        """energies only, W"""
        ...
    @staticmethod
    def quadratic(weights: ArrayLike) -> Activation:
        """1/2 sum w r^2, with weights (n,)."""
        ...
    @staticmethod
    def barrier(weights: ArrayLike, lower: ArrayLike, upper: ArrayLike) -> Activation:
        """1/2 sum w d^2, where d is how far r is outside of its bounds; all (n,), in the unit of r."""
        ...

class Cost:
    """weight * activation(residual).

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., weight: float = ..., activation: Activation = ..., residual: Union[LibraryResidual, Residual] = ..., defines: bool = ...) -> None: ...
    def replace(self, *, name: str = ..., weight: float = ..., activation: Activation = ..., residual: Union[LibraryResidual, Residual] = ..., defines: bool = ...) -> Cost: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """for reports"""
        ...
    @property
    def weight(self) -> float:
        """finite, not negative"""
        ...
    @property
    def activation(self) -> Activation:
        """Activation"""
        ...
    @property
    def residual(self) -> Union[LibraryResidual, Residual]:
        """residual of the library (bielle.residuals), or a Residual written in Python"""
        ...
    @property
    def defines(self) -> bool:
        """it defines the motion, and keeps its weight for every objective"""
        ...

class PathConstraint:
    """lower <= r <= upper; equal bounds make an equation.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., residual: Union[LibraryResidual, Residual] = ..., lower: ArrayLike = ..., upper: ArrayLike = ..., scale: ArrayLike = ...) -> None: ...
    def replace(self, *, name: str = ..., residual: Union[LibraryResidual, Residual] = ..., lower: ArrayLike = ..., upper: ArrayLike = ..., scale: ArrayLike = ...) -> PathConstraint: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """for messages"""
        ...
    @property
    def residual(self) -> Union[LibraryResidual, Residual]:
        """residual of the library (bielle.residuals), or written in Python"""
        ...
    @property
    def lower(self) -> Array:
        """(n,), -inf: open"""
        ...
    @property
    def upper(self) -> Array:
        """(n,), inf: open"""
        ...
    @property
    def scale(self) -> Array:
        """(n,), the violation that counts as 1, in the unit of r"""
        ...

class StateCost:
    """1/2 weight sum w_i d_i^2 with d = (q (-) q_ref, v - v_ref).

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, weight: float = ..., q_ref: ArrayLike = ..., v_ref: ArrayLike = ..., weights: ArrayLike = ...) -> None: ...
    def replace(self, *, weight: float = ..., q_ref: ArrayLike = ..., v_ref: ArrayLike = ..., weights: ArrayLike = ...) -> StateCost: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def weight(self) -> float:
        """0: none"""
        ...
    @property
    def q_ref(self) -> Array:
        """(nq,)"""
        ...
    @property
    def v_ref(self) -> Array:
        """(nv,)"""
        ...
    @property
    def weights(self) -> Array:
        """(2 nv,)"""
        ...

class ControlCost:
    """1/2 weight sum w_i (u_i - reference_i)^2.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, weight: float = ..., reference: ArrayLike = ..., weights: ArrayLike = ...) -> None: ...
    def replace(self, *, weight: float = ..., reference: ArrayLike = ..., weights: ArrayLike = ...) -> ControlCost: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def weight(self) -> float:
        """0: none"""
        ...
    @property
    def reference(self) -> Array:
        """(nu,)"""
        ...
    @property
    def weights(self) -> Array:
        """(nu,)"""
        ...

class StageKind:
    DYNAMICS: ClassVar[StageKind]
    IMPACT: ClassVar[StageKind]
    __members__: ClassVar[Dict[str, StageKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class StepRule:
    EULER: ClassVar[StepRule]
    MIDPOINT: ClassVar[StepRule]
    __members__: ClassVar[Dict[str, StepRule]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Formulation:
    FULL: ClassVar[Formulation]
    REDUCED: ClassVar[Formulation]
    __members__: ClassVar[Dict[str, Formulation]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class FreeTiming:
    """Membership of a step in a phase whose duration is a variable.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, phase: int = ..., lower: float = ..., upper: float = ...) -> None: ...
    def replace(self, *, phase: int = ..., lower: float = ..., upper: float = ...) -> FreeTiming: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def phase(self) -> int:
        """the same for all steps of the phase; -1: the duration is fixed"""
        ...
    @property
    def lower(self) -> float:
        """bound of the time scale"""
        ...
    @property
    def upper(self) -> float:
        """bound of the time scale"""
        ...

class Stage:
    """One stage of the horizon, or the terminal node, which has neither dt nor constraints.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, kind: StageKind = ..., step: StepRule = ..., dt: float = ..., timing: FreeTiming = ..., time_weight: float = ..., constraints: ConstraintSet = ..., state: StateCost = ..., control: ControlCost = ..., costs: Sequence[Cost] = ..., path_constraints: Sequence[PathConstraint] = ..., effort_limits: ArrayLike = ...) -> None: ...
    def replace(self, *, kind: StageKind = ..., step: StepRule = ..., dt: float = ..., timing: FreeTiming = ..., time_weight: float = ..., constraints: ConstraintSet = ..., state: StateCost = ..., control: ControlCost = ..., costs: Sequence[Cost] = ..., path_constraints: Sequence[PathConstraint] = ..., effort_limits: ArrayLike = ...) -> Stage: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def kind(self) -> StageKind:
        """StageKind"""
        ...
    @property
    def step(self) -> StepRule:
        """StepRule"""
        ...
    @property
    def dt(self) -> float:
        """s; 0 for an impact"""
        ...
    @property
    def timing(self) -> FreeTiming:
        """FreeTiming"""
        ...
    @property
    def time_weight(self) -> float:
        """cost of a second"""
        ...
    @property
    def constraints(self) -> ConstraintSet:
        """closures and contacts in force (Model.constraints)"""
        ...
    @property
    def state(self) -> StateCost:
        """StateCost"""
        ...
    @property
    def control(self) -> ControlCost:
        """ControlCost"""
        ...
    @property
    def costs(self) -> Tuple[Cost, ...]:
        """Costs"""
        ...
    @property
    def path_constraints(self) -> Tuple[PathConstraint, ...]:
        """PathConstraints"""
        ...
    @property
    def effort_limits(self) -> Array:
        """bounds of |u| (nu,); empty: those of the motors"""
        ...

class ForceAxes:
    CONTACT: ClassVar[ForceAxes]
    WORLD: ClassVar[ForceAxes]
    GROUND: ClassVar[ForceAxes]
    __members__: ClassVar[Dict[str, ForceAxes]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class LibraryResidual:
    """A residual of the library; `bielle.residuals` makes them."""
    @property
    def size(self) -> int:
        """number of rows"""
        ...
    @property
    def origin(self) -> Optional[Tuple[str, Tuple[Any, ...]]]:
        """(function of bielle.residuals, its arguments); None for residuals that the library put into a motion"""
        ...
    def __eq__(self, other: object) -> bool: ...

class Node:
    """Data that a residual can read; valid during one call. Its arrays are copies."""
    @property
    def q(self) -> Array:
        """configuration (nq,)"""
        ...
    @property
    def v(self) -> Array:
        """velocity (nv,)"""
        ...
    @property
    def u(self) -> Array:
        """motor torques (nu,), N m or N; empty at the terminal node"""
        ...
    @property
    def forces(self) -> Array:
        """forces of closures and contacts (rows,), N and N m; empty at the terminal node"""
        ...
    @property
    def speeds(self) -> Array:
        """motor speeds when the torques act (nu,), rad/s or m/s"""
        ...
    @property
    def time_scale(self) -> float:
        """time scale of a free duration"""
        ...
    @property
    def constraints(self) -> ConstraintSet:
        """ConstraintSet in force"""
        ...
    @property
    def com(self) -> Array:
        """centre of mass in the world (3,), m"""
        ...
    @property
    def com_jacobian(self) -> Array:
        """Jacobian of the centre of mass by the tangent of q (3, nv); only in calc_jacobian"""
        ...
    def placement(self, frame: str) -> SE3:
        """SE3 of a link, frame or contact in the world."""
        ...
    def frame_velocity(self, frame: str) -> Array:
        """Twist of a frame in its own coordinates (6,), m/s and rad/s."""
        ...
    def frame_jacobian(self, frame: str) -> Array:
        """Jacobian of that twist (6, nv); only in calc_jacobian."""
        ...

class ControlBounds:
    IGNORE: ClassVar[ControlBounds]
    ENFORCE: ClassVar[ControlBounds]
    __members__: ClassVar[Dict[str, ControlBounds]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class LastRollout:
    CLOSED: ClassVar[LastRollout]
    SEGMENTS: ClassVar[LastRollout]
    __members__: ClassVar[Dict[str, LastRollout]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class ConstraintOptions:
    """How constraints are enforced.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, tolerance: float = ..., initial_penalty: float = ..., penalty_increase: float = ..., max_penalty: float = ...) -> None: ...
    def replace(self, *, tolerance: float = ..., initial_penalty: float = ..., penalty_increase: float = ..., max_penalty: float = ...) -> ConstraintOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def tolerance(self) -> float:
        """largest violation of a converged solve"""
        ...
    @property
    def initial_penalty(self) -> float:
        """cost over squared violation"""
        ...
    @property
    def penalty_increase(self) -> float:
        """factor when the violation falls too slowly"""
        ...
    @property
    def max_penalty(self) -> float:
        """largest"""
        ...

class SolverOptions:
    """Options of FDDP.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, max_iterations: int = ..., gradient_tolerance: float = ..., gap_tolerance: float = ..., cost_tolerance: float = ..., acceptable_decrease: float = ..., initial_regularization: float = ..., min_regularization: float = ..., max_regularization: float = ..., regularization_increase: float = ..., regularization_decrease: float = ..., state_regularization_ratio: float = ..., long_step: float = ..., short_step: float = ..., num_step_lengths: int = ..., acceptance: float = ..., bounds: ControlBounds = ..., constraints: ConstraintOptions = ..., rollout_segments: int = ..., last_rollout: LastRollout = ..., threads: int = ...) -> None: ...
    def replace(self, *, max_iterations: int = ..., gradient_tolerance: float = ..., gap_tolerance: float = ..., cost_tolerance: float = ..., acceptable_decrease: float = ..., initial_regularization: float = ..., min_regularization: float = ..., max_regularization: float = ..., regularization_increase: float = ..., regularization_decrease: float = ..., state_regularization_ratio: float = ..., long_step: float = ..., short_step: float = ..., num_step_lengths: int = ..., acceptance: float = ..., bounds: ControlBounds = ..., constraints: ConstraintOptions = ..., rollout_segments: int = ..., last_rollout: LastRollout = ..., threads: int = ...) -> SolverOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def max_iterations(self) -> int:
        """the solver stops there"""
        ...
    @property
    def gradient_tolerance(self) -> float:
        """(cost per unit of control)^2"""
        ...
    @property
    def gap_tolerance(self) -> float:
        """largest entry of the gaps"""
        ...
    @property
    def cost_tolerance(self) -> float:
        """relative change of the cost by a full step; 0: never"""
        ...
    @property
    def acceptable_decrease(self) -> float:
        """share of the cost; a solve whose cost falls by less in 20 iterations ends within the constraints; 0: never"""
        ...
    @property
    def initial_regularization(self) -> float:
        """regularization of the first sweep"""
        ...
    @property
    def min_regularization(self) -> float:
        """least"""
        ...
    @property
    def max_regularization(self) -> float:
        """the solve gives up above this"""
        ...
    @property
    def regularization_increase(self) -> float:
        """factor"""
        ...
    @property
    def regularization_decrease(self) -> float:
        """divisor"""
        ...
    @property
    def state_regularization_ratio(self) -> float:
        """ratio of the regularization of states to that of controls"""
        ...
    @property
    def long_step(self) -> float:
        """a step is long above this"""
        ...
    @property
    def short_step(self) -> float:
        """a step is short up to this"""
        ...
    @property
    def num_step_lengths(self) -> int:
        """1, 1/2, 1/4, ..."""
        ...
    @property
    def acceptance(self) -> float:
        """share of the predicted decrease, in (0, 1)"""
        ...
    @property
    def bounds(self) -> ControlBounds:
        """ControlBounds"""
        ...
    @property
    def constraints(self) -> ConstraintOptions:
        """ConstraintOptions"""
        ...
    @property
    def rollout_segments(self) -> int:
        """largest number of segments of a rollout"""
        ...
    @property
    def last_rollout(self) -> LastRollout:
        """LastRollout"""
        ...
    @property
    def threads(self) -> int:
        """0: all; at most 1024; results are bitwise independent of it"""
        ...

class Termination:
    CONVERGED: ClassVar[Termination]
    MAX_ITERATIONS: ClassVar[Termination]
    REGULARIZATION_MAX: ClassVar[Termination]
    INFEASIBLE: ClassVar[Termination]
    INTERRUPTED: ClassVar[Termination]
    FAILED: ClassVar[Termination]
    __members__: ClassVar[Dict[str, Termination]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Iteration:
    """One line of the log: the iterate it started from and the step it took.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, iteration: int = ..., cost: float = ..., violation: float = ..., gap: float = ..., gradient: float = ..., step: float = ..., regularization: float = ..., seconds: float = ...) -> None: ...
    def replace(self, *, iteration: int = ..., cost: float = ..., violation: float = ..., gap: float = ..., gradient: float = ..., step: float = ..., regularization: float = ..., seconds: float = ...) -> Iteration: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def iteration(self) -> int:
        """from 1"""
        ...
    @property
    def cost(self) -> float:
        """before the step"""
        ...
    @property
    def violation(self) -> float:
        """largest of the constraints before the step"""
        ...
    @property
    def gap(self) -> float:
        """largest entry before the step"""
        ...
    @property
    def gradient(self) -> float:
        """squared norm of the projected one"""
        ...
    @property
    def step(self) -> float:
        """step length; 0: no step was taken"""
        ...
    @property
    def regularization(self) -> float:
        """regularization of the sweep"""
        ...
    @property
    def seconds(self) -> float:
        """since the start"""
        ...

class Summary:
    """The outcome of a solve.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, termination: Termination = ..., message: str = ..., acceptable: bool = ..., cost: float = ..., gap: float = ..., iterations: int = ..., violation: float = ..., complementarity: float = ..., multiplier: float = ..., penalty: float = ..., multiplier_updates: int = ..., seconds: float = ..., linearize_seconds: float = ..., sweep_seconds: float = ..., rollout_seconds: float = ..., log: Sequence[Iteration] = ...) -> None: ...
    def replace(self, *, termination: Termination = ..., message: str = ..., acceptable: bool = ..., cost: float = ..., gap: float = ..., iterations: int = ..., violation: float = ..., complementarity: float = ..., multiplier: float = ..., penalty: float = ..., multiplier_updates: int = ..., seconds: float = ..., linearize_seconds: float = ..., sweep_seconds: float = ..., rollout_seconds: float = ..., log: Sequence[Iteration] = ...) -> Summary: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def termination(self) -> Termination:
        """Termination"""
        ...
    @property
    def message(self) -> str:
        """why it ended"""
        ...
    @property
    def acceptable(self) -> bool:
        """converged by acceptable_decrease: the gradient has not vanished"""
        ...
    @property
    def cost(self) -> float:
        """cost of the returned trajectory"""
        ...
    @property
    def gap(self) -> float:
        """largest entry of its gaps"""
        ...
    @property
    def iterations(self) -> int:
        """number"""
        ...
    @property
    def violation(self) -> float:
        """largest of the constraints"""
        ...
    @property
    def complementarity(self) -> float:
        """largest multiplier times slack"""
        ...
    @property
    def multiplier(self) -> float:
        """largest"""
        ...
    @property
    def penalty(self) -> float:
        """penalty of violated constraints; 0: there are none"""
        ...
    @property
    def multiplier_updates(self) -> int:
        """number"""
        ...
    @property
    def seconds(self) -> float:
        """s"""
        ...
    @property
    def linearize_seconds(self) -> float:
        """summed over the threads, s"""
        ...
    @property
    def sweep_seconds(self) -> float:
        """likewise"""
        ...
    @property
    def rollout_seconds(self) -> float:
        """likewise"""
        ...
    @property
    def log(self) -> Tuple[Iteration, ...]:
        """Iterations"""
        ...
    @property
    def converged(self) -> bool:
        """whether the solver ended at an optimum"""
        ...

class Multipliers:
    """Multipliers of the constraints, node by node.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, values: Sequence[ArrayLike] = ..., penalty: float = ...) -> None: ...
    def replace(self, *, values: Sequence[ArrayLike] = ..., penalty: float = ...) -> Multipliers: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def values(self) -> Tuple[Array, ...]:
        """N + 1 of (constraint size,)"""
        ...
    @property
    def penalty(self) -> float:
        """penalty of violated constraints"""
        ...

class Objective:
    EFFORT: ClassVar[Objective]
    ENERGY: ClassVar[Objective]
    PEAK_TORQUE: ClassVar[Objective]
    __members__: ClassVar[Dict[str, Objective]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class LimitOptions:
    """Limits of motors and joints.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, enforced: bool = ..., efforts: Mapping[str, float] = ..., velocities: Mapping[str, float] = ..., powers: Mapping[str, float] = ..., dead_point_margin: float = ...) -> None: ...
    def replace(self, *, enforced: bool = ..., efforts: Mapping[str, float] = ..., velocities: Mapping[str, float] = ..., powers: Mapping[str, float] = ..., dead_point_margin: float = ...) -> LimitOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def enforced(self) -> bool:
        """False: all limits, including torque, are ignored"""
        ...
    @property
    def efforts(self) -> Dict[str, float]:
        """by motor, N m or N, instead of the model's"""
        ...
    @property
    def velocities(self) -> Dict[str, float]:
        """by motor, rad/s or m/s, instead of the model's"""
        ...
    @property
    def powers(self) -> Dict[str, float]:
        """by motor, W; driving or braking"""
        ...
    @property
    def dead_point_margin(self) -> float:
        """least share of the transmission at the start; 0: none"""
        ...

class TimingBounds:
    """Bounds of a duration relative to the nominal one.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, lower: float = ..., upper: float = ...) -> None: ...
    def replace(self, *, lower: float = ..., upper: float = ...) -> TimingBounds: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def lower(self) -> float:
        """1"""
        ...
    @property
    def upper(self) -> float:
        """1"""
        ...

class TimingOptions:
    """Phases whose durations the solver chooses.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, phases: Mapping[str, TimingBounds] = ..., time_weight: float = ...) -> None: ...
    def replace(self, *, phases: Mapping[str, TimingBounds] = ..., time_weight: float = ...) -> TimingOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def phases(self) -> Dict[str, TimingBounds]:
        """TimingBounds by name of the phase; "all": those with contacts"""
        ...
    @property
    def time_weight(self) -> float:
        """cost per second of these phases"""
        ...

class ObjectiveOptions:
    """What a motion minimizes besides the costs that define it.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, objective: Objective = ..., regeneration: float = ..., regularization: Optional[float] = ..., scale: Optional[float] = ...) -> None: ...
    def replace(self, *, objective: Objective = ..., regeneration: float = ..., regularization: Optional[float] = ..., scale: Optional[float] = ...) -> ObjectiveOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def objective(self) -> Objective:
        """Objective"""
        ...
    @property
    def regeneration(self) -> float:
        """share of the regenerated energy that is reused, 0 to 1"""
        ...
    @property
    def regularization(self) -> Optional[float]:
        """weight of the other costs; None: the default"""
        ...
    @property
    def scale(self) -> Optional[float]:
        """cost of a joule, or of the peak; None: of the motion of least effort"""
        ...

class ProblemOptions:
    """Options of a problem besides those of the motion.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, formulation: Formulation = ..., step: StepRule = ..., limits: LimitOptions = ..., timings: TimingOptions = ..., objective: ObjectiveOptions = ...) -> None: ...
    def replace(self, *, formulation: Formulation = ..., step: StepRule = ..., limits: LimitOptions = ..., timings: TimingOptions = ..., objective: ObjectiveOptions = ...) -> ProblemOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def formulation(self) -> Formulation:
        """Formulation"""
        ...
    @property
    def step(self) -> StepRule:
        """StepRule"""
        ...
    @property
    def limits(self) -> LimitOptions:
        """LimitOptions"""
        ...
    @property
    def timings(self) -> TimingOptions:
        """TimingOptions"""
        ...
    @property
    def objective(self) -> ObjectiveOptions:
        """ObjectiveOptions"""
        ...

class GoalKind:
    SPEED: ClassVar[GoalKind]
    HEIGHT: ClassVar[GoalKind]
    RISE: ClassVar[GoalKind]
    FLIGHT_TIME: ClassVar[GoalKind]
    TURN: ClassVar[GoalKind]
    DISPLACEMENT: ClassVar[GoalKind]
    FOOTHOLDS: ClassVar[GoalKind]
    __members__: ClassVar[Dict[str, GoalKind]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Foothold:
    """Where a foot is to land.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, contact: str = ..., node: int = ..., position: ArrayLike = ...) -> None: ...
    def replace(self, *, contact: str = ..., node: int = ..., position: ArrayLike = ...) -> Foothold: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def contact(self) -> str:
        """name"""
        ...
    @property
    def node(self) -> int:
        """where the foot lands"""
        ...
    @property
    def position(self) -> Array:
        """position of the origin of its contact frame (3,), m"""
        ...

class Goal:
    """A quantity that is requested, and measured on the trajectory.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, kind: GoalKind = ..., name: str = ..., requested: float = ..., tolerance: float = ..., first: int = ..., last: int = ..., direction: ArrayLike = ..., contacts: Sequence[str] = ..., footholds: Sequence[Foothold] = ...) -> None: ...
    def replace(self, *, kind: GoalKind = ..., name: str = ..., requested: float = ..., tolerance: float = ..., first: int = ..., last: int = ..., direction: ArrayLike = ..., contacts: Sequence[str] = ..., footholds: Sequence[Foothold] = ...) -> Goal: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def kind(self) -> GoalKind:
        """GoalKind"""
        ...
    @property
    def name(self) -> str:
        """e.g. "speed" """
        ...
    @property
    def requested(self) -> float:
        """requested value"""
        ...
    @property
    def tolerance(self) -> float:
        """largest difference that still meets the goal"""
        ...
    @property
    def first(self) -> int:
        """node"""
        ...
    @property
    def last(self) -> int:
        """node"""
        ...
    @property
    def direction(self) -> Array:
        """unit (3,)"""
        ...
    @property
    def contacts(self) -> Tuple[str, ...]:
        """names"""
        ...
    @property
    def footholds(self) -> Tuple[Foothold, ...]:
        """Footholds"""
        ...

class GoalOutcome:
    """Requested and achieved value of a goal.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, goal: Goal = ..., achieved: float = ...) -> None: ...
    def replace(self, *, goal: Goal = ..., achieved: float = ...) -> GoalOutcome: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def goal(self) -> Goal:
        """Goal"""
        ...
    @property
    def achieved(self) -> float:
        """achieved value"""
        ...
    @property
    def met(self) -> bool:
        """within the tolerance"""
        ...

class PhaseTiming:
    """A phase of free duration.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, phase: str = ..., start_node: int = ..., nominal: float = ..., chosen: float = ..., lower: float = ..., upper: float = ...) -> None: ...
    def replace(self, *, phase: str = ..., start_node: int = ..., nominal: float = ..., chosen: float = ..., lower: float = ..., upper: float = ...) -> PhaseTiming: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def phase(self) -> str:
        """name"""
        ...
    @property
    def start_node(self) -> int:
        """first node"""
        ...
    @property
    def nominal(self) -> float:
        """s"""
        ...
    @property
    def chosen(self) -> float:
        """s"""
        ...
    @property
    def lower(self) -> float:
        """bound, s"""
        ...
    @property
    def upper(self) -> float:
        """bound, s"""
        ...

class Trajectory:
    """Node states (N + 1) and controls (N) of a problem.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, xs: Sequence[ArrayLike] = ..., us: Sequence[ArrayLike] = ...) -> None: ...
    def replace(self, *, xs: Sequence[ArrayLike] = ..., us: Sequence[ArrayLike] = ...) -> Trajectory: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def xs(self) -> Tuple[Array, ...]:
        """states: (q, v), and a time scale where one is free"""
        ...
    @property
    def us(self) -> Tuple[Array, ...]:
        """torques, and the time scale at the first step of a free phase"""
        ...

class MotionPlan:
    """A motion before it becomes a problem.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., schedule: ContactSchedule = ..., ground: Ground = ..., stages: Sequence[Stage] = ..., guess: Trajectory = ..., q_start: ArrayLike = ..., q_end: ArrayLike = ..., options: Mapping[str, Union[bool, int, float, str]] = ..., goals: Sequence[Goal] = ...) -> None: ...
    def replace(self, *, name: str = ..., schedule: ContactSchedule = ..., ground: Ground = ..., stages: Sequence[Stage] = ..., guess: Trajectory = ..., q_start: ArrayLike = ..., q_end: ArrayLike = ..., options: Mapping[str, Union[bool, int, float, str]] = ..., goals: Sequence[Goal] = ...) -> MotionPlan: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """e.g. "squat" """
        ...
    @property
    def schedule(self) -> ContactSchedule:
        """ContactSchedule; without phases, that of the stages"""
        ...
    @property
    def ground(self) -> Ground:
        """Ground"""
        ...
    @property
    def stages(self) -> Tuple[Stage, ...]:
        """N running Stages and the terminal one"""
        ...
    @property
    def guess(self) -> Trajectory:
        """Trajectory to start from"""
        ...
    @property
    def q_start(self) -> Array:
        """standing posture (nq,)"""
        ...
    @property
    def q_end(self) -> Array:
        """standing posture (nq,)"""
        ...
    @property
    def options(self) -> Dict[str, Union[bool, int, float, str]]:
        """every option of the motion by name"""
        ...
    @property
    def goals(self) -> Tuple[Goal, ...]:
        """Goals"""
        ...

class Request:
    """A motion by name, with its options: the input of `bielle solve`.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, motion: str = ..., options: Mapping[str, Union[bool, int, float, str]] = ..., sequence: Sequence[str] = ..., files: Mapping[str, str] = ...) -> None: ...
    def replace(self, *, motion: str = ..., options: Mapping[str, Union[bool, int, float, str]] = ..., sequence: Sequence[str] = ..., files: Mapping[str, str] = ...) -> Request: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def motion(self) -> str:
        """name, one of `motions`; empty for a sequence"""
        ...
    @property
    def options(self) -> Dict[str, Union[bool, int, float, str]]:
        """values by name: bool, int, float, or the name of a choice"""
        ...
    @property
    def sequence(self) -> Tuple[str, ...]:
        """names of motions that follow one another; options are "NAME.option" """
        ...
    @property
    def files(self) -> Dict[str, str]:
        """paths by name, e.g. "footholds" """
        ...

def motions() -> Dict[str, Dict[str, Any]]:
    """The motions by name: what they do, their options with defaults and units, files."""
    ...

class Motion:
    """A problem ready to be solved: of a plan (Motion(model, plan, options)), or of a request (Motion.make)."""
    def __init__(self, model: Model, plan: MotionPlan, options: ProblemOptions = ...) -> None: ...
    @staticmethod
    def make(model: Model, request: Request, options: ProblemOptions = ...) -> Motion:
        """The motion of a request. Raises ModelError."""
        ...
    @staticmethod
    def plan(model: Model, request: Request) -> MotionPlan:
        """The plan of a request, e.g. to add costs and constraints to its stages."""
        ...
    @property
    def model(self) -> Model:
        """Model"""
        ...
    @property
    def problem_options(self) -> ProblemOptions:
        """ProblemOptions"""
        ...
    @property
    def request(self) -> Optional[Request]:
        """Request, or None"""
        ...
    @property
    def name(self) -> str:
        """e.g. "squat" """
        ...
    @property
    def num_stages(self) -> int:
        """N"""
        ...
    @property
    def schedule(self) -> ContactSchedule:
        """ContactSchedule"""
        ...
    @property
    def ground(self) -> Ground:
        """Ground"""
        ...
    @property
    def goals(self) -> Tuple[Goal, ...]:
        """Goals"""
        ...
    @property
    def options(self) -> Dict[str, Union[bool, int, float, str]]:
        """every option of the motion by name"""
        ...
    @property
    def guess(self) -> Trajectory:
        """Trajectory that a solve starts from"""
        ...
    def stage(self, node: int) -> Stage:
        """Stage of a node, 0 to N, including the constraints from the robot's limits."""
        ...
    def costs(self, node: int, trajectory: Optional[Trajectory] = ...) -> Dict[str, float]:
        """Costs of a node of a Trajectory, or of the guess, by name, before scaling by the time step."""
        ...
    def solve(self, options: SolverOptions = ..., callback: Optional[Callable[[Iteration], Optional[bool]]] = ..., warm_start: Union[None, Trajectory, Solution, Record] = ..., refine: bool = ...) -> Solution:
        """Solves it as `bielle solve` does. Returns a Solution; the motion stays as it is.

        callback: called with each Iteration; False stops. An exception it raises, or Ctrl-C, ends the solve.
        warm_start: a Trajectory or a Solution of as many stages, or a Record of any motion of the robot; None: the guess
        refine: whether the motion of a Request may be made again, e.g. with shorter stages
        """
        ...

class Gains:
    """Of a stage, about a solution: u = us + k + K (x - xs), x - xs in the tangent space.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, k: ArrayLike = ..., K: ArrayLike = ...) -> None: ...
    def replace(self, *, k: ArrayLike = ..., K: ArrayLike = ...) -> Gains: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def k(self) -> Array:
        """(nu,), vanishes at an optimum"""
        ...
    @property
    def K(self) -> Array:
        """(nu, ndx)"""
        ...

class Solution:
    """A solved Motion."""
    @property
    def motion(self) -> Motion:
        """Motion that was solved: the given one, or that made again of its request"""
        ...
    @property
    def trajectory(self) -> Trajectory:
        """Trajectory"""
        ...
    @property
    def summary(self) -> Summary:
        """Summary"""
        ...
    @property
    def multipliers(self) -> Multipliers:
        """Multipliers of the constraints"""
        ...
    @property
    def gains(self) -> Tuple[Gains, ...]:
        """Gains of every stage, of the solver's last sweep; () for the least peak torque"""
        ...
    @property
    def converged(self) -> bool:
        """whether the solver ended at an optimum"""
        ...
    def _repr_html_(self) -> str: ...

class Record:
    """A motion as numbers: one row per node, or per stage, from its node to the next.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, q_names: Sequence[str] = ..., v_names: Sequence[str] = ..., u_names: Sequence[str] = ..., closure_names: Sequence[str] = ..., contact_names: Sequence[str] = ..., time: ArrayLike = ..., q: ArrayLike = ..., v: ArrayLike = ..., a: ArrayLike = ..., u: ArrayLike = ..., closure_wrenches: ArrayLike = ..., contact_wrenches: ArrayLike = ..., has_midpoints: bool = ..., q_mid: ArrayLike = ..., v_mid: ArrayLike = ..., com: ArrayLike = ..., gap: ArrayLike = ..., footholds: ArrayLike = ..., multipliers: Multipliers = ...) -> None: ...
    def replace(self, *, q_names: Sequence[str] = ..., v_names: Sequence[str] = ..., u_names: Sequence[str] = ..., closure_names: Sequence[str] = ..., contact_names: Sequence[str] = ..., time: ArrayLike = ..., q: ArrayLike = ..., v: ArrayLike = ..., a: ArrayLike = ..., u: ArrayLike = ..., closure_wrenches: ArrayLike = ..., contact_wrenches: ArrayLike = ..., has_midpoints: bool = ..., q_mid: ArrayLike = ..., v_mid: ArrayLike = ..., com: ArrayLike = ..., gap: ArrayLike = ..., footholds: ArrayLike = ..., multipliers: Multipliers = ...) -> Record: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def q_names(self) -> Tuple[str, ...]:
        """names of the columns of q"""
        ...
    @property
    def v_names(self) -> Tuple[str, ...]:
        """names of the columns of v and a"""
        ...
    @property
    def u_names(self) -> Tuple[str, ...]:
        """names of the motors"""
        ...
    @property
    def closure_names(self) -> Tuple[str, ...]:
        """in their order"""
        ...
    @property
    def contact_names(self) -> Tuple[str, ...]:
        """in their order"""
        ...
    @property
    def time(self) -> Array:
        """(N + 1,), s"""
        ...
    @property
    def q(self) -> Array:
        """(N + 1, nq)"""
        ...
    @property
    def v(self) -> Array:
        """(N + 1, nv)"""
        ...
    @property
    def a(self) -> Array:
        """(N, nv)"""
        ...
    @property
    def u(self) -> Array:
        """(N, nu), N m or N"""
        ...
    @property
    def closure_wrenches(self) -> Array:
        """(N, 6 per closure), on body 1, in frame 1"""
        ...
    @property
    def contact_wrenches(self) -> Array:
        """(N, 6 per contact), of the ground on the foot"""
        ...
    @property
    def has_midpoints(self) -> bool:
        """midpoint steps; else the next two are empty"""
        ...
    @property
    def q_mid(self) -> Array:
        """(N, nq), where a, u and wrenches belong"""
        ...
    @property
    def v_mid(self) -> Array:
        """(N, nv)"""
        ...
    @property
    def com(self) -> Array:
        """(N + 1, 3), m"""
        ...
    @property
    def gap(self) -> Array:
        """(N + 1, 2), largest closing error, m and rad"""
        ...
    @property
    def footholds(self) -> Array:
        """(N + 1, 8 per contact), predicted: when, s; where, m, and quaternion x y z w; (0, 0) if not known"""
        ...
    @property
    def multipliers(self) -> Multipliers:
        """multipliers of the constraints, for warm starts; penalty 0 if not known"""
        ...

def read_record(path: str) -> Record:
    """Reads trajectory.npz."""
    ...

def read_result_record(directory: str) -> Record:
    """The Record in a directory of a result."""
    ...

class ElectricalEnergy:
    """What the motors take from their supply.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, by_motor: ArrayLike = ..., total: float = ..., regeneration: float = ..., num_assumed: int = ..., distance: float = ..., cost_of_transport: float = ...) -> None: ...
    def replace(self, *, by_motor: ArrayLike = ..., total: float = ..., regeneration: float = ..., num_assumed: int = ..., distance: float = ..., cost_of_transport: float = ...) -> ElectricalEnergy: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def by_motor(self) -> Array:
        """(nu,), J"""
        ...
    @property
    def total(self) -> float:
        """J"""
        ...
    @property
    def regeneration(self) -> float:
        """share of the regenerated energy that is subtracted"""
        ...
    @property
    def num_assumed(self) -> int:
        """motors whose loss is not known"""
        ...
    @property
    def distance(self) -> float:
        """horizontal distance of the centre of mass, m"""
        ...
    @property
    def cost_of_transport(self) -> float:
        """total divided by weight and distance"""
        ...

class DeadPoint:
    """The nearest dead point of a linkage.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, kind: DeadPointKind = ..., distance: float = ...) -> None: ...
    def replace(self, *, kind: DeadPointKind = ..., distance: float = ...) -> DeadPoint: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def kind(self) -> DeadPointKind:
        """DeadPointKind: whether the output or the motors stand still there"""
        ...
    @property
    def distance(self) -> float:
        """largest way of a motor or joint to there, rad or m; inf beyond 0.5"""
        ...

class DeadPointTrace:
    """Dead points next to a linkage along a motion.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, output: str = ..., nodes: Sequence[int] = ..., points: Sequence[DeadPoint] = ..., nearest: int = ...) -> None: ...
    def replace(self, *, output: str = ..., nodes: Sequence[int] = ..., points: Sequence[DeadPoint] = ..., nearest: int = ...) -> DeadPointTrace: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def output(self) -> str:
        """names of the joints or bodies that the linkage moves"""
        ...
    @property
    def nodes(self) -> Tuple[int, ...]:
        """where they were looked for, in increasing order"""
        ...
    @property
    def points(self) -> Tuple[DeadPoint, ...]:
        """DeadPoints of these nodes"""
        ...
    @property
    def nearest(self) -> int:
        """index of the least distance"""
        ...

class RunInfo:
    """The request that led to a motion.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, robot: str = ..., robot_file: str = ..., command: Sequence[str] = ..., model: str = ..., serial_armature: str = ...) -> None: ...
    def replace(self, *, robot: str = ..., robot_file: str = ..., command: Sequence[str] = ..., model: str = ..., serial_armature: str = ...) -> RunInfo: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def robot(self) -> str:
        """name or path, as given"""
        ...
    @property
    def robot_file(self) -> str:
        """its .urdf, absolute"""
        ...
    @property
    def command(self) -> Tuple[str, ...]:
        """the command line, or empty"""
        ...
    @property
    def model(self) -> str:
        """"closed" or "serial" """
        ...
    @property
    def serial_armature(self) -> str:
        """armature of the serial model"""
        ...

class Result:
    """A solved motion.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, run: RunInfo = ..., motion: str = ..., formulation: Formulation = ..., step: StepRule = ..., options: Mapping[str, Union[bool, int, float, str]] = ..., goals: Sequence[GoalOutcome] = ..., schedule: ContactSchedule = ..., timings: Sequence[PhaseTiming] = ..., ground: Ground = ..., solver: Summary = ..., record: Record = ..., peak_torques: Mapping[str, float] = ..., rms_torques: Mapping[str, float] = ..., continuous_torques: Mapping[str, float] = ..., objective: ObjectiveOptions = ..., energy: ElectricalEnergy = ..., gap_position: float = ..., gap_angle: float = ..., slip_position: float = ..., slip_angle: float = ..., com_start: float = ..., com_lowest: float = ..., dead_points: Sequence[DeadPointTrace] = ...) -> None: ...
    def replace(self, *, run: RunInfo = ..., motion: str = ..., formulation: Formulation = ..., step: StepRule = ..., options: Mapping[str, Union[bool, int, float, str]] = ..., goals: Sequence[GoalOutcome] = ..., schedule: ContactSchedule = ..., timings: Sequence[PhaseTiming] = ..., ground: Ground = ..., solver: Summary = ..., record: Record = ..., peak_torques: Mapping[str, float] = ..., rms_torques: Mapping[str, float] = ..., continuous_torques: Mapping[str, float] = ..., objective: ObjectiveOptions = ..., energy: ElectricalEnergy = ..., gap_position: float = ..., gap_angle: float = ..., slip_position: float = ..., slip_angle: float = ..., com_start: float = ..., com_lowest: float = ..., dead_points: Sequence[DeadPointTrace] = ...) -> Result: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def run(self) -> RunInfo:
        """RunInfo"""
        ...
    @property
    def motion(self) -> str:
        """name"""
        ...
    @property
    def formulation(self) -> Formulation:
        """Formulation"""
        ...
    @property
    def step(self) -> StepRule:
        """StepRule"""
        ...
    @property
    def options(self) -> Dict[str, Union[bool, int, float, str]]:
        """every option of the motion by name"""
        ...
    @property
    def goals(self) -> Tuple[GoalOutcome, ...]:
        """GoalOutcomes: requested and achieved values"""
        ...
    @property
    def schedule(self) -> ContactSchedule:
        """ContactSchedule, with the final time steps"""
        ...
    @property
    def timings(self) -> Tuple[PhaseTiming, ...]:
        """PhaseTimings of the phases of free duration"""
        ...
    @property
    def ground(self) -> Ground:
        """Ground"""
        ...
    @property
    def solver(self) -> Summary:
        """Summary"""
        ...
    @property
    def record(self) -> Record:
        """Record: all numbers, node by node"""
        ...
    @property
    def peak_torques(self) -> Dict[str, float]:
        """largest |u| by motor, largest first, N m or N"""
        ...
    @property
    def rms_torques(self) -> Dict[str, float]:
        """root mean square torque by motor, N m or N"""
        ...
    @property
    def continuous_torques(self) -> Dict[str, float]:
        """torques that motors can sustain indefinitely, where known, N m or N"""
        ...
    @property
    def objective(self) -> ObjectiveOptions:
        """ObjectiveOptions"""
        ...
    @property
    def energy(self) -> ElectricalEnergy:
        """ElectricalEnergy"""
        ...
    @property
    def gap_position(self) -> float:
        """largest closing error, m"""
        ...
    @property
    def gap_angle(self) -> float:
        """rad"""
        ...
    @property
    def slip_position(self) -> float:
        """largest displacement of a foot from its touchdown, m"""
        ...
    @property
    def slip_angle(self) -> float:
        """rad"""
        ...
    @property
    def com_start(self) -> float:
        """height of the centre of mass, m"""
        ...
    @property
    def com_lowest(self) -> float:
        """m"""
        ...
    @property
    def dead_points(self) -> Tuple[DeadPointTrace, ...]:
        """DeadPointTraces: how near each linkage comes to one"""
        ...
    @property
    def converged(self) -> bool:
        """whether the solver ended at an optimum"""
        ...
    @property
    def interrupted(self) -> bool:
        """whether a callback ended it; the record is that of the last iterate"""
        ...
    def write(self, directory: str) -> List[str]:
        """Writes trajectory.csv, trajectory.npz and summary.json, as the command does. Returns their paths."""
        ...
    def _repr_html_(self) -> str: ...

def make_report(directories: Sequence[str]) -> str:
    """The page that shows results, from their directories: 3D replay and plots, offline. HTML."""
    ...

def write_report(path: str, directories: Sequence[str]) -> None:
    """Writes that page to a file."""
    ...

def solve(robot: Robot, request: Request, problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[Record] = ..., callback: Optional[Callable[[Iteration], Optional[bool]]] = ...) -> Result:
    """Solves a Request as `bielle solve` does. Returns a Result.

    callback: called with each Iteration; False stops. An exception it raises, or Ctrl-C, ends the solve.
    """
    ...

def make_result(solution: Solution, robot: Robot) -> Result:
    """The Result of a Solution."""
    ...

class Replacement:
    """Motors of one linkage, replaced by motors on its serial joints.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, motors: Sequence[str] = ..., joints: Sequence[str] = ..., R: ArrayLike = ...) -> None: ...
    def replace(self, *, motors: Sequence[str] = ..., joints: Sequence[str] = ..., R: ArrayLike = ...) -> Replacement: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def motors(self) -> Tuple[str, ...]:
        """names, of the closed model"""
        ...
    @property
    def joints(self) -> Tuple[str, ...]:
        """names, which the new motors have too"""
        ...
    @property
    def R(self) -> Array:
        """ratio at the reference, (motors, joints)"""
        ...

class SerialModel:
    """The Approximate Serial model of the paper: linkages frozen, motors on the serial joints.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, model: Model = ..., q_reference: ArrayLike = ..., frozen_joints: Sequence[str] = ..., dropped_closures: Sequence[str] = ..., replacements: Sequence[Replacement] = ..., dropped_targets: Sequence[str] = ...) -> None: ...
    def replace(self, *, model: Model = ..., q_reference: ArrayLike = ..., frozen_joints: Sequence[str] = ..., dropped_closures: Sequence[str] = ..., replacements: Sequence[Replacement] = ..., dropped_targets: Sequence[str] = ...) -> SerialModel: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def model(self) -> Model:
        """Model"""
        ...
    @property
    def q_reference(self) -> Array:
        """(nq,) of the closed model, where the linkages are frozen"""
        ...
    @property
    def frozen_joints(self) -> Tuple[str, ...]:
        """names"""
        ...
    @property
    def dropped_closures(self) -> Tuple[str, ...]:
        """names"""
        ...
    @property
    def replacements(self) -> Tuple[Replacement, ...]:
        """Replacements"""
        ...
    @property
    def dropped_targets(self) -> Tuple[str, ...]:
        """targets of references that named frozen joints"""
        ...

def make_serial_model(model: Model, q: ArrayLike, armature: str = ...) -> SerialModel:
    """The SerialModel of a robot, frozen at the closed configuration q (nq,).

    armature: of the new motors in kg m^2, or 'reflected'. Raises ModelError when there is no equivalent.
    """
    ...

class LiftMethod:
    NEWTON: ClassVar[LiftMethod]
    NLOPT: ClassVar[LiftMethod]
    __members__: ClassVar[Dict[str, LiftMethod]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class LiftStatus:
    LIFTED: ClassVar[LiftStatus]
    UNREACHABLE_POSTURE: ClassVar[LiftStatus]
    SINGULAR_LINKAGE: ClassVar[LiftStatus]
    INACCURATE: ClassVar[LiftStatus]
    __members__: ClassVar[Dict[str, LiftStatus]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class LiftOptions:
    """How a motion is lifted.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, method: LiftMethod = ..., singular: float = ..., acceleration_tolerance: float = ..., position_tolerance: float = ..., velocity_tolerance: float = ...) -> None: ...
    def replace(self, *, method: LiftMethod = ..., singular: float = ..., acceleration_tolerance: float = ..., position_tolerance: float = ..., velocity_tolerance: float = ...) -> LiftOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def method(self) -> LiftMethod:
        """LiftMethod"""
        ...
    @property
    def singular(self) -> float:
        """margin below which a linkage is at a dead point"""
        ...
    @property
    def acceleration_tolerance(self) -> float:
        """NEWTON: relative to 1 rad/s^2 + the largest"""
        ...
    @property
    def position_tolerance(self) -> float:
        """NLOPT: of the serial joints, rad and m"""
        ...
    @property
    def velocity_tolerance(self) -> float:
        """NLOPT: rad/s and m/s"""
        ...

class LiftNode:
    """How one node was lifted; errors are the largest of the serial coordinates.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, status: LiftStatus = ..., message: str = ..., joint: str = ..., position_error: float = ..., velocity_error: float = ..., acceleration_error: float = ..., margin: float = ..., evaluations: int = ...) -> None: ...
    def replace(self, *, status: LiftStatus = ..., message: str = ..., joint: str = ..., position_error: float = ..., velocity_error: float = ..., acceleration_error: float = ..., margin: float = ..., evaluations: int = ...) -> LiftNode: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def status(self) -> LiftStatus:
        """LiftStatus"""
        ...
    @property
    def message(self) -> str:
        """why not lifted"""
        ...
    @property
    def joint(self) -> str:
        """at which the lift ended, or empty"""
        ...
    @property
    def position_error(self) -> float:
        """rad or m"""
        ...
    @property
    def velocity_error(self) -> float:
        """rad/s or m/s"""
        ...
    @property
    def acceleration_error(self) -> float:
        """error of the closed dynamics, rad/s^2 or m/s^2"""
        ...
    @property
    def margin(self) -> float:
        """smallest over the linkages; 0: dead point"""
        ...
    @property
    def evaluations(self) -> int:
        """by NLopt"""
        ...

class Lift:
    """A serial motion lifted to the closed robot.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, lifted: bool = ..., nodes: Sequence[LiftNode] = ..., result: Optional[Result] = ...) -> None: ...
    def replace(self, *, lifted: bool = ..., nodes: Sequence[LiftNode] = ..., result: Optional[Result] = ...) -> Lift: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def lifted(self) -> bool:
        """all of it"""
        ...
    @property
    def nodes(self) -> Tuple[LiftNode, ...]:
        """LiftNodes up to the first failure"""
        ...
    @property
    def result(self) -> Optional[Result]:
        """Result, as far as it was lifted, or None"""
        ...

def lift(robot: Robot, serial: SerialModel, solution: Solution, options: LiftOptions = ...) -> Lift:
    """Lifts the Solution of a motion of serial.model to the closed robot: the same serial joints, and the motor torques that follow from them.

    The motion must have Euler steps.
    """
    ...

class LengthChange:
    """The distance between two places of one body; the second one moves.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, begin: str = ..., end: str = ..., across: ArrayLike = ..., stretched: str = ...) -> None: ...
    def replace(self, *, begin: str = ..., end: str = ..., across: ArrayLike = ..., stretched: str = ...) -> LengthChange: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def begin(self) -> str:
        """a joint, frame, contact or closure frame"""
        ...
    @property
    def end(self) -> str:
        """another one on the same body, which moves along the line between them"""
        ...
    @property
    def across(self) -> Array:
        """unit vector (3,): only the part perpendicular to it counts; zero: all"""
        ...
    @property
    def stretched(self) -> str:
        """link whose mass, inertia and drawing grow with the length, or empty"""
        ...

class ShiftChange:
    """A joint or frame that moves along a direction of the body it is fixed to.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, of: str = ..., along: ArrayLike = ...) -> None: ...
    def replace(self, *, of: str = ..., along: ArrayLike = ...) -> ShiftChange: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def of(self) -> str:
        """its name"""
        ...
    @property
    def along(self) -> Array:
        """unit vector (3,)"""
        ...

class DesignVariable:
    """A number of a robot that may change.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, name: str = ..., lower: float = ..., upper: float = ..., unit: str = ..., parameter: str = ..., lengths: Sequence[LengthChange] = ..., shifts: Sequence[ShiftChange] = ...) -> None: ...
    def replace(self, *, name: str = ..., lower: float = ..., upper: float = ..., unit: str = ..., parameter: str = ..., lengths: Sequence[LengthChange] = ..., shifts: Sequence[ShiftChange] = ...) -> DesignVariable: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def name(self) -> str:
        """any unique name"""
        ...
    @property
    def lower(self) -> float:
        """bound"""
        ...
    @property
    def upper(self) -> float:
        """bound"""
        ...
    @property
    def unit(self) -> str:
        """"m" unless given"""
        ...
    @property
    def parameter(self) -> str:
        """parameter of the generator, for generated robots; for given ones:"""
        ...
    @property
    def lengths(self) -> Tuple[LengthChange, ...]:
        """the first one is the value; the others change by the same amount"""
        ...
    @property
    def shifts(self) -> Tuple[ShiftChange, ...]:
        """by the value"""
        ...

class Parametrization:
    """A robot as a function of bounded numbers: lengths and shifts of a given one, or parameters of a generator."""
    def __init__(self, model: Model, variables: Sequence[DesignVariable]) -> None:
        """Raises ModelError for unknown names, places on different bodies, bounds that exclude the model."""
        ...
    @staticmethod
    def generated(generator: str, variables: Sequence[DesignVariable], settings: Sequence[Tuple[str, Union[bool, int, float, str]]] = ...) -> Parametrization:
        """Parametrizes a generator (see `generators`); settings: its other parameters by name and value."""
        ...
    @property
    def variables(self) -> Tuple[DesignVariable, ...]:
        """DesignVariables"""
        ...
    @property
    def start(self) -> Array:
        """values of the given robot (n,)"""
        ...
    @property
    def lower(self) -> Array:
        """bounds (n,)"""
        ...
    @property
    def upper(self) -> Array:
        """bounds (n,)"""
        ...
    def make(self, x: ArrayLike) -> Model:
        """The Model at x (n,). Raises ModelError when the numbers do not define a robot."""
        ...

class SearchAlgorithm:
    CRS: ClassVar[SearchAlgorithm]
    ISRES: ClassVar[SearchAlgorithm]
    BOBYQA: ClassVar[SearchAlgorithm]
    SBPLX: ClassVar[SearchAlgorithm]
    SLSQP: ClassVar[SearchAlgorithm]
    MMA: ClassVar[SearchAlgorithm]
    __members__: ClassVar[Dict[str, SearchAlgorithm]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class SearchStage:
    """One algorithm of a search.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, algorithm: SearchAlgorithm = ..., evaluations: int = ..., tolerance: float = ...) -> None: ...
    def replace(self, *, algorithm: SearchAlgorithm = ..., evaluations: int = ..., tolerance: float = ...) -> SearchStage: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def algorithm(self) -> SearchAlgorithm:
        """SearchAlgorithm"""
        ...
    @property
    def evaluations(self) -> int:
        """at most"""
        ...
    @property
    def tolerance(self) -> float:
        """tolerance of the steps, relative to the width of the bounds"""
        ...

class SearchResult:
    """The best point of a search.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, x: ArrayLike = ..., value: float = ..., evaluations: int = ...) -> None: ...
    def replace(self, *, x: ArrayLike = ..., value: float = ..., evaluations: int = ...) -> SearchResult: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def x(self) -> Array:
        """(n,)"""
        ...
    @property
    def value(self) -> float:
        """value of the objective"""
        ...
    @property
    def evaluations(self) -> int:
        """number"""
        ...

def minimize(objective: Callable[[Array], Union[float, Tuple[float, ArrayLike]]], start: ArrayLike, lower: ArrayLike, upper: ArrayLike, stages: Sequence[SearchStage], seed: int = ...) -> SearchResult:
    """Minimizes a function of (n,) within bounds by SearchStages, each from the best point so far.

    objective: returns a number, for SLSQP and MMA with its gradient, (value, (n,)). An exception it raises, or Ctrl-C, ends the search.
    """
    ...

def cost_gradient(solution: Solution, robot: Parametrization, x: ArrayLike) -> Array:
    """Derivatives (n,) of the optimal cost of a motion by every number of its robot, at x (n,).

    solution: of a motion made from a Request for `robot.make(x)`. The derivatives are those of motions solved again for every change, but nothing is solved: the multipliers of the optimum suffice (envelope theorem).
    """
    ...

class PredictiveOptions:
    """Options of predictive control.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, nodes: int = ..., iterations: int = ..., regularization: float = ..., penalty: float = ..., look_ahead: float = ..., dead_point_stop: float = ..., threads: int = ..., own_thread: bool = ..., end_place: float = ..., end_posture: float = ..., end_velocity: float = ...) -> None: ...
    def replace(self, *, nodes: int = ..., iterations: int = ..., regularization: float = ..., penalty: float = ..., look_ahead: float = ..., dead_point_stop: float = ..., threads: int = ..., own_thread: bool = ..., end_place: float = ..., end_posture: float = ..., end_velocity: float = ...) -> PredictiveOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def nodes(self) -> int:
        """number of stages of a window, 10 to 1000"""
        ...
    @property
    def iterations(self) -> int:
        """solver iterations at every stage"""
        ...
    @property
    def regularization(self) -> float:
        """regularization of its sweeps"""
        ...
    @property
    def penalty(self) -> float:
        """penalty of violated constraints"""
        ...
    @property
    def look_ahead(self) -> float:
        """near the end of a contact phase, the last gains computed at least this long before it are reused, s"""
        ...
    @property
    def dead_point_stop(self) -> float:
        """motors brake before the transmission of a linkage reaches this share of that at the start, or the reciprocal"""
        ...
    @property
    def threads(self) -> int:
        """0: all; at most 1024; results are bitwise independent of it"""
        ...
    @property
    def own_thread(self) -> bool:
        """solves run in parallel with control; results then depend on their speed"""
        ...
    @property
    def end_place(self) -> float:
        """weight of heading and place at the end of a window, 1/m^2 or 1"""
        ...
    @property
    def end_posture(self) -> float:
        """weight of the other coordinates"""
        ...
    @property
    def end_velocity(self) -> float:
        """weight of the velocities, s^2/m^2 or s^2"""
        ...

class PredictedFoothold:
    """The predicted next foothold of a foot.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, contact: int = ..., time: float = ..., X_WF: SE3 = ...) -> None: ...
    def replace(self, *, contact: int = ..., time: float = ..., X_WF: SE3 = ...) -> PredictedFoothold: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def contact(self) -> int:
        """index into the model's contacts"""
        ...
    @property
    def time(self) -> float:
        """time of its landing, s"""
        ...
    @property
    def X_WF(self) -> SE3:
        """placement of the contact's frame in the world"""
        ...

class Controller:
    """A feedback law: from measured states to torques. Controller.policy and .predictive make them."""
    @staticmethod
    def policy(solution: Solution, gains: bool = ...) -> Controller:
        """Torques of a Solution, and feedback with its gains."""
        ...
    @staticmethod
    def predictive(model: Model, plan: MotionPlan, solved: Trajectory, problem: ProblemOptions = ..., options: PredictiveOptions = ...) -> Controller:
        """Solves the next second again at every stage. plan: a MotionPlan; solved: Trajectory of its Motion."""
        ...
    def update(self, time: float, q: ArrayLike, v: ArrayLike, delay: float = ...) -> Array:
        """Motor torques (nu,) at a time (s) and a measured state (nq,), (nv,); delay until they act, s.

        Call it in order of time.
        """
        ...
    def reference(self, time: float) -> Tuple[Array, Array]:
        """q (nq,) and v (nv,) that a policy follows at a time, s."""
        ...
    @property
    def duration(self) -> float:
        """duration of a policy, s"""
        ...
    @property
    def counts(self) -> Dict[str, int]:
        """counts of predictive control: solves, failed solves, early and late landings, solves longer than a stage"""
        ...
    @property
    def footholds(self) -> List[PredictedFoothold]:
        """predictive control only: a PredictedFoothold for each contact that lands within the window"""
        ...

class SensorReadings:
    """Sensor readings at one instant of control.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, time: float = ..., motor_positions: ArrayLike = ..., motor_torques: ArrayLike = ..., angular_velocity: ArrayLike = ..., specific_force: ArrayLike = ...) -> None: ...
    def replace(self, *, time: float = ..., motor_positions: ArrayLike = ..., motor_torques: ArrayLike = ..., angular_velocity: ArrayLike = ..., specific_force: ArrayLike = ...) -> SensorReadings: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def time(self) -> float:
        """s"""
        ...
    @property
    def motor_positions(self) -> Array:
        """(nu,), rad or m"""
        ...
    @property
    def motor_torques(self) -> Array:
        """(nu,), torques that acted since the previous instant, N m or N"""
        ...
    @property
    def angular_velocity(self) -> Array:
        """angular velocity of the IMU in its frame (3,), rad/s"""
        ...
    @property
    def specific_force(self) -> Array:
        """acceleration minus gravity in its frame (3,), m/s^2"""
        ...

class EstimatorOptions:
    """Noise is one standard deviation, densities as in data sheets.

    Immutable; `replace` makes a changed copy.
    """
    def __init__(self, imu: SE3 = ..., bandwidth: float = ..., smoothing: float = ..., gyro_noise: float = ..., accelerometer_noise: float = ..., gyro_offset: float = ..., accelerometer_offset: float = ..., gyro_walk: float = ..., accelerometer_walk: float = ..., tilt: float = ..., foot_position: float = ..., foot_attitude: float = ..., foot_slide: float = ..., foot_turn: float = ..., planned_contact: float = ..., surprising_contact: float = ..., slip: float = ...) -> None: ...
    def replace(self, *, imu: SE3 = ..., bandwidth: float = ..., smoothing: float = ..., gyro_noise: float = ..., accelerometer_noise: float = ..., gyro_offset: float = ..., accelerometer_offset: float = ..., gyro_walk: float = ..., accelerometer_walk: float = ..., tilt: float = ..., foot_position: float = ..., foot_attitude: float = ..., foot_slide: float = ..., foot_turn: float = ..., planned_contact: float = ..., surprising_contact: float = ..., slip: float = ...) -> EstimatorOptions: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def imu(self) -> SE3:
        """placement of the IMU in the trunk, SE3"""
        ...
    @property
    def bandwidth(self) -> float:
        """bandwidth of the motor observers, 1/s"""
        ...
    @property
    def smoothing(self) -> float:
        """time constant of the accelerations, s"""
        ...
    @property
    def gyro_noise(self) -> float:
        """rad/s/sqrt(Hz)"""
        ...
    @property
    def accelerometer_noise(self) -> float:
        """m/s^2/sqrt(Hz)"""
        ...
    @property
    def gyro_offset(self) -> float:
        """offset at the start, rad/s"""
        ...
    @property
    def accelerometer_offset(self) -> float:
        """offset at the start, m/s^2"""
        ...
    @property
    def gyro_walk(self) -> float:
        """change of the offset in one second, rad/s"""
        ...
    @property
    def accelerometer_walk(self) -> float:
        """change of the offset in one second, m/s^2"""
        ...
    @property
    def tilt(self) -> float:
        """tilt of the trunk at the start, rad"""
        ...
    @property
    def foot_position(self) -> float:
        """position of a foot from the encoders, m"""
        ...
    @property
    def foot_attitude(self) -> float:
        """attitude of a foot from the encoders, rad"""
        ...
    @property
    def foot_slide(self) -> float:
        """displacement of a standing foot in one second, m"""
        ...
    @property
    def foot_turn(self) -> float:
        """rotation of a standing foot in one second, rad"""
        ...
    @property
    def planned_contact(self) -> float:
        """normal force of a standing foot relative to the weight"""
        ...
    @property
    def surprising_contact(self) -> float:
        """the same where no contact is planned"""
        ...
    @property
    def slip(self) -> float:
        """a foot has slipped if its deviation, 6 on average, exceeds this"""
        ...

class EstimatorStatus:
    OK: ClassVar[EstimatorStatus]
    NEAR_DEAD_POINT: ClassVar[EstimatorStatus]
    NOT_CLOSED: ClassVar[EstimatorStatus]
    NOT_FINITE: ClassVar[EstimatorStatus]
    __members__: ClassVar[Dict[str, EstimatorStatus]]
    def __init__(self, value: int) -> None: ...
    def __int__(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class Estimator:
    """The state of a robot from the encoders of its motors and an IMU in its trunk: passive joints by closing the
    loops, the trunk by an invariant extended Kalman filter, contacts by the forces on the feet.
    """
    def __init__(self, model: Model, q: ArrayLike, options: EstimatorOptions = ...) -> None:
        """q: a closed configuration (nq,). Raises ModelError when motors do not determine a joint."""
        ...
    def reset(self, time: float, q: ArrayLike, v: ArrayLike, contacts: Sequence[str]) -> None:
        """Starts from a closed state (nq,), (nv,), standing on the named contacts."""
        ...
    def update(self, readings: SensorReadings, planned: Sequence[str] = ...) -> EstimatorStatus:
        """Processes the readings of an instant. planned: names of the contacts in the plan at this time."""
        ...
    @property
    def q(self) -> Array:
        """(nq,)"""
        ...
    @property
    def v(self) -> Array:
        """(nv,)"""
        ...
    @property
    def contacts(self) -> Dict[str, bool]:
        """whether each contact stands, by name"""
        ...
    @property
    def wrenches(self) -> Array:
        """wrenches from the ground on the feet in their contact frames (contacts, 6), N and N m"""
        ...
    @property
    def margin(self) -> float:
        """the least that motors move in a unit motion of their linkage; 1 without linkages"""
        ...
    @property
    def message(self) -> str:
        """message of the last status; empty if OK"""
        ...

class World:
    """Physics with contact, in which motors drive a robot and the ground pushes it.

    engine: 'bielle', its own, or 'simbody' and 'mujoco' where it was built with them.
    With `count`, that many worlds are stepped together on all cores: arguments and results have a leading axis of worlds.
    """
    def __init__(self, model: Model, count: Optional[int] = ..., ground: Ground = ..., time_step: float = ..., engine: str = ...) -> None: ...
    @property
    def model(self) -> Model:
        """Model"""
        ...
    @property
    def count(self) -> Optional[int]:
        """number of worlds, or None"""
        ...
    @property
    def engine(self) -> str:
        """its name"""
        ...
    def reset(self, q: ArrayLike, v: ArrayLike, where: ArrayLike = ...) -> WorldState:
        """Sets closed configurations (nq,) and velocities (nv,) that keep them closed; everything else starts again.

        where: (count,), True for the worlds that are reset while the others stay unchanged; None: all. Returns the WorldState.
        """
        ...
    def step(self, u: ArrayLike, duration: float, push: ArrayLike = ...) -> WorldState:
        """Advances by a duration (s) under motor torques (nu,), cut at their limits, and a force at the trunk (3,), N.

        Returns the WorldState; its `ok` is False where the integration failed.
        """
        ...
    @property
    def wrenches(self) -> Array:
        """wrenches from the ground on the feet in their contact frames (contacts, 6), N and N m"""
        ...

class Sensors:
    """Encoders of 14 bits on the motors and an IMU (Bosch BMI088) in the trunk of a robot in a World."""
    def __init__(self, world: World, noise: float = ..., seed: int = ..., imu: SE3 = ...) -> None:
        """noise: factor of the data-sheet noise, 0: exact; imu: its placement in the trunk."""
        ...
    def reset(self, time: float) -> None:
        """Starts from the world's current state; the first readings come after a time, s."""
        ...
    def read(self) -> SensorReadings:
        """SensorReadings at the time of the world; IMU readings are means since the last call."""
        ...

class _residuals:
    """Residuals of the library."""
    @staticmethod
    def com_position(reference: ArrayLike) -> LibraryResidual:
        """Centre of mass minus a reference (3,), m."""
        ...
    @staticmethod
    def com_velocity(reference: ArrayLike) -> LibraryResidual:
        """Velocity of the centre of mass minus a reference (3,), m/s."""
        ...
    @staticmethod
    def frame_placement(model: Model, frame: str, X_WT: SE3) -> LibraryResidual:
        """Log6 of the frame in a target (6,), m and rad."""
        ...
    @staticmethod
    def frame_translation(model: Model, frame: str, reference: ArrayLike) -> LibraryResidual:
        """Position of the frame's origin minus a reference (3,), m."""
        ...
    @staticmethod
    def frame_rotation(model: Model, frame: str, R_WT: ArrayLike) -> LibraryResidual:
        """Log3 of the frame's rotation in a target (3,), rad."""
        ...
    @staticmethod
    def frame_velocity(model: Model, frame: str, reference: ArrayLike = ...) -> LibraryResidual:
        """Velocity of the frame's origin and angular velocity in world axes, minus a reference (6,), m/s and rad/s."""
        ...
    @staticmethod
    def sole_clearance(model: Model, sole: str, half_length: float, half_width: float, ground: Ground, ramp: float) -> LibraryResidual:
        """Heights of the corners of a sole over the ground (4,), of its origin if it has no size (1,), m."""
        ...
    @staticmethod
    def contact_force(constraints: ConstraintSet, contact: int, reference: ArrayLike, axes: ForceAxes = ...) -> LibraryResidual:
        """Force of a contact minus a reference (6,) or (3,), N and N m. contact: its index among those in force."""
        ...
    @staticmethod
    def center_of_pressure(constraints: ConstraintSet, contact: int, axes: ForceAxes = ...) -> LibraryResidual:
        """Centre of pressure of a 6D contact about its origin (2,), m."""
        ...
    @staticmethod
    def wrench_cone(constraints: ConstraintSet, contact: int, half_length: float, half_width: float, friction: float) -> LibraryResidual:
        """Wrench cone of a rectangular sole (17,), or of a point (5,): inside when all rows are positive, N and N m."""
        ...
    @staticmethod
    def joint_position(model: Model, dofs: Sequence[int]) -> LibraryResidual:
        """Coordinates of joints with one dof (n,), rad or m; no dofs: all with limits."""
        ...
    @staticmethod
    def joint_velocity(model: Model, dofs: Sequence[int]) -> LibraryResidual:
        """Velocity coordinates (n,), rad/s or m/s."""
        ...
    @staticmethod
    def motor_power(model: Model, motors: Sequence[int]) -> LibraryResidual:
        """Mechanical power of motors (n,), W; on steps only."""
        ...
    @staticmethod
    def motor_voltage(model: Model, motors: Sequence[int]) -> LibraryResidual:
        """Voltages of motors with a winding and a supply (n,), V; on steps only."""
        ...
    @staticmethod
    def electrical_power(model: Model, losses: ArrayLike) -> LibraryResidual:
        """Electrical powers of all motors, then their torques (2 nu,), W and N m."""
        ...
