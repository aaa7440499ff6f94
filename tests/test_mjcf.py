"""test_mjcf.py BIELLE SOURCE: `bielle convert --to mjcf` writes XML with a robot's names, and names omissions."""
import json
import math
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree


def run(*arguments, **options):
    return subprocess.run(arguments, capture_output=True, text=True, check=False, **options)


def names(tree, *tags):
    return [e.get("name") for e in tree.iter() if e.tag in tags and e.get("name")]


def check_robot(bielle, robot, path):
    result = run(bielle, "convert", robot, "--to", "mjcf", "-o", path)
    assert result.returncode == 0, result.stderr
    info = json.loads(run(bielle, "info", robot, "--json").stdout)
    tree = ElementTree.parse(path).getroot()
    bodies = tree.find("worldbody")
    assert sorted(names(bodies, "body")) == sorted(j["child"] for j in info["joints"])
    for joint in info["joints"]:
        found = [n for n in names(bodies, "joint") if n == joint["name"] or n.startswith(joint["name"] + ".")]
        assert found, joint
    assert names(tree, "motor") == [m["name"] for m in info["motors"]]
    rows = {"weld": 6, "connect": 3, "joint": 1, "tendon": 1}
    written = sum(rows[e.tag] for e in tree.find("equality") or ())
    hinges = sum(c["kind"] == "5d" for c in info["closures"])
    assert written == info["closure_rows"] + hinges, (written, info["closure_rows"], hinges)
    soles = [e for e in tree.iter("geom") if e.get("class") == "sole"]
    types = {"6d": "box", "5d": "capsule", "3d": "sphere"}
    assert sorted(e.get("type") for e in soles) == sorted(types[c["kind"]] for c in info["contacts"])
    assert names(tree, "key") == [r["name"] for r in info["references"] if r["closed"]]
    for text in (e.get(a) for e in tree.iter() for a in ("pos", "quat", "diaginertia", "ref") if e.get(a)):
        for number in text.split():
            assert math.isfinite(float(number)), (text, path)
    return result.stderr


def main(bielle, source):
    robots = ["bipetto", "cleobot", "rsu_biped", "belt_biped", "kangaroo", "kangaroo_leg", "fivebar_leg",
              "spring_leg", "spring_biped", "delta", "fourbar_chain", "fourbar", "fivebar"]
    with tempfile.TemporaryDirectory() as place:
        for robot in robots:
            check_robot(bielle, os.path.join(source, "robots", robot), os.path.join(place, robot + ".xml"))
        # What cannot be said is named.
        with open(os.path.join(place, "pendulum.urdf"), "w", encoding="utf-8") as file:
            file.write("""<robot name="pendulum"><link name="world"/><link name="bob"><inertial><mass value="1"/>
              <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><visual><geometry>
              <mesh filename="bob.stl"/></geometry></visual></link><link name="tip"/>
              <joint name="swing" type="revolute"><parent link="world"/><child link="bob"/>
              <limit lower="-1" upper="1" effort="3" velocity="2"/></joint>
              <joint name="turn" type="continuous"><parent link="bob"/><child link="tip"/></joint></robot>""")
        with open(os.path.join(place, "pendulum.yaml"), "w", encoding="utf-8") as file:
            file.write("armature: {turn: 0.001}\n")
        warnings = check_robot(bielle, os.path.join(place, "pendulum.urdf"), os.path.join(place, "pendulum.xml"))
        for element in ("'swing'", "bob.stl", "'tip'"):
            assert element in warnings, warnings
        result = run(bielle, "convert", "no_such_robot", "--to", "mjcf", "-o", "none.xml", cwd=place)
        assert result.returncode == 2 and "no_such_robot" in result.stderr, result
        result = run(bielle, "convert", "bipetto", "--to", "mjcf", "-o", os.path.join(place, "no", "such.xml"))
        assert result.returncode == 2, result
    print("robots as MJCF are XML with their names")


if __name__ == "__main__":
    main(*sys.argv[1:])
