"""Robots as functions of numbers, gradients of optimal costs, searches with one's own objective; serial models."""

import pickle

import numpy as np
import pytest

import bielle

EULER = bielle.ProblemOptions(step=bielle.StepRule.EULER)
TIGHT = bielle.SolverOptions(gradient_tolerance=1e-14, initial_regularization=1e-5)


def shift(name, joint, width=0.01):
    sides = [bielle.ShiftChange(of=f"{joint}_{side}", along=(1, 0, 0)) for side in ("left", "right")]
    return bielle.DesignVariable(name=name, lower=-width, upper=width, shifts=sides)


@pytest.fixture(scope="module")
def knee(model):
    return bielle.Parametrization(model, [shift("motor_x", "motor_knee"), shift("rocker_x", "free_knee")])


def test_a_robot_as_a_function_of_numbers(knee, model):
    assert knee.start == pytest.approx(np.zeros(2))
    q = model.standing()
    assert knee.make(knee.start).mass_matrix(q) == pytest.approx(model.mass_matrix(q))
    moved = knee.make([2e-3, 0])
    assert moved.mass == pytest.approx(model.mass)
    assert np.abs(moved.closure_residual(q)).max() == pytest.approx(2e-3, rel=0.2)
    again = pickle.loads(pickle.dumps(knee))
    assert again.variables == knee.variables and again.make([2e-3, 0]) == moved
    with pytest.raises(ValueError, match=r"x: expected shape \(2,\)"):
        knee.make([0])
    with pytest.raises(bielle.InputError, match="nowhere"):
        bielle.Parametrization(model, [shift("motor_x", "nowhere")])


def test_a_generated_robot(robot):
    name, parameters = next(iter(bielle.generators().items()))
    parameter, described = next((p, d) for p, d in parameters.items() if d["unit"] == "m")
    start = described["default"]
    variable = bielle.DesignVariable(name="size", lower=0.9 * start, upper=1.1 * start, parameter=parameter)
    generated = bielle.Parametrization.generated(name, [variable])
    assert generated.start == pytest.approx([start])
    made, default = generated.make([1.05 * start]), bielle.generate_robot(name).model
    assert generated.make([start]).mass == pytest.approx(default.mass)
    assert made == bielle.generate_robot(name, **{parameter: 1.05 * start}).model != default


def test_gradient_of_an_optimum(knee):
    request = bielle.Request(motion="squat", options={"depth": 0.8})

    def solve(x):
        solution = bielle.Motion.make(knee.make(x), request, EULER).solve(TIGHT)
        assert solution.converged
        return solution

    gradient = bielle.cost_gradient(solve(knee.start), knee, knee.start)
    step = 1e-4
    differences = [(solve(side).summary.cost - solve(-side).summary.cost) / (2 * step) for side in step * np.eye(2)]
    assert gradient == pytest.approx(np.array(differences), rel=1e-4)
    poisoned = gradient + [0, 1e-3 * np.abs(gradient).max()]
    assert poisoned != pytest.approx(np.array(differences), rel=1e-4)
    plan = bielle.Motion.plan(knee.make(knee.start), request)
    with pytest.raises(RuntimeError, match="make it from a Request"):
        bielle.cost_gradient(bielle.Motion(knee.make(knee.start), plan).solve(TIGHT), knee, knee.start)


def rosenbrock(x):
    value = (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2
    return value, np.array([-2 * (1 - x[0]) - 400 * x[0] * (x[1] - x[0] ** 2), 200 * (x[1] - x[0] ** 2)])


@pytest.mark.parametrize("algorithm", ["SLSQP", "MMA", "BOBYQA", "SBPLX"])
def test_minimize(algorithm):
    stage = bielle.SearchStage(algorithm=bielle.SearchAlgorithm.__members__[algorithm], evaluations=2000, tolerance=1e-8)
    found = bielle.minimize(rosenbrock, [-1, 1], [-2, -2], [2, 2], [stage])
    assert found.x == pytest.approx([1, 1], abs=0.05) and found.value < 1e-3  # MMA creeps along the valley
    assert found.value == pytest.approx(rosenbrock(found.x)[0])


def test_objectives_that_are_wrong():
    slsqp = [bielle.SearchStage(algorithm=bielle.SearchAlgorithm.SLSQP)]
    with pytest.raises(TypeError, match="gradient"):
        bielle.minimize(lambda x: 1.0, [0], [-1], [1], slsqp)
    with pytest.raises(ValueError, match="finite"):
        bielle.minimize(lambda x: np.nan, [0], [-1], [1], [bielle.SearchStage()])
    with pytest.raises(ValueError, match="between"):
        bielle.minimize(lambda x: 1.0, [2], [-1], [1], slsqp)
    with pytest.raises(ZeroDivisionError):
        bielle.minimize(lambda x: 1 / 0, [0], [-1], [1], slsqp)


def test_lift(robot, model):
    serial = bielle.make_serial_model(model, model.standing())
    assert serial.model.num_closure_rows == 0 and serial.model.nu == model.nu
    assert serial == pickle.loads(pickle.dumps(serial))
    motion = bielle.Motion.make(serial.model, bielle.Request(motion="squat", options={"depth": 0.9}), EULER)
    solution = motion.solve()
    assert solution.converged
    lifted = bielle.lift(robot, serial, solution)
    assert lifted.lifted and max(node.acceleration_error for node in lifted.nodes) < 1e-4
    assert lifted.result.gap_position < 1e-8
    with pytest.raises(ValueError, match="Euler"):
        midpoint = bielle.Motion.make(serial.model, bielle.Request(motion="squat", options={"depth": 0.9}))
        bielle.lift(robot, serial, midpoint.solve(bielle.SolverOptions(max_iterations=1)))


def test_info(robot, model):
    info = robot.info()
    assert info["nq"] == model.nq and len(info["closures"]) == len(model.closures)
    assert info["mobility"]["closed"] and info["mobility"]["mobility"] == model.nv - info["mobility"]["rank"]


def test_they_show_themselves(robot, model):
    assert "<iframe" in robot._repr_html_()
    motion = bielle.Motion.make(model, bielle.Request(motion="squat", options={"depth": 0.9}))
    assert "<iframe" in motion.solve()._repr_html_()
