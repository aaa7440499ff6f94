#!/usr/bin/env python3
"""Writes docs/results/public.md: published models with loops, as they are read.

    docs/results/public.py --models DIRECTORY [--bielle build/bin/bielle]

DIRECTORY has checkouts of the repositories as OWNER/NAME; what is not there is told. Takes seconds.
"""
import json
import pathlib
import re

import common

# Repository, path, the mobility that it must have (joints less what loops take; 6 of it a free base, one for each rod on two balls), or
# what is missing in the file.
MODELS = [
    ("limxdynamics/humanoid-description", "HU_D04_description/xml/HU_D04_01.xml", 43),
    ("newton-physics/newton-assets", "disneyresearch/dr_legs/usd/dr_legs_no_meshes.usda", 18),
    ("newton-physics/newton", "newton/tests/assets/kamino/basics/boxes_fourbar.usda", 7),
    ("newton-physics/newton", "newton/tests/assets/4_bar.xml", 1),
    ("feidedao/Parallel_Ankle_Joint", "2_g1_ankle/urdf/23urdf311.xml", 2),
    ("feidedao/Parallel_Ankle_Joint", "5_tiangong/urdf/TG10-00.xml", 4),
    ("google-deepmind/mujoco_menagerie", "robotiq_2f85/2f85.xml", 3),
    ("google-deepmind/mujoco_menagerie", "robotiq_2f85_v4/2f85.xml", 1),
    ("google-deepmind/mujoco_menagerie", "ufactory_xarm7/hand.xml", 1),
    ("pal-robotics/pal_mjlab", "src/pal_mjlab/robots/pal_kangaroo_full/xmls/kangaroo_full.xml", 18),
    ("ROAM-Lab-ND/generalized_rbda", "robot-models/four_bar.urdf", 7),
    ("ROAM-Lab-ND/generalized_rbda", "robot-models/six_bar.urdf", 9),
    ("ROAM-Lab-ND/generalized_rbda", "robot-models/planar_leg_linkage.urdf", 8),
    ("ROAM-Lab-ND/generalized_rbda", "robot-models/mit_humanoid.urdf", 24),
    ("ROAM-Lab-ND/generalized_rbda", "robot-models/mini_cheetah.urdf", 18),
    ("ROAM-Lab-ND/generalized_rbda", "robot-models/tello_humanoid.urdf", "42: its differentials are in code alone, which is told"),
    ("google-deepmind/mujoco", "test/engine/testdata/core_constraint/jdotv_connect_2d.xml", 2),
    ("google-deepmind/mujoco", "test/engine/testdata/core_constraint/jdotv_connect_3d.xml", 6),
    ("google-deepmind/mujoco", "test/engine/testdata/core_constraint/jdotv_weld_3d.xml", 3),
    ("RobotLocomotion/drake", "examples/multibody/four_bar/four_bar.sdf", "3: its bushing is in code alone"),
    ("RobotLocomotion/drake", "examples/multibody/four_bar/four_bar_unassembled.sdf", 1),
    ("RobotLocomotion/drake", "examples/multibody/four_bar/asymmetric_linkage.sdf", "4: its weld is in code alone"),
    ("RobotLocomotion/drake", "examples/multibody/bushing_as_revolute_joint/transmission.sdf", 7),
    ("Adriaeik/fusion2URDF", "examples/Assem1_description/urdf/Assem1.urdf", 12),
    ("assadollahi/kayra", "mujoco/fourBars.xml", 1),
    ("assadollahi/kayra", "mujoco/kayraCircle.xml", 8),
    ("assadollahi/kayra", "mujoco/kayraLowerBody.xml", 14),
    ("Rhoban/onshape-to-robot-examples", "planar-2dof/robot.xml", 2),
    ("Rhoban/onshape-to-robot-examples", "orbita_mujoco/robot.xml", 3),
    ("gazebosim/harmonic_demo", "harmonic_demo/harmonic_mimic_mechanisms.sdf", "three mechanisms in one file"),
]


def main():
    parser = common.make_parser(__doc__)
    parser.add_argument("--models", required=True, help="checkouts, as OWNER/NAME")
    arguments = parser.parse_args()
    runner = common.Runner(arguments.bielle)
    rows = []
    for repository, path, right in MODELS:
        file = pathlib.Path(arguments.models).resolve() / repository / path
        if not file.exists():
            rows.append([f"{repository}: {path}", str(right), "not at hand"])
            continue
        done = runner.run("info", file, "--json", allowed=(0, 2))
        if done.returncode == 2:
            reason = re.sub(r"^.*?: error: \S+: ", "", done.stderr.strip().splitlines()[-1])
            rows.append([f"{repository}: {path}", str(right), "refused: " + reason])
            continue
        mobility = json.loads(done.stdout)["mobility"]
        idle = mobility["idle_spins"]
        rows.append([f"{repository}: {path}", str(right), str(mobility["mobility"]) + (f", of which spins of rods: {idle}" if idle else "")])
    page = common.Page(__file__, "Published models, as they are read", common.describe_run(arguments.commit))
    page.add("""Robots and mechanisms with loops that others have published, as their files are, without a file beside them: the mobility
        that they must have, with that of a free base and the spins of rods on two balls, and the one that is read. Of some, the
        text alone was at hand, without meshes, and was written again without comments and what is drawn: cubes stand for the
        two meshes from which `robotiq_2f85/2f85.xml` takes masses.""")
    page.table(["model", "right", "read"], rows)
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
