#!/bin/bash
# A COLLADA file of a robot's link has its parts in three places for three programs: in Gazebo's reader a screw that is drawn twice is
# there once, in three's a part that the file keeps apart has lost its place.
#
# Guessed: what transforms a node counts in the order of the file, as the standard (1.4.1) says, and each instance is drawn.
# Seen with Ignition Common 4.5.1 (Debian 12, libignition-common4-graphics4 4.5.1+ds-2+b1, which reads meshes for Gazebo), assimp 5.2.5
# (Debian 12, libassimp5 5.2.5~ds0-1+b1, for RViz) and ColladaLoader of three 0.187.0 (npm, for urdf-loader), on a box of 100 x 50 x 20 mm
# in files that are valid by the schema, up axis Y:
# - a geometry that two nodes instantiate: Ignition has the first one alone;
# - a node scaled before it is turned, or moved before and after it is turned: Ignition takes scale, turn and the first move, in its own
#   order, so the box is elsewhere, or stretched the other way;
# - a node of <library_nodes> with a place of its own, which another node instantiates: three leaves this place out;
# - <lookat>: Ignition and three leave it out. assimp has all as the standard has them.
# Shapes that touch are as wrong. One <matrix>, and each geometry once, is understood by all. Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
common=4.5.1+ds-2+b1 assimp=5.2.5~ds0-1+b1
mkdir -p archives/partial
# With what of their dependencies is not installed.
apt-get install -qq --download-only --reinstall --no-install-recommends -o APT::Sandbox::User=root \
  -o "Dir::Cache::archives=$PWD/archives" "libignition-common-graphics-dev=$common" "libignition-common-core-dev=$common" \
  "libignition-common4-graphics4=$common" "libignition-common4-4=$common" libignition-math-dev=6.10.0+ds3-7+b4 \
  libignition-math6-6=6.10.0+ds3-7+b4 libignition-utils-dev=1.2.0+ds-1 "libassimp-dev=$assimp" "libassimp5=$assimp" > /dev/null
for package in archives/*.deb; do dpkg -x "$package" root; done
npm install --silent --no-fund --no-audit three@0.187.0 jsdom@24.1.3

cat > make.mjs <<'JS'
import fs from "fs";
const points = [0, 20].flatMap((z) => [[0, 0, z], [100, 0, z], [100, 50, z], [0, 50, z]]);
const faces = "0 2 1 0 3 2 4 5 6 4 6 7 0 1 5 0 5 4 1 2 6 1 6 5 2 3 7 2 7 6 3 0 4 3 4 7";
const box = '<instance_geometry url="#box"/>', turn = "<rotate>0 0 1 90</rotate>";
const files = {
  twice: `<node id="a">${box}</node><node id="b"><translate>1000 0 0</translate>${box}</node>`,
  scaled_then_turned: `<node id="a"><scale>2 1 1</scale>${turn}${box}</node>`,
  moved_turned_moved: `<node id="a"><translate>10 0 0</translate>${turn}<translate>0 300 0</translate>${box}</node>`,
  kept_apart: '<node id="a"><translate>10 0 0</translate><instance_node url="#part"/></node>',
  one_matrix: `<node id="a"><matrix>0 -1 0 10 1 0 0 20 0 0 1 0 0 0 0 1</matrix>${box}</node>`,
  looks_at: `<node id="a"><lookat>10 0 0 10 0 -100 0 1 0</lookat>${box}</node>`,
};
const part = `<library_nodes><node id="part"><translate>5 0 0</translate>${box}</node></library_nodes>`;
for (const [name, nodes] of Object.entries(files))
  fs.writeFileSync(`${name}.dae`, `<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><created>2020-01-01T00:00:00</created>
<modified>2020-01-01T00:00:00</modified><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="box"><mesh><source id="places"><float_array id="numbers" count="24">${points.flat().join(" ")}</float_array>
<technique_common><accessor source="#numbers" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="corners"><input semantic="POSITION" source="#places"/>
</vertices><triangles count="12"><input semantic="VERTEX" source="#corners" offset="0"/><p>${faces}</p></triangles></mesh></geometry>
</library_geometries>${name === "kept_apart" ? part : ""}<library_visual_scenes><visual_scene id="all">${nodes}</visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#all"/></scene></COLLADA>
`);
JS
node make.mjs
names="twice scaled_then_turned moved_turned_moved kept_apart looks_at one_matrix"

# All tell what the box reaches along x and y, mm.
cat > ignition.cpp <<'CPP'
#include <cmath>
#include <cstdio>
#include <ignition/common/Mesh.hh>
#include <ignition/common/MeshManager.hh>
int main(int count, char** names) {
  for (int k = 1; k < count; ++k) {
    const auto* mesh = ignition::common::MeshManager::Instance()->Load(names[k] + std::string(".dae"));
    if (!mesh) return 1;
    const auto low = mesh->Min() * 1000, high = mesh->Max() * 1000;
    std::printf("%s: Ignition %+ld to %+ld, %+ld to %+ld\n", names[k], std::lround(low.X()), std::lround(high.X()),
                std::lround(low.Y()), std::lround(high.Y()));
  }
}
CPP
cat > assimp.cpp <<'CPP'
#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cmath>
#include <cstdio>
#include <string>
int main(int count, char** names) {
  for (int k = 1; k < count; ++k) {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(names[k] + std::string(".dae"), aiProcess_PreTransformVertices);
    if (!scene) return 1;
    float low[2] = {1e9f, 1e9f}, high[2] = {-1e9f, -1e9f};
    for (unsigned m = 0; m < scene->mNumMeshes; ++m)
      for (unsigned v = 0; v < scene->mMeshes[m]->mNumVertices; ++v)
        for (int i = 0; i < 2; ++i) {
          const float x = 1000 * scene->mMeshes[m]->mVertices[v][i];
          low[i] = std::min(low[i], x), high[i] = std::max(high[i], x);
        }
    std::printf("%s: assimp %+ld to %+ld, %+ld to %+ld\n", names[k], std::lround(low[0]), std::lround(high[0]), std::lround(low[1]),
                std::lround(high[1]));
  }
}
CPP
cat > three.mjs <<'JS'
import fs from "fs";
import { JSDOM } from "jsdom";
const { window } = new JSDOM("");
for (const name of ["DOMParser", "XMLSerializer", "Document", "Element", "document"]) globalThis[name] = window[name];
console.warn = () => {};
const { Box3 } = await import("three"), { ColladaLoader } = await import("three/examples/jsm/loaders/ColladaLoader.js");
const show = (x) => (x < -0.0005 ? "" : "+") + (Math.round(x * 1000) + 0);
for (const name of process.argv.slice(2)) {
  const { scene } = new ColladaLoader().parse(fs.readFileSync(`${name}.dae`, "utf8"), "");
  scene.updateMatrixWorld(true);
  const { min, max } = new Box3().setFromObject(scene);
  process.stdout.write(`${name}: three ${show(min.x)} to ${show(max.x)}, ${show(min.y)} to ${show(max.y)}\n`);
}
JS
include=root/usr/include libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 -w ignition.cpp -I $include/ignition/common4 -I $include/ignition/math6 -I $include/ignition/utils1 -L $libraries \
  -Wl,-rpath-link,$libraries -l:libignition-common4-graphics.so.4 -l:libignition-common4.so.4 -l:libignition-math6.so.6 -o ignition
g++ -std=c++17 -w assimp.cpp -I $include -L $libraries -Wl,-rpath-link,$libraries -l:libassimp.so.5 -o assimp
export LD_LIBRARY_PATH=$PWD/$libraries
{ HOME=$PWD timeout 60 ./ignition $names; ./assimp $names; env -u LD_LIBRARY_PATH node three.mjs $names | grep ': three'; } | tee seen
cat > expected <<'TEXT'
twice: Ignition +0 to +100, +0 to +50
scaled_then_turned: Ignition -50 to +0, +0 to +200
moved_turned_moved: Ignition -40 to +10, +0 to +100
kept_apart: Ignition +15 to +115, +0 to +50
looks_at: Ignition +0 to +100, +0 to +50
one_matrix: Ignition -40 to +10, +20 to +120
twice: assimp +0 to +1100, +0 to +50
scaled_then_turned: assimp -100 to +0, +0 to +100
moved_turned_moved: assimp -340 to -290, +0 to +100
kept_apart: assimp +15 to +115, +0 to +50
looks_at: assimp +10 to +110, +0 to +50
one_matrix: assimp -40 to +10, +20 to +120
twice: three +0 to +1100, +0 to +50
scaled_then_turned: three -100 to +0, +0 to +100
moved_turned_moved: three -340 to -290, +0 to +100
kept_apart: three +10 to +110, +0 to +50
looks_at: three +0 to +100, +0 to +50
one_matrix: three -40 to +10, +20 to +120
TEXT
diff expected seen && echo "as described"
