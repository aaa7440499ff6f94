#!/bin/bash
# Roll, pitch and yaw of a URDF, given to JavaScript libraries in this order, make different rotations, also where the order is
# called RPY.
#
# Seen with npm's three 0.187.0, gl-matrix 3.4.4, quaternion 2.2.0, math3d 0.2.2 and roslib 2.1.0, for rpy="0.3 -0.5 1.1", which the
# specification turns about the fixed axes x, y and z in turn, as degrees where the library wants them:
# - Euler(r, p, y, "ZYX") of three, quat.fromEuler(r, p, y) of gl-matrix and the joints of roslib are the URDF's;
# - Quaternion.fromEuler(r, p, y, "RPY") of quaternion is 35 degrees off: it turns about axes that turn along. YPR of (y, p, r), or
#   fromEulerLogical(r, p, y, "RPY"), is right;
# - Quaternion.Euler(r, p, y) of math3d is 34 degrees off, and Euler(r, p, y) of three, whose order is XYZ unless told, 35.
# Angles near zero do not show it: the error is of second order. Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-fund --no-audit three@0.187.0 gl-matrix@3.4.4 quaternion@2.2.0 math3d@0.2.2 roslib@2.1.0
cat > turn.mjs <<'JS'
import { Euler, Quaternion as Three } from "three";
import { quat } from "gl-matrix";
import Quaternion from "quaternion";
import math3d from "math3d";
import { UrdfModel } from "roslib";
const [r, p, y] = [0.3, -0.5, 1.1], [R, P, Y] = [r, p, y].map((x) => x * 180 / Math.PI);
// By hand: q = qz qy qx.
const times = (a, b) => [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                         a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]];
const about = (k, angle) => [0, 1, 2, 3].map((i) => i === 0 ? Math.cos(angle / 2) : i === k ? Math.sin(angle / 2) : 0);
const wanted = times(about(3, y), times(about(2, p), about(1, r)));
const tell = (name, { w, x, y, z }) => {
  const cosine = Math.abs([w, x, y, z].reduce((sum, q, i) => sum + q * wanted[i], 0));
  console.log(`${name}: ${(2 * Math.acos(Math.min(cosine, 1)) * 180 / Math.PI).toFixed(0)} degrees off`);
};
const [x, y_, z, w] = quat.fromEuler(quat.create(), R, P, Y);
tell("three, ZYX", new Three().setFromEuler(new Euler(r, p, y, "ZYX")));
tell("three", new Three().setFromEuler(new Euler(r, p, y)));
tell("gl-matrix", { w, x, y: y_, z });
tell("quaternion, RPY", Quaternion.fromEuler(r, p, y, "RPY"));
tell("quaternion, YPR", Quaternion.fromEuler(y, p, r, "YPR"));
tell("quaternion, logical RPY", Quaternion.fromEulerLogical(r, p, y, "RPY"));
tell("math3d", math3d.Quaternion.Euler(R, P, Y));
const robot = new UrdfModel({ string: `<robot name="arm"><link name="base"/><link name="arm"/><joint name="hinge" type="continuous">
  <origin rpy="${r} ${p} ${y}"/><parent link="base"/><child link="arm"/></joint></robot>` });
tell("roslib", robot.joints.hinge.origin.orientation);
JS
node turn.mjs | tee seen
cat > expected <<'TEXT'
three, ZYX: 0 degrees off
three: 35 degrees off
gl-matrix: 0 degrees off
quaternion, RPY: 35 degrees off
quaternion, YPR: 0 degrees off
quaternion, logical RPY: 0 degrees off
math3d: 34 degrees off
roslib: 0 degrees off
TEXT
diff expected seen && echo "as described"
