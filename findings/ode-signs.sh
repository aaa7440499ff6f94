#!/bin/bash
# A universal joint of ODE counts otherwise when the world takes the place of a body that stands still: its second angle then runs
# against its own rate, as that of a hinge-2 always does.
#
# Seen with ODE 0.16.2 (Debian 12, libode8 2:0.16.2-1). A body is turned by 0.3 rad about, or moved by 0.3 m along, an axis of the
# joint that ties it to a body that stands still, or to the world (0), and moves on with 2 rad/s or m/s:
# - with the moved body first, angles, positions and rates are positive, with the still one first negative: joints count how their
#   first body moves, seen from the second;
# - with the world first, hinges, sliders and pistons are negative, too. But a universal joint's first angle and both rates are
#   positive, and its second angle is negative;
# - a hinge-2 with the moved body first has its second angle at -0.3 and the rate +2, with the still one first +0.3 and -2.
# Feedback on angles and rates of such joints drives them away. Attach (body, 0), not (0, body).
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libode-dev=2:0.16.2-1 libode8=2:0.16.2-1 libccd2=2.1-2+b1
for package in *.deb; do dpkg -x "$package" root; done
cat > signs.cpp <<'CPP'
#include <ode/ode.h>

#include <cstdio>
static dWorldID world;
static dBodyID moved, still;
struct Motion {
  bool turns;
  double x, y, z;  // its axis
};
static void place(const Motion& m, double by, double rate) {
  dQuaternion q;
  dQFromAxisAndAngle(q, m.x, m.y, m.z, m.turns ? by : 0);
  dBodySetQuaternion(moved, q);
  dBodySetPosition(moved, m.turns ? 0 : by * m.x, m.turns ? 0 : by * m.y, m.turns ? 0 : by * m.z);
  dBodySetAngularVel(moved, m.turns ? rate * m.x : 0, m.turns ? rate * m.y : 0, m.turns ? rate * m.z : 0);
  dBodySetLinearVel(moved, m.turns ? 0 : rate * m.x, m.turns ? 0 : rate * m.y, m.turns ? 0 : rate * m.z);
}
static const Motion kAlong = {false, 0, 0, 1}, kAboutX = {true, 1, 0, 0}, kAboutY = {true, 0, 1, 0}, kAboutZ = {true, 0, 0, 1};
using Get = dReal (*)(dJointID);
static void tell(dJointID joint, const Motion& motion, Get position, Get rate) {
  place(motion, 0.3, 2);
  std::printf(" %+.1f %+.0f", position(joint), rate(joint));
  place(motion, 0, 0);
}
int main() {
  dInitODE2(0);
  world = dWorldCreate(), moved = dBodyCreate(world), still = dBodyCreate(world);
  const dReal x[] = {1, 0, 0}, y[] = {0, 1, 0};
  for (int way = 0; way < 4; ++way) {
    const dBodyID first = way < 2 ? moved : way == 2 ? still : nullptr, second = way == 0 ? still : way == 1 ? nullptr : moved;
    std::printf("%s\n", (const char*[]){"moved, still", "moved, world", "still, moved", "world, moved"}[way]);
    dJointID j = dJointCreateHinge(world, nullptr);
    dJointAttach(j, first, second), dJointSetHingeAxis(j, 0, 0, 1);
    std::printf("  hinge"), tell(j, kAboutZ, dJointGetHingeAngle, dJointGetHingeAngleRate), dJointDestroy(j);
    j = dJointCreateSlider(world, nullptr);
    dJointAttach(j, first, second), dJointSetSliderAxis(j, 0, 0, 1);
    std::printf("\n  slider"), tell(j, kAlong, dJointGetSliderPosition, dJointGetSliderPositionRate), dJointDestroy(j);
    j = dJointCreatePiston(world, nullptr);
    dJointAttach(j, first, second), dJointSetPistonAnchor(j, 0, 0, 0), dJointSetPistonAxis(j, 0, 0, 1);
    std::printf("\n  piston"), tell(j, kAlong, dJointGetPistonPosition, dJointGetPistonPositionRate), dJointDestroy(j);
    j = dJointCreateUniversal(world, nullptr);
    dJointAttach(j, first, second), dJointSetUniversalAxis1(j, 0, 1, 0), dJointSetUniversalAxis2(j, 0, 0, 1);
    std::printf("\n  universal"), tell(j, kAboutY, dJointGetUniversalAngle1, dJointGetUniversalAngle1Rate);
    tell(j, kAboutZ, dJointGetUniversalAngle2, dJointGetUniversalAngle2Rate), dJointDestroy(j);
    if (first && second) {
      j = dJointCreateHinge2(world, nullptr);
      dJointAttach(j, first, second), dJointSetHinge2Anchor(j, 0, 0, 0), dJointSetHinge2Axes(j, x, y);
      std::printf("\n  hinge-2"), tell(j, kAboutX, dJointGetHinge2Angle1, dJointGetHinge2Angle1Rate);
      tell(j, kAboutY, dJointGetHinge2Angle2, dJointGetHinge2Angle2Rate), dJointDestroy(j);
    }
    std::printf("\n");
  }
}
CPP
libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 -w signs.cpp -I root/usr/include -L $libraries -Wl,-rpath,"$PWD/$libraries" -Wl,-rpath-link,$libraries \
  -l:libode.so.8 -o signs
./signs | tee seen
cat > expected <<'TEXT'
moved, still
  hinge +0.3 +2
  slider +0.3 +2
  piston +0.3 +2
  universal +0.3 +2 +0.3 +2
  hinge-2 +0.3 +2 -0.3 +2
moved, world
  hinge +0.3 +2
  slider +0.3 +2
  piston +0.3 +2
  universal +0.3 +2 +0.3 +2
still, moved
  hinge -0.3 -2
  slider -0.3 -2
  piston -0.3 -2
  universal -0.3 -2 -0.3 -2
  hinge-2 -0.3 -2 +0.3 -2
world, moved
  hinge -0.3 -2
  slider -0.3 -2
  piston -0.3 -2
  universal +0.3 +2 -0.3 +2
TEXT
diff expected seen && echo "as described"
