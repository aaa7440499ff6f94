#!/usr/bin/python3
"""bielle-dxf FILE: writes the links that it reads from the standard input (results/workshop_solids.h) as plates.

A plate is a link whose hinges are parallel, or a rod between two pivots, seen along its hinges: a layer with its holes,
circles, and its outline, lines and arcs. The layer NOTES has names and distances. The file is DXF R12, in mm.
Debian's Python runs this, which has Debian's ezdxf.
"""

import itertools
import json
import math
import sys

try:
    import ezdxf
    from ezdxf.math import Vec2, Vec3, convex_hull_2d
except ImportError:
    ezdxf = None

SAME_HOLE, PLANE = 1e-4, 1e-3  # mm
OUTLINE = 1.25  # distance from the centres over the diameter of the holes
GAP, TEXT = 15, 3  # mm, between plates; height of a text
NOTES = "NOTES"


def say(kind, text):
    print(f"bielle: {kind}: {text}", file=sys.stderr)


def find_normal(axes, places):
    """The direction along which a link is flat, or None. `places` are seen from the first of them."""
    if axes:
        return axes[0] if all(axes[0].cross(axis).magnitude <= 1e-9 for axis in axes) else None
    # Balls alone: a rod, or what lies in a plane.
    along = max(places, key=lambda p: p.magnitude)
    across = [n for n in (along.cross(p) for p in places) if n.magnitude > PLANE * along.magnitude]
    if not across and not along.is_null:
        units = (Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1))
        across = [along.cross(min(units, key=lambda axis: abs(axis.dot(along))))]
    normal = across[-1].normalize() if across else None
    return normal if normal is not None and all(abs(normal.dot(p)) < PLANE for p in places) else None


def flatten(pivots):
    """[name, centre] of holes at different places, the first at the origin, the farthest one on the x axis.

    None if the link is not plane.
    """
    places = [Vec3(pivot["at"]) - Vec3(pivots[0]["at"]) for pivot in pivots]
    normal = find_normal([Vec3(pivot["axis"]) for pivot in pivots if pivot["axis"]], places)
    if normal is None:
        return None
    holes = []
    for pivot, place in zip(pivots, places):
        flat = place - normal * normal.dot(place)
        here = next((hole for hole in holes if hole[1].distance(flat) < SAME_HOLE), None)
        if here is None:
            holes.append([pivot["name"], flat])
        elif here[0] != pivot["name"]:
            here[0] += "+" + pivot["name"]
    far = max((flat for _, flat in holes), key=lambda p: p.magnitude)
    if not far.is_null:
        x = far.normalize()
        holes = [[name, Vec2(x.dot(p), normal.cross(x).dot(p))] for name, p in holes]
    return holes


def draw_outline(space, centres, reach, attributes):
    """What is parallel to the hull: lines, and arcs about its corners, each from where the last one ends.

    Not polylines: OpenSCAD leaves those of R12 out, and others lose their arcs (findings/dxf-polylines.sh).
    """
    corners = convex_hull_2d(centres)[:-1] if len(centres) > 2 else centres
    edges = list(zip(corners, corners[1:] + corners[:1]))
    sides = [(end - start).orthogonal(ccw=False).normalize(reach) for start, end in edges]
    for i, (start, end) in enumerate(edges):
        space.add_arc(start, reach, sides[i - 1].angle_deg % 360, sides[i].angle_deg % 360, dxfattribs=attributes)
        space.add_line(start + sides[i], end + sides[i], dxfattribs=attributes)


def draw_plate(space, layer, name, holes, top, diameter):
    """Below `top`; returns where the next one may begin, mm."""
    reach, centres = OUTLINE * diameter, [centre for _, centre in holes]
    origin = Vec2(0, top - 3 * TEXT - reach - max(centre.y for centre in centres))

    def write(at, text, height=TEXT):
        space.add_text(text, dxfattribs={"layer": NOTES, "height": height, "insert": at})

    write(Vec2(-reach, top - TEXT), name)
    draw_outline(space, [origin + centre for centre in centres], reach, {"layer": layer})
    for of, centre in holes:
        space.add_circle(origin + centre, diameter / 2, dxfattribs={"layer": layer})
        write(origin + centre + Vec2(0.6, 0.6) * diameter, of, 0.6 * TEXT)
    for (i, a), (k, b) in itertools.combinations(enumerate(centres), 2):
        if len(centres) <= 3 or i == 0 or k == i + 1:  # of many, from the first one and from the one before
            write(origin + a.lerp(b) - Vec2(1.5, 1.5) * TEXT, f"{a.distance(b):.3f}")
    return origin.y + min(centre.y for centre in centres) - reach - GAP


def name_layer(name, used):
    """R12 allows 31 letters, digits and some signs."""
    base = layer = "".join(c.upper() if c.isascii() and c.isalnum() else "_" for c in name[:26])
    number = 1
    while layer in used:
        number += 1
        layer = f"{base}_{number}"
    used.add(layer)
    return layer


def list_plates(robot):
    """(name, holes) of the links that are plane, and the names of the others."""
    plates, left_out = [], []
    for link in robot["links"]:
        holes = flatten(link["pivots"]) if len(link["pivots"]) > 1 else []
        if holes is None:
            left_out.append(link["name"])
        elif len(holes) > 1:
            plates.append((link["name"], holes))
    return plates, left_out


def write_plates(plates, diameter, path):
    ezdxf.options.write_fixed_meta_data_for_testing = True  # no dates: the same robot gives the same file
    drawing, used, top = ezdxf.new("R12"), {NOTES}, 0
    drawing.layers.add(NOTES, color=8)
    for name, holes in plates:
        layer = name_layer(name, used)
        drawing.layers.add(layer, color=7)
        top = draw_plate(drawing.modelspace(), layer, name, holes, top, diameter)
    with open(path, "w", encoding=drawing.output_encoding, errors="dxfreplace") as file:
        file.write("999\nmillimetres\n")  # R12 has no units
        drawing.write(file)


def main():
    if len(sys.argv) != 2:
        say("error", "`bielle convert ROBOT --to dxf -o FILE` runs bielle-dxf")
        return 2
    if ezdxf is None:
        say("error", "--to dxf: ezdxf, which writes DXF, is not installed; install it (Debian: python3-ezdxf)")
        return 2
    robot = json.load(sys.stdin)
    plates, left_out = list_plates(robot)
    if not plates:
        say("error", f"{robot['robot']}: links: none of them is plane: their hinges are not parallel; "
            "draw them from `bielle convert --to sheet`")  # fmt: skip
        return 2
    for link in left_out:
        say("warning", f"link '{link}' is left out: its hinges are not parallel, or its pivots not in a plane")
    write_plates(plates, robot["hole"], sys.argv[1])
    return 0


if __name__ == "__main__":
    sys.exit(main())
