#!/bin/bash
# A joint of a URDF whose limits are 0 and 0, or not given, is free for one program and locked for the next.
#
# Seen with MuJoCo 3.14.0 and urdf-loader 0.13.1 (npm, @mujoco/mujoco, with three 0.187.0), and libsdformat 12.3.0 (Debian 12,
# libsdformat12-12 12.3.0+ds-2), which reads URDFs for Gazebo:
# - a revolute joint with <limit effort="0" velocity="0"/>, which urdfdom takes: MuJoCo gives it no range. In urdf-loader it stays at 0
#   whatever it is set to; libsdformat gives it the range from 0 to 0, effort 0 and speed 0. A loop with such a joint is rigid there;
# - a prismatic joint likewise;
# - continuous without <limit> is free in all. So is a range of 1e16, effort 1e16 and speed 1e16, which is what libsdformat writes for
#   none; MuJoCo then has a range and a limit of force, both of 1e16.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libsdformat-dev=12.3.0+ds-2 libsdformat12-12=12.3.0+ds-2 libignition-math-dev=6.10.0+ds3-7+b4 \
  libignition-math6-6=6.10.0+ds3-7+b4 libignition-utils-dev=1.2.0+ds-1 liburdfdom-model3.0=3.0.1-1 libtinyxml2-9=9.0.0+dfsg-3.1 \
  libtinyxml2.6.2v5=2.6.2-6+deb12u1 libconsole-bridge1.0=1.0.1+dfsg2-3+b1
for package in *.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit @mujoco/mujoco@3.14.0 urdf-loader@0.13.1 three@0.187.0 jsdom@24.1.3

inertial='<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
{
  echo "<robot name=\"joints\"><link name=\"base\">$inertial</link>"
  while read -r name type limit; do
    echo "<link name=\"${name}_link\">$inertial</link><joint name=\"$name\" type=\"$type\"><parent link=\"base\"/><child link=\"${name}_link\"/>" \
      "<axis xyz=\"0 0 1\"/>$limit</joint>"
  done <<'JOINTS'
hinge revolute <limit effort="0" velocity="0"/>
slide prismatic <limit effort="0" velocity="0"/>
turn continuous
wide prismatic <limit lower="-1e16" upper="1e16" effort="1e16" velocity="1e16"/>
JOINTS
  echo "</robot>"
} > joints.urdf

cat > read.cpp <<'CPP'
#include <cstdio>
#include <sdf/sdf.hh>
int main() {
  sdf::Root root;
  if (!root.Load("joints.urdf").empty()) return 1;
  for (const char* name : {"hinge", "slide", "turn", "wide"}) {
    const sdf::JointAxis& axis = *root.Model()->JointByName(name)->Axis(0);
    std::printf("libsdformat %s: from %g to %g, effort %g, speed %g\n", name, axis.Lower(), axis.Upper(), axis.Effort(),
                axis.MaxVelocity());
  }
}
CPP
libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 -w read.cpp -I root/usr/include/sdformat-12.3 -I root/usr/include/ignition/math6 -I root/usr/include/ignition/utils1 \
  -L $libraries -Wl,-rpath,"$PWD/$libraries" -Wl,-rpath-link,$libraries -l:libsdformat12.so.12 -l:libignition-math6.so.6 -o read
HOME=$PWD ./read > seen
cat > read.mjs <<'JS'
import fs from "fs";
import { JSDOM } from "jsdom";
import mujoco from "@mujoco/mujoco";
const { window } = new JSDOM("");
for (const name of ["DOMParser", "XMLSerializer", "Document", "Element", "document"]) globalThis[name] = window[name];
const { default: URDFLoader } = await import("urdf-loader");
const text = fs.readFileSync("joints.urdf", "utf8"), names = ["hinge", "slide", "turn", "wide"];
const robot = new URDFLoader().parse(text);
for (const name of names) {
  robot.setJointValue(name, 0.5);
  console.log(`urdf-loader ${name}: set to 0.5, is at ${robot.joints[name].angle}`);
}
const module = await mujoco();
module.FS.writeFile("joints.urdf", text);
module.mj_saveLastXML("saved.xml", module.MjModel.mj_loadXML("joints.urdf"));
const saved = module.FS.readFile("saved.xml", { encoding: "utf8" });
for (const name of names) console.log(`MuJoCo ${name}: ${saved.match(`<joint name="${name}"[^>]* range="([^"]*)"`)?.[1] ?? "no range"}`);
JS
node read.mjs >> seen
cat seen
cat > expected <<'TEXT'
libsdformat hinge: from 0 to 0, effort 0, speed 0
libsdformat slide: from 0 to 0, effort 0, speed 0
libsdformat turn: from -1e+16 to 1e+16, effort inf, speed inf
libsdformat wide: from -1e+16 to 1e+16, effort 1e+16, speed 1e+16
urdf-loader hinge: set to 0.5, is at 0
urdf-loader slide: set to 0.5, is at 0
urdf-loader turn: set to 0.5, is at 0.5
urdf-loader wide: set to 0.5, is at 0.5
MuJoCo hinge: no range
MuJoCo slide: no range
MuJoCo turn: no range
MuJoCo wide: -1e+16 1e+16
TEXT
diff expected seen && echo "as described"
