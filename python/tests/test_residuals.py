"""Costs and constraints written in Python."""

import gc
import multiprocessing
import pickle
import re
import threading
import weakref

import numpy as np
import pytest

import bielle
from bielle import residuals


class ComHeight(bielle.Residual):
    """Height of the centre of mass minus a reference, m."""

    size = 1
    depends_on = ("q",)

    def __init__(self, reference):
        self.reference = reference

    def calc(self, node):
        return node.com[2:] - self.reference

    def calc_jacobian(self, node):
        return {"q": node.com_jacobian[2:]}

    def __eq__(self, other):
        return type(self) is type(other) and self.reference == other.reference


class ComHeightByDifferences(ComHeight):
    calc_jacobian = bielle.Residual.calc_jacobian


class Everything(bielle.Residual):
    """Depends on all that differences are taken of."""

    size = 2
    depends_on = ("q", "v", "forces", "controls")

    def calc(self, node):
        p = node.placement("foot_left").p
        w = node.frame_velocity("foot_left")
        return [p[0] * w[1] + np.sin(node.u).sum() * p[2], np.tanh(node.forces[-6:]).sum() * p[0] + w[5] ** 2]


def make_motion(model, cost):
    """A short squat with one cost more on its running stages."""
    plan = bielle.Motion.plan(model, bielle.Request(motion="squat", options={"depth": 0.9, "time_step": 0.05}))
    *running, terminal = plan.stages
    stages = [stage.replace(costs=[*stage.costs, cost]) for stage in running]
    return bielle.Motion(model, plan.replace(stages=[*stages, terminal]))


def solve(model, residual, threads=0, weight=1e3):
    """The squat with a residual more, which would hold its centre of mass a little lower."""
    cost = bielle.Cost("own", weight, bielle.Activation.quadratic(np.ones(residual.size)), residual)
    solution = make_motion(model, cost).solve(bielle.SolverOptions(threads=threads))
    return solution.summary, solution.trajectory


@pytest.fixture(scope="module")
def height(model):
    return 0.97 * float(model.com(model.standing())[2])


def test_own_cost_is_that_of_the_library(model, height):
    own, trajectory = solve(model, ComHeight(height))
    assert own.converged
    x, y = model.com(model.standing())[:2]
    library = bielle.Cost("own", 1e3, bielle.Activation.quadratic([0, 0, 1]), residuals.com_position([x, y, height]))
    solution = make_motion(model, library).solve(bielle.SolverOptions())
    assert solution.summary.cost == pytest.approx(own.cost, rel=1e-9)
    assert np.abs(np.array(solution.trajectory.us) - np.array(trajectory.us)).max() < 1e-4
    assert make_motion(model, library.replace(weight=0)).solve().summary.cost < 0.99 * own.cost  # the cost matters


def test_differences(model, height):
    exact, first = solve(model, ComHeight(height))
    differences, second = solve(model, ComHeightByDifferences(height))
    assert differences.converged and differences.cost == pytest.approx(exact.cost, rel=1e-9)
    assert np.abs(np.array(first.us) - np.array(second.us)).max() < 1e-4


def test_threads_do_not_matter(model, height):
    _, alone = solve(model, ComHeight(height), threads=1)
    for threads in (2, 8):
        assert solve(model, ComHeight(height), threads=threads)[1] == alone


def test_everything_that_a_node_has(model):
    summary, alone = solve(model, Everything(), threads=1, weight=1e-3)
    assert summary.iterations > 0 and np.isfinite(summary.cost)
    assert solve(model, Everything(), threads=8, weight=1e-3)[1] == alone


@pytest.mark.parametrize("where", ["calc", "calc_jacobian"])
@pytest.mark.parametrize("threads", [1, 8])
def test_exceptions_come_out_as_themselves(model, height, where, threads):
    error = KeyError("mine")

    class Failing(ComHeight):
        calls = 0

        def fail(self, node):
            self.calls += 1
            if self.calls > 40:
                raise error
            return getattr(ComHeight, where)(self, node)

    setattr(Failing, where, Failing.fail)
    with pytest.raises(KeyError) as caught:
        solve(model, Failing(height), threads=threads)
    assert caught.value is error
    assert solve(model, ComHeight(height))[0].converged  # nothing is left behind


def test_wrong_shapes_say_which_was_wanted(model, height):
    class Long(ComHeight):
        def calc(self, node):
            return [1, 2]

    class Wide(ComHeight):
        def calc_jacobian(self, node):
            return {"q": np.zeros((1, 3))}

    class Missing(ComHeight):
        def calc_jacobian(self, node):
            return {}

    with pytest.raises(ValueError, match=r"Long.calc: expected shape \(1,\), got \(2,\)"):
        solve(model, Long(height))
    with pytest.raises(ValueError, match=rf"Wide.calc_jacobian, q: expected shape \(1, {model.nv}\), got \(1, 3\)"):
        solve(model, Wide(height))
    with pytest.raises(KeyError, match="q: missing"):
        solve(model, Missing(height))
    with pytest.raises(TypeError, match="derived from bielle.Residual"):
        bielle.Cost("c", 1, bielle.Activation.quadratic([1]), "height")
    with pytest.raises(ValueError, match="depends_on: expected .*, got 'x'"):
        bielle.Cost("c", 1, bielle.Activation.quadratic([1]), type("X", (ComHeight,), {"depends_on": ("x",)})(1))


def test_a_node_expires(model, height):
    kept = []

    class Keeping(ComHeight):
        def calc(self, node):
            kept.append((node, node.q))
            return super().calc(node)

    solve(model, Keeping(height))
    node, q = kept[0]
    assert q.shape == (model.nq,)  # a copy
    with pytest.raises(RuntimeError, match="valid only during the call"):
        node.q


def test_own_constraint(model, height):
    """Example 11 in Python: knees that must not go too far ahead."""

    class Knee(bielle.Residual):
        size = 1
        depends_on = ("q",)

        def calc(self, node):
            return node.placement("shin_left").p[:1]

        def calc_jacobian(self, node):
            return {"q": (node.placement("shin_left").R @ node.frame_jacobian("shin_left")[:3])[:1]}

    plan = bielle.Motion.plan(model, bielle.Request(motion="squat"))
    free = bielle.Motion(model, plan).solve()
    assert free.converged

    def find_farthest(solution):
        q = np.array([x[: model.nq] for x in solution.trajectory.xs])
        return model.placement(q, "shin_left")[:, 0, 3].max()

    most = find_farthest(free) - 0.01
    limit = bielle.PathConstraint("knee", Knee(), lower=[-np.inf], upper=[most], scale=[0.01])
    bounded = bielle.Motion(
        model, plan.replace(stages=[s.replace(path_constraints=s.path_constraints + (limit,)) for s in plan.stages])
    ).solve()
    assert bounded.converged
    assert find_farthest(bounded) == pytest.approx(most, abs=1e-8)
    assert max(y.max() for y in bounded.multipliers.values if y.size) > 0

    # What is not a number is named, in its value and in its derivatives.
    class Broken(Knee):
        def __init__(self, values, derivatives):
            self.factors = values, derivatives

        def calc(self, node):
            return super().calc(node) * self.factors[0]

        def calc_jacobian(self, node):
            return {"q": super().calc_jacobian(node)["q"] * self.factors[1]}

    for factors, told in (
        ((np.nan, 1), "node 50: .*'broken knee' is not a number"),
        ((1, np.nan), "not finite: the derivatives of broken knee at node 50$"),
    ):
        broken = bielle.PathConstraint("broken knee", Broken(*factors), lower=[-np.inf], upper=[-1], scale=[0.01])
        stages = list(plan.stages)
        stages[50] = stages[50].replace(path_constraints=stages[50].path_constraints + (broken,))
        failed = bielle.Motion(model, plan.replace(stages=stages)).solve()
        assert re.search(told, failed.summary.message), failed.summary.message


def test_residuals_of_the_library_compare_and_pickle(model):
    feet = model.constraints(("foot_left",))
    made = [
        residuals.com_position([0, 0, 0.4]),
        residuals.com_position(np.array([0, 0, 0.4])),
        residuals.frame_placement(model, "foot_left", bielle.SE3(p=[1, 0, 0])),
        residuals.contact_force(feet, 0, np.zeros(6), bielle.ForceAxes.WORLD),
        residuals.wrench_cone(feet, 0, 0.1, 0.05, 0.7),
        residuals.joint_velocity(model, [6, 7]),
    ]
    for residual in made:
        twin = pickle.loads(pickle.dumps(residual))
        assert twin == residual and twin.size == residual.size and repr(twin) == repr(residual)
    assert made[0] == made[1] and made[0] != residuals.com_position([0, 0, 0.5]) and made[0] != made[2]
    with pytest.raises(IndexError, match="contact 1: the constraints have 1"):
        residuals.contact_force(feet, 1, np.zeros(6))
    with pytest.raises(ValueError, match=r"reference: expected shape \(6,\), got \(3,\)"):
        residuals.contact_force(feet, 0, np.zeros(3))


def test_costs_pickle_with_their_residuals(height):
    own = bielle.Cost("own", 2, bielle.Activation.quadratic([1]), ComHeight(height))
    library = bielle.Cost("lib", 1, bielle.Activation.quadratic([1, 1, 1]), residuals.com_position([0, 0, height]))
    stage = bielle.Stage(dt=0.02, costs=[own, library])
    twin = pickle.loads(pickle.dumps(stage))
    assert twin == stage and twin.costs[0].residual.reference == height
    assert twin.costs[1] == library and stage != stage.replace(costs=[own])
    assert own.residual is stage.costs[0].residual


def test_stages_pickle_with_their_feet(model):
    plan = bielle.Motion.plan(model, bielle.Request(motion="walk", options={"steps": 2}))
    feet = [foot for stage in plan.stages for foot in stage.feet]
    assert {foot.role for foot in feet} == {bielle.FootRole.SWING, bielle.FootRole.LANDING}
    swing = next(stage for stage in plan.stages if stage.feet and stage.feet[0].clearance is not None)
    twin = pickle.loads(pickle.dumps(swing))
    assert twin == swing and twin.feet == swing.feet and twin != swing.replace(feet=[])
    assert twin.feet[0].place in [cost.residual for cost in twin.costs]
    assert twin.feet[0].clearance in [constraint.residual for constraint in twin.path_constraints]


def test_nothing_keeps_a_residual(height):
    residual = ComHeight(height)
    alive = weakref.ref(residual)
    stage = bielle.Stage(costs=[bielle.Cost("own", 1, bielle.Activation.quadratic([1]), residual)])
    del residual
    assert alive() is not None
    del stage
    gc.collect()
    assert alive() is None


def solve_elsewhere(arguments):
    model, residual = arguments
    return solve(model, residual)[1]


@pytest.mark.long
def test_spawned_processes(model, height):
    expected = solve(model, ComHeight(height))[1]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(solve_elsewhere, [(model, ComHeight(height))] * 2) == [expected] * 2


@pytest.mark.long
def test_solves_on_several_python_threads(model, height):
    expected, results = solve(model, ComHeight(height))[1], []
    threads = [
        threading.Thread(target=lambda: results.append(solve(model, ComHeight(height), threads=4)[1])) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [expected] * 4


def test_a_residual_reads_its_motion_while_it_is_solved(model):
    class Peek(ComHeight):
        def calc(self, node):
            if solving:
                assert motion.guess == guess and "own" in costs
            return super().calc(node)

    solving = False
    motion = make_motion(model, bielle.Cost("own", 1e3, bielle.Activation.quadratic(np.ones(1)), Peek(0.6)))
    guess, costs = motion.guess, motion.costs(0)
    solving = True
    assert motion.solve(bielle.SolverOptions(max_iterations=1)).summary.iterations == 1
