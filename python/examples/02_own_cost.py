"""A squat whose knees must not go too far forward: a constraint written in Python, and its price.

With x_knee(q) the place of a knee along x, the squat gets one more row per node, x_knee(q_k) <= x_max. The solver calls
`calc` and `calc_jacobian` on all its threads. Its multipliers are what a metre of room would save.
"""

from typing import Dict

import numpy as np
import numpy.typing as npt

import bielle


class KneePosition(bielle.Residual):
    """Place of a knee along x, m."""

    size = 1
    depends_on = ("q",)

    def __init__(self, shin: str) -> None:
        self.shin = shin

    def calc(self, node: bielle.Node) -> npt.ArrayLike:
        return node.placement(self.shin).p[:1]

    def calc_jacobian(self, node: bielle.Node) -> Dict[str, npt.ArrayLike]:
        # The Jacobian is in the axes of the frame; linear rows first.
        return {"q": (node.placement(self.shin).R @ node.frame_jacobian(self.shin)[:3])[:1]}


def find_farthest(solution: bielle.Solution, shin: str) -> float:
    model = solution.motion.model
    q = np.array([x[: model.nq] for x in solution.trajectory.xs])
    return float(model.placement(q, shin)[:, 0, 3].max())


def main() -> None:
    model = bielle.load_robot("bipetto").model
    plan = bielle.Motion.plan(model, bielle.Request(motion="squat", options={"depth": 0.7}))
    free = bielle.Motion(model, plan).solve()
    print("free:   ", free.summary.message)
    x_max = find_farthest(free, "shin_left") - 0.01

    limits = [
        bielle.PathConstraint("knee of " + shin, KneePosition(shin), lower=[-np.inf], upper=[x_max], scale=[0.01])
        for shin in ("shin_left", "shin_right")
    ]
    stages = [stage.replace(path_constraints=[*stage.path_constraints, *limits]) for stage in plan.stages]
    bounded = bielle.Motion(model, plan.replace(stages=stages)).solve()
    print("bounded:", bounded.summary.message)
    print(f"the knee may go to {x_max:.4f} m and goes to {find_farthest(bounded, 'shin_left'):.4f} m")


if __name__ == "__main__":
    main()
