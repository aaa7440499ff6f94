"""Many robots for learning, by the conventions of Gymnasium's VectorEnv, without Gymnasium."""

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from ._bielle import Ground, LoopCloser, Model, NumericalStatus, RodFriction, Sensors, World
from .named import Readings, WorldState

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


class Box:
    """Arrays between two bounds, as gymnasium.spaces.Box."""

    def __init__(self, low: npt.ArrayLike, high: npt.ArrayLike, seed: Optional[int] = None) -> None:
        self.low, self.high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        self.shape, self.dtype = self.low.shape, self.low.dtype
        self.seed(seed)

    def seed(self, seed: Optional[int] = None) -> None:
        self._generator = np.random.default_rng(seed)

    def sample(self) -> Array:
        """Uniform between finite bounds, else normal, cut at the bound that there is."""
        finite = np.isfinite(self.low) & np.isfinite(self.high)
        uniform = self._generator.uniform(np.where(finite, self.low, 0), np.where(finite, self.high, 1))
        return np.where(finite, uniform, np.clip(self._generator.normal(size=self.shape), self.low, self.high))

    def contains(self, x: npt.ArrayLike) -> bool:
        x = np.asarray(x)
        return x.shape == self.shape and bool(((x >= self.low) & (x <= self.high)).all())


class StartStates:
    """Random closed states: motors within `spread` (rad, m) of a posture, that of standing(), the trunk turned by as much about
    all axes, velocities within `speed` (rad/s, m/s); the lowest corner of the soles is at a height, m."""

    def __init__(
        self, model: Model, q: Optional[npt.ArrayLike] = None, spread: float = 0.1, speed: float = 0.1, height: float = 0.0
    ) -> None:
        for name, value in (("spread", spread), ("speed", speed), ("height", height)):
            if not np.isfinite(value) or (value < 0 and name != "height"):
                raise ValueError(f"{name}: expected a finite number" + ", not negative" * (name != "height"))
        self.model, self.spread, self.speed, self.height = model, spread, speed, height
        self.q = model.standing() if q is None else np.asarray(q, dtype=float)
        self._motors = [list(model.q_names).index(name) for name in model.u_names]
        self._closer = LoopCloser(model, self.q, list(model.u_names))

    def draw(self, generator: np.random.Generator) -> Tuple[Array, Array]:
        """(nq,), (nv,)."""
        model, q = self.model, self.q
        for attempt in range(10):  # what is out of reach is drawn again, nearer
            asked = self.q.copy()
            asked[self._motors] += generator.uniform(-self.spread, self.spread, model.nu) * 0.7**attempt
            self._closer.reset(self.q)
            closed, told = self._closer.close(asked)
            if told.status == NumericalStatus.OK:
                q = closed
                break
        v = generator.uniform(-self.speed, self.speed, model.nv)
        if model.has_free_flyer:
            turn = np.zeros(model.nv)
            turn[3:6] = generator.uniform(-self.spread, self.spread, 3)
            q = model.integrate(q, turn)
            corners = [
                model.placement(q, contact.name) @ [x * contact.half_length, y * contact.half_width, 0, 1]
                for contact in model.contacts
                for x in (-1, 1)
                for y in (-1, 1)
            ]
            q[2] += self.height - min((corner[2] for corner in corners), default=self.height)
        return q, model.project_velocity(q, v)


class VectorEnv:
    """Robots that learn, each in a world of its own, by the conventions of gymnasium.vector.VectorEnv (of which it is none).

    Actions (num_envs, nu) are torques of the motors, N m or N, held for a period, s; or those of `action_space`, a Box for one
    robot, of which `torques(actions, readings)` makes torques at each of `repeat` periods. Observations are what sensors of the
    robot read (Sensors): positions of the motors, their differences over the last period per second, the torques that acted, and,
    of a robot that no joint holds, the IMU's angular velocity, rad/s, and specific force, m/s^2. `reward(state, torques)` and
    `termination(state)` are functions of arrays: the WorldState and torques (num_envs, nu).
    `start(generator)` gives their first states, by default those of StartStates, and `push(state)` the forces on their trunks
    (num_envs, 3), N, during the period to come. Episodes are truncated after a duration, s, and terminated also where physics break
    off, or an action is not finite (worlds.message tells). `worlds` are theirs, of the `engine` and with the `play` and
    `rod_frictions` of World (World, World.set()).

    Autoreset "NextStep": the step after the last one of an episode starts the next one, whatever the action, with reward 0.
    Each robot has random numbers of its own: its episodes are the same, bit by bit, for any number of robots and of threads.
    """

    metadata: Dict[str, Any] = {"autoreset_mode": "NextStep", "render_modes": []}
    _state: WorldState
    _readings: Readings

    def __init__(
        self,
        model: Model,
        num_envs: int,
        reward: Callable[[WorldState, Array], npt.ArrayLike],
        termination: Optional[Callable[[WorldState], npt.ArrayLike]] = None,
        *,
        action_space: Optional[Box] = None,
        torques: Optional[Callable[[Array, Readings], npt.ArrayLike]] = None,
        start: Optional[Callable[[np.random.Generator], Tuple[Array, Array]]] = None,
        push: Optional[Callable[[WorldState], npt.ArrayLike]] = None,
        period: float = 0.01,
        repeat: int = 1,
        duration: float = 10.0,
        noise: float = 1.0,
        ground: Ground = Ground(),
        time_step: float = 0.0,
        threads: int = 0,
        engine: str = "bielle",
        play: Mapping[str, float] = {},
        rod_frictions: Sequence[RodFriction] = (),
    ) -> None:
        if repeat < 1 or int(repeat) != repeat:
            raise ValueError("repeat: expected a number of periods, 1 at least")
        for name, value in (("period", period), ("duration", duration)):
            if not 0 < value < np.inf:
                raise ValueError(f"{name}: expected a positive number of seconds")
        if not 0 <= noise < np.inf:
            raise ValueError("noise: expected 0 or a positive number")
        self.worlds = World(
            model,
            count=num_envs,
            ground=ground,
            time_step=time_step,
            threads=threads,
            engine=engine,
            play=play,
            rod_frictions=rod_frictions,
        )
        self.model, self.num_envs, self.noise = model, num_envs, noise
        self.period, self.repeat, self.duration = period, repeat, duration
        self._reward, self._termination, self._torques, self._push = reward, termination, torques, push
        self._start = start or StartStates(model, height=ground.height).draw
        self.render_mode: Optional[str] = None
        self._generators: List[np.random.Generator] = []
        limit = np.array([motor.effort_limit for motor in model.motors])
        size = np.full(3 * model.nu + (6 if model.has_free_flyer else 0), np.inf)
        self.single_action_space, self.single_observation_space = action_space or Box(-limit, limit), Box(-size, size)
        self.action_space, self.observation_space = (
            Box(np.broadcast_to(one.low, (num_envs, *one.shape)), np.broadcast_to(one.high, (num_envs, *one.shape)))
            for one in (self.single_action_space, self.single_observation_space)
        )

    def reset(self, *, seed: Optional[int] = None, options: Optional[Dict[str, Any]] = None) -> Tuple[Array, Dict[str, Any]]:
        """Starts all anew, or those of the mask (num_envs,) options["reset_mask"]. Without a seed the random numbers go on."""
        mask = (options or {}).get("reset_mask")
        where = np.ones(self.num_envs, dtype=bool) if mask is None else np.asarray(mask, dtype=bool)
        if where.shape != (self.num_envs,) or (not self._generators and not where.all()):
            raise ValueError(f"reset_mask: expected shape ({self.num_envs},), and none for the first reset")
        if seed is not None or not self._generators:
            sequence = np.random.SeedSequence(seed)
            self._generators = [np.random.default_rng(child) for child in sequence.spawn(self.num_envs)]
            self._sensors = Sensors(self.worlds, self.noise, int(sequence.generate_state(1)[0]))
            shape = (self.num_envs, self.model.nu)
            self._q, self._v = np.tile(self.model.standing(), (self.num_envs, 1)), np.zeros((self.num_envs, self.model.nv))
            self._positions, self._speeds, self._over = np.zeros(shape), np.zeros(shape), np.zeros(self.num_envs, dtype=bool)
            self._begin(np.ones(self.num_envs, dtype=bool))
        else:
            self._begin(where)
        return self._observe(), self._state._asdict()

    def step(self, actions: npt.ArrayLike) -> Tuple[Array, Array, Mask, Mask, Dict[str, Any]]:
        """Observations, rewards, terminations, truncations, and as infos the arrays of the WorldState."""
        if not self._generators:
            raise RuntimeError("step: reset() first")
        actions = np.asarray(actions, dtype=float)
        if actions.shape != self.action_space.shape:
            raise ValueError(f"actions: expected shape {self.action_space.shape}, got {actions.shape}")
        torques = actions
        for _ in range(self.repeat):
            if self._torques is not None:
                torques = np.asarray(self._torques(actions, self._readings), dtype=float)
            force = np.zeros(3) if self._push is None else self._push(self._state)
            self._state = self.worlds.step(torques, self.period, force)
            self._read()
        ended: Mask = self._state.ok == 0
        if self._termination is not None:
            ended = ended | self._spread(self._termination(self._state), "termination").astype(bool)
        rewards: Array = self._spread(self._reward(self._state, torques), "reward").astype(float)
        rewards[(self._state.ok == 0) & ~np.isfinite(rewards)] = 0  # of torques that are not finite
        late: Mask = (self._state.time > self.duration - 0.5 * self.period) & ~ended
        begin = self._over
        if begin.any():
            self._begin(begin)
            rewards[begin], ended[begin], late[begin] = 0, False, False
        self._over = ended | late
        return self._observe(), rewards, ended, late, self._state._asdict()

    @property
    def readings(self) -> Readings:
        """What the sensors read last."""
        return self._readings

    def close(self) -> None:
        """Nothing is left open."""

    def _spread(self, value: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
        """(num_envs,), of one for each or one for all."""
        array = np.asarray(value)
        if array.shape not in ((), (self.num_envs,)):
            raise ValueError(f"{name}: expected shape ({self.num_envs},), got {array.shape}")
        return np.broadcast_to(array, (self.num_envs,))

    def _begin(self, where: Mask) -> None:
        for i in np.flatnonzero(where):
            self._q[i], self._v[i] = self._start(self._generators[i])
        self._state = self.worlds.reset(self._q, self._v, where)
        if where.all():
            self._sensors.reset(0.0)
        else:
            self._sensors.reset(0.0, where)
        self._readings = self._sensors.read()
        self._positions = np.where(where[:, None], self._readings.motor_positions, self._positions)
        self._speeds[where] = 0
        self._over = self._over & ~where

    def _read(self) -> None:
        self._readings = self._sensors.read()
        self._speeds = (self._readings.motor_positions - self._positions) / self.period
        self._positions = self._readings.motor_positions

    def _observe(self) -> Array:
        r = self._readings
        imu = [r.angular_velocity, r.specific_force] if self.model.has_free_flyer else []
        return np.hstack([r.motor_positions, self._speeds, r.motor_torques, *imu])
