#!/usr/bin/env python3
"""jump.py [-o springs.png]: the same jump of spring_biped with leaf springs and with rigid leaves.

Generates both robots, solves both jumps with `bielle` (on the path), prints the energy of each motor and of the springs, and
draws them. Needs numpy and matplotlib. The solves take about a minute; they are written into a directory that is kept with
--keep DIR.
"""
import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile

try:
    import matplotlib
    import numpy as np
except ModuleNotFoundError as error:
    print(f"jump.py needs numpy and matplotlib (Debian: python3-matplotlib): {error}", file=sys.stderr)
    sys.exit(77)
matplotlib.use("Agg")
plt = importlib.import_module("matplotlib.pyplot")

STIFFNESS = {"shin_spring": 1500.0, "heel_spring": 1250.0}  # N m/rad, those of the generator
ROBOTS = {"rigid": ["--set", "shin_stiffness=0", "--set", "heel_stiffness=0"],
          "springs": [f"--set={joint.split('_')[0]}_stiffness={k}" for joint, k in STIFFNESS.items()]}
# Motors of a leg; those of the toe share its work.
MOTORS = {"hip roll": ["hip_roll"], "hip yaw": ["hip_yaw"], "hip pitch": ["hip_pitch"], "knee": ["knee"],
          "toe (two)": ["motor_toe1", "motor_toe2"]}
SIDES = ("_left", "_right")
COLORS = {"rigid": "#8d8d93", "springs": "#c0392b"}


def run(*arguments):
    """Runs bielle; what it prints."""
    result = subprocess.run(["bielle", *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if result.returncode != 0:
        sys.exit(f"bielle {' '.join(arguments)}: status {result.returncode}\n{result.stdout}")
    return result.stdout


def solve(name, place, options):
    """The robot and its jump, converged and checked, or the end of the program. -> directory of the result"""
    robot, directory = os.path.join(place, name), os.path.join(place, name + "-jump")
    run("generate", "spring_biped", *ROBOTS[name], "-o", robot)
    printed = run("solve", "jump", "--robot", robot, *options, "--quiet", "--no-report", "-o", directory)
    print(printed.strip())
    if ": passed" not in printed:
        sys.exit(f"{name}: the jump was not checked")
    return directory


class Jump:
    """Energies of a result, J, of both legs together."""

    def __init__(self, directory):
        with open(os.path.join(directory, "summary.json"), encoding="utf-8") as file:
            summary = json.load(file)
        record = np.load(os.path.join(directory, "trajectory.npz"))
        names = {kind: [str(name) for name in record[kind + "_names"]] for kind in ("q", "v", "u")}
        self.time = record["time"]
        electrical = summary["electrical_energy"]["motors_J"]
        steps = np.diff(self.time)

        def work(motor, side):
            """Mechanical work of a motor over each stage, at its middle, where the torque acts."""
            speed = record["v_mid"][:, names["v"].index(motor + side)]
            return record["u"][:, names["u"].index(motor + side)] * speed * steps

        self.electrical = {label: sum(electrical[m + s] for m in motors for s in SIDES)
                           for label, motors in MOTORS.items()}
        self.mechanical = {label: sum(np.abs(work(m, s)).sum() for m in motors for s in SIDES)
                           for label, motors in MOTORS.items()}
        self.power = sum(work("knee", side) for side in SIDES) / steps
        self.springs = {joint: sum(0.5 * k * record["q"][:, names["q"].index(joint + side)] ** 2 for side in SIDES)
                        for joint, k in STIFFNESS.items() if joint + SIDES[0] in names["q"]}
        self.phases = [(phase["name"], phase["nodes"], phase["time_step_s"]) for phase in summary["phases"]]

    def list_bounds(self):
        """[(name, begin, end)], s."""
        bounds, begin = [], 0.0
        for name, nodes, step in self.phases:
            bounds.append((name, begin, begin + nodes * step))
            begin += nodes * step
        return bounds


def print_table(jumps):
    print(f"\n{'':12}" + "".join(f"{name + ': electrical, mechanical [J]':>40}" for name in jumps))
    for label in MOTORS:
        print(f"{label:12}" + "".join(f"{j.electrical[label]:30.1f}{j.mechanical[label]:10.1f}" for j in jumps.values()))
    print(f"{'all':12}" + "".join(f"{sum(j.electrical.values()):30.1f}{sum(j.mechanical.values()):10.1f}"
                                  for j in jumps.values()))
    jump = jumps["springs"]
    total = sum(jump.springs.values())
    for name, begin, end in jump.list_bounds():
        inside = (jump.time >= begin - 1e-9) & (jump.time <= end + 1e-9)
        print(f"springs, {name:7}: at its start {total[inside][0]:6.2f} J, at most {total[inside].max():6.2f} J at "
              f"{jump.time[inside][total[inside].argmax()]:.3f} s, at its end {total[inside][-1]:6.2f} J")


def draw(jumps, path):
    figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    place = np.arange(len(MOTORS))
    for i, (name, jump) in enumerate(jumps.items()):
        at = place + 0.4 * (i - 0.5)
        axes[0].bar(at, jump.electrical.values(), 0.36, color=COLORS[name], label=f"{name}, electrical")
        last = i + 1 == len(jumps)
        axes[0].bar(at, jump.mechanical.values(), 0.16, color="none", edgecolor="black",
                    label="mechanical, ∫|u ω| dt" if last else None)
    axes[0].set_xticks(place, MOTORS)
    axes[0].set_ylabel("energy of both legs' motors [J]")
    axes[0].legend(loc="upper left", frameon=False)
    for name, jump in jumps.items():
        axes[1].plot(jump.time[:-1], jump.power, color=COLORS[name], label=name)
    axes[1].set_ylabel("power of both knees' motors [W]")
    axes[1].legend()
    jump = jumps["springs"]
    axes[2].stackplot(jump.time, jump.springs.values(), labels=["shins", "heels"], colors=["#e08e79", "#c0392b"])
    axes[2].set_ylabel("energy in the leaf springs [J]")
    axes[2].legend()
    for ax in axes[1:]:
        ax.set_xlabel("time [s]")
        ax.margins(x=0)
        for phase, begin, end in jump.list_bounds():
            if phase == "flight":
                ax.axvspan(begin, end, color="#d6eaf8", zorder=0)
                ax.text((begin + end) / 2, 0.97, "flight", transform=ax.get_xaxis_transform(), ha="center", va="top")
    figure.savefig(path, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", default="springs.png", help="the figure")
    parser.add_argument("--objective", default="energy", help="of bielle solve")
    parser.add_argument("--time-step", default="0.0025", help="of bielle solve, s")
    parser.add_argument("--keep", help="directory for robots and results")
    arguments = parser.parse_args()
    options = ["--set", "time_step=" + arguments.time_step, "--objective", arguments.objective]
    if arguments.objective != "effort":
        options += ["--regularization", "1"]  # with the usual 0.2, the jump with springs needs more than 300 iterations
    with tempfile.TemporaryDirectory() as scratch:
        place = arguments.keep or scratch
        os.makedirs(place, exist_ok=True)
        jumps = {name: Jump(solve(name, place, options)) for name in ROBOTS}
    print_table(jumps)
    stored = sum(jumps["springs"].springs.values())
    if not stored.max() > 4 * stored[0]:
        sys.exit("the springs hardly take up more than the weight bends them by")
    draw(jumps, arguments.output)


if __name__ == "__main__":
    main()
