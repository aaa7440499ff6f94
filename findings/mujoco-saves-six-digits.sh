#!/bin/bash
# A linkage that turns in the file of its author is locked in the copy that MuJoCo saves: mj_saveLastXML of 2.2.2 and of 3.14.0
# writes six significant digits, whatever the file had.
#
# Seen with MuJoCo 2.2.2 (Debian 12, libmujoco2.2.2 2.2.2-3) and 3.14.0 (npm, @mujoco/mujoco), on a valid four-bar in an
# inclined plane, whose loop is closed by two connects on one pin and whose numbers have 17 digits:
# - its three hinges are parallel to better than 1e-14 rad as loaded, and to 1e-6 rad only when the saved file is loaded again;
# - six equations, of which two said something, then say three things to three angles: no freedom is left but what the softness of
#   the constraints gives. MuJoCo moves the linkage all the same; what closes loops exactly does not.
# A place of 0.00227431 m keeps eight decimals and one of 12.3457 m four, so that no number of decimals tells that the file was
# rounded. The binary model (mj_saveModel) keeps all digits. Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libmujoco-dev=2.2.2-3 libmujoco2.2.2=2.2.2-3 libccd2=2.1-2+b1 liblodepng0=0.0~git20220618.b4ed2cd-3 \
  libqhull-r8.0=2020.2-5 libtinyxml2-9=9.0.0+dfsg-3.1
for package in *.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit @mujoco/mujoco@3.14.0

# A four-bar in the plane of two unit vectors u and v, its bodies turned at random angles about the normal n and about u.
cat > make.mjs <<'JS'
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const times = (R, p) => R.map((row) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
const turned = (R, p) => [0, 1, 2].map((k) => R[0][k] * p[0] + R[1][k] * p[1] + R[2][k] * p[2]);
const minus = (a, b) => a.map((x, k) => x - b[k]);
const rotate = (q) => {
  const [w, x, y, z] = q;
  return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
          [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
          [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
};
const unit = (q) => q.map((x) => x / Math.hypot(...q));
const plane = rotate(unit([0.9, 0.2, -0.3, 0.4]));
const at = (x, y) => times(plane, [x, y, 0]), n = times(plane, [0, 0, 1]);
const [knee, pin, ground] = [at(0.05, 0.11), at(0.33, 0.17), at(0.41, 0.0012345)];
const q = [[0.8, 0.1, 0.5, -0.3], [0.7, -0.4, 0.2, 0.5], [0.6, 0.3, 0.3, -0.7]].map(unit);
const R = q.map(rotate);
const product = ([a, b, c, d], [e, f, g, h]) => [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
                                                 a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
const inverse = ([w, x, y, z]) => [w, -x, -y, -z];
const body = (name, place, attitude, i, inside = "") =>
  `<body name="${name}" pos="${place.join(" ")}" quat="${attitude.join(" ")}"><joint name="${name}" axis="` +
  `${turned(R[i], n).join(" ")}"/><geom type="sphere" size="0.02"/>${inside}</body>\n`;
const second = pin.map((x, k) => x + 0.02 * n[k]);
console.log(`<mujoco model="fourbar"><compiler angle="radian"/><worldbody>\n` +
  body("crank", [0, 0, 0], q[0], 0, body("coupler", turned(R[0], knee), product(inverse(q[0]), q[1]), 1)) +
  body("rocker", ground, q[2], 2) + `</worldbody><equality>\n` + [pin, second].map((p) =>
    `<connect body1="coupler" body2="rocker" anchor="${turned(R[1], minus(p, knee)).join(" ")}"/>\n`).join("") +
  `</equality></mujoco>`);
JS
node make.mjs > fourbar.xml

# Both tell the largest angle between two axes, before and after saving.
cat > save.c <<'C'
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
static double spread(const mjModel* model) {
  double largest = 0;
  mjData* data = mj_makeData(model);
  mj_forward(model, data);
  for (int j = 1; j < 3; ++j) {
    const double *a = data->xaxis, *b = data->xaxis + 3 * j;
    const double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    largest = fmax(largest, sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]));
  }
  return largest;
}
int main(void) {
  char error[500] = "";
  mjModel* model = mj_loadXML("fourbar.xml", 0, error, sizeof error);
  if (!model || !mj_saveLastXML("saved.xml", model, error, sizeof error)) return puts(error), 1;
  mj_saveModel(model, "saved.mjb", 0, 0);
  const double exact = spread(model), text = spread(mj_loadXML("saved.xml", 0, error, sizeof error));
  const double binary = spread(mj_loadModel("saved.mjb", 0));
  printf("axes of the file parallel: %s\n", exact < 1e-14 ? "yes" : "no");
  printf("of the saved text: off by between 1e-7 and 1e-5 rad: %s\n", text > 1e-7 && text < 1e-5 ? "yes" : "no");
  printf("of the saved binary parallel: %s\n", binary < 1e-14 ? "yes" : "no");
}
C
libraries=$(dirname "$(find root -name libmujoco.so.2.2.2)")
gcc save.c -I root/usr/include -L "$libraries" -Wl,-rpath,"$PWD/$libraries" -l:libmujoco.so.2.2.2 -lm -o save
cat > save.mjs <<'JS'
import fs from "fs";
import load from "@mujoco/mujoco";
const mujoco = await load();
const read = (name) => {
  const model = mujoco.MjModel.mj_loadXML(name), data = new mujoco.MjData(model);
  mujoco.mj_forward(model, data);
  const x = [...data.xaxis];
  const angle = (j) => Math.hypot(x[1] * x[3 * j + 2] - x[2] * x[3 * j + 1], x[2] * x[3 * j] - x[0] * x[3 * j + 2],
                                  x[0] * x[3 * j + 1] - x[1] * x[3 * j]);
  return [model, Math.max(angle(1), angle(2))];
};
mujoco.FS.writeFile("fourbar.xml", fs.readFileSync("fourbar.xml"));
const [model, exact] = read("fourbar.xml");
mujoco.mj_saveLastXML("saved.xml", model);
const text = read("saved.xml")[1];
console.log(`axes of the file parallel: ${exact < 1e-14 ? "yes" : "no"}`);
console.log(`of the saved text: off by between 1e-7 and 1e-5 rad: ${text > 1e-7 && text < 1e-5 ? "yes" : "no"}`);
JS
{ ./save && node save.mjs; } | tee seen
[ "$(grep -c ': yes$' seen)" = 5 ] && [ "$(wc -l < seen)" = 5 ] && echo "as described"
