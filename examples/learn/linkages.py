"""What a policy that was learned on the serial model sees and does on the closed robot: joints for motors, and back."""

import numpy as np

import bielle
from walk import PERIOD


class Linkages:
    """Of `count` closed robots. Joints are those of the serial model's motors, in its order.

    With `constant`, positions and torques go by the ratio of motors to joints in the standing posture, as is often done;
    else by the loops in the present one."""

    def __init__(self, closed: bielle.Model, serial: bielle.Model, count, constant=False):
        self.closed, self.count, self.constant = closed, count, constant
        stand = closed.standing()
        self.maps = [bielle.LinkageMap(closed, stand) for _ in range(count)]
        self.order = [self.maps[0].joint_names.index(name) for name in serial.u_names]
        joints = {joint.name: joint for joint in closed.joints}
        self.dofs = [joints[name].idx_v for name in serial.u_names]
        self.motors0 = stand[[list(closed.q_names).index(name) for name in closed.u_names]]
        self.joints0 = stand[[joints[name].idx_q for name in serial.u_names]]
        self.ratio0 = self.calc_ratio(stand)
        self.ratios = np.tile(self.ratio0, (count, 1, 1))

    def calc_ratio(self, q):
        """R (nu, nu) of v_motors = R v_joints, from the loops."""
        model = self.closed
        loops, trunk, joints = model.closure_jacobian(q), np.eye(6, model.nv), np.eye(model.nv)[self.dofs]
        known = np.vstack([np.zeros((len(loops) + 6, model.nu)), np.eye(model.nu)])
        v = np.linalg.lstsq(np.vstack([loops, trunk, joints]), known, rcond=1e-9)[0]
        return v[[motor.dof for motor in model.motors]]

    def joints(self, motors):
        """(N, nu) of (N, nu). Where the loops do not close, the nearest ones."""
        if self.constant:
            return self.joints0 + np.linalg.solve(self.ratio0, (motors - self.motors0).T).T
        out = np.empty_like(motors)
        for i, (map_, at) in enumerate(zip(self.maps, motors)):
            out[i] = map_.joints(at)[0][self.order]
            self.ratios[i] = self.calc_ratio(map_.q)
        return out

    def torques(self, joint_torques):
        """Of the motors, at what joints() saw last: the same power."""
        return np.linalg.solve(np.swapaxes(self.ratios, 1, 2), joint_torques[..., None])[..., 0]


class SerialPolicy:
    """A policy of the serial model, between the readings and the motors of closed robots."""

    def __init__(self, policy, linkages: Linkages):
        self.policy, self.linkages, self.plan = policy, linkages, policy.plan

    def begin(self, count):
        self.policy.begin(count)
        self.before = None

    def observe(self, k, observations):
        nu = self.linkages.closed.nu
        joints = self.linkages.joints(observations[:, :nu])
        speeds = np.zeros_like(joints) if self.before is None else (joints - self.before) / PERIOD
        speeds[k == 0] = 0
        self.before = joints
        return self.policy.observe(k, np.hstack([joints, speeds, observations[:, 2 * nu :]]))

    def features(self, k, e):
        return self.policy.features(k, e)

    def act(self, k, z, thetas):
        return self.policy.act(k, z, thetas)

    def torques(self, k, e, actions):
        return self.linkages.torques(self.policy.torques(k, e, actions))
