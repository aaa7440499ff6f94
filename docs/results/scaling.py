#!/usr/bin/env python3
"""Writes docs/results/scaling.md: what the dynamics of chains with loops cost, over their depth and the size of the loop.

    docs/results/scaling.py                    writes the page from the table in docs/results/data
    docs/results/scaling.py --measure          measures first (two minutes)

`--quick` measures the shortest chains and prints the page.
"""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import common

DATA = common.HERE / "data/scaling.csv"
SIZES = {"rod": {5: (3, 5, 7, 9, 11), 10: (3, 5, 9, 13, 17), 20: (3, 7, 13, 21, 31), 40: (3, 9, 17, 29, 41)},
         "gears": {5: (2, 4, 6, 8, 10), 10: (2, 4, 8, 12, 16), 20: (2, 6, 12, 20, 30), 40: (2, 8, 16, 28, 40)}}
TITLES = {"rod": "Chains tied by a rod", "gears": "Chains coupled by gears"}
WHAT = {"accelerations": "accelerations", "derivatives": "with derivatives", "step": "step",
        "linearization": "step with derivatives"}
LENGTH, MASS, RADIUS = 0.3, 0.5, 0.02


def format_link(name):
    across = MASS * (LENGTH ** 2 / 12 + RADIUS ** 2 / 4)
    return f"""  <link name="{name}">
    <inertial>
      <origin xyz="0 {LENGTH / 2} 0"/>
      <mass value="{MASS}"/>
      <inertia ixx="{across:.9g}" ixy="0" ixz="0" iyy="{MASS * RADIUS ** 2 / 2:.9g}" iyz="0" izz="{across:.9g}"/>
    </inertial>
  </link>"""


def format_joint(name, parent, child, place, independent):
    return f"""  <joint name="{name}" type="continuous" independent="{str(independent).lower()}">
    <origin xyz="{place[0]} {place[1]} 0"/>
    <parent link="{parent}"/>
    <child link="{child}"/>
    <axis xyz="0 0 1"/>
  </joint>"""


def format_robot(kind, depth, size):
    """Two chains of `depth` links side by side in URDF+, tied at the end of their first links: `size` links in the loop."""
    tied = size // 2
    apart = LENGTH if kind == "rod" else 0
    parts = ['  <link name="base"/>']
    for level in range(1, depth + 1):
        for chain in (1, 2):
            parent = f"link_{chain}_{level - 1}" if level > 1 else "base"
            place = (0, LENGTH) if level > 1 else (apart * (chain - 1), 0)
            is_free = chain == 1 or level != (1 if kind == "rod" else tied)
            parts += [format_link(f"link_{chain}_{level}"),
                      format_joint(f"joint_{chain}_{level}", parent, f"link_{chain}_{level}", place, is_free)]
    ends = [f"link_{chain}_{tied}" for chain in (1, 2)]
    if kind == "rod":
        parts += [format_link("rod"), format_joint("joint_rod", ends[0], "rod", (0, LENGTH), False), f"""  <loop name="closure" type="revolute">
    <predecessor link="rod">
      <origin xyz="{LENGTH} 0 0"/>
    </predecessor>
    <successor link="{ends[1]}">
      <origin xyz="0 {LENGTH} 0"/>
    </successor>
    <axis xyz="0 0 1"/>
  </loop>"""]
    else:
        parts.append(f"""  <coupling name="gears">
    <predecessor link="{ends[0]}"/>
    <successor link="{ends[1]}"/>
    <ratio value="1"/>
  </coupling>""")
    return "\n".join([f'<robot name="{kind}_{depth}_{size}">', *parts, "</robot>", ""])


def measure(bielle, sizes, duration=0.02):
    program = pathlib.Path(bielle).resolve().parent / "bielle-loops"
    rows = []
    with tempfile.TemporaryDirectory() as place:
        for kind, depths in sizes.items():
            for depth, loops in depths.items():
                for size in loops:
                    path = pathlib.Path(place) / f"{kind}_{depth}_{size}.urdf"
                    path.write_text(format_robot(kind, depth, size), encoding="utf-8")
                    print(path.name, file=sys.stderr, flush=True)
                    run = subprocess.run([program, "dynamics", path, "--run", str(duration)], stdout=subprocess.PIPE, text=True, check=True)
                    found = json.loads(run.stdout)
                    assert found["mobility"] == 2 * depth - 1, found
                    rows.append({"kind": kind, "depth": depth, "size": size, "velocities": found["velocities"],
                                 **{key: f"{1e6 * found[key]:.4g}" for key in WHAT}})
    return rows


def calc_growth(rows, kind, key, depths):
    """Exponent of the time over the depth with the smallest loop, and with the largest, between two depths."""
    found = {}
    for depth in depths:
        times = [float(row[key]) for row in rows if row["kind"] == kind and int(row["depth"]) == depth]
        found[depth] = (times[0], times[-1])
    ratio = math.log(depths[1] / depths[0])
    return [math.log(last / first) / ratio for first, last in zip(found[depths[0]], found[depths[1]])]


def make_page(comment, rows):
    page = common.Page(__file__, "Dynamics of long chains with a loop", comment)
    page.add("""The scaling family of grbda (Chignoli, Adrador, Wensing and Kim, "A propagation perspective on recursive forward dynamics
for systems with kinematic loops", arXiv 2311.13732): two chains of links side by side, tied once, so that the loop has 2 to 41 links
and the mechanism 2 depth − 1 freedoms. `docs/results/scaling.py` writes such robots in URDF+ with links of its own; the files published
with the paper, of depth 20 and 40, load with the same mobility.""")
    page.add("""Processor time, one thread, least of ten runs, µs. *Accelerations* are those of all coordinates, with the forces of the
closures (`updateConstrainedDynamics()`), *with derivatives* adds their derivatives by configuration, velocity and torques; a *step* is
one of optimal control in reduced coordinates and ends with closed loops, *step with derivatives* adds its linearization, several
nodes at once.""")
    for kind, title in TITLES.items():
        chosen = [row for row in rows if row["kind"] == kind]
        if not chosen:
            continue
        page.heading(title)
        page.table(["depth", "links in the loop", "velocities", *(WHAT.values())],
                   [[str(row[key]) for key in ("depth", "size", "velocities", *WHAT)] for row in chosen])
    depths = sorted({int(row["depth"]) for row in rows})
    if len(depths) > 1:
        page.heading("Growth")
        page.add("""The exponent of the depth in the times, with the smallest and with the largest loop, which is the longer the deeper the chain: 1 is linear. Derivatives fill matrices
of (2 depth)² entries, so that a part of their time must grow like the square. A step in reduced coordinates factorizes a dense mass
matrix of 2 depth − 1 rows, of which a part grows like the cube, and the basis of a loop as one block.""")
        pairs = list(zip(depths, depths[1:]))
        lines = [[TITLES[kind], title, *(" and ".join(f"{x:.1f}" for x in calc_growth(rows, kind, key, pair)) for pair in pairs)]
                 for kind in TITLES for key, title in WHAT.items()]
        page.table(["", "", *(f"{a} to {b}" for a, b in pairs)], lines)
    page.heading("Beside what is published")
    page.add("""Published are curves, no figures, and of forward dynamics alone. The script that draws those of this family, by code generated
for each robot, has axes from 2 to 100 µs at depth 5, from 4 to 200 µs at depth 10, from 10 µs to 1 ms at depth 20 and from 10 µs to 2 ms
at depth 40. Read from the figure beside the library, it takes about 31 µs for a chain of 12 links with gears, 32 µs for Mini Cheetah,
49 µs for the MIT Humanoid and 60 µs for Tello. The machine is not named.""")
    return page


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--measure", action="store_true", help="measure first")
    arguments = parser.parse_args()
    run = common.describe_run(arguments.commit)
    if os.getloadavg()[0] > os.cpu_count():
        run += ", among other programs"
    if arguments.quick:
        rows = measure(arguments.bielle, {kind: {5: depths[5][:1], 10: depths[10][:1]} for kind, depths in SIZES.items()},
                       duration=1e-3)
        make_page(run, rows).write(True)
        return
    if arguments.measure:
        rows = measure(arguments.bielle, SIZES)
        with open(DATA, "w", encoding="utf-8", newline="") as file:
            file.write(f"# {run}\n")
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    with open(DATA, encoding="utf-8", newline="") as file:
        comment = file.readline()[1:].strip()
        make_page(comment, list(csv.DictReader(file))).write(False)


if __name__ == "__main__":
    main()
