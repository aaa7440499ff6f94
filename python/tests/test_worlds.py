"""Controllers, and worlds in which they act."""

import json
import time

import numpy as np
import pytest

import bielle

@pytest.fixture(scope="module")
def solution(model):
    solution = bielle.Motion.make(model, bielle.Request(motion="squat", options={"depth": 0.9})).solve()
    assert solution.converged
    return solution


@pytest.fixture(scope="module")
def controller(solution):
    return bielle.Controller.policy(solution)


def follow(world, controller, duration, period=2e-3):
    state = world.reset(*controller.reference(0))
    while state.time < duration:
        state = world.step(controller.update(float(state.time), state.q, state.v), period)
        assert state.ok
    return state


def test_policy(solution, controller, model):
    motion = solution.motion
    assert controller.duration == pytest.approx(motion.schedule.phases[0].dt * motion.num_stages)
    q, v = controller.reference(0.6)
    there = controller.update(0.6, q, v)
    assert there == pytest.approx(bielle.Controller.policy(solution, gains=False).update(0.6, q, v))
    moved = controller.update(0.6, model.integrate(q, 1e-3 * np.eye(model.nv)[2]), v)
    assert np.abs(moved - there).max() > 0.01
    with pytest.raises(ValueError, match=r"q: expected shape \(61,\), got \(3,\)".replace("61", str(model.nq))):
        controller.update(0, np.zeros(3), v)


def test_the_least_peak_torque_has_no_gains(model):
    problem = bielle.ProblemOptions(objective=bielle.ObjectiveOptions(objective=bielle.Objective.PEAK_TORQUE))
    peak = bielle.Motion.make(model, bielle.Request(motion="squat", options={"depth": 0.95}), problem)
    solution = peak.solve(bielle.SolverOptions(max_iterations=1))
    assert solution.gains == ()
    with pytest.raises(RuntimeError, match="gains=False"):
        bielle.Controller.policy(solution)


def test_squat_stands_in_the_world(controller, model):
    world = bielle.World(model)
    state = follow(world, controller, controller.duration)
    q, _ = controller.reference(controller.duration)
    assert np.abs(state.q[:3] - q[:3]).max() < 0.01
    assert world.wrenches[:, 2].sum() == pytest.approx(9.81 * model.mass, rel=0.05)


def test_a_state_that_is_none_is_refused(controller, model):
    world = bielle.World(model)
    q, v = controller.reference(0)
    for bad in (np.nan, np.inf):
        with pytest.raises(ValueError, match="finite"):
            world.reset(q + bad, v)
        with pytest.raises(ValueError, match="finite"):
            world.reset(q, v * 0 + bad)
    world.reset(q, v)


def test_torques_that_are_not_finite_break_one_world_off(model):
    """The others are what they are beside a sound one; a single world refuses them."""
    q, v, u = model.standing(), np.zeros(model.nv), np.zeros((3, model.nu))
    states = []
    for bad in (0, np.nan):
        world = bielle.World(model, count=3, threads=1)
        world.reset(q, v)
        u[1, 2] = bad
        states.append(world.step(u, 0.01))
    assert states[1].ok.tolist() == [True, False, True] and "not finite" in world.message[1] and states[1].time[1] == 0
    assert all(np.array_equal(states[0].q[i], states[1].q[i]) for i in (0, 2))
    env = bielle.VectorEnv(model, 3, lambda state, torques: 1 - 1e-3 * np.abs(torques).sum(axis=1), period=0.01)
    env.reset(seed=1)
    _, rewards, terminated, _, _ = env.step(u)
    assert terminated.tolist() == [False, True, False] and rewards.tolist() == [1, 0, 1]
    _, _, terminated, _, state = env.step(np.zeros((3, model.nu)))  # begins anew
    assert not terminated.any() and state["time"] == pytest.approx([0.02, 0, 0.02])
    single = bielle.World(model)
    single.reset(q, v)
    with pytest.raises(ValueError, match="u: expected finite"):
        single.step(u[1], 0.01)


def test_open_loops_are_told(model):
    """Where a world is reset, alone or among others; as is a world that was not reset."""
    q, v, u = model.standing(), np.zeros(model.nv), np.zeros(model.nu)
    torn = q.copy()
    torn[list(model.q_names).index("knee_right")] += 1e-3
    for options in ({}, {"tolerance": 1e-8}, {"count": 1}):
        world = bielle.World(model, **options)
        message = lambda world=world: np.ravel(world.message)[0]  # noqa: E731
        assert not world.step(u, 1e-3).ok and message() == "it has not been reset"
        state = world.reset(torn, v)
        assert not state.ok and message().startswith("its loops are open by ")
        assert not world.step(u, 1e-3).ok and np.array_equal(np.ravel(state.q), torn)
        assert world.reset(q, v).ok and world.step(u, 1e-3).ok


def test_worlds_stand_on_grounds_of_their_own_and_stay_when_they_are_left_out(model):
    high, low = (bielle.Ground(steps=[bielle.GroundStep(top=[0, 0, z], length=4, width=4)]) for z in (0.01, 0))
    world = bielle.World(model, count=9, time_step=1e-3, ground=low, threads=1)
    world.set(grounds=[high, low] * 4 + [high])
    q = np.tile(model.standing(), (9, 1))
    q[:, 2] += np.where(np.arange(9) % 2 == 0, 0.01, 0)
    world.reset(q, np.zeros((9, model.nv)))
    for _ in range(20):
        state = world.step(np.zeros(model.nu), 1e-3, where=np.arange(9) != 4)
    assert state.time[4] == 0 and np.array_equal(state.q[4], q[4]) and state.time[3] == pytest.approx(0.02)
    assert state.q[0, 2] - state.q[1, 2] == pytest.approx(0.01, abs=1e-6)
    for grounds, told in (([low], "there are 1 grounds"), (bielle.Ground(), "a ground has no steps")):
        with pytest.raises(ValueError, match=told):
            world.set(grounds=grounds)


def test_what_happens_in_a_world_is_a_result(model, tmp_path):
    """Of one robot of many, in Bielle's world and in MuJoCo's: what was recorded is read again, and shown."""
    robot = bielle.load_robot("bipetto")
    for engine in ("bielle", "mujoco"):
        world = bielle.World(model, count=2, engine=engine)
        recorder = bielle.Recorder(world, 1)
        q, u = np.tile(model.standing(), (2, 1)), np.ones((2, model.nu))
        recorder.reset(world.reset(q, np.zeros((2, model.nv))))
        for _ in range(5):
            state = world.step(u, 0.004)
            recorder.add(state, u)
        paths = recorder.write(tmp_path / engine, robot, outcome="stood", ground=bielle.Ground())
        record = bielle.read_result_record(str(tmp_path / engine))
        assert np.array_equal(record.q[-1], state.q[1]) and record.u.shape == (5, model.nu) and (record.u == 1).all()
        assert record.time == pytest.approx(0.004 * np.arange(6)) and record.gap.max() < 1e-3
        assert np.array_equal(record.contact_wrenches[-1], world.wrenches[1].ravel()) and record.contact_wrenches[-1, 2] > 10
        summary = json.loads((tmp_path / engine / "summary.json").read_text())
        assert summary["world"] == engine and summary["outcome"] == "stood" and len(paths) == 3
        assert "motor_knee_left" in bielle.make_report([str(tmp_path / engine)])
    with pytest.raises(ValueError, match="which: expected a robot of 2, got 2"):
        bielle.Recorder(world, 2)
    with pytest.raises(ValueError, match="torques: expected shape"):
        recorder.add(state, u[0])
    with pytest.raises(ValueError, match="v is 6 x 3; give"):
        bielle.write_happened(str(tmp_path / "bad"), robot, record.time, record.q, record.v[:, :3], record.u)


def test_a_robot_without_torques_falls(controller, model):
    world = bielle.World(model)
    state = world.reset(*controller.reference(0))
    start = state.q[2]
    for _ in range(100):
        state = world.step(np.zeros(model.nu), 0.01)
    assert state.q[2] < 0.7 * start


def test_many_worlds_do_not_disturb_each_other_and_are_single_ones(controller, model):
    q, v = controller.reference(0)
    torques = controller.update(0, q, v) * np.array([[0.0], [0.9], [1.0], [1.1], [1.2]])
    push = np.array([0, 5.0, 0])
    many, first, one = bielle.World(model, count=5), bielle.World(model, count=1), bielle.World(model)
    assert many.reset(q, v).q.shape == (5, model.nq)
    for _ in range(20):
        together = many.step(torques, 0.005, push)
    assert many.wrenches.shape == (5, len(model.contacts), 6)
    for i in range(5):
        for world in (first, one):
            world.reset(q, v)
            for _ in range(20):
                alone = world.step(torques[i], 0.005, push)
            exact = world is first  # several are computed at once
            assert np.allclose(alone.q, together.q[i], rtol=0, atol=0 if exact else 1e-8)
            assert np.allclose(alone.v, together.v[i], rtol=0, atol=0 if exact else 1e-6)
            assert np.allclose(world.wrenches, many.wrenches[i], rtol=0, atol=0 if exact else 1e-4)


def test_a_world_that_breaks_off_says_why_and_leaves_the_others(model):
    world = bielle.World(model, count=3)
    world.reset(model.standing(), np.zeros(model.nv))
    push = np.zeros((3, 3))
    push[1, 0] = 1e13
    state = world.step(np.zeros(model.nu), 0.01, push)
    assert list(state.ok) == [True, False, True] and world.message[0] == world.message[2] == ""
    assert world.message[1].startswith("after ") and np.isfinite(state.q).all()
    assert np.array_equal(state.q[0], state.q[2])
    state = world.reset(model.standing(), np.zeros(model.nv), where=~state.ok)
    assert state.ok.all() and world.message == ["", "", ""]


def test_some_worlds_start_anew():
    model = bielle.load_robot("fivebar_leg").model
    q, v = model.standing(), np.zeros(model.nv)
    world = bielle.World(model, count=3)
    world.reset(q, v)
    before = world.step(np.zeros(model.nu), 0.05)
    after = world.reset(q, v, where=[False, True, False])
    assert np.array_equal(after.q[1], q) and after.time[1] == 0 and not np.array_equal(before.q[1], q)
    for i in (0, 2):
        assert np.array_equal(after.q[i], before.q[i]) and after.time[i] == before.time[i]
    with pytest.raises(ValueError, match=r"where: expected shape \(3,\), got \(2,\)"):
        world.reset(q, v, where=[True, False])


def test_wrong_arguments_are_refused_and_nothing_is_stepped(model):
    world = bielle.World(model, count=2)
    q, v, u = model.standing(), np.zeros(model.nv), np.zeros(model.nu)
    before = world.reset(q, v)
    nan, three = np.full(model.nu, np.nan), (3, model.nu)
    for arguments, told in [
        ((np.zeros(three), 0.01), rf"u: expected shape \(2, {model.nu}\), got \(3, {model.nu}\)"),
        ((u, -1), "duration"), ((u, np.nan), "duration"),
        ((u, 0.01, np.zeros((2, 2))), r"push: expected shape \(2, 3\)"), ((u, 0.01, [0, 0, 0], [True]), "where: expected shape"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=told):
            world.step(*arguments)
    for arguments, told in [
        ((q[:3], v), "q: expected shape"), ((q, v + np.nan), "v: expected finite"), ((q, v, [True]), "where: expected shape"),
        ((q, v, [0, np.nan]), "where: expected True or False"), ((q, v, [0, 2]), "where: expected True or False"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=told):
            world.reset(*arguments)
    for arguments, told in [
        ({"mass_factors": [1]}, "mass_factors: expected shape"), ({"friction": [0.5, -1]}, "friction of world 1 has a -1"),
        ({"delays": np.nan}, "delays of world 0 has a nan"), ({"effort_limits": nan}, "effort_limits: expected finite"),
        ({"friction": [1, 1, 1]}, r"friction: expected shape \(2,\)"), ({"armatures": -u - 1}, "armatures of world 0 has a -1"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=told):
            world.set(**arguments)
    after = world.reset(q, v, where=[False, False])
    assert all(np.array_equal(a, b) for a, b in zip(before, after)) and (world.parameters.friction == bielle.Ground().friction).all()
    for arguments, told in [({"count": 0}, "count: at least one"), ({"count": -3}, "count: at least one"),
                            ({"time_step": -1.0}, "time_step"), ({"tolerance": np.nan}, "tolerance"), ({"threads": -1}, "threads")]:
        with pytest.raises(ValueError, match=told):
            bielle.World(model, **arguments)


def test_parameters_of_worlds(model):
    """A robot of half the weight drops as fast, stands on half the force, slides without friction, and hears late."""
    world = bielle.World(model, count=3, threads=2)
    world.set(mass_factors=np.array([[1.0], [0.5], [1.0]]) * np.ones(len(model.bodies)), friction=[0.7, 0.7, 0.0])
    q, u = model.standing(), np.zeros(model.nu)
    world.reset(q, np.zeros(model.nv))
    for _ in range(40):
        state = world.step(u, 2e-3)
    push = world.wrenches[:, :, 2].sum(axis=1)
    assert state.ok.all() and push[1] == pytest.approx(0.5 * push[0], rel=0.2)
    assert np.abs(world.wrenches[2, :, :2]).max() < 1e-2 and np.abs(world.wrenches[:2, :, :2]).max() > 0.1
    now = world.parameters
    assert now.mass_factors[1, 3] == 0.5 and list(now.friction) == [0.7, 0.7, 0.0] and (now.delays == 0).all()
    assert np.array_equal(now.effort_limits[2], [motor.effort_limit for motor in model.motors])
    world.set(mass_factors=np.ones(len(model.bodies)), friction=0.7, delays=[0, 0.004, 0.004])
    world.reset(q, np.zeros(model.nv))
    for k in range(3):
        state = world.step(u + 3.0 * (k > 0), 2e-3)
        assert np.array_equal(state.q[0], state.q[1]) == (k == 0) and np.array_equal(state.q[1], state.q[2])
    for other in (bielle.World(model), bielle.World(model, count=2, tolerance=1e-6)):
        with pytest.raises(ValueError, match="made with `count`"):
            other.set(friction=1)


def test_windings_and_rods_of_worlds(model):
    """A motor at rest gives e n k U / R, one of a strong supply what its current allows; rods change what a posture is closed at."""
    world = bielle.World(model, count=3)
    sensors, q, v = bielle.Sensors(world, noise=0.0), model.standing(), np.zeros(model.nv)
    with pytest.raises(ValueError, match="give torque_constants"):
        world.set(voltages=24 * np.ones(model.nu))
    world.set(torque_constants=0.1 * np.ones(model.nu), resistances=0.5 * np.ones(model.nu),
              voltages=np.array([[np.inf], [5.0], [1000.0]]) * np.ones(model.nu), currents=np.array([[np.inf], [np.inf], [30.0]]) * np.ones(model.nu))
    world.reset(q, v)
    sensors.reset(0)
    world.step(np.full(model.nu, 4.0), 1e-3)
    torques, drives = sensors.read().motor_torques, [motor.drive for motor in model.motors]
    gears = np.array([drive.efficiency * drive.ratio * 0.1 for drive in drives])
    assert (torques[0] == 4).all() and torques[1] == pytest.approx(gears * 5 / 0.5) and torques[2] == pytest.approx(gears * 30)

    rods = np.zeros((3, len(model.closures)))
    rods[1] = 1e-3
    before = world.reset(q, v)
    world.set(rod_changes=rods)
    assert list(world.step(np.zeros(model.nu), 1e-3).ok) == [True, False, True] and "rods" in world.message[1]
    after = world.reset(q, v)
    assert after.ok.all() and np.array_equal(after.q[::2], before.q[::2]) and 1e-3 < np.abs(after.q[1] - before.q[1]).max() < 0.1
    assert np.array_equal(world.parameters.rod_changes, rods) and (world.parameters.voltages[1] == 5).all()
    with pytest.raises(ValueError, match="rod_changes: expected shape"):
        world.set(rod_changes=[1e-3])


def test_steps_that_cannot_be_met_are_told(model):
    world = bielle.World(model, time_step=0.001)
    world.reset(model.standing(), np.zeros(model.nv))
    with pytest.warns(RuntimeWarning, match="time_step: 0.001 s is longer than a step of 0.0005 s"):
        world.step(np.zeros(model.nu), 0.0005)
    integration = world.integration
    assert integration["integrator"] == "leapfrog" and integration["longest_step"] == pytest.approx(0.0005)
    assert integration["tolerance"] == 0 and world.warnings == []
    engines = pytest.importorskip("bielle._engines")
    if "mujoco" in engines.names:
        with pytest.raises(ValueError, match="tolerance of world 'mujoco'"):
            bielle.World(model, engine="mujoco", tolerance=1e-6)


@pytest.mark.parametrize("own_thread", [False, True])
def test_predictive_control(solution, model, own_thread):
    options = bielle.PredictiveOptions(nodes=20, own_thread=own_thread)
    plan = bielle.Motion.plan(model, solution.motion.request)
    controller = bielle.Controller.predictive(model, plan, solution.trajectory, options=options)
    reference = bielle.Controller.policy(solution)
    world = bielle.World(model)
    state = world.reset(*reference.reference(0))
    for _ in range(100):
        state = world.step(controller.update(float(state.time), state.q, state.v), 2e-3)
    assert state.ok and controller.counts["failed"] == 0
    assert controller.footholds == []  # a squat lifts no foot
    assert np.abs(state.q[:3] - reference.reference(0.2)[0][:3]).max() < 0.01
    # In a thread of its own it solves while this world, which waits for nobody, goes on: on a busy machine it may still be at
    # the first problem now.
    deadline = time.monotonic() + 60
    while own_thread and controller.counts["solves"] == 0 and time.monotonic() < deadline:
        time.sleep(0.01)
        controller.update(float(state.time), state.q, state.v)
    assert controller.counts["solves"] > (0 if own_thread else 5)


@pytest.mark.long
@pytest.mark.parametrize("engine", ["simbody", "mujoco"])
def test_squat_stands_in_other_engines(controller, model, engine):
    engines = pytest.importorskip("bielle._engines")
    if engine not in engines.names:
        pytest.skip(f"built without {engine}")
    world = bielle.World(model, engine=engine)
    assert world.engine == engine
    state = follow(world, controller, 0.5 * controller.duration)
    q, _ = controller.reference(0.5 * controller.duration)
    assert np.abs(state.q[:3] - q[:3]).max() < 0.02
    assert world.wrenches[:, 2].sum() == pytest.approx(9.81 * model.mass, rel=0.3)


def test_engines_have_names(model):
    with pytest.raises(bielle.InputError, match="nowhere"):
        bielle.World(model, engine="nowhere")


def estimate(controller, model, noise, duration):
    """The largest errors of height and velocity of the trunk, as a squat is followed by what the sensors tell."""
    world = bielle.World(model)
    estimator = bielle.Estimator(model, model.standing())
    sensors = bielle.Sensors(world, noise=noise)
    feet = [contact.name for contact in model.contacts]
    state = world.reset(*controller.reference(0))
    sensors.reset(0)
    estimator.reset(0, state.q, state.v, feet)
    errors, torques = [], controller.update(0, state.q, state.v)
    while state.time < duration:
        state = world.step(torques, 2e-3)
        assert estimator.update(sensors.read(), feet) == bielle.NumericalStatus.OK
        torques = controller.update(float(state.time), estimator.q, estimator.v)
        errors.append([abs(estimator.q[2] - state.q[2]), np.abs(estimator.v[:3] - state.v[:3]).max()])
    assert estimator.contacts == {name: True for name in feet}
    assert estimator.wrenches[:, 2].sum() == pytest.approx(9.81 * model.mass, rel=0.3)
    return np.max(errors, axis=0)


def test_estimator(controller, model):
    exact, real = (estimate(controller, model, noise, 0.4) for noise in (0, 1))
    assert exact[0] < 1e-3 and exact[1] < 0.03
    assert real[0] < 5e-3 and real[1] < 0.1 and real[0] > exact[0]


def test_sensors_need_a_start(model):
    for world in (bielle.World(model), bielle.World(model, count=2)):
        with pytest.raises(RuntimeError, match="reset"):
            bielle.Sensors(world).read()


def test_sensors_of_many_worlds_are_those_of_single_ones(model):
    many, q, v = bielle.World(model, count=3), model.standing(), np.zeros(model.nv)
    torques = np.arange(3)[:, None] * np.linspace(1, 9, model.nu)
    many.reset(q, v)
    for noise, near in ((0, 1e-6), (1, 1e-3)):
        sensors = bielle.Sensors(many, noise=noise, seed=5)
        many.reset(q, v)
        sensors.reset(0)
        for _ in range(3):
            many.step(torques, 2e-3)
            readings = sensors.read()
        for i in range(3):
            world = bielle.World(model)
            world.reset(q, v)
            own = bielle.Sensors(world, noise=noise, seed=5 + i)
            own.reset(0)
            for _ in range(3):
                world.step(torques[i], 2e-3)
                reading = own.read()
            for name in ("time", "motor_positions", "motor_torques", "angular_velocity", "specific_force"):
                assert getattr(readings, name)[i] == pytest.approx(getattr(reading, name), abs=near), name
    before = sensors.read()
    many.reset(q, v, where=[0, 1, 0])
    sensors.reset(0, [0, 1, 0])
    after = sensors.read()
    assert after.time[1] == 0 and not np.array_equal(after.angular_velocity[1], before.angular_velocity[1])
    assert np.array_equal(after.specific_force[[0, 2]], before.specific_force[[0, 2]])


def learn(model, num_envs, steps=12, seed=4, **options):
    """Observations, rewards and ends of limp robots, some of which have fallen before their episodes are over."""
    env = bielle.VectorEnv(model, num_envs, lambda state, torques: state.q[:, 2] - 1e-3 * (torques**2).sum(axis=1),
                           lambda state: state.v[:, 2] < -0.45, duration=0.05, **options)  # fmt: skip
    first, _ = env.reset(seed=seed)
    out = [env.step(np.full((num_envs, model.nu), 0.1 * k)) for k in range(steps)]
    return env, np.array([first] + [step[0] for step in out]), *(np.array([step[k] for step in out]) for k in (1, 2, 3, 4))


def test_vector_env_keeps_the_conventions(model):
    env, observations, rewards, terminations, truncations, infos = learn(model, 5)
    assert env.num_envs == 5 and env.metadata["autoreset_mode"] == "NextStep"
    assert env.single_observation_space.shape == (3 * model.nu + 6,) and env.action_space.shape == (5, model.nu)
    assert env.single_action_space.high[0] == model.motors[0].effort_limit and env.action_space.contains(env.action_space.sample())
    assert observations.shape == (13, *env.observation_space.shape) and rewards.shape == truncations.shape == (12, 5)
    over = terminations | truncations
    assert truncations.any() and terminations.any() and not (terminations & truncations).any()
    for k, i in np.argwhere(over[:-1]):  # the next step starts anew
        assert rewards[k + 1, i] == 0 and infos[k + 1]["time"][i] == 0 and not over[k + 1, i]
        assert (observations[k + 2, i, model.nu : 3 * model.nu] == 0).all()
    going = np.argwhere(~over[:-1])
    assert all(infos[k + 1]["time"][i] == pytest.approx(infos[k]["time"][i] + 0.01) for k, i in going)
    assert all(np.isfinite(observations).ravel()) and (rewards[~np.roll(over, 1, axis=0)][5:] != 0).all()
    position = infos[-1]["q"][:, list(model.q_names).index(model.u_names[3])]
    assert observations[-1, :, 3] == pytest.approx(position, abs=2e-4)  # of 14 bits
    assert (observations[-1, :, 3] != position).all()
    with pytest.raises(ValueError, match="actions: expected shape"):
        env.step(np.zeros((5, 3)))
    state = env.reset(options={"reset_mask": [True, False, False, False, False]})[1]
    assert state["time"][0] == 0 and np.array_equal(state["time"][1:], infos[-1]["time"][1:])


def test_episodes_of_a_robot_depend_on_its_seed_alone(model):
    _, first, rewards, *_ = learn(model, 3, threads=1)
    for other in (learn(model, 3, threads=1), learn(model, 11, threads=2)):
        assert np.array_equal(other[1][:, :3], first) and np.array_equal(other[2][:, :3], rewards)
    assert not np.array_equal(learn(model, 3, seed=5)[1], first) and not np.array_equal(first[:, 0], first[:, 1])


def test_vector_env_makes_torques_of_targets(model):
    """Springs and dampers at 1 ms about targets, of which one action in 10 ms tells; the robot stays where it is told to."""
    stand, at = model.standing(), [list(model.q_names).index(name) for name in model.u_names]
    space = bielle.vector_env.Box(np.full(model.nu, -3.0), np.full(model.nu, 3.0))
    start = lambda generator: (stand, np.zeros(model.nv))
    calls = []

    def track(actions, readings):
        calls.append(readings.time[0])
        return 300 * (actions - readings.motor_positions)

    env = bielle.VectorEnv(model, 2, lambda state, torques: -np.abs(torques).max(axis=1), torques=track, action_space=space,
                           start=start, period=1e-3, repeat=10, noise=0)  # fmt: skip
    env.reset()
    _, rewards, *_, state = env.step(np.tile(stand[at], (2, 1)))
    assert calls == pytest.approx(1e-3 * np.arange(10), abs=1e-9) and state["time"][0] == pytest.approx(0.01)
    assert (rewards < 0).all() and np.abs(state["q"][:, at] - stand[at]).max() < 0.05


@pytest.mark.parametrize("engine", ["bielle", "mujoco"])
def test_vector_env_pushes_in_any_world(model, engine):
    """Each period of a push gives the momentum that its force says, to that robot alone."""
    if engine == "mujoco":
        pytest.importorskip("bielle._engines")
    start = model.standing()
    start[2] += 0.3  # in the air
    push = lambda state: np.where(state.time < 0.0199, 1, 0)[:, None] * [[0, 50, 0], [0, 0, 0]]
    env = bielle.VectorEnv(model, 2, lambda state, torques: state.v[:, 0], start=lambda generator: (start, np.zeros(model.nv)), push=push,
                           engine=engine)  # fmt: skip
    env.reset(seed=1)
    for k in range(3):
        *_, state = env.step(np.zeros((2, model.nu)))
        momentum = model.mass * model.com_velocity(state["q"], state["v"])
        assert momentum[:, 1] == pytest.approx([0.5 * min(k + 1, 2), 0], abs=5e-3)
    assert momentum[:, 2] == pytest.approx(-9.81 * model.mass * 0.03, rel=0.01)


def test_start_states_are_closed_and_stand_on_the_ground(model):
    starts, generator = bielle.StartStates(model, spread=0.2, speed=0.5, height=0.1), np.random.default_rng(1)
    for _ in range(5):
        q, v = starts.draw(generator)
        assert np.abs(model.closure_residual(q)).max() < 1e-9 and 0.02 < np.abs(q - starts.q).max() < 1
        assert np.abs(model.closure_jacobian(q) @ v).max() < 1e-9 and np.abs(v).max() > 0.1
        corners = [(model.placement(q, c.name) @ [x * c.half_length, y * c.half_width, 0, 1])[2]
                   for c in model.contacts for x in (-1, 1) for y in (-1, 1)]  # fmt: skip
        assert min(corners) == pytest.approx(0.1, abs=1e-12)


def test_simulate(solution, robot, tmp_path):
    result = bielle.make_result(solution, robot)
    summary = bielle.simulate(result, world="bielle", control="gains")
    assert not summary["fell"] and summary["duration"] >= 1
    kept = bielle.simulate(result, tmp_path / "out", world="bielle", control="gains", no_report=True)
    assert (tmp_path / "out" / "trajectory.npz").is_file() and kept["fell"] is False
    with pytest.raises(RuntimeError, match="nowhere"):
        bielle.simulate(result, world="nowhere")


def test_mechanism_in_motion():
    """A four-bar swings in steps of controlled error and keeps its energy; a coarser tolerance keeps it less well."""
    model = bielle.load_robot("fourbar").model
    drifts = []
    for tolerance in (1e-4, 1e-10):
        world = bielle.World(model, tolerance=tolerance)
        world.reset(model.posture("crank_at_60_degrees"), np.zeros(model.nv))
        start = world.books
        state = world.step([0], 2.0)
        assert state.ok and not world.message
        end = world.books
        assert end.kinetic > 0 and isinstance(end.kinetic, float)
        drifts.append(abs(end.kinetic + end.potential - start.kinetic - start.potential))
    assert drifts[1] < 1e-7 < drifts[0]
    with pytest.raises(ValueError):
        bielle.World(model, count=2, tolerance=1e-6).books


def test_free_motion_in_two_worlds(tmp_path):
    pytest.importorskip("bielle._engines")
    summaries = bielle.simulate("fourbar", tmp_path, world="bielle,simbody", duration=0.2, no_report=True)
    assert [summary["outcome"] for summary in summaries.values()] == ["ended", "ended"]
    assert summaries["bielle"]["largest_gap"] < 1e-12


def test_rewards_and_terminations_are_one_for_each_robot():
    model = bielle.load_robot("fourbar").model
    start = lambda generator: (model.standing(), np.zeros(model.nv))  # noqa: E731
    for wrong, name in (({"reward": lambda state, torques: np.zeros(3)}, "reward"),
                        ({"termination": lambda state: np.zeros(1, dtype=bool)}, "termination")):
        env = bielle.VectorEnv(model, 2, **{"reward": lambda state, torques: 1.0, "start": start, **wrong})
        env.reset(seed=1)
        with pytest.raises(ValueError, match=f"{name}: expected shape \\(2,\\)"):
            env.step(np.zeros((2, model.nu)))
    env = bielle.VectorEnv(model, 2, lambda state, torques: 1.0, start=start)
    env.reset(seed=1)
    assert (env.step(np.zeros((2, model.nu)))[1] == [1, 1]).all()
    with pytest.raises(ValueError, match="period"):
        bielle.VectorEnv(model, 2, lambda state, torques: 1.0, period=-0.01)


def test_worlds_have_play(model):
    q, v = model.standing(), np.zeros(model.nv)
    joint = model.joints[model.motors[0].joint]
    for world in (bielle.World(model, play={joint.name: 0.02}), bielle.World(model, count=2, play={joint.name: 0.02})):
        sensors = bielle.Sensors(world, noise=0)
        world.reset(q, v)
        sensors.reset(0.0)
        torques = np.zeros((model.nu,) if world.count is None else (world.count, model.nu))
        torques[..., 0] = 10
        for _ in range(20):
            state = world.step(torques, 1e-3)
        ahead = np.ravel(sensors.read().motor_positions)[0] - np.ravel(state.q)[joint.idx_q]
        assert ahead == pytest.approx(0.01, rel=0.2)
    with pytest.raises(ValueError, match="without play"):
        world.set(friction=0.5)
    for wrong in ({"nowhere": 1e-3}, {joint.name: -1}):
        with pytest.raises(ValueError, match="play of"):
            bielle.World(model, play=wrong)
    with pytest.raises(TypeError):
        bielle.World(model, play=3)


def test_worlds_have_friction_of_rods(model):
    closure = model.closures[0]
    rods = [bielle.RodFriction(closure=closure.name, coefficient=0.2, radius=0.01, joints=[model.joints[closure.body1].name])]
    robot = bielle.Robot(name="rubbing", model=model, rod_frictions=rods)
    assert robot.rod_frictions[0] == rods[0]
    q, v = model.standing(), np.zeros(model.nv)
    free, one, many = bielle.World(model), bielle.World(model, rod_frictions=rods), bielle.World(model, count=2, rod_frictions=rods)
    for world in (free, one, many):
        world.reset(q, v)
    for _ in range(20):
        smooth, rubbed, both = (w.step(np.zeros(model.nu), 1e-3) for w in (free, one, many))
    assert one.books.other_loss > 0
    assert free.books.other_loss == pytest.approx(0, abs=1e-12)
    assert np.abs(rubbed.v - smooth.v).max() > 1e-4
    assert np.abs(both.v - rubbed.v).max() < 1e-6
    with pytest.raises(ValueError, match="there is no such closure"):
        bielle.World(model, rod_frictions=[rods[0].replace(closure="nowhere")])
