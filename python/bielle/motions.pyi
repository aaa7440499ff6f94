"""Written by make_stubs.py."""

from typing import Callable, Dict, Iterable, Mapping, Optional, Union

from ._bielle import Iteration, ProblemOptions, Record, Request, Result, Robot, SolverOptions, motions

Callback = Callable[[Iteration], Optional[bool]]
WarmStart = Union[str, Record, Result]
FUNCTIONS: Dict[str, Callable[..., Result]]
__all__ = ['FUNCTIONS', 'motions', 'solve_request', 'solve_sequence', 'solve_squat', 'solve_walk', 'solve_side_walk', 'solve_turn', 'solve_stairs', 'solve_footholds', 'solve_box', 'solve_gap', 'solve_jump', 'solve_run', 'solve_hop']

def solve_request(robot: Union[str, Robot], request: Request, problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result: ...
def solve_sequence(robot: Union[str, Robot], sequence: Iterable[str], options: Mapping[str, Union[bool, float, str]] = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result: ...

def solve_squat(robot: Union[str, Robot], *, depth: float = ..., duration: float = ..., settle: float = ..., time_step: float = ..., com_weight: float = ..., state_weight: float = ..., torso_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., friction: float = ..., cone_margin: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """go down and up again with feet flat; the height of the centre of mass follows a sine.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    depth: lowest height of the centre of mass divided by its initial height [1], default 0.7
    duration: time to go down and come back [s], default 2.4
    settle: time at rest before and after [s], default 0.3
    time_step: length of a shooting stage [s], default 0.015
    com_weight: follow the height of the centre of mass [1/m^2], default 100000
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    force_weight: share the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 1
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 10000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 200
    closure_kp: position gain of the stabilisation of closures [1/s^2], default 0
    closure_kd: velocity gain of the stabilisation of closures [1/s], default 0
    """
    ...

def solve_walk(robot: Union[str, Robot], *, speed: float = ..., steps: int = ..., start_support: float = ..., start_pressure: float = ..., single_support: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """steps forward or backward on level ground, from standing to standing.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    speed: speed of the steady steps; negative: backward [m/s], default 0.5
    steps: number of steps; the last one brings the feet together [1], default 6
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    single_support: duration with one foot on the ground [s], default 0.36
    double_support: duration with both feet on the ground between two steps [s], default 0.045
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.04
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.95
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 3000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    """
    ...

def solve_side_walk(robot: Union[str, Robot], *, speed: float = ..., steps: int = ..., start_support: float = ..., start_pressure: float = ..., single_support: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """steps to the left or to the right.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    speed: speed of the steady steps to the left; negative: to the right [m/s], default 0.2
    steps: number of steps: one opens the stance, the next one closes it [1], default 6
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    single_support: duration with one foot on the ground [s], default 0.36
    double_support: duration with both feet on the ground between two steps [s], default 0.045
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.04
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.95
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 3000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    """
    ...

def solve_turn(robot: Union[str, Robot], *, angle: float = ..., radius: float = ..., steps: int = ..., start_support: float = ..., start_pressure: float = ..., single_support: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """steps on the spot or along an arc, to another heading.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    angle: angle to turn to the left; negative: to the right [rad], default 1.57
    radius: radius of the arc to walk along; 0: turn on the spot [m], default 0
    steps: number of steps; the last one brings the feet together [1], default 8
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    single_support: duration with one foot on the ground [s], default 0.36
    double_support: duration with both feet on the ground between two steps [s], default 0.045
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.04
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.95
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 3000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    """
    ...

def solve_stairs(robot: Union[str, Robot], *, height: float = ..., depth: float = ..., slope: float = ..., stairs: int = ..., speed: float = ..., width: float = ..., start_support: float = ..., start_pressure: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """climb or descend stairs, one foot per step.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    height: height of a step; negative: down [m], default 0.06
    depth: depth of a step [m], default 0.2
    slope: height over depth; replaces the height unless 0 [1], default 0
    stairs: number of steps of the staircase [1], default 4
    speed: forward speed; with the depth it determines the duration of a step [m/s], default 0.3
    width: width of the stairs [m], default 0.8
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    double_support: duration with both feet on the ground between two steps [s], default 0.09
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.03
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0.1
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.9
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 1000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    """
    ...

def solve_footholds(robot: Union[str, Robot], *, rim: float = ..., start_support: float = ..., start_pressure: float = ..., single_support: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., footholds: str, problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """steps on uneven footholds from a file.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    rim: width of the stones around the soles [m], default 0.02
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    single_support: duration with one foot on the ground [s], default 0.5
    double_support: duration with both feet on the ground between two steps [s], default 0.09
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.04
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0.15
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.85
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 1000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    footholds: path of a file
    """
    ...

def solve_box(robot: Union[str, Robot], *, height: float = ..., length: float = ..., width: float = ..., distance: float = ..., down: bool = ..., start_support: float = ..., start_pressure: float = ..., single_support: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """a step onto a box, and down again if requested.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    height: height of the box [m], default 0.1
    length: length of its top; the feet stand in the middle [m], default 0.2
    width: width of the box [m], default 0.8
    distance: distance from the soles to the box [m], default 0.05
    down: step down again behind the box [bool], default False
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    single_support: duration with one foot on the ground [s], default 0.6
    double_support: duration with both feet on the ground between two steps [s], default 0.09
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.03
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0.25
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.75
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 1000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    """
    ...

def solve_gap(robot: Union[str, Robot], *, width: float = ..., distance: float = ..., depth: float = ..., start_support: float = ..., start_pressure: float = ..., single_support: float = ..., double_support: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """a step over a gap in the ground.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    width: width of the gap in the direction of travel [m], default 0.15
    distance: distance of the soles from its edges, on both sides [m], default 0.02
    depth: depth of the gap's floor below its banks [m], default 0.3
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    single_support: duration with one foot on the ground [s], default 0.36
    double_support: duration with both feet on the ground between two steps [s], default 0.045
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.04
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 0.95
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 3000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 10
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    """
    ...

def solve_jump(robot: Union[str, Robot], *, flight: float = ..., length: float = ..., stand: float = ..., push: float = ..., land: float = ..., settle: float = ..., stretch: float = ..., clearance: float = ..., friction: float = ..., cone_margin: float = ..., time_step: float = ..., apex_weight: float = ..., com_weight: float = ..., state_weight: float = ..., torso_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., swing_weight: float = ..., swing_rotation_weight: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """push off, fly for a given time, land; the time determines the height of the centre of mass at mid-flight.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    flight: time in the air, rounded to an even number of time steps; the height follows [s], default 0.3
    length: distance from take-off to landing, forward [m], default 0
    stand: time at rest before the push [s], default 0.15
    push: time of acceleration with the feet on the ground [s], default 0.3
    land: time from touchdown until the body is braked [s], default 0.3
    settle: time to come back to rest [s], default 0.4
    stretch: height of the centre of mass at take-off and touchdown above that at the start [m], default 0.02
    clearance: least height of the soles at mid-flight [m], default 0.04
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    time_step: length of a shooting stage [s], default 0.002
    apex_weight: height of the centre of mass at mid-flight [1/m^2], default 10000
    com_weight: height of the centre of mass on the ground [1/m^2], default 1000
    state_weight: stay near the standing posture, at rest [1], default 0.02
    torso_weight: keep the torso upright, within the state regularization [1], default 2000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.003
    force_weight: share the load evenly between the feet and over time, relative to (m g)^2 [1], default 30
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 1
    swing_weight: follow the path of the feet in flight [1/m^2], default 100000
    swing_rotation_weight: keep the soles level in flight [1], default 100
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts and closures (at most 1/(3 h^2) with the time step h; Euler steps: 1/(2 h^2)) [1/s^2], default 10000
    contact_kd: velocity gain of the stabilisation of contacts and closures (at most 1/h) [1/s], default 200
    """
    ...

def solve_run(robot: Union[str, Robot], *, speed: float = ..., steps: int = ..., flight: float = ..., stance: float = ..., start_support: float = ..., start_pressure: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., stretch: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """steps with flights between them, from standing to standing.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    speed: speed of the steady steps; negative: backward [m/s], default 1
    steps: number of steps; the last one brings the feet together [1], default 8
    flight: time in the air between two steps [s], default 0.08
    stance: time with one foot on the ground [s], default 0.24
    start_support: least duration of double support before the first step [s], default 0.3
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.04
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 1
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 3000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 100
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    stretch: height of the centre of mass at take-off and touchdown above that at the start [m], default 0
    """
    ...

def solve_hop(robot: Union[str, Robot], *, foot: str = ..., hops: int = ..., flight: float = ..., length: float = ..., stance: float = ..., start_support: float = ..., start_pressure: float = ..., end_support: float = ..., time_step: float = ..., swing_height: float = ..., swing_apex: float = ..., swing_leave: float = ..., swing_arrive: float = ..., friction: float = ..., cone_margin: float = ..., rigid_landing: bool = ..., landing_speed: float = ..., foothold_room: float = ..., state_weight: float = ..., torso_weight: float = ..., heading_weight: float = ..., motor_weight: float = ..., control_weight: float = ..., com_weight: float = ..., com_height_weight: float = ..., com_velocity_weight: float = ..., swing_weight: float = ..., swing_velocity_weight: float = ..., swing_rotation_weight: float = ..., foothold_weight: float = ..., force_weight: float = ..., pressure_weight: float = ..., feet_distance: float = ..., terminal_weight: float = ..., contact_kp: float = ..., contact_kd: float = ..., closure_kp: float = ..., closure_kd: float = ..., stretch: float = ..., problem: ProblemOptions = ..., solver: SolverOptions = ..., warm_start: Optional[WarmStart] = ..., callback: Optional[Callback] = ...) -> Result:
    """lift one foot, take off and land on the other one.

    robot: a Robot, or the name of one
    problem: ProblemOptions: formulation, limits, free durations, objective
    solver: SolverOptions: iterations, threads, tolerances
    warm_start: a Result, a Record or the directory of a result to start from
    callback: called with each Iteration; returning False stops the solver
    foot: foot to hop on [left or right], default left
    hops: number of flights [1], default 1
    flight: time in the air of each hop [s], default 0.15
    length: length of each hop, forward; negative: backward [m], default 0
    stance: time on one foot before the first flight, between flights and after the last one [s], default 0.3
    start_support: least duration of double support before the first step [s], default 0.6
    start_pressure: start_support is lengthened until the centre of pressure stays within this share of the soles; 0: never [1], default 0.4
    end_support: duration of double support after the last step [s], default 0.45
    time_step: length of a shooting stage; 0: 12 ms, 5 ms with flights, less for fast swings [s], default 0
    swing_height: apex of the swing foot above the higher end of its path [m], default 0.02
    swing_apex: time of the apex as a fraction of the swing, from 0 to 1 [1], default 0.5
    swing_leave: time at which the swing foot starts to move horizontally, from 0 to 1 [1], default 0
    swing_arrive: time at which the swing foot is above its foothold, from 0 to 1 [1], default 1
    friction: friction coefficient [1], default 0.7
    cone_margin: share of friction and soles that wrenches leave unused [1], default 0.01
    rigid_landing: a rigid impact at every landing, as a separate stage [bool], default False
    landing_speed: with rigid_landing: landing velocity of the feet, below 0.1; 0: at rest [m/s], default 0
    foothold_room: largest distance along x and y between a foot's landing place and its foothold; 0: exactly on it [m], default 0
    state_weight: stay near the standing posture, at rest [1], default 0.1
    torso_weight: keep the torso upright, within the state regularization [1], default 10000
    heading_weight: keep the heading of the feet, within the state regularization [1], default 1000
    motor_weight: keep motors slow, within the state regularization [1], default 1
    control_weight: keep motor torques small [1/(N m)^2], default 0.001
    com_weight: horizontal position of the centre of mass [1/m^2], default 100
    com_height_weight: height of the centre of mass [1/m^2], default 3000
    com_velocity_weight: velocity of the centre of mass in the direction of travel [s^2/m^2], default 0
    swing_weight: path of the swing foot [1/m^2], default 10000
    swing_velocity_weight: velocity of the swing foot along its path [s^2/m^2], default 200
    swing_rotation_weight: orientation of the swing foot [1], default 1000
    foothold_weight: with foothold_room: land near the foothold, swing near its horizontal path [1/m^2], default 20
    force_weight: transfer the weight evenly between the feet, relative to (m g)^2 [1], default 100
    pressure_weight: keep the centre of pressure in the middle of the sole [1], default 10
    feet_distance: least distance between the soles, or that of the footholds if smaller [m], default 0.01
    terminal_weight: position of the centre of mass at the end [1/m^2], default 1000
    contact_kp: position gain of the stabilisation of contacts (at most 1/(3 h^2) with the time step h; Euler: 1/(2 h^2)) [1/s^2], default 2000
    contact_kd: velocity gain of the stabilisation of contacts (at most 1/h) [1/s], default 100
    closure_kp: position gain of the stabilisation of closures (full formulation) [1/s^2], default 10000
    closure_kd: velocity gain of the stabilisation of closures (full formulation) [1/s], default 100
    stretch: height of the centre of mass at take-off and touchdown above that at the start [m], default 0
    """
    ...
