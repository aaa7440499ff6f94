"""The guesses of the protocol (docs/suite.md): that of a problem's archive, displaced at random and closed again.

    suite/guesses.py FILE.json COUNT [SEED]      writes FILE_guess_0.npz, ... with arrays q, v, u

Guess i of a seed is the same for everybody: NumPy's generator PCG64, seeded by (seed, i).
"""
import sys

import numpy as np

from mechanism import Loops, State
from problem import Problem

ANGLE, LENGTH, TORQUE = 0.1, 0.02, 0.1  # rad, m, and over the largest torque of the guess
MODES = 3
CLOSED = 1e-12
ITERATIONS, HALVINGS = 60, 6


def close(mechanism, q):
    """The loops of configurations closed by Newton's method, by least motions in the metric; None if they do not close."""
    for _ in range(ITERATIONS):
        loops = Loops(State(mechanism, q))
        if not np.isfinite(loops.residual).all():
            return None
        if np.abs(loops.residual).max(initial=0) < CLOSED:
            return q
        step = loops.solve(loops.residual)
        q = mechanism.add(q, step * np.minimum(1, 0.2 / np.maximum(1e-300, np.abs(step).max(-1, keepdims=True))))
    return None


def make_waves(generator, size, nodes):
    """Smooth random functions of the nodes (nodes, size) that vanish at both ends."""
    amplitudes = generator.standard_normal((MODES, size))
    modes = np.arange(1, MODES + 1)
    return (np.sin(np.pi * np.outer(np.arange(nodes) / (nodes - 1), modes)) / np.sqrt(modes)) @ amplitudes


def make_guess(problem, trial, seed=0):
    """{q, v, u} of one guess."""
    m, archive = problem.mechanism, problem.read_optimum()
    q, v, u = archive["guess_q"], archive["guess_v"], archive["guess_u"]
    generator = np.random.Generator(np.random.PCG64([seed, trial]))
    size = np.full(m.nv, ANGLE)
    for joint in m.joints:
        if joint.kind == "prismatic":
            size[joint.v] = LENGTH
        if joint.kind == "free-flyer":
            size[joint.v][:3] = LENGTH
    way = size * make_waves(generator, m.nv, len(q))
    u = u + TORQUE * np.abs(u).max() * make_waves(generator, u.shape[1], len(u))
    for _ in range(HALVINGS):
        closed = close(m, m.add(q, way))
        if closed is not None:
            return {"q": closed, "v": Loops(State(m, closed)).project(v), "u": u}
        way = way / 2
    raise ValueError(f"{problem.path}: guess {trial} does not close")


def main():
    if len(sys.argv) < 3:
        print(__doc__.strip())
        return 2
    problem = Problem(sys.argv[1])
    for trial in range(int(sys.argv[2])):
        path = problem.path.with_name(f"{problem.path.stem}_guess_{trial}.npz")
        np.savez(path, **make_guess(problem, trial, int(sys.argv[3]) if len(sys.argv) > 3 else 0))
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
