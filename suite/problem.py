#!/usr/bin/env python3
"""Reads optimal control problems that `bielle export --format problem` wrote, and evaluates trajectories of them, by NumPy alone.

    suite/problem.py FILE.json ...

For each problem and the optimum beside it: the cost, every row of the constraints, the bounds of the torques, and what the
steps leave of the equations of motion, of the contacts and of the closed loops, computed from the files and compared with the
values in them; and whether the robot's URDF is the same mechanism. Exit status 0 if all agree.

As a module: `Problem(path)`, then `problem.evaluate(trajectory)` and `problem.check_steps(trajectory)`. docs/problems.md has the
format and the equations.
"""
import copy
import json
import pathlib
import sys

import numpy as np

from mechanism import Loops, Mechanism, State, apply, bring, compose, invert, log3, log6, read_placement, transpose
from robot_files import check_urdf

TOLERANCE = 1e-9  # of costs and of equations, over the size of their terms
BOUND = 1e-8      # that a constraint may be violated by, over its scale


def read_bounds(entry, key, absent):
    return np.array([absent if x is None else x for x in entry[key]], float)


class Trajectory(dict):
    """q, v (N + 1 nodes), u, a, q_mid, v_mid, contact_wrenches, closure_wrenches (N stages), as the archive names them."""

    def __init__(self, path):
        with np.load(path, allow_pickle=False) as archive:
            super().__init__({name: archive[name] for name in archive.files})


class Nodes:
    """Nodes k of a trajectory, and what residuals read there."""

    def __init__(self, problem, trajectory, ks):
        self.problem, self.ks = problem, ks
        q, v = trajectory["q"][ks], trajectory["v"][ks]
        self.state = State(problem.mechanism, q, v)
        running = ks < problem.stages  # the last node has neither forces nor controls
        stage = np.minimum(ks, problem.stages - 1)
        self.u = np.where(running[:, None], trajectory["u"][stage], np.nan)
        self.forces = np.where(running[:, None, None], trajectory["contact_wrenches"][stage], np.nan)
        self.speeds = np.where(running[:, None], trajectory["v_mid"][stage][:, problem.mechanism.motor_dofs], np.nan)

    def select(self, rows):
        """The same for some of the nodes."""
        part = copy.copy(self)
        part.ks, part.state = self.ks[rows], self.state.select(rows)
        part.u, part.forces, part.speeds = self.u[rows], self.forces[rows], self.speeds[rows]
        return part


def get_frame(nodes, r):
    R = np.array(r["R_BF"]) if "R_BF" in r else np.eye(3)
    p = np.array(r["p_BF"]) if "p_BF" in r else np.zeros(3)
    return nodes.state.get_frame(r["body"], (R, p))


# Residuals: functions of nodes and of the entry, with a row for each node.

def calc_frame_velocity(n, r):
    V, p = n.state.V[r["body"]], get_frame(n, r)[1]
    return np.concatenate([V[:, :3] + np.cross(V[:, 3:], p), V[:, 3:]], -1) - r["reference"]


def calc_sole_clearance(n, r):
    R, p = get_frame(n, r)
    rows = []
    for corner in np.array(r["corners"]):
        point = p + apply(R, corner)
        rise = np.zeros(len(point))
        for x, y, z, length, width, yaw, pitch, roll in r["steps"]:
            c, s = np.cos(yaw), np.sin(yaw)
            dx, dy = point[:, 0] - x, point[:, 1] - y
            local = np.stack([c * dx + s * dy, c * dy - s * dx], -1)
            beyond = np.maximum(0, np.abs(local) - 0.5 * np.array([length, width]))
            t = np.maximum(0, 1 - np.linalg.norm(beyond, axis=-1) / r["ramp"])
            top = z - np.tan(pitch) * local[:, 0] + np.tan(roll) / np.cos(pitch) * local[:, 1]
            rise = np.maximum(rise, (top - r["height"]) * t**2 * (3 - 2 * t))
        rows.append(point[:, 2] - r["height"] - rise)
    return np.stack(rows, -1)


def calc_shape_distance(n, r):
    """Of two segments with a radius: the soles."""
    ends = []
    for side in ("_a", "_b"):
        half = np.array(r["half" + side])
        if np.count_nonzero(half) > 1:
            raise ValueError("shape_distance: boxes are not read")
        X = n.state.get_frame(r["body" + side], read_placement(r, side))
        ends.append((X[1], apply(X[0], half)))
    (pa, ea), (pb, eb) = ends
    d, dot = pa - pb, lambda x, y: (x * y).sum(-1)
    aa, ab, bb = dot(ea, ea), dot(ea, eb), dot(eb, eb)
    with np.errstate(divide="ignore", invalid="ignore"):
        best = np.full(len(d), np.inf)
        det = aa * bb - ab**2
        inner = np.stack([(ab * dot(d, eb) - bb * dot(d, ea)) / det, (aa * dot(d, eb) - ab * dot(d, ea)) / det])
        inner = np.where((det > 1e-14 * aa * bb) & (np.abs(inner).max(0) <= 1), inner, 0)
        candidates = [inner]
        for end in (-1.0, 1.0):  # the nearest point of one segment to an end of the other
            fixed = np.full(len(d), end)
            candidates.append(np.stack([fixed, np.clip(np.nan_to_num((dot(d, eb) + end * ab) / bb), -1, 1)]))
            candidates.append(np.stack([np.clip(np.nan_to_num((end * ab - dot(d, ea)) / aa), -1, 1), fixed]))
    for s, t in candidates:
        best = np.minimum(best, np.linalg.norm(d + s[:, None] * ea - t[:, None] * eb, axis=-1))
    return best[:, None] - r["radius_a"] - r["radius_b"]


def get_force(n, r):
    """The wrench of a contact in the axes that the residual names."""
    contact = n.problem.mechanism.contacts[r["contact"]]
    force = n.forces[:, r["contact"]]
    if r["axes"] != "contact":
        R = n.state.get_frame(contact["body"], read_placement(contact, "_BF"))[0]
        if r["axes"] == "ground":
            R = transpose(n.problem.get_places(n.ks, r["contact"])) @ R
        force = np.concatenate([apply(R, force[:, :3]), apply(R, force[:, 3:])], -1)
    return force[:, :3] if contact["kind"] == "3d" else force


def calc_center_of_pressure(n, r):
    f = get_force(n, r)
    load = np.maximum(f[:, 2], 1)
    return np.stack([-f[:, 4] / load, f[:, 3] / load], -1)


def calc_transmission(n, r):
    _, J, _ = n.state.calc_closures(r["closures"])
    mobility = len(r["motor_dofs"]) + r.get("idle", 0)
    N = transpose(np.linalg.svd(J[:, :, r["dofs"]])[2][:, len(r["dofs"]) - mobility:])
    T = N @ np.linalg.pinv(N[:, [r["dofs"].index(dof) for dof in r["motor_dofs"]]])
    if r["output_dofs"]:
        Q = T[:, [r["dofs"].index(dof) for dof in r["output_dofs"]]]
        return (np.linalg.det(Q) / r["reference_volume"])[:, None]
    scale = np.repeat([1 / r["length"], 1], 3)[:, None]
    O = [scale * bring(n.state.X[body], n.state.get_jacobian(body))[:, :, r["dofs"]] for body in r["output_bodies"]]
    Q = np.concatenate(O, 1) @ T
    sign = np.where(np.linalg.det(np.array(r["reference"]).T @ Q) < 0, -1, 1)
    return (sign * np.sqrt(np.maximum(0, np.linalg.det(transpose(Q) @ Q))) / r["reference_volume"])[:, None]


def continue_transmission(n, r):
    """Above the largest one linearly in its arctangent, through the dead point of the motors."""
    rho, largest = calc_transmission(n, r), r["largest"]
    angle = np.arctan(rho) + np.where(rho < 0, np.pi, 0)
    return np.where((rho > largest) | (rho < -1), largest + (1 + largest**2) * (angle - np.arctan(largest)), rho)


def calc_electrical_power(n, r):
    loss, drive, back = (np.array(r[key]) for key in ("losses", "drive", "back"))
    p = n.u * n.speeds
    root = np.hypot(p, r["smoothing"])
    power = ((drive + back) / 2 * p + (drive - back) / 2 * (root - r["smoothing"])
             + loss * n.u**2 * ((drive**2 + back**2) / 2 + (drive**2 - back**2) / 2 * p / root))
    return np.concatenate([power, n.u], -1)


def get_positions(n, r):
    q_of_dof = {joint.v.start: joint.q.start for joint in n.problem.mechanism.joints
                if joint.v.stop - joint.v.start == 1}
    return n.state.q[:, [q_of_dof[dof] for dof in r["dofs"]]]


RESIDUALS = {
    "com_position": lambda n, r: n.state.get_com()[0] - r["reference"],
    "com_velocity": lambda n, r: n.state.get_com()[1] - r["reference"],
    "frame_placement": lambda n, r: log6(compose(invert(read_placement(r, "_WT")), get_frame(n, r))),
    "frame_translation": lambda n, r: get_frame(n, r)[1] - r["reference"],
    "frame_rotation": lambda n, r: log3(np.array(r["R_WT"]).T @ get_frame(n, r)[0]),
    "frame_velocity": calc_frame_velocity,
    "sole_clearance": calc_sole_clearance,
    "shape_distance": calc_shape_distance,
    "contact_force": lambda n, r: get_force(n, r) - r["reference"],
    "center_of_pressure": calc_center_of_pressure,
    "wrench_cone": lambda n, r: get_force(n, r) @ np.array(r["matrix"]).T,
    "joint_position": get_positions,
    "joint_velocity": lambda n, r: n.state.v[:, r["dofs"]],
    "transmission": continue_transmission,
    "motor_power": lambda n, r: n.u[:, r["motors"]] * n.state.v[:, [n.problem.mechanism.motor_dofs[m]
                                                                   for m in r["motors"]]],
    "motor_voltage": lambda n, r: n.u[:, r["motors"]] * r["per_effort"] + n.speeds[:, r["motors"]] * r["per_speed"],
    "electrical_power": calc_electrical_power,
}


def activate(activation, r):
    weights = np.array(activation["weights"])
    if activation["kind"] == "energy":
        P = r[:, :len(weights)]
        smooth = (P + np.hypot(P, activation["smoothing"])) / 2
        return (activation["share"] * P + (1 - activation["share"]) * smooth) @ weights
    if activation["kind"] == "barrier":
        r = (np.minimum(0, r - read_bounds(activation, "lower", -np.inf))
             + np.maximum(0, r - read_bounds(activation, "upper", np.inf)))
    return 0.5 * r**2 @ weights


class Problem:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.data = json.loads(self.path.read_text(encoding="utf-8"))
        if self.data.get("format") != "bielle problem 1":
            raise ValueError(f"{path}: it is no problem of format 1")
        self.mechanism = Mechanism(self.data["mechanism"])
        self.stage = self.data["stages"]
        self.stages = len(self.stage) - 1
        if any(stage["kind"] != "step" for stage in self.stage[:-1]) or self.data["step"] != "midpoint":
            raise ValueError(f"{path}: impacts and steps other than midpoints are not read")
        self.dt = np.array([stage["dt"] for stage in self.stage[:-1]])

    def read_optimum(self):
        return Trajectory(self.path.with_suffix(".npz"))

    def get_places(self, ks, contact):
        """Rotations of the places where a contact belongs at some stages."""
        sets = self.data["contact_sets"]
        return np.array([next(place["R_WT"] for place in sets[self.stage[k]["contacts"]] if place["contact"] == contact)
                         for k in ks])

    def group(self, key):
        """{index of a shared entry: nodes that use it}"""
        groups = {}
        for k, stage in enumerate(self.stage):
            indices = stage.get(key)
            for index in indices if isinstance(indices, list) else [] if indices is None else [indices]:
                groups.setdefault(index, []).append(k)
        return {index: np.array(ks) for index, ks in groups.items()}

    def evaluate(self, trajectory):
        """Costs of the nodes (N + 1), and the rows of the constraints over their scales, node by node, with their bounds."""
        m, nodes = self.mechanism, Nodes(self, trajectory, np.arange(self.stages + 1))
        cost = np.zeros(self.stages + 1)
        for index, ks in self.group("state_cost").items():
            entry = self.data["state_costs"][index]
            d = np.concatenate([m.subtract(trajectory["q"][ks], np.array(entry["q"])), trajectory["v"][ks] - entry["v"]], 1)
            if "axes" in entry:  # of a free base
                nv = d.shape[1] // 2
                for first in (0, 3, nv, nv + 3):
                    d[:, first:first + 3] = d[:, first:first + 3] @ np.transpose(entry["axes"])
            cost[ks] += 0.5 * entry["weight"] * (d**2 @ entry["weights"])
        for index, ks in self.group("control_cost").items():
            entry = self.data["control_costs"][index]
            cost[ks] += 0.5 * entry["weight"] * ((trajectory["u"][ks] - entry["reference"])**2 @ entry["weights"])
        for index, ks in self.group("costs").items():
            entry = self.data["costs"][index]
            r = RESIDUALS[entry["residual"]["kind"]](nodes.select(ks), entry["residual"])
            cost[ks] += entry["weight"] * activate(entry["activation"], r)
        cost[:-1] *= self.dt
        values = {}
        for index, ks in self.group("constraints").items():
            entry = self.data["constraints"][index]
            r = RESIDUALS[entry["residual"]["kind"]](nodes.select(ks), entry["residual"]) / entry["scale"]
            for k, row in zip(ks, r):
                values[k, index] = row
        rows, lower, upper = [], [], []
        for k, stage in enumerate(self.stage):
            for index in stage["constraints"]:
                entry = self.data["constraints"][index]
                rows.append(values[k, index])
                lower.append(read_bounds(entry, "lower", -np.inf) / entry["scale"])
                upper.append(read_bounds(entry, "upper", np.inf) / entry["scale"])
        join = lambda parts: np.concatenate(parts) if parts else np.zeros(0)
        return cost, join(rows), join(lower), join(upper)

    def check_steps(self, t):
        """What the steps leave of their equations, each over the size of its terms; docs/problems.md has the equations."""
        m, h = self.mechanism, self.dt[:, None]
        start, end, half = (State(m, t["q"][:-1], t["v"][:-1]), State(m, t["q"][1:]), State(m, t["q_mid"], t["v_mid"]))
        loops, loops_half, loops_end = Loops(start), Loops(half), Loops(end)
        speed, pace = np.abs(t["v"]).max() + 1, np.abs(t["a"]).max() + 1
        out = {"closures": np.max([np.abs(x.residual).max(initial=0) for x in (loops, loops_half, loops_end)]),
               "closures: velocities": np.abs(apply(loops.J, t["v"][:-1])).max(initial=0) / speed}
        # Drifts (3): along the closures where they begin; where they end, the velocity is projected.
        first, second = m.subtract(t["q_mid"], t["q"][:-1]) / (h / 2), m.subtract(t["q"][1:], t["q_mid"]) / (h / 2)
        begin = loops_half.project(first)
        out["first drift"] = loops.measure(t["v"][:-1] - first) / speed
        out["second drift"] = loops_half.measure(begin + h * t["a"] - second) / speed
        out["velocity at the end"] = np.abs(loops_end.project(second) - t["v"][1:]).max() / speed
        # The kick: (2) at (4), whose velocity is foreseen without stabilization.
        before = State(m, t["q_mid"], begin)
        gain = (t["v_mid"] - begin) / (h / 2)
        foreseen = gain - loops_half.solve(Loops(before).gamma)
        tau = np.zeros((self.stages, m.nv))
        tau[:, m.motor_dofs] = t["u"]
        ground, rows = np.zeros_like(tau), np.zeros((self.stages, 6 * len(m.contacts), m.nv))
        slip = slip_foreseen = 0.0
        for index, ks in self.group("contacts").items():
            at_start, at_half, at_before = (state.select(ks) for state in (start, half, before))
            for place in self.data["contact_sets"][index]:
                c = place["contact"]
                r, J0, _ = at_start.calc_contact(place)
                _, J, gamma = at_half.calc_contact(place)
                stabilization = place["kd"] * apply(J0, t["v"][ks]) - place["kp"] * r
                slip = np.maximum(slip, np.abs(apply(J, t["a"][ks]) + gamma + stabilization).max())
                gamma = at_before.calc_contact(place)[2]
                slip_foreseen = np.maximum(slip_foreseen, np.abs(apply(J, foreseen[ks]) + gamma).max())
                rows[ks, 6 * c:6 * c + J.shape[1]] = J
                ground[ks] += at_half.generalize_contact(c, t["contact_wrenches"][ks, c])
        needed, inside = half.calc_inverse_dynamics(t["a"]), half.generalize_closures(t["closure_wrenches"])
        force = np.abs(needed).max() + np.abs(inside).max() + np.abs(ground).max()
        out["equations of motion"] = np.abs(needed - tau - inside - ground).max() / force
        out["closures: accelerations"] = np.abs(apply(loops_half.J, t["a"]) + loops_half.gamma).max(initial=0) / pace
        out["contacts: accelerations"] = slip / pace
        left = Loops(half, rows).remove_forces(before.calc_inverse_dynamics(foreseen) - tau)
        out["foreseen: equations of motion"] = np.abs(left).max() / force
        out["foreseen: closures"] = np.abs(apply(loops_half.J, gain)).max(initial=0) / pace
        out["foreseen: contacts"] = slip_foreseen / pace
        return out


def check(path):
    """[(what, value, bound), ...] of a problem and the optimum beside it."""
    problem = Problem(path)
    t = problem.read_optimum()
    strange = sum(np.count_nonzero(~np.isfinite(array)) for array in t.values())
    if strange:
        return problem, np.nan, [("entries that are no number", strange, 0.0)]
    cost, rows, lower, upper = problem.evaluate(t)
    size = np.abs(rows).max(initial=1)
    limits = np.array([read_bounds({"l": problem.data["effort_limits"][stage["effort_limit"]]}, "l", np.inf)
                       for stage in problem.stage[:-1]])
    start = problem.data["initial"]
    table = [("cost", abs(cost.sum() - t["cost"].sum()) / abs(t["cost"].sum()), TOLERANCE),
             ("costs of the nodes", np.abs(cost - t["cost"]).max() / np.abs(t["cost"]).max(), TOLERANCE),
             ("rows of the constraints", np.abs(rows - t["constraints"]).max(initial=0) / size, TOLERANCE),
             ("violation of the constraints", np.maximum(lower - rows, rows - upper).max(initial=0), BOUND),
             ("torques over their limits", np.maximum(0, np.abs(t["u"]) - limits).max(), 0.0),
             ("start", np.maximum(np.abs(t["q"][0] - start["q"]).max(), np.abs(t["v"][0] - start["v"]).max()), TOLERANCE)]
    table += [(name, value, TOLERANCE) for name, value in problem.check_steps(t).items()]
    table += [(name, value, TOLERANCE) for name, value in check_urdf(problem, t)]
    return problem, cost.sum(), table


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 2
    failed = False
    for path in sys.argv[1:]:
        problem, cost, table = check(path)
        print(f"{path}: {problem.data['name']}, {problem.stages} stages, cost {cost:.12g}")
        for what, value, bound in table:
            ok = bool(value <= bound)  # not so for what is no number
            failed |= not ok
            print(f"  {'pass' if ok else 'FAIL'}  {what:45} {value:9.1e}  up to {bound:.0e}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
