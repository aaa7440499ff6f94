"""Augmented random search, version V2 (Mania, Guy, Recht, NeurIPS 2018), on arrays alone.

Of `pairs` random directions, tried forth and back, the best ones move the parameters; features are normalized by the mean and the
deviation of all seen so far.
"""

import dataclasses
import json
import time
from pathlib import Path
from typing import Any, Callable, Dict, Tuple

import numpy as np

from walk import save


@dataclasses.dataclass
class Search:
    """Between two iterations. What is written of it depends on the seed and the settings alone, not on interruptions."""

    theta: np.ndarray
    random: np.random.Generator
    features: int
    iteration: int = 0
    seen: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0))  #: number, then sum and sum of squares of features

    def scales(self):
        """(mean, deviation) (features,) of what was seen; those that never change, as a constant 1, stay as they are."""
        features = self.features
        if self.seen.size == 0:
            return np.zeros(features), np.ones(features)
        number = self.seen[0]
        mean = self.seen[1 : 1 + features] / number
        deviation = np.sqrt(np.maximum(0, self.seen[1 + features :] / number - mean**2))
        still = deviation < 1e-9
        return np.where(still, 0, mean), np.where(still, 1, deviation)


def step(search: Search, evaluate: Callable, pairs: int, best: int, noise: float, rate: float):
    """One iteration. evaluate(thetas (2 pairs, ..), mean, deviation, random) gives (returns (2 pairs,), and of the features
    seen their number, sum and sum of squares). The first half of thetas are forth, the second back. Returns the returns."""
    directions = search.random.standard_normal((pairs, *search.theta.shape))
    thetas = np.concatenate([search.theta + noise * directions, search.theta - noise * directions])
    returns, *moments = evaluate(thetas, *search.scales(), search.random)
    forth, back = returns[:pairs], returns[pairs:]
    chosen = np.argsort(-np.maximum(forth, back), kind="stable")[:best]
    spread = np.concatenate([forth[chosen], back[chosen]]).std()
    if spread > 0:
        slope = sum(by * direction for by, direction in zip(forth[chosen] - back[chosen], directions[chosen]))  # in this order
        search.theta = search.theta + rate / (best * spread) * slope
    moments = np.concatenate([np.atleast_1d(moment).ravel() for moment in moments])
    search.seen = moments if search.seen.size == 0 else search.seen + moments
    search.iteration += 1
    return returns


def write(search: Search, path: Path):
    state = json.dumps(search.random.bit_generator.state)
    arrays = {"theta": search.theta, "seen": search.seen, "features": search.features, "iteration": search.iteration, "random": state}
    save(path, lambda file: np.savez(file, **arrays))


def read(path: Path) -> Search:
    with np.load(path) as file:
        random = np.random.default_rng()
        random.bit_generator.state = json.loads(str(file["random"]))
        return Search(file["theta"], random, int(file["features"]), int(file["iteration"]), file["seen"])


Row = Dict[str, Any]


def learn(directory: Path, start: Search, iterate: Callable[[Search], Row], minutes: float, iterations: int, every: float,
          tell: Callable[[str], None] = print) -> Tuple[Search, list]:  # fmt: skip
    """Iterates for minutes of processor time, or until so many iterations are done, whichever is first; with those that a
    directory has. A checkpoint follows every `every` seconds of processor time, and at the end.

    iterate(search) makes one iteration and returns what progress.json keeps of it, with times."""
    checkpoint, log = directory / "checkpoint.npz", directory / "progress.json"
    search, rows = start, []
    if checkpoint.exists():
        search = read(checkpoint)
        rows = json.loads(log.read_text())[: search.iteration]
    before = rows[-1]["seconds"] if rows else 0.0
    begin, clock, written, done = time.process_time(), time.monotonic(), 0.0, search.iteration
    while search.iteration < iterations and before + spent_since(begin) < 60 * minutes:
        row = iterate(search)
        spent = spent_since(begin)
        rows.append({"iteration": search.iteration, "seconds": round(before + spent, 3), **row})
        left = min((iterations - search.iteration) * spent / (search.iteration - done), 60 * minutes - before - spent)
        left *= (time.monotonic() - clock) / spent
        tell(f"{(before + spent) / 60:6.1f} processor min, iteration {search.iteration}: "
             + ", ".join(f"{name} {value:.3f}" for name, value in row.items()) + f"; {max(0.0, left) / 60:.1f} min left")  # fmt: skip
        if spent - written >= every:
            written = spent
            keep(search, rows, checkpoint, log)
    keep(search, rows, checkpoint, log)
    return search, rows


def spent_since(begin):
    return time.process_time() - begin


def keep(search, rows, checkpoint, log):
    """The log first: rows beyond the checkpoint are dropped when it is read."""
    save(log, lambda file: file.write(json.dumps(rows, indent=0).encode()))
    write(search, checkpoint)
