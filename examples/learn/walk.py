"""A walk of Bielle's own as arrays over instants of control, and a policy about it that sees what sensors of the robot see.

The policy is linear, and follows the time t of the plan. With what the motors and the IMU read beside what they would read
on the plan,

    e = [motors; their speeds; attitude; angular velocity; 1],                                                          (1)
    u = u*(t) + W(t) (e - [L(t) d; L(t) dd/dt; 0]),                 z = [V(t) e; attitude; angular velocity],           (2)
    dd/dt = (a - d) / TAU,                    a = sum_b psi_b(t) Theta_b (z - mean) / deviation.                        (3)

W and V are fitted to the gains of the solver, which see the true state, and to the place and velocity of the trunk over the
standing foot (imitate.py); they are tables by 24 ms of a step on either foot, and of the time before and after all steps.
Theta is what is learned (ars.py): where the feet should be, relative to the trunk, other than on the plan. L are the motors'
positions by those of the feet, from the loops. Steps on the right foot are mirrored ones on the left: they share Theta,
which is in two parts, for motion forward and to the side. Theta = 0 is the imitated feedback.
"""

import dataclasses
import pickle
from pathlib import Path

import numpy as np

import bielle

PERIOD = 4e-3  # s, of control
BIN = 0.024  # s, that share W and V
EVERY = 6  # instants that share L
STAND = 0.6  # s, after the plan
TAU = 0.03  # s

# In each plane, forward and lateral, three actions a, in m and rad: where the standing foot should be, how it should be
# turned, where the swinging one should be. They are entries of twists of the feet; turns are opposite in their planes.
UNITS = np.array([[0.01, 0.02, 0.02], [0.01, -0.02, 0.02]])
ENTRIES = np.array([[0, 4, 6], [1, 3, 7]])  # of the twists of the standing foot and then the swinging one
# And four features of e, and 1: place and velocity of the trunk over the standing foot, attitude, angular velocity.
SEEN = np.array([[0, 2, 5, 8], [1, 3, 4, 7]])  # of [V e; attitude; angular velocity]
FEATURES, BASES = SEEN.size + 2, 2
SHAPE = (BASES, 2, 3, 5)  # of Theta
LIMIT = 3.0  # of actions, in their units


def solve_walk(robot, speed, steps, serial=False, armature=""):
    """The Solution of a walk of the robot, or of its Approximate Serial model with an armature of make_serial_model()."""
    model = bielle.load_robot(robot).model
    if serial:
        model = bielle.make_serial_model(model, model.standing(), armature).model
    request = bielle.Request(motion="walk", options={"speed": speed, "steps": steps})
    solution = bielle.Motion.make(model, request).solve()
    if not solution.converged:
        raise RuntimeError(f"the walk has not converged: {solution.summary.message}")
    return solution


def rotations(quaternions):
    """(N, 3, 3) of quaternions x y z w (N, 4)."""
    x, y, z, w = np.moveaxis(np.asarray(quaternions), -1, 0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]  # fmt: skip
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def turns(R0, R1):
    """Vectors of the small rotations R0' R1 (N, 3)."""
    R = np.swapaxes(R0, -1, -2) @ R1
    skew = (R - np.swapaxes(R, -1, -2)) / 2
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


@dataclasses.dataclass(frozen=True)
class Plan:
    """A solved walk at the instants k of control; what sensors would read there, and when which foot stands."""

    solution: bielle.Solution
    q: np.ndarray  #: (K, nq)
    v: np.ndarray  #: (K, nv)
    torques: np.ndarray  #: (K, nu), for the period that begins
    read: np.ndarray  #: (K, 2 nu + 6): motors, their speeds, angular velocity, specific force
    rotation: np.ndarray  #: (K, 3, 3), of the trunk
    velocity: np.ndarray  #: (K, 3), of the trunk in the world
    over: np.ndarray  #: (K, 2), place of the trunk over the standing foot, in the world
    left: np.ndarray  #: (K,), whether the left foot is the standing one
    basis: np.ndarray  #: (K, 2), psi: from the beginning of a step on, towards its end
    bins: np.ndarray  #: (K,), row of the tables W and V
    legs: np.ndarray  #: (K / EVERY, nu, 12), L: motors by twists of the left and the right foot in their frames

    @property
    def model(self):
        return self.solution.motion.model

    @property
    def num_instants(self):
        return len(self.q)

    @property
    def duration(self):
        return PERIOD * (self.num_instants - 1)

    def instant(self, time):
        return np.minimum(np.rint(np.asarray(time) / PERIOD).astype(int), self.num_instants - 1)


def make_plan(solution):
    model = solution.motion.model
    follow = bielle.Controller.policy(solution, gains=False)
    times = PERIOD * np.arange(int((follow.duration + STAND) / PERIOD) + 1)
    q, v = (np.array(part) for part in zip(*(follow.reference(time) for time in times)))
    torques = np.array([follow.update(*now, PERIOD / 2) for now in zip(times, q, v)])
    motors = [list(model.q_names).index(name) for name in model.u_names]
    R = rotations(q[:, 3:7])
    velocity = np.einsum("kij,kj->ki", R, v[:, :3])
    turn = turns(R[:-1], R[1:]) / PERIOD
    felt = np.einsum("kji,kj->ki", R[:-1], np.diff(velocity, axis=0) / PERIOD - model.gravity)
    felt -= np.cross(turn * PERIOD / 2, felt)  # in the middle of the period
    read = np.hstack([q[1:, motors], np.diff(q[:, motors], axis=0) / PERIOD, turn, felt])
    first = np.hstack([q[0, motors], np.zeros(model.nu + 3), -R[0].T @ model.gravity])
    left, basis, bins = time_steps(solution.motion, times)
    feet = np.array([model.placement(q, name)[:, :2, 3] for name in ("foot_left", "foot_right")])
    legs = np.array([calc_legs(model, q[k]) for k in range(0, len(q), EVERY)])
    return Plan(solution, q, v, torques, np.vstack([first, read]), R, velocity, q[:, :2] - np.where(left[:, None], *feet), left,
                basis, bins, legs)  # fmt: skip


def time_steps(motion, times):
    """(left, basis, bins) of a Plan. A step goes from one lift-off to the next."""
    names, begin, steps = [contact.name for contact in motion.model.contacts], 0.0, []  # (begin, end, whether on the left foot)
    for phase in motion.schedule.phases:
        length = phase.nodes * phase.dt
        if len(phase.contacts) == 1:
            steps.append((begin, begin + length, names[phase.contacts[0].contact] == "foot_left"))
        begin += length
    ends = [lift for lift, _, _ in steps[1:]] + [steps[-1][1]]
    longest = max(end - lift for (lift, _, _), end in zip(steps, ends))
    number = int(np.ceil(longest / BIN))
    left, basis = np.ones(len(times), dtype=bool), np.zeros((len(times), BASES))
    bins = 2 * number + np.minimum(times, begin) // BIN
    for (lift, _, stand), end in zip(steps, ends):
        here = (times >= lift - 1e-9) & (times < end - 1e-9)
        left[here] = stand
        basis[here] = 1 - np.abs((times[here, None] - lift) / (end - lift) - [0, 1])
        bins[here] = number * stand + (times[here] - lift + 1e-9) // BIN
    return left, basis, np.unique(bins, return_inverse=True)[1]


def calc_legs(model, q):
    """(nu, 12): speeds of the motors for twists of the feet while the trunk rests, from the loops."""
    trunk = np.eye(6, model.nv)
    loops = model.closure_jacobian(q)
    feet = [model.frame_jacobian(q, name) for name in ("foot_left", "foot_right")]
    A = np.vstack([loops, trunk, *feet])
    b = np.vstack([np.zeros((len(loops) + 6, 12)), np.eye(12)])
    v = np.linalg.lstsq(A, b, rcond=1e-9)[0]
    return v[[motor.dof for motor in model.motors]]


def save(path, write):
    """Calls write(file), and renames the file once it is complete."""
    part = Path(f"{path}.part")
    with open(part, "wb") as file:
        write(file)
    part.replace(path)


def load_plan(directory, robot, speed, steps, serial, armature=""):
    """Solves the walk, or takes it from a directory where this was done: LAPACK's last bits depend on where arrays lie."""
    path = Path(directory) / "walk.pickle"
    if not path.exists():
        plan = make_plan(solve_walk(robot, speed, steps, serial, armature))
        save(path, lambda file: pickle.dump(plan, file))
    return pickle.loads(path.read_bytes())


class Policy:
    """Eq. (1) to (3) for many robots: W is `gains` (bins, 2 nu + 7, nu), V `observer` (bins, 2 nu + 7, 4), transposed."""

    def __init__(self, plan, gains, observer):
        self.plan, self.gains, self.observer = plan, gains, observer

    def begin(self, count):
        self.attitude, self.offsets = np.zeros((count, 3)), np.zeros((count, 12))
        self.zero = np.zeros((count, 6))

    def observe(self, k, observations):
        """e (N, 2 nu + 7) at the instants k (N,). A robot begins at rest: there gyro and accelerometer are zeroed."""
        plan, nu = self.plan, self.plan.model.nu
        read = np.hstack([observations[:, : 2 * nu], observations[:, 3 * nu :]])
        first = k == 0
        self.zero[first] = (read - plan.read[k])[first, -6:]
        self.attitude[first], self.offsets[first] = 0, 0
        error = read - plan.read[k]
        error[:, -6:] -= self.zero
        leaning = np.column_stack([error[:, -2], -error[:, -3]]) / 9.81
        self.attitude += PERIOD * error[:, -6:-3]
        self.attitude[:, :2] += PERIOD / 3.0 * (leaning - self.attitude[:, :2])
        return np.hstack([error[:, : 2 * nu], self.attitude, error[:, -6:-3], np.ones((len(k), 1))])

    def features(self, k, e):
        """z (N, 10): five for each plane; lateral ones are mirrored where the right foot stands, but for their 1."""
        seen = np.hstack([np.einsum("ni,nij->nj", e, self.observer[self.plan.bins[k]]), e[:, 2 * self.plan.model.nu : -1]])
        z = np.ones((len(k), 2, 5))
        z[:, :, :4] = seen[:, SEEN]
        z[~self.plan.left[k], 1, :4] *= -1
        return z.reshape(-1, FEATURES)

    def act(self, k, z, thetas):
        """a (N, 2, 3) in units, for normalized z and a Theta each (N, 2, 2, 3, 5)."""
        actions = np.einsum("nb,nbpij,npj->npi", self.plan.basis[k], thetas, z.reshape(-1, 2, 5))
        return np.clip(actions, -LIMIT, LIMIT)

    def torques(self, k, e, actions):
        """u (N, nu), for actions in units, those of the left foot standing."""
        plan, nu = self.plan, self.plan.model.nu
        moved = UNITS * actions
        moved[~plan.left[k], 1] *= -1
        twists = np.zeros((len(k), 12))
        twists[:, ENTRIES] = moved
        twists[~plan.left[k]] = np.roll(twists[~plan.left[k]], 6, axis=1)  # of the left foot first
        rates = (twists - self.offsets) / TAU
        self.offsets = self.offsets + PERIOD * rates
        legs, e = plan.legs[k // EVERY], e.copy()
        e[:, :nu] -= np.einsum("nij,nj->ni", legs, self.offsets)
        e[:, nu : 2 * nu] -= np.einsum("nij,nj->ni", legs, rates)
        return plan.torques[k] + np.einsum("ni,nij->nj", e, self.gains[plan.bins[k]])
