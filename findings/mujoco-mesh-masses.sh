#!/bin/bash
# A part drawn as a mesh has another mass in MuJoCo 2.2.2 than in 3.14.0, also if it is convex: there, its mass is that of a box with the
# same moments of inertia.
#
# Guessed: density times volume, which a closed convex mesh leaves no doubt about; only what is concave differs, as its manual says.
# Seen with MuJoCo 2.2.2 (Debian 12, libmujoco2.2.2 2.2.2-3) and 3.14.0 (npm, @mujoco/mujoco), on closed meshes of density 1000:
# - a box weighs what it should in both;
# - in 2.2.2 a prism with 48 sides weighs 0.95 times its mass, an icosahedron 0.90 and a tetrahedron 1.39 times;
# - a U of three boards weighs 3.1 times its mass; with `exactmeshinertia` it and the tetrahedron weigh what they should;
# - in 3.14.0 the convex ones have their masses; so has the U with `inertia="exact"`, else 3.3 times;
# - with `mass` at the geom both have this mass, and the moments of the convex ones agree.
# Version 2.2.2 warns of neither. Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libmujoco-dev=2.2.2-3 libmujoco2.2.2=2.2.2-3 libccd2=2.1-2+b1 liblodepng0=0.0~git20220618.b4ed2cd-3 \
  libqhull-r8.0=2020.2-5 libtinyxml2-9=9.0.0+dfsg-3.1
for package in *.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit @mujoco/mujoco@3.14.0

# Closed meshes whose faces are seen from outside, and files of MuJoCo with one each. masses.txt has what they weigh.
cat > make.mjs <<'JS'
import fs from "fs";
const det = ([a, b, c]) => a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
const fanOf = (outline) => outline.slice(2).map((_, k) => [0, k + 1, k + 2]);
const prism = (outline, height, triangles = fanOf(outline)) => {
  const n = outline.length, points = [...outline.map(([x, y]) => [x, y, 0]), ...outline.map(([x, y]) => [x, y, height])];
  const sides = outline.flatMap((_, k) => [[k, (k + 1) % n, n + (k + 1) % n], [k, n + (k + 1) % n, n + k]]);
  return [points, [...sides, ...triangles.map(([a, b, c]) => [a, c, b]), ...triangles.map((f) => f.map((k) => k + n))]];
};
const corners = (n) => [...Array(n).keys()].map((k) => [0.1 * Math.cos(2 * Math.PI * k / n), 0.1 * Math.sin(2 * Math.PI * k / n)]);
const g = 0.05 * (1 + Math.sqrt(5)), twelve = [0, 1, 2].flatMap((k) => [[0, 0.1, g], [0, -0.1, g], [0, 0.1, -g], [0, -0.1, -g]].map(
  (p) => [0, 1, 2].map((i) => p[(i + k) % 3])));
const near = (a, b) => Math.hypot(...twelve[a].map((x, i) => x - twelve[b][i])) < 0.21;
const twenty = []; // faces of three corners that are next to each other, each seen from outside
for (let a = 0; a < 12; ++a)
  for (let b = a + 1; b < 12; ++b)
    for (let c = b + 1; c < 12; ++c)
      if (near(a, b) && near(b, c) && near(c, a)) twenty.push(det([a, b, c].map((k) => twelve[k])) > 0 ? [a, b, c] : [a, c, b]);
const solids = {
  box: prism([[0, 0], [0.1, 0], [0.1, 0.2], [0, 0.2]], 0.3),
  prism: prism(corners(48), 0.3),
  icosahedron: [twelve, twenty],
  tetrahedron: [[[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]],
  U: prism([[0, 0], [0.1, 0], [0.1, 0.1], [0.09, 0.1], [0.09, 0.01], [0.01, 0.01], [0.01, 0.1], [0, 0.1]], 0.1,
           [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]]),
};
const write = (file, name, compiler, mesh, geom) =>
  fs.writeFileSync(file, `<mujoco><compiler ${compiler}/><asset><mesh name="part" file="${name}.obj" ${mesh}/></asset><worldbody>` +
    `<body euler="10 20 30"><freejoint/><geom type="mesh" mesh="part" ${geom}/></body></worldbody></mujoco>`);
for (const [name, [points, faces]] of Object.entries(solids)) {
  fs.writeFileSync(`${name}.obj`, points.map((p) => `v ${p.join(" ")}\n`).join("") + faces.map((f) => `f ${f.map((k) => k + 1).join(" ")}\n`).join(""));
  fs.appendFileSync("masses.txt", `${name} ${1000 / 6 * faces.reduce((sum, f) => sum + det(f.map((k) => points[k])), 0)}\n`);
  write(`${name}.xml`, name, "", "", "");
}
for (const name of ["U", "tetrahedron"]) write(`${name}_exact_2.xml`, name, 'exactmeshinertia="true"', "", "");
write("U_exact_3.xml", "U", "", 'inertia="exact"', "");
for (const name of ["box", "tetrahedron"]) write(`${name}_given.xml`, name, "", "", 'mass="2"');
JS
node make.mjs
cat > weigh.c <<'C'
#include <mujoco/mujoco.h>
#include <stdio.h>
int main(int count, char** files) {
  for (int k = 1; k < count; ++k) {
    char error[500] = "";
    const mjModel* model = mj_loadXML(files[k], 0, error, sizeof error);
    if (!model || *error) return puts(error), 1;
    printf("%s %.9g %.9g\n", files[k], model->body_mass[1], model->body_inertia[3]);
  }
}
C
libraries=$(dirname "$(find root -name libmujoco.so.2.2.2)")
gcc weigh.c -I root/usr/include -L "$libraries" -Wl,-rpath,"$PWD/$libraries" -l:libmujoco.so.2.2.2 -lm -o weigh
cat > weigh.mjs <<'JS'
import fs from "fs";
import load from "@mujoco/mujoco";
const mujoco = await load();
for (const name of process.argv.slice(2)) {
  for (const file of [name, name.split(/[_.]/)[0] + ".obj"]) mujoco.FS.writeFile(file, fs.readFileSync(file));
  const model = mujoco.MjModel.mj_loadXML(name);
  console.log(name, [...model.body_mass][1], [...model.body_inertia][3]);
}
JS
# Masses as shares of what they should be; where they are given, the largest moment of inertia in kg m².
tell() {
  while read -r file mass moment; do
    right=$(awk -v name="${file%%[_.]*}" '$1 == name { print $2 }' masses.txt)
    case $file in
      *given*) printf '%s %s: %.0f kg, %.4f\n' "$1" "$file" "$mass" "$moment" ;;
      *) printf '%s %s: %s\n' "$1" "$file" "$(awk -v m="$mass" -v right="$right" 'BEGIN { printf "%.2f", m / right }')" ;;
    esac
  done
}
convex="box.xml prism.xml icosahedron.xml tetrahedron.xml box_given.xml tetrahedron_given.xml U.xml"
./weigh $convex U_exact_2.xml tetrahedron_exact_2.xml | tell 2.2.2 | tee seen
node weigh.mjs $convex U_exact_3.xml | tell 3.14.0 | tee -a seen
cat > expected <<'TEXT'
2.2.2 box.xml: 1.00
2.2.2 prism.xml: 0.95
2.2.2 icosahedron.xml: 0.90
2.2.2 tetrahedron.xml: 1.39
2.2.2 box_given.xml: 2 kg, 0.0217
2.2.2 tetrahedron_given.xml: 2 kg, 0.0100
2.2.2 U.xml: 3.07
2.2.2 U_exact_2.xml: 1.00
2.2.2 tetrahedron_exact_2.xml: 1.00
3.14.0 box.xml: 1.00
3.14.0 prism.xml: 1.00
3.14.0 icosahedron.xml: 1.00
3.14.0 tetrahedron.xml: 1.00
3.14.0 box_given.xml: 2 kg, 0.0217
3.14.0 tetrahedron_given.xml: 2 kg, 0.0100
3.14.0 U.xml: 3.31
3.14.0 U_exact_3.xml: 1.00
TEXT
diff expected seen && echo "as described"
