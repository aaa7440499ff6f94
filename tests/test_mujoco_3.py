"""test_mujoco_3.py BIELLE: today's MuJoCo reads what is tested with Debian's: references for learning and the files of all robots.

It is npm's @mujoco/mujoco, looked for in $BIELLE_NODE_MODULES; without node, the package or NumPy, the test ends with status 77.
"""
import json
import os
import sys
import tempfile

from node import require, run, step_mujoco

try:
    import numpy as np
except ImportError:
    print("skipped: no NumPy")
    sys.exit(77)

BIELLE = sys.argv[1]
STEP = """
({file, frames}) => {
  const model = M.MjModel.from_xml_string(fs.readFileSync(file, 'utf8')), data = new M.MjData(model);
  const worst = {bodies: 0, turns: 0, loops: 0};
  const getLoops = () => data.efc_pos.filter((x, row) => data.efc_type[row] === EQUALITY).map(Math.abs);
  for (const {q, p, quaternions} of frames) {
    data.qpos.set(q);
    M.mj_forward(model, data);
    p.flat().forEach((x, i) => { worst.bodies = Math.max(worst.bodies, Math.abs(data.xpos[3 + i] - x)); });
    quaternions.forEach((u, i) => {
      const product = u.reduce((sum, x, j) => sum + x * data.xquat[4 * (i + 1) + j], 0);
      worst.turns = Math.max(worst.turns, 1 - Math.abs(product));
    });
    worst.loops = Math.max(worst.loops, ...getLoops());
  }
  if (!frames.length) {
    M.mj_forward(model, data);
    worst.loops = Math.max(0, ...getLoops());
    for (let i = 0; i < 100; ++i) M.mj_step(model, data);
  }
  return {...worst, finite: data.qpos.every(Number.isFinite) && (data.time > 0) === !frames.length};
}
"""


def read_frames(path, names):
    with np.load(path) as archive:
        joints, p, quaternions = (archive[name] for name in names)
    return [{"q": [*p[k, 0], *quaternions[k, 0], *joints[k]], "p": p[k].tolist(), "quaternions": quaternions[k].tolist()}
            for k in range(len(p))]


def main():
    require("@mujoco/mujoco")
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        run(BIELLE, "solve", "squat", "--robot", "bipetto", "--depth", 0.85, "--duration", 0.6, "--set", "settle=0", "--set",
            "time_step=0.02", "--no-check", "--no-report", "-o", "squat")
        tasks = []
        for form, names in (("mjlab", ("joint_pos", "body_pos_w", "body_quat_w")),
                            ("amp", ("dof_positions", "body_positions", "body_rotations"))):
            run(BIELLE, "export", "squat", "--format", form)
            tasks.append({"file": f"squat/{form}.xml", "frames": read_frames(f"squat/{form}.npz", names)})
        poisoned = json.loads(json.dumps(tasks[0]))
        poisoned["frames"][3]["q"][10] += 1e-6
        tasks.append(poisoned)
        robots = [line.split()[0] for line in run(BIELLE, "robots").splitlines() if line.strip()]
        for robot in robots:
            for joints in ("balls", "hinges"):
                run(BIELLE, "convert", robot, "--to", "mjcf", "--joints", joints, "-o", f"{robot}.{joints}.xml")
                tasks.append({"file": f"{robot}.{joints}.xml", "frames": []})
        found = step_mujoco(STEP, tasks)
        for task, result in zip(tasks, found["results"]):
            agrees = max(result["bodies"], result["turns"], result["loops"]) < 1e-9 and result["finite"]
            assert agrees == (task is not poisoned), (task["file"], result)
    print(f"MuJoCo {found['version']} has the bodies of 2 references where the files have them, and carries out {len(robots)} robots")


main()
