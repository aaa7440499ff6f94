"""test_keys.py BIELLE SOURCE: no reader of YAML passes over what it does not use, and docs/keys.md lists what they accept.

Files of each kind get a key that nobody knows in each of their maps, one after the other. Whatever reads them ends with status 2
and names the file, the line, the key and what may stand there.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

BIELLE, SOURCE = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
UNKNOWN = "unheard_of"

ROBOT = {
    "model": "fourbar", "base": "fixed", "gravity": [0, 0, -9.81], "motor_catalogue": ["own.yaml"], "armature": {"rocker_joint": 0.001},
    "frames": {"pin": {"link": "rocker", "place": [0.1, 0, 0], "rpy": [0, 0, 0]}},
    "closures": [{"name": "coupler", "frames": ["coupler_middle", "coupler_far_middle"], "type": "6d", "kp": 0, "kd": 0},
                 {"name": "belt", "type": "coupler", "joints": {"crank_joint": 0, "rocker_joint": 0}, "offset": 0},
                 {"name": "rod", "type": "distance", "frames": ["ground", "pin"], "length": 0.1}],
    "motors": {"crank_joint": {"type": "small", "effort": 10, "torque_loss": 0.1}},
    "joint_forces": {"crank_coupler": {"damping": 0.1}},
    "point_springs": {"spring": {"frames": ["ground", "pin"], "points": [[0, 0, 0], [0, 0, 0]], "stiffness": 10, "rest": 0.2}},
    "contacts": {"tip": {"frame": "pin", "type": "3d"}},
    "serial_joints": ["rocker_joint"], "importance": {"rocker_joint": [1, 1]},
    "references": {"start": {"joints": {"crank_joint": 1.047198, "crank_coupler": -0.541627},
                             "height": {"frame": "pin", "value": 0.1}, "feet": {"tip": {"place": [0, 0, 0], "yaw": 0}}}},
}
CATALOGUE = {"motors": {"small": {"source": "a shop", "effort": 10, "velocity": 20, "ratio": 6, "rotor_inertia": 1e-5}}}
GENERATED = {"generator": "fourbar_chain", "set": {"count": 2}}
PART = {
    "help": "a drawn knee", "mounts": {"thigh": "link", "shank": "link", "knee": "joint"},
    "parameters": {"crank": {"value": 0.05, "unit": "m", "bounds": [0.01, 0.1], "help": "length of the crank"}},
    "points": ["hip"], "requires": [{"that": "crank > 0", "problem": "the crank is none", "remedy": "give one"}],
    "let": {"arm": "crank"},
    "linkage": {"base": "thigh", "through": [0, 0.05, 0], "normal": "y", "radius": 0.005, "density": 0.5,
                "points": {"a": [0, 0], "b": ["-arm", 0], "c": ["-arm", -0.3], "d": [0, -0.3]},
                "fixed": {"thigh": ["a"], "shank": {"points": ["c", "d"], "angles": {"knee": 0}}},
                "bars": {"{part}_crank": {"points": ["a", "b"], "density": 1}, "{part}_rod": ["b", "c"]},
                "hinges": {"a": "{part}_motor"}},
    "solids": {"thigh": [{"motor": 0.5, "at": [0, 0.04, 0], "axis": "y"}]},
    "frames": {"{part}_mark": {"link": "shank", "place": [0, 0, -0.1]}},
    "motors": {"{part}_motor": {"effort": 20, "velocity": 10}},
}
COMPOSED = {
    "base": "fixed", "parameters": {"mass": {"value": 1, "unit": "kg"}},
    "tree": {"trunk": {"solids": [{"box": [0.1, 0.1, 0.1], "mass": "mass"}]},
             "thigh": {"parent": "trunk", "joint": "hip", "axis": "y", "range": [-1, 1],
                       "solids": [{"rod": ["origin", [0, 0, -0.3]], "radius": 0.02, "material": "aluminium"}]},
             "shank": {"parent": "thigh", "joint": "knee", "axis": "y", "place": [0, 0, -0.3],
                       "solids": [{"cylinder": [0.02, 0.3], "at": [0, 0, -0.15], "axis": "z", "density": 2}]},
             "drive": {"part": "own.yaml", "role": "knee", "set": {"crank": 0.04, "hip": [0, 0, 0]},
                       "mounts": {"thigh": "thigh", "shank": "shank", "knee": "knee"}}},
    "motors": {"hip": {"effort": 30}}, "roles": {"knee": {"effort": 25}},
    "serial_joints": ["hip", "knee"], "references": {"start": {"joints": {"hip": 0.1, "knee": 0.2}}},
}
DESIGN = {
    "generator": "leg_biped", "set": {"ankle": "serial"}, "architecture": ["four_bar_knee", "belt_knee"],
    "variables": [{"name": "thigh", "parameter": "thigh_length", "bounds": [0.2, 0.25]},
                  {"name": "gear", "ratio": "*hip*", "bounds": [1, 2], "gear": {"loss": 0.01, "mass": 0.001}, "start": 1.5}],
    "motions": [{"motion": "squat", "set": {"depth": 0.9}, "weight": 1, "payload": 1, "payload_at": [0, 0, 0]}],
    "objective": [{"measure": "electrical_energy", "weight": 1},
                  {"measure": "workspace", "region": {"foot": "foot_left", "x": [-0.1, 0.1], "z": 0}}],
    "constraints": [{"measure": "mass", "at_most": 30}],
    "drives": {"motor_constant": 2, "regeneration": 0, "motors": {"hipy_left": 1}},
    "search": {"seed": 1, "starts": [{"thigh": 0.22, "gear": 1.2}],
               "stages": [{"algorithm": "sbplx", "evaluations": 1, "tolerance": 1e-3}]},
}
LENGTHS = {
    "robot": "bipetto",
    "variables": [{"name": "crank", "bounds": [0.04, 0.06], "length": [
                      {"from": "motor_knee_right", "to": "transmission_knee_right", "across": [0, 0, 1],
                       "stretch": "knee_crank_right"}]},
                  {"name": "place", "bounds": [-0.01, 0.01], "shift": [{"of": "motor_knee_right", "along": [1, 0, 0]}]}],
    "objective": [{"measure": "mass"}, {"measure": "conditioning", "motors": ["motor_knee_right"]}],
    "search": {"pareto": {"algorithm": "nsga2", "population": 8, "generations": 0,
                          "refine": {"algorithm": "slsqp", "evaluations": 1}}},
}
COMPARISON = {
    "robots": {"bipetto": {"robot": "bipetto"}, "other": {"generator": "leg_biped", "set": {"knee": "belt"}}}, "mass": 30,
    "motions": [{"motion": "squat", "set": {"depth": 0.9}}],
    "speeds": {"motion": "walk", "option": "speed", "from": 0.3, "to": 0.4, "step": 0.1, "set": {"steps": 2}},
    "groups": {"hips": ["hip"]}, "drives": {"motor_constant": 2, "regeneration": 0},
}
CAMPAIGN = {
    "motions": [{"name": "one", "solve": "squat", "robot": "bipetto", "set": {"depth": 0.9}, "options": {"max-iterations": 1}}],
    "options": {"friction": [0.5, 0.7]}, "push": {"time": 0.1, "duration": 0.1, "largest_impulse": {"up_to": 2, "step": 1}},
}
DATASET = {
    "licence": "CC0-1.0", "formats": ["mjlab"], "fps": 50,
    "motions": [{"solve": "squat", "robot": "bipetto", "payload": 1, "set": {"depth": 0.9}, "options": {"max-iterations": 1},
                 "simulate": {"hold": 0.1}}],
}
FOOTHOLDS = {"footholds": [{"foot": "right", "x": 0.2, "y": -0.1, "z": 0, "yaw": 0}]}
COMMANDS = {"commands": [{"time": 0.5, "forward": 0.1, "sideways": 0, "turning": 0}]}
TORQUES = {"torques": [{"time": 0, "crank_joint": 1}]}

# What a name given by the user stands for: a new one is as good as the others.
NEW = {"let", "groups"}
# Files beside the one that is changed, and the command that reads it.
KINDS = {
    "robot": (ROBOT, {"own.yaml": CATALOGUE}, ["info", "FILE"]),
    "catalogue": (CATALOGUE, {"robot.yaml": {**ROBOT, "motor_catalogue": "FILE"}}, ["info", "robot.yaml"]),
    "generated": (GENERATED, {}, ["info", "FILE"]),
    "part": (PART, {"robot.yaml": {**COMPOSED, "tree": {**COMPOSED["tree"], "drive": {**COMPOSED["tree"]["drive"], "part": "FILE"}}}},
             ["info", "robot.yaml"]),
    "composed": (COMPOSED, {"own.yaml": PART}, ["info", "FILE"]),
    "design": (DESIGN, {}, ["design", "FILE", "-o", "out"]),
    "lengths": (LENGTHS, {}, ["design", "FILE", "-o", "out"]),
    "comparison": (COMPARISON, {}, ["compare", "FILE", "-o", "out"]),
    "campaign": (CAMPAIGN, {}, ["campaign", "FILE", "-o", "out"]),
    "data set": (DATASET, {}, ["dataset", "FILE", "-o", "out"]),
    "footholds": (FOOTHOLDS, {}, ["solve", "footholds", "--robot", "bipetto", "--footholds", "FILE", "-o", "out"]),
    "commands": (COMMANDS, {}, ["simulate", "walk", "--robot", "bipetto", "--command", "FILE", "-o", "out"]),
    "torques": (TORQUES, {}, ["simulate", "fourbar", "--torques", "FILE", "-o", "out"]),
}


def list_maps(value, way=()):
    if isinstance(value, dict):
        yield way
        for key, item in value.items():
            yield from list_maps(item, way + (key,))
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from list_maps(item, way + (i,))


def find(value, way):
    for key in way:
        value = value[key]
    return value


def add_unknown(value, way):
    """A copy with the unknown key in one of its maps."""
    value = json.loads(json.dumps(value))
    find(value, way)[UNKNOWN] = 1
    return value


def read(directory, name, value, others, command):
    directory.mkdir()
    for other, content in others.items():
        (directory / other).write_text(json.dumps(content).replace("FILE", name))
    path = directory / name
    path.write_text(json.dumps(value, indent=1))  # which is YAML
    command = [name if word == "FILE" else word for word in command]
    result = subprocess.run([BIELLE, *command], cwd=directory, capture_output=True, text=True, check=False)
    return path.read_text(), result


def check(kind, way, directory):
    value, others, command = KINDS[kind]
    name = "read.yaml"
    text, result = read(directory, name, add_unknown(value, way), others, command)
    place = f"{kind}, {'.'.join(map(str, way)) or 'the file'}"
    if way and way[-1] in NEW:
        return None
    line = 1 + text[:text.index(UNKNOWN)].count("\n")
    errors = [error for error in result.stderr.splitlines() if error.startswith("bielle: error: ")]
    if result.returncode != 2 or not errors:
        return f"{place}: status {result.returncode}\n{result.stdout[-500:]}{result.stderr[-2000:]}"
    error = errors[-1]
    known = [key for key in find(value, way) if not isinstance(key, int)]
    is_option = way[-1:] in (("options",), ("simulate",))
    is_named = " --help`" in error if is_option else any(key.split("}")[-1] in error for key in known)
    # A new name, whose value is not what such a name stands for.
    is_new = "it is not a " in error or "is not one of" in error or "has no '" in error or "it is no" in error or "a mount is" in error
    if name in error and f"(line {line})" in error and UNKNOWN in error and (is_named or is_new):
        return None
    return f"{place}: line {line}, known {known}: {error}"


def check_page():
    """docs/keys.md is what the programs print, and every key of the files above is in it."""
    programs = [BIELLE + suffix for suffix in ("", "-complete", "-design", "-tasks", "-simulate")]
    rows = set()
    for program in programs:
        rows |= set(subprocess.run([program, "--yaml-keys"], capture_output=True, text=True, check=True).stdout.splitlines())
    page = (SOURCE / "docs" / "keys.md").read_text(encoding="utf-8")
    assert sorted(rows) == [row for row in page.splitlines() if row.startswith("| ") and "`" in row], "run scripts/update_help.sh"
    listed = set(re.findall(r"`(\w+)`", page))
    for value in (ROBOT, CATALOGUE, GENERATED, PART, COMPOSED, DESIGN, COMPARISON, CAMPAIGN, DATASET, FOOTHOLDS, COMMANDS, TORQUES):
        assert set(value) <= listed, set(value) - listed


def main():
    check_page()
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(2) as pool:
        place = pathlib.Path(place)
        tries = [(kind, way) for kind in KINDS for way in list_maps(KINDS[kind][0])]
        found = list(pool.map(lambda i: check(*tries[i], place / str(i)), range(len(tries))))
    wrong = [text for text in found if text]
    print(f"{len(tries)} maps of {len(KINDS)} kinds of files")
    assert not wrong, "\n\n".join(wrong)


main()
