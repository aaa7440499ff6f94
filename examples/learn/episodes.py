"""Walks of many robots that differ, pushed: what the policy learns from, and is measured by."""

import dataclasses

import numpy as np

import bielle
from walk import PERIOD, Plan, rotations, turns

PUSH = 0.1  # s


@dataclasses.dataclass(frozen=True)
class Conditions:
    """What N robots meet, by which they and their grounds differ from the model."""

    masses: np.ndarray  #: (N, bodies), over those of the model
    friction: np.ndarray  #: (N,)
    delays: np.ndarray  #: (N,), s
    times: np.ndarray  #: (N, pushes), s
    impulses: np.ndarray  #: (N, pushes, 2), N s

    def repeated(self, times):
        return Conditions(*(np.concatenate([getattr(self, f.name)] * times) for f in dataclasses.fields(self)))


def draw_conditions(random, count, model, duration, impulse):
    """Masses within 10 % together and 3 % each, friction 0.6 to 1, delays of up to 4 ms; pushes of up to an impulse, N s,
    in any direction, one in each 1.5 s."""
    pushes = max(1, int(duration / 1.5))
    masses = random.uniform(0.9, 1.1, (count, 1)) * random.uniform(0.97, 1.03, (count, len(model.bodies)))
    times = 0.3 + duration / pushes * (np.arange(pushes) + random.uniform(0, 0.8, (count, pushes)))
    angle, size = random.uniform(0, 2 * np.pi, (count, pushes)), impulse * random.uniform(0.3, 1, (count, pushes))
    impulses = size[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return Conditions(masses, random.uniform(0.6, 1, count), random.uniform(0, 4e-3, count), times, impulses)


class Walks:
    """`count` robots, in worlds of Bielle's batch, or of another engine, which takes no conditions but pushes. They are
    those of the plan, or of a model of the same trunk, which starts as it stands."""

    def __init__(self, plan: Plan, count, threads=0, engine="bielle", model=None, noise=1.0):
        start = (plan.q[0], plan.v[0]) if model is None else (model.standing(), np.zeros(model.nv))
        self.plan, self.count, self.engine = plan, count, engine
        self.conditions = None
        self.env = bielle.VectorEnv(model or plan.model, count, self.reward, self.termination, start=lambda _: start, push=self.push,
                                    period=PERIOD, duration=plan.duration, time_step=1e-3 if engine == "bielle" else 0,
                                    threads=threads, engine=engine, noise=noise)  # fmt: skip

    def draw(self, random, impulse, count=None):
        return draw_conditions(random, count or self.count, self.env.model, self.plan.duration, impulse)

    def set(self, conditions: Conditions):
        self.conditions = conditions
        if self.engine == "bielle":
            self.env.worlds.set(mass_factors=conditions.masses, friction=conditions.friction, delays=conditions.delays)

    def push(self, state):
        c, force = self.conditions, np.zeros((self.count, 3))
        if c is not None:
            acts = (state.time[:, None] > c.times - PERIOD / 2) & (state.time[:, None] < c.times + PUSH - PERIOD / 2)
            force[:, :2] = (acts[..., None] * c.impulses).sum(axis=1) / PUSH
        return force

    def lean(self, state):
        R = rotations(state.q[:, 3:7])
        return R, np.linalg.norm(turns(self.plan.rotation[self.plan.instant(state.time)], R), axis=1)

    def reward(self, state, torques):
        """Between 0 and 1: how nearly the trunk has velocity and attitude of the plan."""
        R, lean = self.lean(state)
        off = np.einsum("nij,nj->ni", R, state.v[:, :3]) - self.plan.velocity[self.plan.instant(state.time)]
        return np.exp(-((off[:, :2] ** 2).sum(axis=1) / 0.4**2 + (lean / 0.4) ** 2))

    def termination(self, state):
        """A fall: the trunk turned by 0.6 rad or below 0.75 of its height, or a joint faster than 40 rad/s. What falls
        further takes the world the time of a hundred walks."""
        R, lean = self.lean(state)
        height = self.plan.q[self.plan.instant(state.time), 2]
        return (lean > np.sin(0.6)) | (state.q[:, 2] < 0.75 * height) | (np.abs(state.v).max(axis=1) > 40)

    def run(self, control, seed, watch=None, begin=None):
        """One walk of each. control(k, observations, state) gives torques (N, nu) at the instants k (N,).

        Returns (mean rewards (N,), zero after a fall; whether it stood in the end (N,)). watch(k, alive, state) looks on, after
        begin(state)."""
        observations, infos = self.env.reset(seed=seed)
        if begin is not None:
            begin(infos)
        alive, total = np.ones(self.count, dtype=bool), np.zeros(self.count)
        for _ in range(self.plan.num_instants - 1):
            k = self.plan.instant(infos["time"])
            observations, rewards, fell, _, infos = self.env.step(control(k, observations, infos))
            alive &= ~fell
            total += np.where(alive, rewards, 0)
            if watch is not None:
                watch(self.plan.instant(infos["time"]), alive, infos)
            if not alive.any():
                break
        return total / (self.plan.num_instants - 1), alive
