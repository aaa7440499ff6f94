"""The example that learns, examples/learn."""

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bielle

LEARN = Path(__file__).resolve().parents[2] / "examples" / "learn"
sys.path.insert(0, str(LEARN))

import ars  # noqa: E402
import replay  # noqa: E402
import train  # noqa: E402
import walk  # noqa: E402
from episodes import Walks  # noqa: E402
from imitate import Gains, imitate  # noqa: E402
from linkages import Linkages  # noqa: E402

SMALL = ["--steps", "2", "--pairs", "2", "--best", "1", "--threads", "1", "--imitated", "2"]


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A directory with the walk, the imitated gains, and what one uninterrupted run of three iterations has learned."""
    directory = tmp_path_factory.mktemp("learn") / "begun"
    train.main([str(directory), *SMALL, "--iterations", "3"])
    return directory


@pytest.fixture(scope="module")
def given(begun):
    return train.read_arguments([str(begun), *SMALL])


@pytest.fixture(scope="module")
def plan(given):
    return walk.load_plan(given.directory, given.robot, given.speed, given.steps, given.serial, given.armature)


def test_search_climbs():
    """A paraboloid seen with noise; without the right sign of the slope it would fall."""
    goal = np.random.default_rng(2).standard_normal((2, 3))

    def evaluate(thetas, mean, deviation, random):
        returns = -((thetas - goal) ** 2).sum(axis=(1, 2)) + 0.01 * random.standard_normal(len(thetas))
        seen = np.array([[1.0, 2.0, 5.0], [3.0, 2.0, 5.0]])
        return returns, len(seen), seen.sum(axis=0), (seen**2).sum(axis=0)

    search = ars.Search(np.zeros((2, 3)), np.random.default_rng(1), 3)
    before = ((search.theta - goal) ** 2).sum()
    returns = [ars.step(search, evaluate, 8, 4, 0.1, 0.1).mean() for _ in range(60)]
    assert ((search.theta - goal) ** 2).sum() < 0.05 * before and returns[-1] > 0.1 * returns[0]
    mean, deviation = search.scales()
    assert mean == pytest.approx([2, 0, 0]) and deviation == pytest.approx([1, 1, 1])  # constants are left as they are


def test_a_killed_run_goes_on_to_the_same_bytes(begun, tmp_path):
    directory = tmp_path / "killed"
    directory.mkdir()
    for name in ("settings.json", "walk.pickle", "imitation.npz"):
        shutil.copy(begun / name, directory)
    command = [sys.executable, str(LEARN / "train.py"), str(directory), *SMALL, "--iterations", "3", "--checkpoint", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert "iteration 1" in process.stdout.readline()
        process.stdout.readline()  # the checkpoint of the first is complete
        process.send_signal(signal.SIGKILL)
    assert not (directory / "policy.npz").exists() and ars.read(directory / "checkpoint.npz").iteration in (1, 2)
    train.main(command[2:])
    for name in ("checkpoint.npz", "policy.npz"):
        assert (directory / name).read_bytes() == (begun / name).read_bytes(), name
    rows = json.loads((directory / "progress.json").read_text())
    assert [row["iteration"] for row in rows] == [1, 2, 3] and rows[0]["seconds"] < rows[1]["seconds"] < rows[2]["seconds"]
    assert rows[0]["measured return"] > 0 and 0 < rows[2]["return"] < 1
    assert np.abs(np.load(directory / "policy.npz")["theta"]).max() > 0


def test_what_is_learned_does_not_depend_on_threads(begun, given, plan):
    policy, results = train.load_policy(given, plan), []
    thetas = 0.3 * np.random.default_rng(3).standard_normal((4, *walk.SHAPE))
    for threads in (1, 2):
        walks = Walks(plan, 4, threads)
        walks.set(walks.draw(np.random.default_rng(5), 4.0))
        results.append(train.walk(walks, policy, thetas, np.zeros(walk.FEATURES), np.full(walk.FEATURES, 0.1), 7)[0])
    assert np.array_equal(*results) and len(set(results[0])) == 4


@pytest.mark.long
def test_imitation_walks_as_the_gains_do(plan):
    """From sensors alone, it stands without a push, where the plan's torques fall, and most of them after one; there it asks for
    what the gains ask for, which see the true state, but for 0.55 of the squares. Without feedback that would be 1."""
    policy, gains = walk.Policy(plan, *imitate(plan, 16, 1, 1)), Gains(plan)
    walks = Walks(plan, 4, 1)
    conditions = walks.draw(np.random.default_rng(1), 4.0)
    conditions.times[:], conditions.impulses[:, 0] = 0.6, [[0, 0], [0, 3], [0, -3], [3, 0]]
    walks.set(conditions)
    off, asked = [], []

    def control(k, observations, state):
        e = policy.observe(k, observations)
        torques = policy.torques(k, e, np.zeros((4, 2, 3)))
        shown = gains.feedback(k, state["q"], state["v"])
        off.append(torques - plan.torques[k] - shown)
        asked.append(shown)
        return torques

    policy.begin(4)
    rewards, stood = walks.run(control, 1)
    assert stood[0] and rewards[0] > 0.99 and stood.sum() >= 3
    after = slice(round(0.6 / walk.PERIOD), round(1.2 / walk.PERIOD))
    off, asked = (np.array(torques)[after][:, stood] for torques in (off, asked))
    assert (off**2).sum() < 0.7 * (asked**2).sum()
    assert not walks.run(lambda k, observations, state: plan.torques[k], 1)[1].any()


def test_a_push_is_felt(plan, given):
    policy = train.load_policy(given, plan)
    walks = Walks(plan, 2, 1)
    conditions = walks.draw(np.random.default_rng(1), 20.0)
    conditions.impulses[:] = [[[0, 30]], [[0, 0]]]
    walks.set(conditions)
    rewards, _, _ = train.walk(walks, policy, np.zeros((2, *walk.SHAPE)), np.zeros(walk.FEATURES), np.ones(walk.FEATURES), 1)
    assert rewards[0] < rewards[1] - 0.1


def test_legs_follow_from_the_loops(plan):
    """Against postures that are closed with the motors where L says: the feet have moved by their twists. A wrong entry is seen."""
    model, at = plan.model, 5
    q, L = plan.q[walk.EVERY * at], plan.legs[at]
    motors = [list(model.q_names).index(name) for name in model.u_names]
    closer = bielle.LoopCloser(model, q, list(model.u_names))
    twists = np.random.default_rng(4).standard_normal(12)

    def err(L, size=1e-6):
        ends = []
        for sign in (-1, 1):
            asked = q.copy()
            asked[motors] += sign * size * L @ twists
            closer.reset(q)
            closed, _ = closer.close(asked)
            trunk = np.linalg.inv(model.placement(closed, model.bodies[1].name))
            ends.append([trunk @ model.placement(closed, name) for name in ("foot_left", "foot_right")])
        moved = []
        for before, after in zip(*ends):
            M = np.linalg.inv(before) @ after / (2 * size)
            moved += [*M[:3, 3], M[2, 1], M[0, 2], M[1, 0]]
        return np.abs(moved - twists).max()

    assert err(L) < 1e-5
    wrong = L.copy()
    wrong[np.unravel_index(np.abs(L).argmax(), L.shape)] *= 1.001
    assert err(wrong) > 1e-4


@pytest.fixture(scope="module")
def robots():
    """The closed robot and its serial model."""
    closed = bielle.load_robot("bipetto").model
    return closed, bielle.make_serial_model(closed, closed.standing()).model


def test_linkages_pass_on_what_gravity_asks_for(robots):
    """Virtual work: the torques of joints that hold the legs, differences of the potential energy along the joints, become those of
    motors, differences along the motors, where the trunk is held in a posture far from standing. Constant ratios are off by a
    hundredth or more."""
    closed, serial = robots
    postures = bielle.LinkageMap(closed, closed.standing())
    order = [postures.joint_names.index(name) for name in serial.u_names]
    joints = closed.standing()[[list(closed.q_names).index(name) for name in postures.joint_names]]
    joints += np.random.default_rng(1).uniform(-0.25, 0.25, closed.nu)

    def differentiate(move, at, size=1e-5):
        def energy(x):
            move(x)
            return closed.potential_energy(postures.q)

        return np.array([(energy(at + size * e) - energy(at - size * e)) / (2 * size) for e in np.eye(closed.nu)])

    motors, _ = postures.motors(joints)
    of_joints, of_motors = differentiate(postures.motors, joints)[order], differentiate(postures.joints, motors)
    exact, constant = (Linkages(closed, serial, 1, constant) for constant in (False, True))
    assert exact.joints(motors[None])[0] == pytest.approx(joints[order], abs=1e-9)
    assert exact.torques(of_joints[None])[0] == pytest.approx(of_motors, abs=1e-5) and np.abs(of_motors).max() > 1
    constant.joints(motors[None])
    assert np.abs(constant.torques(of_joints[None])[0] - of_motors).max() > 0.01


def test_linkages_carry_a_slow_crouch(robots):
    """The serial model's static torques and springs at its joints, on motors of the closed robot: it arrives within three milliradians;
    with constant ratios it is off by many times as much."""
    closed, serial = robots
    stand, period, off = serial.standing(), 4e-3, []
    at = [list(serial.q_names).index(name) for name in serial.u_names]
    way = np.zeros(serial.nu)
    for i, name in enumerate(serial.u_names):
        if "hipy" in name or "knee" in name or "ankley" in name:
            way[i] = np.sign(stand[at[i]]) * (2 if "knee" in name else 1)
    motors, seen = ([list(closed.q_names).index(name) for name in model.u_names] for model in (closed, serial))
    for constant in (False, True):
        linkages, world = Linkages(closed, serial, 1, constant), bielle.World(closed, count=1, time_step=1e-3)
        state, before = world.reset(closed.standing(), np.zeros(closed.nv)), None
        for k in range(400):
            q = stand.copy()
            q[at] += 0.1 * (1 - np.cos(np.pi * min(1, k / 300))) * way
            q[2] -= min(serial.placement(q, contact.name)[2, 3] for contact in serial.contacts)
            joints = linkages.joints(state.q[:, motors])[0]
            speeds = 0 if before is None else (joints - before) / period
            before = joints
            torques = serial.static_torques(q, [contact.name for contact in serial.contacts])
            state = world.step(linkages.torques((torques + 150 * (q[at] - joints) - 3 * speeds)[None]), period)
        off.append(np.abs(state.q[0, seen] - q[at]).max())
    assert off[0] < 3e-3 and off[1] > 5 * off[0]


def test_a_replay_is_a_result_that_is_read(begun, given, plan, tmp_path, capsys):
    """The walk that the page shows is that of the same policy, to the last bit."""
    replay.main([str(begun), "-o", str(tmp_path / "replay"), "--world", "bielle", "--impulse", "0"])
    told = capsys.readouterr().out
    record = bielle.read_result_record(str(tmp_path / "replay"))
    summary = json.loads((tmp_path / "replay" / "summary.json").read_text())
    assert summary["outcome"] in told and (tmp_path / "replay" / "report.html").stat().st_size > 1e5
    walks = Walks(plan, 1)
    conditions = walks.draw(np.random.default_rng(1), 0.0)
    walks.set(type(conditions)(np.ones_like(conditions.masses), np.ones(1), np.zeros(1), conditions.times, conditions.impulses))
    with np.load(begun / "policy.npz") as file:
        learned, last = dict(file), []
    policy = walk.Policy(plan, learned["gains"], learned["observer"])
    train.walk(walks, policy, learned["theta"][None], learned["mean"], learned["deviation"], 1, lambda k, alive, s: last.append(s["q"][0]))
    assert len(record.u) == len(last) and np.array_equal(record.q[-1], last[-1])
    assert np.abs(record.q[0] - plan.q[0]).max() < 1e-9


def test_mirrored_steps_share_what_is_learned(plan, given):
    """The same deviation, mirrored, moves the other foot as much, to the other side."""
    policy = train.load_policy(given, plan)
    left, right = (np.flatnonzero((plan.left == side) & (plan.basis[:, 0] == 1))[:1] for side in (True, False))
    nu = plan.model.nu
    policy.observer = np.zeros_like(policy.observer)
    thetas = np.random.default_rng(1).standard_normal((1, *walk.SHAPE))
    offsets = []
    for k, mirror in ((left, [1, 1, 1, 1, 1, 1]), (right, [-1, 1, -1, -1, 1, -1])):
        policy.begin(1)
        e = np.zeros((1, 2 * nu + 7))
        e[0, 2 * nu : 2 * nu + 6] = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]) * mirror
        policy.torques(k, e, policy.act(k, policy.features(k, e), thetas))
        offsets.append(policy.offsets[0].reshape(2, 6))
    assert np.allclose(offsets[0], [1, -1, 1, -1, 1, -1] * offsets[1][::-1], atol=1e-15)
    assert (offsets[0] != 0).sum() == 6 and np.abs(offsets[0]).max() > 1e-4


@pytest.mark.parametrize("options, told", [
    (["--pairs", "4"], "was begun with 2"), (["--best", "3"], "--best: expected 2 or less"),
    (["--minutes", "-1"], "--minutes: expected a positive"), (["--minutes", "nan"], "--minutes: expected a positive"),
    (["--steps", "0"], "--steps: expected 2 or more"), (["--imitated", "0"], "--imitated: expected 1 or more"),
    (["--impulse", "inf"], "--impulse: expected 0 or"), (["--seed", "-1"], "--seed: expected 0 or more"),
])  # fmt: skip
def test_wrong_arguments_are_told(begun, options, told, capsys):
    with pytest.raises(SystemExit) as ended:
        train.read_arguments([str(begun), *SMALL, *options])
    assert ended.value.code == 2 and told in capsys.readouterr().err
