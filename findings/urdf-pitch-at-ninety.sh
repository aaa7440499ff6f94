#!/bin/bash
# A joint whose frame is pitched by 89.8 degrees stands at 90 when urdfdom saves the robot, and its roll is 0: the angles that it gives
# are up to a quarter of a degree off.
#
# Guessed: at a right angle, roll and yaw are one, so one of them may be 0; beside it all three come back but for the digits.
# Seen with urdfdom 3.0.1 (Debian 12, liburdfdom-model3.0 3.0.1-1, where getRPY is in liburdfdom-headers-dev 1.0.5-3) and Euler of three
# 0.187.0 (npm), on rpy="0.3 pitch 0.7":
# - urdfdom's exportURDF, which asks its getRPY, takes 90 degrees from 89.74 on, where the sine is 0.99999, and no roll: a pitch of
#   1.567 rad comes back 4.0 mrad off, which is 0.4 mm at 0.1 m. The six digits that it writes do a thousandth of this;
# - at 1.5708, which is what a file has for 90 degrees, nothing is lost but these digits;
# - three sets the roll to 0 from 89.97 degrees on, and keeps the pitch: 1.5704 rad come back 0.1 mrad off.
# Loops whose axes must be parallel lock by this, and the saved file does not tell: 1.5708 is what others have there, too.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq liburdfdom-dev=3.0.1-1 liburdfdom-model3.0=3.0.1-1 liburdfdom-headers-dev=1.0.5-3 libtinyxml-dev=2.6.2-6+deb12u1 \
  libtinyxml2.6.2v5=2.6.2-6+deb12u1 libconsole-bridge1.0=1.0.1+dfsg2-3+b1
for package in *.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit three@0.187.0
cat > save.cpp <<'CPP'
#include <tinyxml.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <cstdio>
#include <string>
static urdf::Rotation getRotation(const urdf::ModelInterface& robot) {
  return robot.getJoint("hinge")->parent_to_joint_origin_transform.rotation;
}
int main(int count, char** pitches) {
  for (int k = 1; k < count; ++k) {
    const auto robot = urdf::parseURDF(
        "<robot name=\"arm\"><link name=\"base\"/><link name=\"arm\"/><joint name=\"hinge\" type=\"continuous\"><origin rpy=\"0.3 " +
        std::string(pitches[k]) + " 0.7\"/><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/></joint></robot>");
    TiXmlDocument* document = urdf::exportURDF(*robot);
    TiXmlPrinter printer;
    document->Accept(&printer);
    const std::string text = printer.CStr();
    const size_t joint = text.find("<joint"), at = text.find("rpy=\"", joint) + 5;
    const urdf::Rotation a = getRotation(*robot), b = getRotation(*urdf::parseURDF(text));
    const double dot = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
    // Of the small turn between them, by its sine.
    const double rest = std::hypot(std::hypot(b.w - dot * a.w, b.x - dot * a.x), std::hypot(b.y - dot * a.y, b.z - dot * a.z));
    std::printf("urdfdom %s: saved as %s, %.1f mrad off\n", pitches[k], text.substr(at, text.find('"', at) - at).c_str(),
                2e3 * rest);
    delete document;
  }
}
CPP
include=root/usr/include libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 -w save.cpp -I $include/urdfdom -I $include/urdfdom_headers -I $include -L $libraries -Wl,-rpath,"$PWD/$libraries" \
  -Wl,-rpath-link,$libraries -l:liburdfdom_model.so.3.0 -l:libtinyxml.so.2.6.2 -o save
cat > save.mjs <<'JS'
import { Euler, Quaternion } from "three";
for (const pitch of process.argv.slice(2)) {
  const q = new Quaternion().setFromEuler(new Euler(0.3, +pitch, 0.7, "ZYX"));
  const back = new Quaternion().setFromEuler(new Euler().setFromQuaternion(q, "ZYX"));
  const rest = back.multiply(q.conjugate());
  console.log(`three ${pitch}: ${(2e3 * Math.hypot(rest.x, rest.y, rest.z)).toFixed(1)} mrad off`);
}
JS
pitches="1.55 1.566 1.567 1.569 1.5704 1.5708"
{ ./save $pitches; node save.mjs $pitches; } | tee seen
cat > expected <<'TEXT'
urdfdom 1.55: saved as 0.3 1.55 0.7, 0.0 mrad off
urdfdom 1.566: saved as 0.3 1.566 0.7, 0.0 mrad off
urdfdom 1.567: saved as 0 1.5708 0.398876, 4.0 mrad off
urdfdom 1.569: saved as 0 1.5708 0.399469, 1.9 mrad off
urdfdom 1.5704: saved as 0 1.5708 0.399883, 0.4 mrad off
urdfdom 1.5708: saved as 0 1.5708 0.400001, 0.0 mrad off
three 1.55: 0.0 mrad off
three 1.566: 0.0 mrad off
three 1.567: 0.0 mrad off
three 1.569: 0.0 mrad off
three 1.5704: 0.1 mrad off
three 1.5708: 0.0 mrad off
TEXT
diff expected seen && echo "as described"
