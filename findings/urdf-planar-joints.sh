#!/bin/bash
# A planar joint of a URDF leaves its plane in urdf-loader, and its angle swings the link around its parent: origin and axis of the
# joint are taken in another order than by MuJoCo.
#
# Seen with urdf-loader 0.13.1 (npm, with three 0.187.0) and MuJoCo 3.14.0 (npm, @mujoco/mujoco), on a planar joint 1 m along x from its
# parent, whose <axis>, the normal of the plane by the specification, is y:
# - MuJoCo moves the link along x and -z, and turns it about y where it is;
# - urdf-loader's second coordinate moves it along y, the normal. By the third the link turns about y, and its place about the parent's
#   origin, as if the origin of the joint came after its motion: 0.5 rad take it 0.48 m down;
# - with the axis z, the plane is right, and the angle swings the link as well. Only a joint at its parent's origin is right.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-fund --no-audit @mujoco/mujoco@3.14.0 urdf-loader@0.13.1 three@0.187.0 jsdom@24.1.3
cat > move.mjs <<'JS'
import { JSDOM } from "jsdom";
import load from "@mujoco/mujoco";
const { window } = new JSDOM("");
for (const name of ["DOMParser", "XMLSerializer", "Document", "Element", "document"]) globalThis[name] = window[name];
const { Vector3 } = await import("three"), { default: URDFLoader } = await import("urdf-loader"), mujoco = await load();
const inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>';
const write = (axis) => `<robot name="sled"><link name="rail">${inertial}</link><link name="sled">${inertial}</link>
  <joint name="sled" type="planar"><origin xyz="1 0 0"/><parent link="rail"/><child link="sled"/><axis xyz="${axis}"/></joint></robot>`;
const show = (p) => [...p].map((x) => (Math.round(x * 1e3) / 1e3 + 0).toString()).join(" ");
for (const axis of ["0 1 0", "0 0 1"]) {
  mujoco.FS.writeFile("sled.urdf", write(axis));
  const model = mujoco.MjModel.mj_loadXML("sled.urdf"), data = new mujoco.MjData(model), robot = new URDFLoader().parse(write(axis));
  for (const q of [[0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.5]]) {
    data.qpos.set(q);
    mujoco.mj_forward(model, data);
    robot.setJointValue("sled", ...q);
    robot.updateMatrixWorld(true);
    console.log(`axis ${axis}, at ${q.join(" ")}: MuJoCo ${show([...data.xpos].slice(3))}, urdf-loader ` +
                show(robot.links.sled.getWorldPosition(new Vector3()).toArray()));
  }
}
JS
node move.mjs | tee seen
cat > expected <<'TEXT'
axis 0 1 0, at 0.2 0 0: MuJoCo 1.2 0 0, urdf-loader 1.2 0 0
axis 0 1 0, at 0 0.2 0: MuJoCo 1 0 -0.2, urdf-loader 1 0.2 0
axis 0 1 0, at 0 0 0.5: MuJoCo 1 0 0, urdf-loader 0.878 0 -0.479
axis 0 0 1, at 0.2 0 0: MuJoCo 1.2 0 0, urdf-loader 1.2 0 0
axis 0 0 1, at 0 0.2 0: MuJoCo 1 0.2 0, urdf-loader 1 0.2 0
axis 0 0 1, at 0 0 0.5: MuJoCo 1 0 0, urdf-loader 0.878 0.479 0
TEXT
diff expected seen && echo "as described"
