"""Motions by name: the same as the command makes them; callbacks, signals, warm starts."""

import os
import pickle
import signal
import subprocess
import threading
import time

import numpy as np
import pytest

import bielle


@pytest.fixture(scope="module")
def squat(robot):
    return bielle.solve_squat(robot, depth=0.8)


def test_files_are_those_of_the_command(robot, squat, tmp_path):
    command = os.environ.get("BIELLE_COMMAND")
    if not command:
        pytest.skip("BIELLE_COMMAND does not name the command")
    subprocess.run([command, "solve", "squat", "--robot", "bipetto", "--depth", "0.8", "--no-check", "--no-report",
                    "--quiet", "-o", str(tmp_path / "command")], check=True, stdout=subprocess.DEVNULL)
    squat.write(str(tmp_path / "python"))
    for name in ("trajectory.csv", "trajectory.npz"):
        first, second = ((tmp_path / place / name).read_bytes() for place in ("command", "python"))
        assert first == second, name


def test_result(squat, model):
    assert squat.converged and squat.solver.termination == bielle.Termination.CONVERGED
    assert squat.options["depth"] == 0.8
    goal = squat.goals[0]
    assert goal.met and goal.goal.requested == 0.8 and abs(goal.achieved - 0.8) < 0.01
    record = squat.record
    assert record.q.shape == (record.time.size, model.nq) and record.q.base is not None
    assert record.com == pytest.approx(model.com(record.q), abs=1e-9)
    assert max(squat.peak_torques.values()) == np.abs(record.u).max()
    twin = pickle.loads(pickle.dumps(squat))
    assert twin == squat and twin.record.u.tobytes() == record.u.tobytes()


def test_options_are_those_of_the_registry(robot):
    assert set(bielle.motions()) >= {"squat", "walk", "side-walk", "turn", "stairs", "jump", "run", "hop"}
    for name, motion in bielle.motions().items():
        assert motion["help"].split()[0] in getattr(bielle, "solve_" + name.replace("-", "_")).__doc__
    with pytest.raises(TypeError, match="solve_squat has no option 'deep'; it has: depth, "):
        bielle.solve_squat(robot, deep=0.7)
    with pytest.raises(bielle.InputError) as caught:
        bielle.solve_squat(robot, depth=-1)
    assert "depth" in caught.value.element
    with pytest.raises(bielle.InputError, match="option 'foot': 'middle' is not one of its choices; .*left, right"):
        bielle.solve_hop(robot, foot="middle")
    with pytest.raises(bielle.InputError, match="option 'steps': '2.5' is not a whole number"):
        bielle.solve_walk(robot, steps=2.5)
    with pytest.raises(bielle.InputError, match="option 'rigid_landing': .*true or false"):
        bielle.solve_walk(robot, rigid_landing=1)
    defaults = {name: option["default"] for name, option in bielle.motions()["hop"]["options"].items()}
    assert defaults["foot"] == "left" and defaults["hops"] == 1 and defaults["rigid_landing"] is False


def test_threads_do_not_matter(robot, squat):
    alone = bielle.solve_squat(robot, depth=0.8, solver=bielle.SolverOptions(threads=1))
    assert alone.record == squat.record


def test_warm_start(robot, squat, tmp_path):
    squat.write(str(tmp_path))
    for start in (squat, squat.record, str(tmp_path)):
        again = bielle.solve_squat(robot, depth=0.8, warm_start=start)
        assert again.converged and again.solver.iterations < squat.solver.iterations


def test_callback(robot):
    seen = []
    stopped = bielle.solve_squat(robot, depth=0.8, callback=lambda i: seen.append(i) or len(seen) < 3)
    assert [i.iteration for i in seen] == [1, 2, 3]
    assert stopped.interrupted and seen[2].cost > 0


def test_exceptions_of_a_callback_come_out_as_themselves(robot):
    class OwnError(Exception):
        pass

    error = OwnError("enough")

    def fail(iteration):
        raise error

    with pytest.raises(OwnError) as caught:
        bielle.solve_squat(robot, callback=fail)
    assert caught.value is error


def test_interrupt_leaves_the_motion_as_it_is(model):
    motion = bielle.Motion.make(model, bielle.Request(motion="squat"))
    guess = motion.guess

    def press(iteration):
        if iteration.iteration == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        motion.solve(callback=press)
    assert motion.guess == guess
    stopped = motion.solve(callback=lambda iteration: iteration.iteration < 2)
    assert not stopped.converged and stopped.trajectory != guess
    again = motion.solve(warm_start=stopped)
    assert again.converged and len(again.gains) == motion.num_stages and again.gains[0].K.shape[0] == model.nu
    high = bielle.Motion.make(model, bielle.Request(motion="squat", options={"depth": 0.8}))  # which keeps away from dead points
    assert high.solve(warm_start=bielle.solve_squat(bielle.load_robot("bipetto"), depth=0.8).record).summary.iterations < 5


def test_gains_are_those_of_the_last_sweep(model):
    motion = bielle.Motion.make(model, bielle.Request(motion="squat"))
    solution = motion.solve()
    assert solution.converged and len(solution.gains) == motion.num_stages
    for gains, x, u in zip(solution.gains, solution.trajectory.xs, solution.trajectory.us):
        assert gains.k.shape == u.shape and gains.K.shape[0] == len(u) and 0 < gains.K.shape[1] < len(x)
        assert np.abs(gains.k).max() < 1e-3 * np.abs(u).max()
    assert np.abs(solution.gains[0].K).max() > 1


def test_other_threads_run_during_a_solve(robot):
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        before = len(ticks)
        bielle.solve_walk(robot, speed=0.3, steps=4)
        assert len(ticks) - before > 20
    finally:
        done.set()
        thread.join()


def test_sequence(robot):
    result = bielle.solve_sequence(robot, ["squat", "squat"], {"squat.depth": 0.9, "squat2.depth": 0.85})
    assert result.converged and result.options["squat2.depth"] == 0.85


def test_objective_and_limits(robot, squat):
    problem = bielle.ProblemOptions(objective=bielle.ObjectiveOptions(objective=bielle.Objective.ENERGY))
    frugal = bielle.solve_squat(robot, depth=0.8, problem=problem)
    assert frugal.converged and frugal.energy.total < squat.energy.total
    motor, peak = next(iter(squat.peak_torques.items()))
    limits = bielle.LimitOptions(efforts={motor: 0.9 * peak})
    limited = bielle.solve_squat(robot, depth=0.8, problem=bielle.ProblemOptions(limits=limits))
    assert limited.converged and limited.peak_torques[motor] <= 0.9 * peak * (1 + 1e-9)


def test_motions_pickle(model):
    motion = bielle.Motion.make(model, bielle.Request(motion="squat", options={"depth": 0.9}))
    twin = pickle.loads(pickle.dumps(motion))
    assert twin.guess == motion.guess
    solution = motion.solve()
    assert solution.converged and solution.trajectory == twin.solve().trajectory
    again = pickle.loads(pickle.dumps(solution))
    assert again.trajectory == solution.trajectory and again.gains == solution.gains
    assert again.summary == solution.summary and again.multipliers == solution.multipliers


@pytest.mark.long
def test_a_motion_is_made_again_where_its_stages_are_too_long(model):
    options = {"speed": 0.4, "single_support": 0.25, "swing_height": 0.14, "steps": 2}
    motion = bielle.Motion.make(model, bielle.Request(motion="walk", options=options))
    solution = motion.solve()
    assert solution.converged and solution.motion.num_stages > 1.9 * motion.num_stages
    assert solution.motion.options["time_step"] == 0.006 and motion.options["time_step"] == 0
    assert motion.solve(refine=False).motion is motion


def make_hopper():
    """A leg of two links on a vertical rail, made from nothing; the posture in which its foot is at the origin."""
    builder = bielle.ModelBuilder("hopper")
    rail = bielle.Joint(name="rail", kind=bielle.JointKind.PRISMATIC, axis=[0, 0, 1])
    builder.add_link("hip", "world", rail, bielle.Inertia(mass=1, I_com=1e-3 * np.eye(3)))
    for link, parent, joint, z in (("thigh", "hip", "hip_pitch", 0), ("shin", "thigh", "knee", -0.2)):
        pivot = bielle.Joint(name=joint, kind=bielle.JointKind.REVOLUTE, axis=[0, 1, 0], X_PJ=bielle.SE3(p=[0, 0, z]))
        builder.add_link(link, parent, pivot, bielle.Inertia(mass=0.2, com=[0, 0, -0.1], I_com=1e-3 * np.eye(3)))
        builder.add_motor(joint, armature=1e-3)
    builder.add_frame("foot", "shin", bielle.SE3(p=[0, 0, -0.2]))
    builder.add_contact("foot", "foot", bielle.ContactKind.POINT_3D)
    model = builder.build()
    q = np.array([0, 0.5, -1.0])
    q[0] = -model.placement(q, "foot")[2, 3]
    return model, q


def make_hop(model, q, height, timing):
    """A push-off and a flight, at whose end the centre of mass is at a height."""
    foot = bielle.SE3(p=model.placement(q, "foot")[:3, 3])
    common = dict(
        dt=0.02,
        state=bielle.StateCost(weight=1e-2, q_ref=q, v_ref=np.zeros(3), weights=np.ones(6)),
        control=bielle.ControlCost(weight=1e-2, reference=np.zeros(2), weights=np.ones(2)),
    )
    push = bielle.Stage(constraints=model.constraints([bielle.ContactTarget(X_WT=foot)]), timing=timing, **common)
    flight = bielle.Stage(constraints=model.constraints(), **common)
    x, y = model.com(q)[:2]
    apex = bielle.residuals.com_position([x, y, height])
    end = flight.replace(costs=[bielle.Cost("apex", 1e3, bielle.Activation.quadratic([0, 0, 1]), apex)])
    guess = bielle.Trajectory(xs=[np.r_[q, 0, 0, 0]] * 24, us=[model.static_torques(q, ["foot"])] * 23)
    return bielle.MotionPlan(name="hop", stages=[push] * 15 + [flight] * 8 + [end], guess=guess, q_start=q, q_end=q)


@pytest.mark.parametrize("timing", [bielle.FreeTiming(), bielle.FreeTiming(phase=0, lower=0.5, upper=2)])
def test_a_problem_made_from_nothing(timing, tmp_path):
    model, q = make_hopper()
    motion = bielle.Motion(model, make_hop(model, q, 0.55, timing))
    solution = motion.solve()
    assert solution.converged
    assert model.com(solution.trajectory.xs[-1][:3])[2] == pytest.approx(0.55, abs=0.01)
    assert [(phase.nodes, len(phase.contacts)) for phase in motion.schedule.phases] == [(15, 1), (8, 0)]
    assert "<iframe" in solution._repr_html_()
    bielle.Robot(name="hopper", model=model).write(str(tmp_path / "hopper"))
    result = bielle.make_result(solution, bielle.load_robot(str(tmp_path / "hopper")))
    assert result.converged and (result.schedule.phases[0].dt != 0.02) == (timing.phase >= 0)
    assert np.abs(result.record.contact_wrenches[15:]).max() == 0
    forces = np.linalg.norm(result.record.contact_wrenches[:15, :3], axis=1)  # in the frame of the foot, which is inclined
    assert forces.mean() > 9.81 * model.mass


def test_schedules_fit_their_stages():
    model, q = make_hopper()
    plan = make_hop(model, q, 0.55, bielle.FreeTiming())
    schedule = bielle.ContactSchedule(phases=[bielle.ContactPhase(name="all", nodes=7, dt=0.02)])
    with pytest.raises(ValueError, match="7 stages in its phases, and 24 of the plan"):
        bielle.Motion(model, plan.replace(schedule=schedule))


def test_figures(squat, model):
    plot = pytest.importorskip("matplotlib.pyplot")
    axes = plot.figure().add_subplot()
    assert bielle.plot.torques(squat, axes=axes) is axes and len(axes.lines) == 4
    name = next(iter(squat.peak_torques))
    assert np.array_equal(axes.lines[0].get_ydata(), squat.record.u[:, squat.record.u_names.index(name)])
    axes.clear()
    loads = bielle.plot.loads(squat.record, axes=axes).lines
    assert sum(line.get_ydata().mean() for line in loads) == pytest.approx(9.81 * model.mass, rel=0.01)
    axes.clear()
    assert bielle.plot.convergence(squat, axes=axes).lines[0].get_xdata()[-1] == squat.solver.log[-1].iteration
    with pytest.raises(ValueError, match="'nobody' is not among"):
        bielle.plot.coordinates(squat, ["nobody"], axes=axes)
    plot.close("all")


def test_what_is_doubtful_is_a_warning_and_what_cannot_succeed_an_error():
    robot = bielle.load_robot("rsu_biped")

    def solve(knees):
        limits = bielle.LimitOptions(efforts={"knee_left": knees, "knee_right": knees})
        return bielle.solve_squat(robot, depth=0.8, problem=bielle.ProblemOptions(limits=limits),
                                  solver=bielle.SolverOptions(max_iterations=1))  # fmt: skip

    with pytest.warns(RuntimeWarning, match="knee_left needs .* N m, its limit is 12 N m"):
        solve(12)
    with pytest.raises(bielle.InputError, match="motor 'knee.*--limit knee_left="):
        solve(6)
