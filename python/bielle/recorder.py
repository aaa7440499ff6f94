"""What happens to one robot of a World, as a result that `bielle report` and `bielle export` read."""

import json
from typing import Any, List

import numpy as np
import numpy.typing as npt

from ._bielle import Ground, Robot, World, write_happened
from .named import WorldState


class Recorder:
    """Of the robot `which` of a World made with `count`, or of a VectorEnv's `worlds`: reset() with the WorldState in which it
    starts, then add() after every step, then write()."""

    def __init__(self, worlds: World, which: int = 0) -> None:
        if worlds.count is None or not 0 <= which < worlds.count:
            raise ValueError(f"which: expected a robot of {worlds.count or 'a World made with `count`'}, got {which}")
        self.worlds, self.which = worlds, which
        self._nodes: List[WorldState] = []
        self._torques: List[npt.NDArray[np.float64]] = []
        self._wrenches: List[npt.NDArray[np.float64]] = []

    def reset(self, state: WorldState) -> None:
        """Begins anew."""
        self._nodes, self._torques, self._wrenches = [self._take(state)], [], []

    def add(self, state: WorldState, torques: npt.ArrayLike) -> None:
        """torques (count, nu), N m or N: those of the step that led to this state. Where a robot has not moved on, as one that
        broke off, nothing is added."""
        if not self._nodes:
            raise RuntimeError("add: reset() first")
        node, u = self._take(state), np.asarray(torques, dtype=float)
        if u.shape != (self.worlds.count, self.worlds.model.nu):
            raise ValueError(f"torques: expected shape {(self.worlds.count, self.worlds.model.nu)}, got {u.shape}")
        if node.time > self._nodes[-1].time:
            self._nodes.append(node)
            self._torques.append(u[self.which].copy())
            self._wrenches.append(np.asarray(self.worlds.wrenches)[self.which].ravel())

    def write(
        self, directory: str, robot: Robot, motion: str = "recorded motion", ground: Ground = Ground(), **facts: Any
    ) -> List[str]:
        """Returns the paths. facts: entries of the summary, such as outcome="fell"."""
        if not self._torques:
            raise RuntimeError("write: add() a step first")
        told = {"world": self.worlds.engine, "outcome_message": self.worlds.message[self.which], **facts}
        time, q, v = (np.array([getattr(node, name) for node in self._nodes]) for name in ("time", "q", "v"))
        torques, wrenches = np.array(self._torques), np.array(self._wrenches)
        return write_happened(str(directory), robot, time, q, v, torques, wrenches, motion, ground, json.dumps(told))

    def _take(self, state: WorldState) -> WorldState:
        return WorldState(*(np.array(part[self.which]) for part in state))
