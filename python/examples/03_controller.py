"""Carries a walk out in a world, step by step: gains of the solver about the plan, and a push that they bear."""

import numpy as np

import bielle


def main() -> None:
    robot = bielle.load_robot("bipetto")
    motion = bielle.Motion.make(robot.model, bielle.Request(motion="walk", options={"speed": 0.3, "steps": 4}))
    solution = motion.solve()
    print(solution.summary.message)
    controller = bielle.Controller.policy(solution)

    world = bielle.World(robot.model, ground=motion.ground)
    state = world.reset(*controller.reference(0))
    while state.time < controller.duration and state.ok:
        push = (0, 10, 0) if 0.5 < state.time < 0.6 else (0, 0, 0)  # N
        state = world.step(controller.update(float(state.time), state.q, state.v), 1e-3, push)
    q, _ = controller.reference(controller.duration)
    print(f"at the end the trunk is {np.linalg.norm(state.q[:3] - q[:3]) * 1000:.1f} mm from its place in the plan")


if __name__ == "__main__":
    main()
