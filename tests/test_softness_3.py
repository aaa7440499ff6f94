"""test_softness_3.py BIELLE: what `bielle softness` predicts, stepped by today's MuJoCo.

It is npm's @mujoco/mujoco, looked for in $BIELLE_NODE_MODULES; without node or the package the test ends with status 77.
"""
import json
import os
import re
import sys
import tempfile

from node import require, run, step_mujoco

BIELLE = sys.argv[1]
TOLERANCE = 0.1  # as promised

# Motors are held by a huge armature while the loop comes to rest; then they pull as much as that took, and steps that are a little
# shorter and longer than the longest stable one follow.
STEP = """
({file, motor, stable}) => {
  const model = M.MjModel.from_xml_string(fs.readFileSync(file, 'utf8')), data = new M.MjData(model);
  const armature = model.dof_armature[motor], step = model.opt.timestep;
  model.dof_armature[motor] = 1e9;
  model.opt.tolerance = 0;  // relative to the mean inertia
  while (data.time < 1.5) M.mj_step(model, data);
  M.mj_forward(model, data);
  const rows = [...data.efc_pos].filter((x, row) => data.efc_type[row] === EQUALITY);
  const norm = (x) => Math.hypot(...x);
  const result = {gap: norm(rows.slice(0, 3)), angle: 2 * norm(rows.slice(3)), moved: [...data.qpos]};
  const torque = data.qfrc_bias[motor] - data.qfrc_constraint[motor], rest = [...data.qpos];
  model.dof_armature[motor] = armature;
  result.diverges = stable === null ? [] : [0.9 * stable, 1.1 * stable].map((duration) => {
    model.opt.timestep = duration;
    M.mj_resetData(model, data);
    data.qpos.set(rest);
    data.qfrc_applied[motor] = torque;
    data.qvel[1] = 1e-6;
    for (let i = 0; i < 20000; ++i) {
      M.mj_step(model, data);
      if (!(Math.abs(data.qvel[1]) < 20)) return true;
    }
    return false;
  });
  return result;
}
"""


def make_swing(tie, option="timestep='0.001'", joint=""):
    """Two rods that hang on the world, and a third between their ends, whose motor begins where its range does."""
    inertia = "<inertial pos='0 0 -0.1' mass='%g' diaginertia='0.002 0.002 0.001'/>"
    return f"""<mujoco><compiler angle="radian"/><option {option}/><worldbody>
  <body name="crank"><joint name="crank" axis="0 1 0" range="0 1" {joint}/>{inertia % 0.5}
    <body name="coupler" pos="0 0 -0.3"><joint name="coupler" axis="0 1 0"/>
      <inertial pos="0.2 0 -0.05" mass="2" diaginertia="0.01 0.02 0.02"/></body></body>
  <body name="rocker" pos="0.35 0 0.05"><joint name="rocker" axis="0 1 0"/>{inertia % 0.8}</body></worldbody>
  <equality><{tie}/></equality>
  <actuator><motor name="crank" joint="crank" ctrllimited="true" ctrlrange="-5 5"/></actuator></mujoco>"""


SLIDER = """<body name="rocker" pos="0.35 0 -0.3"><joint name="rocker" type="slide" axis="1 0 0"/>
    <geom type="box" size="0.02 0.04 0.03" mass="0.8" contype="0" conaffinity="0"/></body></worldbody>"""
SLIDING = 8  # the case with it
TIP = """<body name="tip" pos="0 0 -0.35"/></body></worldbody>"""


def make_cases():
    pin = "connect name='pin' body1='coupler' body2='rocker' anchor='0.35 0 0'"
    weld = "weld name='pin' body1='coupler' body2='world'"
    return [make_swing(pin + " solref='0.06 1' solimp='0.9 0.95'"),
            make_swing(pin + " solref='-900 -40' solimp='0.8 0.8'"),
            make_swing(weld + " solref='0.03 1' solimp='0.9 0.9'"),
            make_swing("joint name='pin' joint1='coupler' joint2='crank' polycoef='0 0.5 0 0 0' solref='0.03 1' solimp='0.9 0.9'"),
            make_swing(pin + " solref='-1e6 -1000' solimp='0.95 0.95'", "timestep='0.0005'"),
            make_swing(pin + " solref='-4e5 -10' solimp='0.95 0.95'", "timestep='0.0005'"),
            make_swing(pin + " solref='-1e6 -1000' solimp='0.95 0.95'", "timestep='0.0005' integrator='RK4'"),
            make_swing(pin + " solref='0.001 1' solimp='0.95 0.95'", "timestep='0.0005'", "stiffness='2000' damping='1'"),
            # Bodies whose inverse inertia MuJoCo estimates otherwise: one that only slides, one without mass.
            re.sub('<body name="rocker".*</worldbody>', SLIDER, make_swing(pin + " solref='0.06 1' solimp='0.9 0.95'")),
            make_swing(pin.replace("rocker", "tip") + " solref='0.06 1' solimp='0.9 0.95'").replace("</body></worldbody>", TIP)]


def main():
    require("@mujoco/mujoco")
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        tasks, rows = [], []
        for k, text in enumerate(make_cases()):
            with open(f"{k}.xml", "w", encoding="utf-8") as file:
                file.write(text)
            run(BIELLE, "softness", f"{k}.xml", "--postures", 1, "-o", f"soft{k}")
            with open(f"soft{k}/softness.jsonl", encoding="utf-8") as file:
                rows.append(json.loads(file.readlines()[1]))
            assert rows[-1]["state"] == "holds" and abs(rows[-1]["position"]) < 1e-9, rows[-1]
            stable = rows[-1]["stable_step"]
            tasks.append({"file": f"{k}.xml", "motor": 0, "stable": stable if stable < 0.1 else None})
        found = step_mujoco(STEP, tasks)
        weld, old = found["results"][2], run(BIELLE, "softness", "2.xml", "--postures", 1, "--mujoco", 2, "--json", "-o", "old")
        assert abs(json.loads(old)["loops"][0]["sag"] / max(map(abs, weld["moved"][1:2])) - 1) > TOLERANCE  # of other versions
        steps = 0
        for task, row, result in zip(tasks, rows, found["results"]):
            def check(predicted, stepped):
                assert abs(stepped - predicted) <= TOLERANCE * abs(predicted) + 1e-12, (task["file"], row, result)
            if row["gap"] > 0:
                check(row["gap"], result["gap"])
                check(row["angle"], result["angle"])
            else:  # of a joint, whose only row it is; the rocker swings
                check(row["angle"], result["gap"])
            # Of a slider alone, which carries more than the coupler.
            driven = slice(2, 3) if task["file"] == f"{SLIDING}.xml" else slice(1, 3 if row["gap"] > 0 else 2)
            check(row["sag"], max(map(abs, result["moved"][driven])))
            if task["stable"]:
                steps += 1
                assert result["diverges"] == [False, True], (task, result)
        assert steps == 5, tasks
    print(f"MuJoCo {found['version']} opens {len(tasks)} loops as far as predicted, and steps of {steps} are stable as long as predicted")


main()
