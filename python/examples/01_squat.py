"""A squat: solved, measured, written as the command writes it, and checked against Simbody.

Usage: 01_squat.py [DIRECTORY]
"""

import sys

import numpy as np

import bielle


def main(directory: str) -> None:
    robot = bielle.load_robot("bipetto")
    squat = bielle.solve_squat(robot, depth=0.7, callback=lambda i: print(f"{i.iteration:3d}  cost {i.cost:.6f}"))
    print(squat.goals[0])

    # All numbers are arrays; functions of states take them all at once.
    record, model = squat.record, robot.model
    power = record.u * record.v[:-1, [motor.dof for motor in model.motors]]
    print(f"largest mechanical power {np.abs(power).max():.1f} W, largest closing error "
          f"{np.abs(model.closure_residual(record.q)).max():.1e}")

    squat.write(directory)
    bielle.write_report(directory + "/report.html", [directory])


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "squat")
