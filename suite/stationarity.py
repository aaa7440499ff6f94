#!/usr/bin/env python3
"""Whether the optimum of a problem is stationary with the multipliers of its archive, by differences and NumPy alone.

    suite/stationarity.py FILE.json ...

With L = sum h l + sum y . c, and the steps x+ = f(x, u) of docs/problems.md, Eqs. (2) to (4), costates and gradients are

    p_N = dL/dx_N,    Q_k = dL/du_k + F_u^T p_{k+1},    p_k = dL/dx_k + F_x^T p_{k+1} + K_k^T Q_k,              (1)

where torques that are not at their bounds follow a state by K_k, of a linear-quadratic regulator. That changes nothing where Q
vanishes; without it, errors of Q would grow from step to step as the robot falls.

At a local optimum Q vanishes but for torques at their bounds, which it pulls outwards; y is positive at upper bounds only, and
negative at lower ones. Columns of F are central differences: of a step that is perturbed by e, every equation, such as that a loop is
closed, is solved by one step of Newton's method from the solution in the archive. That leaves an error of e^2, which differences
between e and -e do not see. A tangent vector of closed states is N y, with N^T W N = 1, as (3) of docs/problems.md has it.
"""
import sys

import numpy as np

from mechanism import RANK, Loops, State, apply, make_plane, transpose
from problem import Problem, read_bounds

TORQUE = 1e-4  # weight of squares of torques in the regulator, over that of states
STEP = 1e-5  # rad, m, rad/s, m/s, and over the largest torque
TOLERANCE = 1e-5  # of Q, over the largest sum of its terms
COMPLEMENTARITY = 1e-6  # of y times the distance from the bound, over the cost


class Tangents:
    """Bases N of the closed motions at states, and coordinates in them."""

    def __init__(self, state):
        self.loops, self.root = Loops(state), np.sqrt(state.mechanism.metric)
        s, rows = np.linalg.svd(self.loops.J / self.root)[1:]
        counts = (s > RANK * s[:, :1]).sum(1)
        if (counts != counts[0]).any():
            raise ValueError("the closures lose rank at a node: there are no coordinates")
        self.scaled = rows[:, counts[0]:]  # (W^1/2 N)^T
        self.size = self.scaled.shape[1]

    def get_column(self, j):
        return self.scaled[:, j] / self.root

    def measure(self, d):
        return apply(self.scaled, self.root * d)


def differentiate_sum(m, q, d):
    """The derivative of q (+) d by d (K, nv, nv), which has a block for each joint, in coordinates about the sum."""
    out = np.zeros((len(q), m.nv, m.nv))
    end = m.add(q, d)
    for j in range(6):
        dofs = [joint.v.start + j for joint in m.joints if joint.v.start + j < joint.v.stop]
        step = np.zeros(m.nv)
        step[dofs] = STEP
        column = (m.subtract(m.add(q, d + step), end) - m.subtract(m.add(q, d - step), end)) / (2 * STEP)
        for joint in m.joints:
            if joint.v.start + j < joint.v.stop:
                out[:, joint.v, joint.v.start + j] = column[:, joint.v]
    return out


class Drift:
    """(3) of docs/problems.md from (q, v) to (q1, v1) in the time t (K, 1), and from states beside."""

    def __init__(self, m, t, q, v, loops, q1, v1, loops1):
        self.m, self.t, self.loops, self.loops1, self.root = m, t, loops, loops1, np.sqrt(m.metric)
        w = m.subtract(q1, q) / t
        self.zeta, self.mu = (apply(transpose(l.inverse), apply(l.rows, self.root * d))
                              for l, d in ((loops, v - w), (loops1, w - v1)))
        J_d = differentiate_sum(m, q, t * w) * self.root[:, None] / self.root
        self.gram = t[:, :, None] * loops1.rows @ J_d @ transpose(loops.rows)
        idle = ~loops.rows.any(-1)  # redundant rows
        self.gram += idle[:, :, None] * np.eye(idle.shape[1])

    def move(self, J, q, v):
        """J: of the closures at q."""
        m = self.m
        w = v - apply(transpose(J), self.zeta) / m.metric
        open_ = State(m, m.add(q, self.t * w)).calc_closures()[0]
        left = np.linalg.solve(self.gram, apply(self.loops1.inverse, open_)[..., None])[..., 0]
        w = w + apply(transpose(self.loops.rows), left) / self.root  # J is minus the derivative of what is open
        q1 = m.add(q, self.t * w)
        J1 = State(m, q1).calc_closures()[1]
        v1 = w - apply(transpose(J1), self.mu) / m.metric
        return J1, q1, v1 - self.loops1.solve(apply(J1, v1))


def get_axes(kind):
    """Rows of a contact in its frame: of wrenches, the transpose."""
    if kind != "5d":
        return np.eye(6)[:{"6d": 6, "3d": 3}[kind]]
    rows = np.zeros((5, 6))
    rows[:3, :3], rows[3:, 3:] = np.eye(3), make_plane([1, 0, 0])
    return rows


class Kick:
    """(2) of docs/problems.md half way along steps: accelerations and forces of the contacts at states beside."""

    def __init__(self, problem, t):
        self.problem, self.m = problem, problem.mechanism
        m, K = self.m, problem.stages
        self.root, self.tau = np.sqrt(m.metric), np.zeros((K, m.nv))
        half = State(m, t["q_mid"], t["v_mid"])
        none = half.calc_inverse_dynamics(np.zeros((K, m.nv)))
        M = np.stack([half.calc_inverse_dynamics(np.tile(row, (K, 1))) - none for row in np.eye(m.nv)], -1)
        J, _ = self.get_rows(half)
        U, s, rows = np.linalg.svd(J / self.root)
        counts = s > RANK * s[:, :1]
        free = 1 - np.pad(counts, ((0, 0), (0, m.nv - s.shape[1]))).astype(float)  # of the rows of V^T
        self.rows = rows[:, :s.shape[1]] * counts[:, :, None]
        self.inverse = transpose(U[:, :, :s.shape[1]]) / np.where(counts, s, np.inf)[:, :, None]
        N = transpose(rows * free[:, :, None]) / self.root[:, None]
        inner = transpose(N) @ M @ N + (1 - free)[:, :, None] * np.eye(m.nv)
        self.M, self.N, self.inner = M, N, inner

    def get_rows(self, state):
        """Jacobian and drift of the closures and of all contacts, those that do not stand zero."""
        _, J, gamma = state.calc_closures()
        rows = np.zeros((len(J), 6 * len(self.m.contacts), self.m.nv))
        drift = np.zeros(rows.shape[:2])
        for index, ks in self.problem.group("contacts").items():
            part = state.select(ks)
            for place in self.problem.data["contact_sets"][index]:
                _, J_c, gamma_c = part.calc_contact(place)
                first = 6 * place["contact"]
                rows[ks, first:first + J_c.shape[1]] = J_c
                drift[ks, first:first + J_c.shape[1]] = gamma_c
        return np.concatenate([J, rows], 1), np.concatenate([gamma, drift], 1)

    def stabilize(self, state):
        """k_d J_c v - k_p r_c of the contacts at the start of the steps."""
        out = np.zeros((len(state.q), 6 * len(self.m.contacts)))
        for index, ks in self.problem.group("contacts").items():
            part = state.select(ks)
            for place in self.problem.data["contact_sets"][index]:
                r, J_c, _ = part.calc_contact(place)
                first = 6 * place["contact"]
                out[ks, first:first + J_c.shape[1]] = place["kd"] * apply(J_c, part.v) - place["kp"] * r
        return out

    def find_forces(self, state, a, tau):
        """Those of all rows that accelerations need."""
        return apply(transpose(self.inverse), apply(self.rows, (state.calc_inverse_dynamics(a) - tau) / self.root))

    def solve(self, state, stabilization, tau, a, forces):
        """Accelerations and forces at a state beside that of the known ones."""
        J, gamma = self.get_rows(state)
        gamma[:, gamma.shape[1] - stabilization.shape[1]:] += stabilization
        left = state.calc_inverse_dynamics(a) - tau - apply(transpose(J), forces)
        across = apply(transpose(self.rows), apply(self.inverse, apply(J, a) + gamma)) / self.root
        along = np.linalg.solve(self.inner, apply(transpose(self.N), left - apply(self.M, across))[..., None])[..., 0]
        step = across + apply(self.N, along)
        left = (left - apply(self.M, step)) / self.root
        return a - step, forces + apply(transpose(self.inverse), apply(self.rows, left))


class Steps:
    """The steps of a trajectory, from states and torques beside."""

    def __init__(self, problem, t):
        self.problem, self.m, self.t, self.h = problem, problem.mechanism, t, problem.dt[:, None]
        m, h = self.m, self.h
        half = Loops(State(m, t["q_mid"]))
        self.start, self.end = Loops(State(m, t["q"][:-1])), Loops(State(m, t["q"][1:]))
        before = half.project(m.subtract(t["q_mid"], t["q"][:-1]) / (h / 2))
        self.first = Drift(m, h / 2, t["q"][:-1], t["v"][:-1], self.start, t["q_mid"], before, half)
        self.second = Drift(m, h / 2, t["q_mid"], before + h * t["a"], half, t["q"][1:], t["v"][1:], self.end)
        self.kick, self.half = Kick(problem, t), half
        at_before, gain = State(m, t["q_mid"], before), (t["v_mid"] - before) / (h / 2)
        self.foreseen = gain - half.solve(Loops(at_before).gamma)
        tau = self.get_torques(t["u"])
        self.gain = gain
        self.forces_foreseen = self.kick.find_forces(at_before, self.foreseen, tau)
        self.forces = self.kick.find_forces(State(m, t["q_mid"], t["v_mid"]), t["a"], tau)

    def get_torques(self, u):
        tau = np.zeros((self.problem.stages, self.m.nv))
        tau[:, self.m.motor_dofs] = u
        return tau

    def step(self, q, v, u):
        """Of all stages: q+ and v+, and what residuals read of the step."""
        m, tau, state = self.m, self.get_torques(u), State(self.m, q, v)
        J_half, q_half, v_half = self.first.move(state.calc_closures()[1], q, v)
        none = np.zeros((len(q), 6 * len(m.contacts)))
        foreseen, _ = self.kick.solve(State(m, q_half, v_half), none, tau, self.foreseen, self.forces_foreseen)
        # (1 - J^+ J) a_0 = a_0 - W^-1 J^T x, of which x is known half way along the step of the archive.
        known = apply(transpose(self.half.inverse), apply(self.half.rows, self.half.root * (self.foreseen - self.gain)))
        gain = foreseen - apply(transpose(J_half), known) / m.metric
        gain = gain - self.half.solve(apply(J_half, gain))
        v_mid = v_half + self.h / 2 * gain
        a, forces = self.kick.solve(State(m, q_half, v_mid), self.kick.stabilize(state), tau, self.t["a"], self.forces)
        _, q1, v1 = self.second.move(J_half, q_half, v_half + self.h * a)
        wrenches = np.zeros((len(q), len(m.contacts), 6))
        first = forces.shape[1] - 6 * len(m.contacts)
        for c, contact in enumerate(m.contacts):
            axes = get_axes(contact["kind"])
            wrenches[:, c] = forces[:, first + 6 * c:first + 6 * c + len(axes)] @ axes
        return q1, v1, {"v_mid": v_mid, "contact_wrenches": wrenches}


class Derivatives:
    """F (N, 2r, 2r + nu), and of costs (N + 1) and rows of constraints (R) the derivatives by y, y_v and u of their node."""

    def __init__(self, problem, t):
        m, steps = problem.mechanism, Steps(problem, t)
        tangents = Tangents(State(m, t["q"]))
        r, nu, N = tangents.size, len(m.motor_dofs), problem.stages
        self.F = np.zeros((N, 2 * r, 2 * r + nu))
        self.cost, self.rows = np.zeros((N + 1, 2 * r + nu)), np.zeros((len(t["constraints"]), 2 * r + nu))
        torque = STEP * np.abs(t["u"]).max()
        ahead = lambda d: apply(tangents.scaled[1:], tangents.root * d)
        for j in range(2 * r + nu):
            ends = []
            for sign in (1, -1):
                q, v, u = t["q"], t["v"], t["u"]
                if j < 2 * r:
                    column = tangents.get_column(j % r)
                    step = sign * STEP / np.abs(column).max(-1, keepdims=True)
                    if j < r:
                        q = m.add(q, step * column)
                    else:
                        v = v + step * column
                    v = v - tangents.loops.solve(apply(State(m, q).calc_closures()[1], v))
                else:
                    step = np.full((N + 1, 1), sign * torque)
                    u = u + sign * torque * np.eye(nu)[j - 2 * r]
                q1, v1, read = steps.step(q[:-1], v[:-1], u)
                cost, rows, _, _ = problem.evaluate({"q": q, "v": v, "u": u, **read})
                ends.append((ahead(m.subtract(q1, t["q"][1:])), ahead(v1 - t["v"][1:]), cost, rows))
            width = 2 * np.abs(step)
            by_q, by_v, by_cost, by_rows = (a - b for a, b in zip(*ends))
            self.F[:, :, j] = np.concatenate([by_q, by_v], 1) / width[:-1]
            self.cost[:, j] = by_cost / width[:, 0]
            self.rows[:, j] = by_rows / np.repeat(width[:, 0], t["constraint_rows"].astype(int))
        self.states = 2 * r


def judge(problem, t, derivatives):
    """[(what, value, bound), ...]"""
    N, states, F = problem.stages, derivatives.states, derivatives.F
    _, rows, lower, upper = problem.evaluate(t)
    if "multipliers" not in t:
        raise ValueError(f"{problem.path}: the archive has no multipliers; solve the motion with this version of Bielle")
    y, node = t["multipliers"], np.repeat(np.arange(N + 1), t["constraint_rows"].astype(int))
    pull = derivatives.rows * y[:, None]
    gradient, size = derivatives.cost.copy(), np.abs(derivatives.cost)
    np.add.at(gradient, node, pull)
    np.add.at(size, node, np.abs(pull))
    limits = np.array([read_bounds({"l": problem.data["effort_limits"][stage["effort_limit"]]}, "l", np.inf)
                       for stage in problem.stage[:-1]])
    at = np.abs(t["u"]) >= (1 - 1e-9) * limits
    Q, terms = np.zeros((N, F.shape[2] - states)), 0.0
    p, P = gradient[N, :states], np.eye(states)
    for k in reversed(range(N)):
        total = gradient[k] + F[k].T @ p
        terms = max(terms, (size[k] + np.abs(F[k]).T @ np.abs(p))[states:].max())
        Q[k], free = total[states:], ~at[k]
        Fx, Fu = F[k][:, :states], F[k][:, states:][:, free]
        K = -np.linalg.solve(Fu.T @ P @ Fu + TORQUE * np.eye(free.sum()), Fu.T @ P @ Fx)
        p, P = total[:states] + K.T @ Q[k][free], np.eye(states) + Fx.T @ P @ (Fx + Fu @ K)
    Q = np.where(at, np.maximum(0, Q * np.sign(t["u"])), Q)  # at a bound L falls outwards: Q sign(u) <= 0
    with np.errstate(invalid="ignore"):
        distance = np.where(y > 0, upper - rows, np.where(y < 0, rows - lower, 0))
        slack = np.where(y != 0, np.abs(y) * np.abs(distance), 0)
    return [("stationarity: gradient by the torques", np.abs(Q).max() / terms, TOLERANCE),
            ("stationarity: y times the distance from its bound", slack.max(initial=0) / abs(t["cost"].sum()), COMPLEMENTARITY)]


def check_stationarity(problem, t):
    return judge(problem, t, Derivatives(problem, t))


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 2
    failed = False
    for path in sys.argv[1:]:
        problem = Problem(path)
        for what, value, bound in check_stationarity(problem, problem.read_optimum()):
            ok = bool(value <= bound)
            failed |= not ok
            print(f"{problem.data['name']}:  {'pass' if ok else 'FAIL'}  {what:52} {value:9.1e}  up to {bound:.0e}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
