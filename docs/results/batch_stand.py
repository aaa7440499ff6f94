#!/usr/bin/env python3
"""batch_stand.py [WORLDS] [STEPS]: prints as JSON the steps per second, of processor time and by the wall clock, of Bipettos that
stand in a `bielle.World(count=WORLDS)` by springs at their motors while each is pushed otherwise, at 1 ms; and how far they have
moved. docs/results/batch.py runs it with the package `bielle` of two builds; OMP_NUM_THREADS says how many threads.
"""
import json
import sys
import time

import numpy as np

import bielle

STIFFNESS, DAMPING, PUSH, PUSHED, TICK = 100.0, 2.0, 10.0, 50, 1e-3  # N m/rad, N m s/rad, N, steps, s


def main():
    worlds, steps = (int(word) for word in (sys.argv[1:] + ["256", "100"][len(sys.argv) - 1:]))
    model = bielle.load_robot("bipetto").model
    q0, v0 = model.standing(), np.zeros(model.nv)
    motors = [model.joints[motor.joint].idx_q for motor in model.motors], [motor.dof for motor in model.motors]
    held = model.static_torques(q0, [contact.name for contact in model.contacts])
    world, push = bielle.World(model, count=worlds, time_step=TICK), np.zeros((worlds, 3))
    state, processor, wall = world.reset(q0, v0), 0.0, 0.0
    for step in range(steps):
        u = held + STIFFNESS * (q0[motors[0]] - state.q[:, motors[0]]) - DAMPING * state.v[:, motors[1]]
        push[:, 0] = (step < PUSHED) * PUSH / (1 + np.arange(worlds))
        begin = time.process_time(), time.perf_counter()
        state = world.step(u, TICK, push)
        processor, wall = processor + time.process_time() - begin[0], wall + time.perf_counter() - begin[1]
    print(json.dumps({"processor": worlds * steps / processor, "wall": worlds * steps / wall, "ok": bool(state.ok.all()),
                      "moves": float(np.abs(state.q - q0).max()), "height": float(state.q[:, 2].min())}))  # fmt: skip


if __name__ == "__main__":
    main()
