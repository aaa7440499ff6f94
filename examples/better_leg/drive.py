#!/usr/bin/env python3
"""drive.py MOTOR HIP KNEE ANKLE DIRECTORY: a copy of Bipetto with motors of robots/motors.yaml, whose own gears are of 9, with
gears of these ratios and their losses (docs/design_reference.md); its masses as published."""
import pathlib
import shutil
import sys

motor, target = sys.argv[1], pathlib.Path(sys.argv[5])
ratios = dict(zip(("hip", "knee", "ankle"), sys.argv[2:5]))
source = pathlib.Path(__file__).resolve().parents[2] / "robots" / "bipetto"
target.mkdir(parents=True, exist_ok=True)
shutil.copy(source / "bipetto.urdf", target / f"{target.name}.urdf")
lines, in_motors = [], False
for line in (source / "bipetto.yaml").read_text().splitlines():
    if line.startswith("armature:"):
        continue
    if line.startswith("name_mot:"):
        line, in_motors = "motors:", True
    elif in_motors and line.startswith("  - "):
        ratio = next(value for name, value in ratios.items() if name in line)
        efficiency = round(1 - 0.03 * (1 - 9 / float(ratio)), 5)
        line = f"  {line[4:]}: {{type: {motor}, ratio: {ratio}, efficiency: {efficiency}, back_efficiency: {efficiency}}}"
    else:
        in_motors = False
    lines.append(line)
(target / f"{target.name}.yaml").write_text("\n".join(lines) + "\n")
