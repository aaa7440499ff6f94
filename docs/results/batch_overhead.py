#!/usr/bin/env python3
"""batch_overhead.py [WORLDS]: prints as JSON the processor time, s, that a step of limp robots takes in Python, as a World and as a
VectorEnv, and that of the World's bindings alone. docs/results/batch.py runs it with the package `bielle` beside its command.
"""
import json
import sys
import time

import numpy as np

import bielle

DURATION = 0.1  # s, from the standing posture


def measure(start, step, steps):
    """Of a step, the least of several runs."""
    least = float("inf")
    for _ in range(5):
        start()
        begin = time.process_time()
        for _ in range(steps):
            step()
        least = min(least, (time.process_time() - begin) / steps)
    return least


def main():
    worlds = int(sys.argv[1]) if len(sys.argv) > 1 else 256
    model = bielle.load_robot("bipetto").model
    q, v, actions = model.standing(), np.zeros(model.nv), np.zeros((worlds, model.nu))
    rows = []
    for period in (1e-3, 1e-2):
        steps = round(DURATION / period)
        idle, world = (bielle.World(model, count=worlds, threads=1) for _ in range(2))  # idle: was not reset, stays as it is
        env = bielle.VectorEnv(model, worlds, lambda state, torques: state.v[:, 0], lambda state: state.q[:, 2] < 0.3,
                               threads=1, period=period, start=lambda _: (q, v))  # fmt: skip
        rows.append({"period [s]": period, "bindings [s]": measure(lambda: None, lambda: idle.step(actions, period), 50),
                     "world [s]": measure(lambda: world.reset(q, v), lambda: world.step(actions, period), steps),
                     "environment [s]": measure(lambda: env.reset(seed=1), lambda: env.step(actions), steps)})  # fmt: skip
    print(json.dumps({"worlds": worlds, "rows": rows}))


if __name__ == "__main__":
    main()
