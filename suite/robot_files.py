"""Whether the URDF beside a problem is its mechanism: placements of all links, masses, and points that Drake's balls tie."""
import xml.etree.ElementTree as ElementTree

import numpy as np

from mechanism import State, apply, compose, read_quaternion, rotate

DRAKE = "{http://drake.mit.edu}"
NODES = (0, -1)  # of the optimum, where the links are compared


def read_vector(element, name, default):
    return np.array([float(x) for x in (element.get(name, default) if element is not None else default).split()])


def read_origin(joint):
    origin = joint.find("origin")
    roll, pitch, yaw = read_vector(origin, "rpy", "0 0 0")
    R = np.eye(3)
    for axis, angle in (((0, 0, 1), yaw), ((0, 1, 0), pitch), ((1, 0, 0), roll)):
        R = R @ rotate(axis, np.array([angle]))[0]
    return R, read_vector(origin, "xyz", "0 0 0")


def move(joint, q):
    """Placements (K ..) of the child of a joint of the URDF for its coordinates."""
    none = np.zeros((len(q), 3))
    kind = joint.get("type")
    axis = read_vector(joint.find("axis"), "xyz", "1 0 0")
    if kind in ("revolute", "continuous"):
        return rotate(axis, q[:, 0]), none
    if kind == "prismatic":
        return np.broadcast_to(np.eye(3), (len(q), 3, 3)), q * axis
    if kind == "universal":
        return rotate((1, 0, 0), q[:, 0]) @ rotate((0, 1, 0), q[:, 1]), none
    if kind == "ball":
        return read_quaternion(q), none
    if kind == "fixed":
        return np.broadcast_to(np.eye(3), (len(q), 3, 3)), none
    raise ValueError(f"joint {joint.get('name')}: a {kind} joint is not read")


def check_urdf(problem, trajectory):
    """[(what, largest difference in m or kg), ...]"""
    m = problem.mechanism
    robot = ElementTree.parse(problem.path.parent / problem.data["robot_files"]["urdf"]).getroot()
    q = trajectory["q"][list(NODES)]
    coordinates = {joint.name: joint.q for joint in m.joints}
    joints = robot.findall("joint") + robot.findall(DRAKE + "joint")
    children = {joint.find("child").get("link"): joint for joint in joints}
    X = {}

    def place(link):
        if link in X:
            return X[link]
        joint = children.get(link)
        if joint is None:  # a root: the ground, or what the first joint carries
            free = m.joints[0].kind == "free-flyer" and link == m.names[1]
            X[link] = m.joints[0].place(q) if free else (np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3)))
        else:
            values = q[:, coordinates[joint.get("name")]] if joint.get("name") in coordinates else np.zeros((len(q), 0))
            X[link] = compose(compose(place(joint.find("parent").get("link")), read_origin(joint)), move(joint, values))
        return X[link]

    links = {link.get("name"): link for link in robot.findall("link")}
    state = State(m, q)
    off = np.max([np.abs(place(name)[1] - state.X[i][1]).max() for i, name in enumerate(m.names) if i > 0])
    masses = {name: link.find("inertial/mass") for name, link in links.items()}
    weights = [abs(float(masses[name].get("value")) if masses[name] is not None else 0.0) - mass
               for name, mass in zip(m.names[1:], m.masses[1:])]
    apart = 0.0
    for ball in robot.findall(DRAKE + "ball_constraint"):
        ends = []
        for body, point in (("A", "AP"), ("B", "BQ")):
            R, p = place(ball.find(f"{DRAKE}ball_constraint_body_{body}").get("name"))
            ends.append(p + apply(R, read_vector(ball.find(f"{DRAKE}ball_constraint_p_{point}"), "value", "")))
        apart = np.maximum(apart, np.abs(ends[0] - ends[1]).max())
    return [("URDF: places of the links", off), ("URDF: masses", np.abs(weights).max()),
            ("URDF: points that balls tie", apart)]
