"""A mechanism with closed loops as NumPy arrays: kinematics, closures and equations of motion, all nodes of a motion at once.

Everything is computed from the entry `mechanism` of a problem (docs/problems.md) and shares no code with Bielle. Arrays have a
first axis of K nodes. Spatial vectors are linear first and belong to the origin of the world; `X = (R, p)` places frames.
"""
import copy

import numpy as np

RANK = 1e-6  # singular values of closures below this, over the largest, count as zero


def read_polynomial(term):
    """The polynomial of a coordinate in a coupler."""
    return np.polynomial.Polynomial([0, term["coefficient"], *term.get("higher", [])])


def skew(p):
    out = np.zeros(p.shape[:-1] + (3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -p[..., 2], p[..., 1], -p[..., 0]
    return out - np.swapaxes(out, -1, -2)


def apply(matrix, vector):
    return (matrix @ vector[..., None])[..., 0]


def transpose(matrix):
    return np.swapaxes(matrix, -1, -2)


def compose(A, B):
    return A[0] @ B[0], A[1] + apply(A[0], B[1])


def invert(X):
    return transpose(X[0]), -apply(transpose(X[0]), X[1])


def rotate(axis, angle):
    """Rodrigues' formula: rotations (K, 3, 3) about one axis."""
    K = skew(np.asarray(axis, float))
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * K + (1 - c) * (K @ K)


def read_quaternion(x):
    """Rotations of unit quaternions x, y, z, w."""
    v, w = x[..., :3], x[..., 3][..., None, None]
    K = skew(v)
    return np.eye(3) + 2 * w * K + 2 * (K @ K)


def exp_quaternion(w):
    angle = np.linalg.norm(w, axis=-1, keepdims=True)
    return np.concatenate([0.5 * np.sinc(0.5 * angle / np.pi) * w, np.cos(0.5 * angle)], -1)


def multiply_quaternions(a, b):
    v, w = a[:, :3], a[:, 3:]
    out = np.concatenate([w * b[:, :3] + b[:, 3:] * v + np.cross(v, b[:, :3]),
                          w * b[:, 3:] - (v * b[:, :3]).sum(-1, keepdims=True)], -1)
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def log3(R):
    """Rotation vectors, of angles below pi."""
    axis = 0.5 * np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], -1)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1))
    small = sine < 1e-6
    return axis * np.where(small, 1 + angle**2 / 6, angle / np.where(small, 1, sine))[..., None]


def log6(X):
    """Twists (m, rad) whose exponential is the placement."""
    w = log3(X[0])
    angle = np.linalg.norm(w, axis=-1)
    small = angle < 1e-3
    safe = np.where(small, 1, angle)
    factor = np.where(small, 1 / 12 + angle**2 / 720, (1 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2)
    K = skew(w)
    return np.concatenate([apply(np.eye(3) - 0.5 * K + factor[..., None, None] * (K @ K), X[1]), w], -1)


def carry(X, m):
    """A motion in a frame, in world coordinates; also for columns m (K, 6, n)."""
    angular = X[0] @ m[..., 3:, :]
    return np.concatenate([X[0] @ m[..., :3, :] + skew(X[1]) @ angular, angular], -2)


def bring(X, m):
    """The inverse: columns of world motions in the frame."""
    R = transpose(X[0])
    return np.concatenate([R @ (m[..., :3, :] - skew(X[1]) @ m[..., 3:, :]), R @ m[..., 3:, :]], -2)


def cross(V, m):
    v, w = V[..., :3], V[..., 3:]
    return np.concatenate([np.cross(w, m[..., :3]) + np.cross(v, m[..., 3:]), np.cross(w, m[..., 3:])], -1)


def carry_force(X, f):
    force, moment = apply(X[0], f[..., :3]), apply(X[0], f[..., 3:])
    return np.concatenate([force, moment + np.cross(np.broadcast_to(X[1], force.shape), force)], -1)


def make_plane(normal):
    """Two unit vectors normal to a third one, as rows."""
    n = np.asarray(normal, float)
    first = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(n, first)])


def read_placement(entry, suffix):
    return np.array(entry["R" + suffix]), np.array(entry["p" + suffix])


class Joint:
    SIZES = {"revolute": (1, 1), "continuous": (1, 1), "prismatic": (1, 1), "spherical": (4, 3), "universal": (2, 2),
             "free-flyer": (7, 6)}

    def __init__(self, entry):
        self.kind, self.parent = entry["kind"], entry["parent"]
        if self.kind not in self.SIZES:
            raise ValueError(f"joint {entry['name']}: a {self.kind} joint is not read")
        nq, nv = self.SIZES[self.kind]
        self.name = entry["name"]
        self.q, self.v = slice(entry["first_q"], entry["first_q"] + nq), slice(entry["first_v"], entry["first_v"] + nv)
        self.X_PJ = read_placement(entry, "_PJ")
        self.axis, self.axis2 = (np.array(entry.get(key, [0, 0, 1]), float) for key in ("axis", "axis2"))

    def place(self, q):
        """Placement of the child in the frame of the joint."""
        q = q[:, self.q]
        none = np.zeros((len(q), 3))
        if self.kind in ("revolute", "continuous"):
            return rotate(self.axis, q[:, 0]), none
        if self.kind == "prismatic":
            return np.broadcast_to(np.eye(3), (len(q), 3, 3)), q * self.axis
        if self.kind == "universal":
            return rotate(self.axis, q[:, 0]) @ rotate(self.axis2, q[:, 1]), none
        if self.kind == "spherical":
            return read_quaternion(q), none
        return read_quaternion(q[:, 3:]), q[:, :3]

    def get_axes(self, q):
        """Motions of unit velocities, in the frame of the child (K, 6, nv)."""
        S = np.zeros((len(q), 6, self.v.stop - self.v.start))
        if self.kind in ("revolute", "continuous"):
            S[:, 3:, 0] = self.axis
        elif self.kind == "prismatic":
            S[:, :3, 0] = self.axis
        elif self.kind == "universal":
            S[:, 3:, 0] = apply(transpose(rotate(self.axis2, q[:, self.q][:, 1])), self.axis)
            S[:, 3:, 1] = self.axis2
        elif self.kind == "spherical":
            S[:, 3:] = np.eye(3)
        else:
            S[:] = np.eye(6)
        return S

    def add(self, q, d):
        """q (+) d for tangent vectors d, of the coordinates of the joint."""
        q, d = q[:, self.q], d[:, self.v]
        if self.kind == "spherical":
            return multiply_quaternions(q, exp_quaternion(d))
        if self.kind == "free-flyer":
            w, place = d[:, 3:], q[:, :3]
            angle = np.linalg.norm(w, axis=-1)[:, None, None]
            small = angle < 1e-4
            safe = np.where(small, 1, angle)
            K = skew(w)
            left = (np.eye(3) + np.where(small, 0.5, (1 - np.cos(safe)) / safe**2) * K
                    + np.where(small, 1 / 6, (safe - np.sin(safe)) / safe**3) * (K @ K))
            return np.concatenate([place + apply(read_quaternion(q[:, 3:]), apply(left, d[:, :3])),
                                   multiply_quaternions(q[:, 3:], exp_quaternion(w))], -1)
        return q + d

    def subtract(self, q, q0):
        """The tangent vectors from q0 to q."""
        if self.kind == "spherical":
            return log3(transpose(read_quaternion(q0[:, self.q])) @ read_quaternion(q[:, self.q]))
        if self.kind == "free-flyer":
            return log6(compose(invert(self.place(q0)), self.place(q)))
        return q[:, self.q] - q0[:, self.q]


class Mechanism:
    def __init__(self, entry):
        self.nq, self.nv = entry["nq"], entry["nv"]
        self.joints = [Joint(joint) for joint in entry["joints"]]
        self.names = [body["name"] for body in entry["bodies"]]
        self.masses = np.array([body["mass"] for body in entry["bodies"]])
        self.coms = np.array([body["com"] for body in entry["bodies"]])
        self.inertias = np.array([body["inertia"] for body in entry["bodies"]])
        self.gravity, self.armature = np.array(entry["gravity"]), np.array(entry["armature"])
        self.metric = np.array(entry["metric"])
        self.closures, self.contacts = entry["closures"], entry["contacts"]
        self.motor_dofs = [motor["dof"] for motor in entry["motors"]]
        self.joint_forces, self.point_springs = entry["joint_forces"], entry["point_springs"]
        self.support = np.zeros((len(self.joints) + 1, self.nv), bool)  # which velocities move a body
        for i, joint in enumerate(self.joints, 1):
            self.support[i] = self.support[joint.parent]
            self.support[i, joint.v] = True

    def add(self, q, d):
        out = np.empty_like(q)
        for joint in self.joints:
            out[:, joint.q] = joint.add(q, d)
        return out

    def subtract(self, q, q0):
        out = np.empty((len(q), self.nv))
        for joint in self.joints:
            out[:, joint.v] = joint.subtract(q, np.broadcast_to(q0, q.shape))
        return out


class State:
    """Kinematics of a mechanism at configurations q (K, nq), and velocities v (K, nv) if given."""

    def __init__(self, mechanism, q, v=None):
        m, K = mechanism, len(q)
        self.mechanism, self.q, self.v = m, q, np.zeros((K, m.nv)) if v is None else v
        self.X = [(np.broadcast_to(np.eye(3), (K, 3, 3)), np.zeros((K, 3)))]
        self.J, self.dJv = np.zeros((K, 6, m.nv)), [np.zeros((K, 6))]
        self.V = [np.zeros((K, 6))]
        for joint in m.joints:
            X = compose(compose(self.X[joint.parent], joint.X_PJ), joint.place(q))
            S = carry(X, joint.get_axes(q))
            self.X.append(X)
            self.J[:, :, joint.v] = S
            rates = self.v[:, joint.v]
            V = self.V[joint.parent] + apply(S, rates)
            # Axes turn with the child; the first one of a universal joint with the parent.
            turning = [self.V[joint.parent] if joint.kind == "universal" and i == 0 else V for i in range(S.shape[2])]
            self.V.append(V)
            self.dJv.append(self.dJv[joint.parent] + sum(rates[:, i, None] * cross(turning[i], S[:, :, i])
                                                         for i in range(S.shape[2])))

    def select(self, rows):
        """The same at some of the configurations."""
        part = copy.copy(self)
        part.q, part.v, part.J = self.q[rows], self.v[rows], self.J[rows]
        part.X = [(R[rows], p[rows]) for R, p in self.X]
        part.V, part.dJv = [V[rows] for V in self.V], [drift[rows] for drift in self.dJv]
        return part

    def get_jacobian(self, body):
        return self.J * self.mechanism.support[body]

    def get_frame(self, body, placement):
        return compose(self.X[body], placement)

    def get_com(self):
        """Centre of mass and its velocity."""
        m = self.mechanism
        place, speed = np.zeros((len(self.q), 3)), np.zeros((len(self.q), 3))
        for mass, com, X, V in zip(m.masses, m.coms, self.X, self.V):
            c = X[1] + apply(X[0], com)
            place += mass * c
            speed += mass * (V[:, :3] + np.cross(V[:, 3:], c))
        return place / m.masses[1:].sum(), speed / m.masses[1:].sum()

    # Closures and contacts: (residual, Jacobian, acceleration without a) of all rows (K, rows ..)

    def calc_frames(self, kind, axis, body1, X_B1, body2, X_B2, with_residual=True):
        X1, X2 = self.get_frame(body1, X_B1), self.get_frame(body2, X_B2)
        J = bring(X1, self.get_jacobian(body1) - self.get_jacobian(body2))
        drift = self.dJv[body1] - self.dJv[body2] + cross(self.V[body1], self.V[body2])
        gamma = bring(X1, drift[:, :, None])[:, :, 0]
        X12 = compose(invert(X1), X2)
        if kind == "6d":
            return log6(X12), J, gamma
        if kind == "3d":
            return X12[1], J[:, :3], gamma[:, :3]
        plane = make_plane(axis)
        rows = np.zeros((5, 6))
        rows[:3, :3], rows[3:, 3:] = np.eye(3), plane
        angle = np.cross(np.asarray(axis, float), apply(X12[0], np.asarray(axis, float)))
        return np.concatenate([X12[1], angle @ plane.T], -1), rows @ J, gamma @ rows.T

    def calc_closures(self, indices=None):
        m, K = self.mechanism, len(self.q)
        parts = [(np.zeros((K, 0)), np.zeros((K, 0, m.nv)), np.zeros((K, 0)))]
        for c in m.closures if indices is None else [m.closures[i] for i in indices]:
            if c["kind"] == "coupler":
                J, residual, gamma = np.zeros((K, 1, m.nv)), np.full((K, 1), c["offset"]), np.zeros((K, 1))
                for term in c["terms"]:
                    p, q, v = read_polynomial(term), self.q[:, term["q"]], self.v[:, term["dof"]]
                    residual[:, 0] -= p(q)
                    J[:, 0, term["dof"]] = p.deriv()(q)
                    gamma[:, 0] += p.deriv(2)(q) * v**2
                parts.append((residual, J, gamma))
            else:
                parts.append(self.calc_frames(c["kind"], c.get("axis"), c["body1"], read_placement(c, "_B1"), c["body2"],
                                              read_placement(c, "_B2")))
        return tuple(np.concatenate(part, 1) for part in zip(*parts))

    def calc_contact(self, place):
        """A foot on the ground at `place`."""
        contact = self.mechanism.contacts[place["contact"]]
        return self.calc_frames(contact["kind"], [1, 0, 0], contact["body"], read_placement(contact, "_BF"), 0,
                                read_placement(place, "_WT"))

    def calc_inverse_dynamics(self, a):
        """Generalized forces that accelerations need: M a + b, less springs, dampers and friction (K, nv)."""
        m = self.mechanism
        tau = m.armature * a
        for i, joint in enumerate(m.joints, 1):
            A = apply(self.get_jacobian(i), a) + self.dJv[i]
            V, (R, p) = self.V[i], self.X[i]
            c = p + apply(R, m.coms[i])
            v_c = V[:, :3] + np.cross(V[:, 3:], c)
            force = m.masses[i] * (A[:, :3] + np.cross(A[:, 3:], c) + np.cross(V[:, 3:], v_c) - m.gravity)
            inertia = R @ m.inertias[i] @ transpose(R)
            moment = apply(inertia, A[:, 3:]) + np.cross(V[:, 3:], apply(inertia, V[:, 3:]))
            tau = tau + self.generalize(i, np.concatenate([force, moment + np.cross(c, force)], -1))
        for f in m.joint_forces:
            rate = self.v[:, f["dof"]]
            spring = f["preload"] - f["stiffness"] * (self.q[:, f["q"]] - f["rest"]) - f["damping"] * rate
            tau[:, f["dof"]] -= spring - f["friction"] * rate / np.hypot(rate, f["friction_speed"])
        for s in m.point_springs:
            ends = [self.get_frame(s[f"body{i}"], (np.eye(3), np.array(s[f"point{i}"])))[1] for i in (1, 2)]
            rates = [self.V[s[f"body{i}"]][:, :3] + np.cross(self.V[s[f"body{i}"]][:, 3:], end)
                     for i, end in zip((1, 2), ends)]
            line = ends[1] - ends[0]
            length = np.sqrt((line**2).sum(-1) + 1e-18)
            along = line / length[:, None]
            tension = (s["preload"] + s["stiffness"] * (length - s["rest"])
                       + s["damping"] * (along * (rates[1] - rates[0])).sum(-1))
            for i, end, sign in zip((1, 2), ends, (1, -1)):
                force = sign * tension[:, None] * along
                tau = tau - self.generalize(s[f"body{i}"], np.concatenate([force, np.cross(end, force)], -1))
        return tau

    def generalize(self, body, wrench):
        """Generalized forces (K, nv) of world wrenches on a body."""
        return apply(transpose(self.get_jacobian(body)), wrench)

    def generalize_contact(self, contact, wrench):
        """Of wrenches (K, 6) of the ground on a foot, in its frame."""
        entry = self.mechanism.contacts[contact]
        return self.generalize(entry["body"], carry_force(self.get_frame(entry["body"], read_placement(entry, "_BF")), wrench))

    def generalize_closures(self, wrenches):
        """Of wrenches (K, closures, 6), each in frame 1 and on body 1; of a coupler the first entry."""
        tau = np.zeros((len(self.q), self.mechanism.nv))
        for i, c in enumerate(self.mechanism.closures):
            if c["kind"] == "coupler":
                for term in c["terms"]:
                    tau[:, term["dof"]] += read_polynomial(term).deriv()(self.q[:, term["q"]]) * wrenches[:, i, 0]
                continue
            world = carry_force(self.get_frame(c["body1"], read_placement(c, "_B1")), wrenches[:, i])
            tau += self.generalize(c["body1"], world) - self.generalize(c["body2"], world)
        return tau


class Loops:
    """Closures at states, and projections on the closed motions in the metric W of the problem."""

    def __init__(self, state, extra=None):
        """extra: further rows (K, rows, nv) to project by, those of contacts."""
        self.residual, J, self.gamma = state.calc_closures()
        self.J = J if extra is None else np.concatenate([J, extra], 1)
        self.root = np.sqrt(state.mechanism.metric)
        if self.J.shape[1] == 0:
            self.rows, self.inverse = np.zeros((len(J), 0, J.shape[2])), np.zeros((len(J), 0, 0))
            return
        U, s, rows = np.linalg.svd(self.J / self.root, full_matrices=False)
        counts = s > RANK * s[:, :1]
        self.rows = rows * counts[:, :, None]
        self.inverse = transpose(U) / np.where(counts, s, np.inf)[:, :, None]

    def project(self, v):
        """(1 - J^+ J) v: the closed part of velocities."""
        scaled = v * self.root
        return (scaled - apply(transpose(self.rows), apply(self.rows, scaled))) / self.root

    def solve(self, x):
        """J^+ x: the least velocities, in the metric, that move the closures at the rates x."""
        return apply(transpose(self.rows), apply(self.inverse, x)) / self.root

    def measure(self, v):
        """Largest entry of what of v is no multiple of W^-1 J^T."""
        return np.abs(self.remove_forces(self.root**2 * v) / self.root**2).max()

    def remove_forces(self, tau):
        """What of generalized forces no force of the rows can give, J^T lambda."""
        scaled = tau / self.root
        return (scaled - apply(transpose(self.rows), apply(self.rows, scaled))) * self.root
