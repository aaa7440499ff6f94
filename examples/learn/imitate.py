"""The policy's tables W and V (walk.py, Eq. (2)), fitted to the solver's gains, which see the true state, by walks in which
first these and then the fitted ones act (DAgger: Ross, Gordon, Bagnell, AISTATS 2011)."""

import numpy as np

import bielle
from episodes import Walks
from walk import PERIOD, Plan, Policy, rotations

RIDGE = 1e-2  # over the mean square of each entry of e
SHARES = (1.0, 0.5, 0.25, 0.25)  # of the robots that the solver's gains lead, by round; the fitted ones lead the others
LOOK_AHEAD = 0.036  # s


class Gains:
    """The solver's gains for many robots, whose true states they see. Within LOOK_AHEAD before the end of a contact phase
    those of before act on (as `bielle simulate --look-ahead` has it), because they grow there without bound."""

    def __init__(self, plan: Plan):
        self.plan, self.policy = plan, bielle.Controller.policy(plan.solution)
        self.ends = np.cumsum([phase.nodes * phase.dt for phase in plan.solution.motion.schedule.phases])

    def feedback(self, k, q, v):
        """Torques beyond those of the plan (N, nu), at the instants k (N,) and the states q (N, nq), v (N, nv)."""
        model, out = self.plan.model, np.empty((len(k), self.plan.model.nu))
        off, fast = model.difference(self.plan.q[k], q), v - self.plan.v[k]
        for now in np.unique(k):
            here = np.flatnonzero(k == now)
            time = PERIOD * (now + 0.5)
            phase = min(np.searchsorted(self.ends, time, side="right"), len(self.ends) - 1)
            begin = self.ends[phase - 1] if phase > 0 else 0.0
            time = max(begin + 1e-6, min(time, self.ends[phase] - LOOK_AHEAD))
            q0, v0 = self.policy.reference(time)
            there = model.integrate(np.tile(q0, (len(here), 1)), off[here])
            planned = self.policy.update(time, q0, v0)
            for i, at in zip(here, there):
                out[i] = self.policy.update(time, at, v0 + fast[i]) - planned
        return out


def imitate(plan: Plan, count, seed, threads=0, impulse=3.0, shares=SHARES, tell=print):
    """(gains, observer) of a Policy."""
    walks, expert, random = Walks(plan, count, threads), Gains(plan), np.random.default_rng(seed)
    inputs, nu = 2 * plan.model.nu + 7, plan.model.nu
    bins = plan.bins.max() + 1
    squares, products = np.zeros((bins, inputs, inputs)), np.zeros((bins, inputs, nu + 4))
    policy = Policy(plan, np.zeros((bins, inputs, nu)), np.zeros((bins, inputs, 4)))
    for number, share in enumerate(shares):
        led = np.arange(count) < count * share
        policy.begin(count)

        def control(k, observations, state):
            e = policy.observe(k, observations)
            shown = expert.feedback(k, state["q"], state["v"])
            near = np.abs(e[:, 2 * nu : 2 * nu + 3]).max(axis=1) < 0.3
            targets = np.hstack([shown, calc_deviation(plan, k, state)])
            for bin in np.unique(plan.bins[k[near]]):
                here = near & (plan.bins[k] == bin)
                squares[bin] += e[here].T @ e[here]
                products[bin] += e[here].T @ targets[here]
            return np.where(led[:, None], plan.torques[k] + shown, policy.torques(k, e, np.zeros((count, 2, 3))))

        walks.set(walks.draw(random, impulse))
        _, stood = walks.run(control, int(random.integers(2**31)))
        fit = solve(squares, products)
        policy.gains, policy.observer = fit[:, :, :nu], fit[:, :, nu:]
        told = [f"{stood[who].mean():.0%} of {who.sum()} {name}" for who, name in ((led, "led"), (~led, "imitating")) if who.any()]
        tell(f"imitation, round {number + 1} of {len(shares)}: stood " + ", ".join(told))
    return policy.gains, policy.observer


def calc_deviation(plan, k, state):
    """Of place over the standing foot and of velocity of the trunk from the plan (N, 4), along x and y."""
    q, v = state["q"], state["v"]
    feet = [plan.model.placement(q, name)[:, :2, 3] for name in ("foot_left", "foot_right")]
    over = q[:, :2] - np.where(plan.left[k, None], *feet)
    velocity = np.einsum("nij,nj->ni", rotations(q[:, 3:7]), v[:, :3])
    return np.hstack([over - plan.over[k], (velocity - plan.velocity[k])[:, :2]])


def solve(squares, products):
    """Ridge regression in each bin."""
    seen = squares[:, -1, -1]
    mean = np.einsum("bii->bi", squares).sum(axis=0) / max(1, seen.sum())
    damped = squares + np.einsum("b,ij->bij", RIDGE * np.maximum(seen, 1), np.diag(mean))
    return np.linalg.solve(damped, products)
