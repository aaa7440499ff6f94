"""test_mcap.py BIELLE [core]: motions as MCAP files are what the results say.

Files are read by a reader of our own (read_mcap.py), which knows nothing of the writer; with `core`, by @mcap/core as well, which
must find the same messages. It is looked for in $BIELLE_NODE_MODULES; without node or the package, the test ends with status 77.
"""
import csv
import json
import math
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import node
import read_mcap

BIELLE, *REST = sys.argv[1:]
# Numbers of Foxglove's schemas.
PUBLISHED = {
    "FrameTransform": "timestamp parent_frame_id child_frame_id translation rotation",
    "FrameTransforms": "transforms",
    "SceneUpdate": "deletions entities",
    "SceneEntityDeletion": "timestamp type id",
    "SceneEntity": "timestamp frame_id id lifetime frame_locked metadata arrows cubes spheres cylinders lines triangles texts models",
    "ArrowPrimitive": "pose shaft_length shaft_diameter head_length head_diameter color",
    "CubePrimitive": "pose size color",
    "SpherePrimitive": "pose size color",
    "CylinderPrimitive": "pose size bottom_scale top_scale color",
    "LinePrimitive": "type pose thickness scale_invariant points color colors indices",
    "TriangleListPrimitive": "pose points color colors indices",
    "TextPrimitive": "pose billboard font_size scale_invariant color text",
    "ModelPrimitive": "pose scale color override_color url media_type data",
    "JointState": "name position velocity acceleration effort",
    "JointStates": "timestamp joints",
    "PoseInFrame": "timestamp frame_id pose",
    "Pose": "position orientation",
    "Vector3": "x y z",
    "Point3": "x y z",
    "Quaternion": "x y z w",
    "Color": "r g b a",
    "KeyValuePair": "key value",
    "Log": "timestamp level message name file line",
}
CORE = """
const { McapIndexedReader } = require("@mcap/core");
const { open } = require("fs/promises");
const { createHash } = require("crypto");
(async () => {
  const handle = await open(process.argv[2], "r");
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (offset, size) => {
      const { buffer } = await handle.read(new Uint8Array(Number(size)), 0, Number(size), Number(offset));
      return new Uint8Array(buffer.buffer, buffer.byteOffset, Number(size));
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    console.log([channel.topic, reader.schemasById.get(channel.schemaId).name, message.logTime,
                 createHash("sha256").update(message.data).digest("hex")].join(" "));
  }
})();
"""


def run(*arguments, status=0):
    result = subprocess.run([BIELLE, *map(str, arguments)], capture_output=True, text=True)
    assert status is None or result.returncode == status, (arguments, result.stdout + result.stderr)
    return result


def read_table(directory):
    """Columns of the trajectory by name."""
    with open(os.path.join(directory, "trajectory.csv"), newline="") as file:
        header, *rows = csv.reader(file)
    return {name: [float(row[i]) if row[i] else None for row in rows] for i, name in enumerate(header)}


def vector(message):
    return [message[axis] for axis in "xyz"]


def rotate(quaternion, v):
    """A vector turned by a quaternion."""
    x, y, z, w = (quaternion[axis] for axis in "xyzw")
    assert abs(x * x + y * y + z * z + w * w - 1) < 1e-14
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
            v[2] + w * t[2] + x * t[1] - y * t[0]]


def place(transform, point):
    return [a + b for a, b in zip(vector(transform["translation"]), rotate(transform["rotation"], point))]


def distance(a, b):
    return math.dist(a, b)


def get_frames(message):
    return {t["child_frame_id"]: t for t in message["transforms"]}


def check_types(file):
    for name, fields in PUBLISHED.items():
        ours = {number: field[0] for number, field in file["types"][".foxglove." + name].items()}
        assert ours == dict(enumerate(fields.split(), 1)), name
    for topic, schema in file["schemas"].items():
        assert (schema.startswith("foxglove.") or topic.startswith(("/wrenches", "/footholds", "/plan/footholds"))
                or topic == "/robot_description"), topic


def check_nodes(file, table, info):
    """Frames, joints, motors and the centre of mass are the table's, to the bit where they are not computed."""
    topics, times = file["topics"], [round(t * 1e9) for t in table["time"]]
    for topic in ("/tf", "/joints", "/motors", "/com"):
        assert [time for time, _ in topics[topic]] == times, topic
    base = info["joints"][0]
    for k, (time, message) in enumerate(topics["/tf"]):
        frame = get_frames(message)[base["child"]]
        stamp = frame["timestamp"]
        assert stamp["seconds"] * 10**9 + stamp["nanos"] == time and frame["parent_frame_id"] == "world"
        assert vector(frame["translation"]) == [table[f"q.{base['name']}.{axis}"][k] for axis in "xyz"]
        expected = [table[f"q.{base['name']}.q{axis}"][k] for axis in "xyzw"]
        found = [frame["rotation"][axis] for axis in "xyzw"]
        assert abs(abs(sum(a * b for a, b in zip(expected, found))) - 1) < 1e-14
        assert len(message["transforms"]) == len(info["joints"])
    motors = [motor["name"] for motor in info["motors"]]
    for topic in ("/joints", "/motors"):
        for k, (_, states) in enumerate(topics[topic]):
            names = [joint["name"] for joint in states["joints"]]
            assert set(motors) <= set(names) if topic == "/joints" else names == motors
            for joint in states["joints"]:
                name, last = joint["name"], k + 1 == len(times)
                rate = name.replace(".angle", ".rate")
                assert joint["position"] == table["q." + name][k] and joint["velocity"] == table["v." + rate][k]
                assert joint["acceleration"] == (None if last else table["a." + rate][k])
                assert joint["effort"] == (table["u." + name][k] if name in motors and not last else None)
    for k, (_, com) in enumerate(topics["/com"]):
        assert vector(com["pose"]["position"]) == [table["com." + axis][k] for axis in "xyz"]


def check_forces(file, table, info, slip):
    """Wrenches are the table's; feet that bear a force are on the ground, and its arrow begins there."""
    frames = {time: get_frames(message) for time, message in file["topics"]["/tf"]}
    arrows = {time: message for time, message in file["topics"]["/scene/forces"]}
    count = 0
    for k, (time, message) in enumerate(file["topics"]["/wrenches/contacts"]):
        assert [w["name"] for w in message["wrenches"]] == [c["name"] for c in info["contacts"]]
        shown = {entity["id"]: entity for entity in arrows[time]["entities"]}
        for wrench in message["wrenches"]:
            name = wrench["name"]
            assert vector(wrench["force"]) == [table[f"contact.{name}.f{axis}"][k] for axis in "xyz"]
            assert vector(wrench["torque"]) == [table[f"contact.{name}.n{axis}"][k] for axis in "xyz"]
            assert ("contact/" + name in shown) == any(vector(wrench["force"]))
            if "contact/" + name not in shown:
                continue
            frame = frames[time][wrench["frame_id"]]
            foot = place(frame, vector(wrench["pose"]["position"]))
            assert abs(foot[2]) < slip, foot
            arrow, = shown["contact/" + name]["arrows"]
            assert distance(vector(arrow["pose"]["position"]), foot) < 1e-12
            force = rotate(frame["rotation"], rotate(wrench["pose"]["orientation"], vector(wrench["force"])))
            size = math.hypot(*force)
            assert distance([x / size for x in force], rotate(arrow["pose"]["orientation"], [1, 0, 0])) < 1e-12
            weight = info["mass"] * 9.81
            assert abs((arrow["shaft_length"] + arrow["head_length"]) * weight / size - table["com.z"][0]) < 1e-6
            count += 1
    assert count > 10
    return count


def check_scene(file, info, topic="/scene/robot", prefix=""):
    (time, scene), = file["topics"][topic]
    assert time == 0
    entities = {entity["id"]: entity for entity in scene["entities"]}
    for joint in info["joints"]:
        entity = entities["body/" + joint["child"]]
        assert entity["frame_id"] == prefix + joint["child"] and entity["frame_locked"]
        kinds = ("cubes", "spheres", "cylinders", "triangles")
        assert sum(len(entity[kind]) for kind in kinds) > 0, joint["child"]
    return entities


def check_description(file):
    """The URDF draws every body, with the shapes of the scene but its meshes."""
    (time, urdf), = file["topics"]["/robot_description"]
    assert time == 0
    links = {link.get("name"): link for link in xml.etree.ElementTree.fromstring(urdf).iter("link")}
    for entity in file["topics"]["/scene/robot"][0][1]["entities"]:
        if not entity["id"].startswith("body/") or entity["frame_id"] == "world":
            continue
        shapes = [shape for visual in links[entity["frame_id"]].iter("visual") for shape in visual.find("geometry")]
        assert shapes and not [shape for shape in shapes if shape.tag == "mesh"], entity["id"]
        if entity["triangles"]:
            continue
        for tag, kind in (("box", "cubes"), ("cylinder", "cylinders"), ("sphere", "spheres")):
            assert sum(shape.tag == tag for shape in shapes) == len(entity[kind]), entity["id"]
        edges = [vector(cube["size"]) for cube in entity["cubes"]]
        boxes = [[float(x) for x in shape.get("size").split()] for shape in shapes if shape.tag == "box"]
        assert all(distance(a, b) < 1e-12 for a, b in zip(boxes, edges)), entity["id"]


def is_refused(path, data):
    with open(path, "wb") as file:
        file.write(data)
    try:
        read_mcap.read(path)
    except (AssertionError, KeyError, struct.error, IndexError, ValueError, StopIteration):
        return True
    return False


def check_poisoned(path, scratch):
    """The reader notices a byte that is another one, wherever it is."""
    with open(path, "rb") as file:
        data = file.read()
    for share in range(23):
        at = len(data) * share // 23
        assert is_refused(scratch, data[:at] + bytes([data[at] ^ 1]) + data[at + 1:]), at
    assert is_refused(scratch, data[:-100])


def check_core(path, file):
    """@mcap/core finds the same messages."""
    from hashlib import sha256
    script = os.path.join(os.path.dirname(path), "core.js")
    with open(script, "w", encoding="utf-8") as out:
        out.write(CORE)
    environment = {**os.environ, "NODE_PATH": node.MODULES}
    result = subprocess.run(["node", script, path], capture_output=True, text=True, env=environment)
    assert result.returncode == 0, result.stderr
    ours = [f"{topic} {file['schemas'][topic]} {time} {sha256(data).hexdigest()}" for topic, time, data in file["raw"]]
    assert sorted(result.stdout.splitlines()) == sorted(ours)
    print(f"@mcap/core finds the same {len(ours)} messages")


def check_solved(squat, info):
    run("export", squat, "--format", "mcap")
    path = os.path.join(squat, "trajectory.mcap")
    with open(path, "rb") as out:
        first = out.read()
    run("export", squat, "--format", "mcap")
    with open(path, "rb") as out:
        assert out.read() == first, "it is not the same file every time"
    file, table = read_mcap.read(path), read_table(squat)
    assert file["chunks"] > 1, "too small to test several chunks"
    assert file["metadata"]["bielle"]["motion"] == "squat"
    check_types(file)
    check_nodes(file, table, info)
    with open(os.path.join(squat, "summary.json"), encoding="utf-8") as summary:
        slip = 1e-6 + json.load(summary)["contact_slip"]["position_m"]
    check_forces(file, table, info, slip)
    check_scene(file, info)
    check_description(file)
    soles = [message["footholds"][0] for _, message in file["topics"]["/footholds"]]
    assert sorted(sole["name"] for sole in soles) == sorted(contact["name"] for contact in info["contacts"])
    assert [log["message"] for _, log in file["topics"]["/events"]][0].startswith("phase ")
    # A table with another number is noticed.
    for column, check in ((f"q.{info['joints'][0]['name']}.x", lambda t: check_nodes(file, t, info)),
                          (f"u.{info['motors'][0]['name']}", lambda t: check_nodes(file, t, info)),
                          (f"contact.{info['contacts'][0]['name']}.fz", lambda t: check_forces(file, t, info, slip))):
        poisoned = {**table, column: [None if x is None else x + 1e-3 for x in table[column]]}
        try:
            check(poisoned)
        except AssertionError:
            continue
        raise RuntimeError(f"{column} may be wrong")
    check_poisoned(path, os.path.join(squat, "poisoned.mcap"))
    return path, file


def check_carried_out(squat, info, output):
    run("simulate", squat, "-o", output, "--push", "t=0.2,impulse=2", "--duration", "0.4", "--no-report")
    run("export", output, "--format", "mcap")
    file, table = read_mcap.read(os.path.join(output, "trajectory.mcap")), read_table(output)
    check_nodes(file, table, info)
    check_scene(file, info)
    check_scene(file, info, "/scene/plan", "plan/")
    base = info["joints"][0]["child"]
    happened, planned = (get_frames(file["topics"][topic][0][1]) for topic in ("/tf", "/plan/tf"))
    # It starts where the plan does.
    assert distance(vector(happened[base]["translation"]), vector(planned["plan/" + base]["translation"])) < 1e-9
    assert len(file["topics"]["/plan/joints"]) == len(table["time"])
    events = [(log["level"], log["message"]) for _, log in file["topics"]["/events"]]
    assert (3, "push of 2 N s for 0.1 s in the direction of 0 degrees") in events, events
    assert events[-1][1].startswith("it "), events


def check_told(squat, output):
    """Steps of the ground and a fall, as a summary tells them."""
    shutil.copytree(squat, output)
    step = {"top": [1, 0.2, 0.3], "length": 0.5, "width": 0.7, "yaw": 0.4, "pitch": 0.2, "roll": -0.1}
    with open(os.path.join(output, "summary.json"), encoding="utf-8") as file:
        summary = json.load(file)
    summary.update({"outcome": "fell", "outcome_message": "the trunk leans", "fell": True, "fall_time": 0.5})
    summary["ground"]["steps"] = [step]
    with open(os.path.join(output, "summary.json"), "w", encoding="utf-8") as file:
        json.dump(summary, file)
    run("export", output, "--format", "mcap")
    file = read_mcap.read(os.path.join(output, "trajectory.mcap"))
    (time, log), = file["topics"]["/events"]
    assert (time, log["level"], log["message"]) == (500_000_000, 4, "it fell: the trunk leans"), log
    scene = file["topics"]["/scene/robot"][0][1]
    cube, = next(entity for entity in scene["entities"] if entity["id"] == "ground")["cubes"]
    thickness = cube["size"]["z"]
    frame = {"translation": cube["pose"]["position"], "rotation": cube["pose"]["orientation"]}
    assert distance(place(frame, [0, 0, thickness / 2]), step["top"]) < 1e-12
    yaw, pitch, roll = step["yaw"], step["pitch"], step["roll"]
    along = [math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch)]
    assert distance(rotate(frame["rotation"], [1, 0, 0]), along) < 1e-12
    assert abs(rotate(frame["rotation"], [0, 1, 0])[2] - math.cos(pitch) * math.sin(roll)) < 1e-12
    # Seen from above, its sides are as long as asked.
    assert abs(cube["size"]["x"] * math.cos(pitch) - step["length"]) < 1e-12
    assert abs(cube["size"]["y"] * math.cos(roll) - step["width"]) < 1e-12


def check_mesh(place_of_files):
    """A mesh is written with its scale, corners that triangles share once; a robot without a drawing gets rods."""
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    with open(os.path.join(place_of_files, "part.stl"), "wb") as file:
        file.write(bytes(80) + struct.pack("<I", len(faces)))
        for face in faces:
            file.write(struct.pack("<12fH", 0, 0, 0, *(x for i in face for x in corners[i]), 0))
    with open(os.path.join(place_of_files, "pendulum.urdf"), "w", encoding="utf-8") as file:
        file.write("""<robot name="pendulum"><link name="world"/><link name="bob"><inertial><mass value="1"/>
          <origin xyz="0 0 -1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><visual>
          <origin xyz="0 0 -1"/><geometry><mesh filename="part.stl" scale="2 3 4"/></geometry></visual></link>
          <joint name="swing" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>""")
    output = os.path.join(place_of_files, "swing")
    run("simulate", os.path.join(place_of_files, "pendulum.urdf"), "-o", output, "--duration", "0.1", "--no-report")
    path = os.path.join(place_of_files, "swing.mcap")
    run("export", output, "--format", "mcap", "-o", path)
    file = read_mcap.read(path)
    entities = {entity["id"]: entity for entity in file["topics"]["/scene/robot"][0][1]["entities"]}
    check_description(file)
    mesh, = entities["body/bob"]["triangles"]
    assert vector(mesh["pose"]["position"]) == [0, 0, -1]
    points = [tuple(vector(point)) for point in mesh["points"]]
    assert sorted(points) == sorted((2 * x, 3 * y, 4 * z) for x, y, z in corners)
    assert [[points[i] for i in mesh["indices"][3 * f:3 * f + 3]] for f in range(len(faces))] == [
        [(2 * corners[i][0], 3 * corners[i][1], 4 * corners[i][2]) for i in face] for face in faces]


def check_joints(place_of_files):
    """Limits do not keep a robot from being described; of axes that no URDF with a YAML file can say, the user is told."""
    for ranges, axis, problem in (('range="-40 1e20"', "0 1 0", ""), ("", "0 0.6 0.8", "/robot_description is left out")):
        with open(os.path.join(place_of_files, "stick.xml"), "w", encoding="utf-8") as file:
            file.write(f"""<mujoco><worldbody><body name="stick"><joint name="swing.angle1" axis="1 0 0" {ranges}/>
              <joint name="swing.angle2" axis="{axis}" {ranges}/><geom type="capsule" size="0.1" fromto="0 0 0 0 0 -1"/></body>
              </worldbody></mujoco>""")
        output = os.path.join(place_of_files, "stick")
        run("simulate", os.path.join(place_of_files, "stick.xml"), "-o", output, "--duration", "0.1", "--no-report")
        told = [line for line in run("export", output, "--format", "mcap").stderr.splitlines() if "description" in line]
        file = read_mcap.read(os.path.join(output, "trajectory.mcap"))
        assert len(told) == bool(problem) and problem in "".join(told), told
        assert ("/robot_description" in file["topics"]) == (not problem)
        if not problem:
            check_description(file)


def main():
    if REST == ["core"]:
        node.require("@mcap/core")
    with tempfile.TemporaryDirectory() as scratch:
        squat = os.path.join(scratch, "squat")
        run("solve", "squat", "--robot", "bipetto", "--depth", "0.9", "--set", "duration=0.6", "--set", "settle=0",
            "--set", "time_step=0.02", "--quiet", "--no-report", "--no-check", "-o", squat)
        info = json.loads(run("info", "bipetto", "--json").stdout)
        if run("export", squat, "--format", "mcap", status=None).returncode == 2:
            print("skipped: built without protobuf")
            return 77
        path, file = check_solved(squat, info)
        if REST == ["core"]:
            check_core(path, file)
            return 0
        check_carried_out(squat, info, os.path.join(scratch, "happened"))
        for arguments in (("mcap", "-o", os.path.join(squat, "trajectory.npz")), ("mjlab", "--fps", 0),
                          ("mjlab", "-o", os.path.join(squat, "trajectory.npz")), ("amp", "-o", os.path.join(squat, "a.xml")),
                          ("mjlab", "--isaac-lab", 3), ("amp", "--isaac-lab", 1), ("sto", "--fps", 50), ("mcap", "--fps", 50)):
            run("export", squat, "--format", *arguments, status=2)
        check_told(squat, os.path.join(scratch, "told"))
        check_mesh(scratch)
        check_joints(scratch)
        refused = run("export", os.path.join(scratch, "nothing"), "--format", "mcap", status=2)
        assert "summary.json" in refused.stderr, refused.stderr
    print("MCAP files say what the results say")
    return 0


sys.exit(main())
