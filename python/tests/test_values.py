"""Values: pickle, copy, repr, ==, and views that keep their owner."""

import copy
import gc
import inspect
import multiprocessing
import pickle

import numpy as np
import pytest

import bielle

VALUES = {
    "SE3": lambda: bielle.SE3(np.eye(3), [1, 2, 3]),
    "Inertia": lambda: bielle.Inertia(mass=1, com=[0, 0, 1], I_com=np.eye(3)),
    "Joint": lambda: bielle.Joint(name="knee", kind=bielle.JointKind.SPHERICAL, X_PJ=bielle.SE3(p=[0, 1, 0])),
    "Motor": lambda: bielle.load_robot("bipetto").model.motors[0],
    "Reference": lambda: bielle.Reference(name="r", joints={"a": [1.0], "b": [0, 0, 0, 1]}, feet={"f": [0, 1, 2]}),
    "ConstraintSet": lambda: bielle.load_robot("bipetto").model.constraints(("foot_left",)),
    "Robot": lambda: bielle.load_robot("bipetto"),
    "Model": lambda: bielle.load_robot("cleobot").model,
}


# They hold what goes on.
NOT_VALUES = {"ModelBuilder", "Node", "Controller", "Estimator", "World", "Sensors", "LoopCloser", "LinkageMap", "StartStates",
              "VectorEnv", "Recorder"}


def make_plan():
    return bielle.Motion.plan(bielle.load_robot("fivebar_leg").model, bielle.Request(motion="squat"))


def make_serial():
    model = bielle.load_robot("bipetto").model
    return bielle.make_serial_model(model, model.standing())


VALUES.update(
    {
        "MotionPlan": make_plan,
        "Stage": lambda: make_plan().stages[0],
        "Cost": lambda: make_plan().stages[0].costs[0],
        "LibraryResidual": lambda: make_plan().stages[0].costs[0].residual,
        "Motion": lambda: bielle.Motion(bielle.load_robot("fivebar_leg").model, make_plan()),
        "Solution": lambda: bielle.Motion(bielle.load_robot("fivebar_leg").model, make_plan()).solve(),
        "Parametrization": lambda: bielle.Parametrization.generated(
            "fivebar_leg", [bielle.DesignVariable(name="upper", lower=0.1, upper=0.3, parameter="upper_length")]
        ),
        "SerialModel": make_serial,
        "InputError": lambda: bielle.InputError("m", "file", "element", "problem", "remedy"),
    }
)


def list_public_types():
    return {name: kind for name, kind in vars(bielle).items() if inspect.isclass(kind) and not name.startswith("_")}


@pytest.mark.parametrize("name", sorted(set(list_public_types()) - NOT_VALUES))
def test_every_public_value_pickles(name):
    kind = list_public_types()[name]
    if hasattr(kind, "__members__"):
        values = list(kind.__members__.values())
    elif name in VALUES:
        values = [VALUES[name]()]
    elif hasattr(kind, "_fields") and issubclass(kind, tuple):
        values = [kind(*(np.arange(3.0) + i for i in range(len(kind._fields))))]
    else:
        values = [kind()]
    for value in values:
        for twin in (pickle.loads(pickle.dumps(value)), copy.copy(value), copy.deepcopy(value)):
            assert type(twin) is type(value) and repr(twin) == repr(value)
            assert same(twin, value)


def same(a, b):
    """Of errors and tuples of arrays, which have no == of their own; of Motion, Solution and Parametrization by what they hold or make."""
    if isinstance(a, bielle.InputError):
        return (str(a), vars(a)) == (str(b), vars(b))
    if isinstance(a, bielle.Residual):
        return vars(a) == vars(b)
    if isinstance(a, bielle.Motion):
        return a.guess == b.guess and all(a.stage(k) == b.stage(k) for k in range(a.num_stages + 1))
    if isinstance(a, bielle.Solution):
        return a.trajectory == b.trajectory and a.summary == b.summary and a.gains == b.gains
    if isinstance(a, bielle.Parametrization):
        return a.variables == b.variables
    if isinstance(a, tuple):
        return all(np.array_equal(x, y) for x, y in zip(a, b))
    return a == b and not a != b


@pytest.fixture(params=["SE3", "Inertia", "Joint", "Motor", "Reference", "ConstraintSet", "Robot", "Model"])
def value(request):
    return VALUES[request.param]()


def test_pickle_copy_equality(value):
    for twin in (pickle.loads(pickle.dumps(value)), copy.copy(value), copy.deepcopy(value)):
        assert type(twin) is type(value) and twin == value and not twin != value
        assert repr(twin) == repr(value)
    assert value != 1


def test_values_differ_by_any_field():
    joint = VALUES["Joint"]()
    for changed in (joint.replace(name="hip"), joint.replace(X_PJ=bielle.SE3(p=[0, 1, 1e-12]))):
        assert changed != joint
    model = bielle.load_robot("fourbar").model
    assert model != bielle.load_robot("fivebar").model
    assert bielle.Inertia(mass=np.nan) == bielle.Inertia(mass=np.nan)


def test_models_survive_to_the_last_bit():
    for name in bielle.list_robots():
        try:
            model = bielle.load_robot(name).model
        except bielle.InputError:
            continue  # completes a published robot that is not here
        twin = pickle.loads(pickle.dumps(model))
        q = np.random.default_rng(4).standard_normal((3, model.nq))
        for names, joint in enumerate(model.joints):
            if joint.kind in (bielle.JointKind.SPHERICAL, bielle.JointKind.FREE_FLYER):
                last = slice(joint.idx_q + joint.nq - 4, joint.idx_q + joint.nq)
                q[:, last] /= np.linalg.norm(q[:, last], axis=1, keepdims=True)
        assert twin == model
        assert np.array_equal(twin.mass_matrix(q), model.mass_matrix(q))


def test_values_are_immutable():
    X = bielle.SE3()
    with pytest.raises(AttributeError):
        X.p = [1, 2, 3]
    with pytest.raises(ValueError):
        X.p[0] = 1
    moved = X.replace(p=[1, 2, 3])
    assert list(moved.p) == [1, 2, 3] and list(X.p) == [0, 0, 0]


def test_views_keep_their_owner():
    axis = bielle.load_robot("fourbar").model.closures[0].X_B1.R  # all owners are gone but for the view
    expected = axis.copy()
    gc.collect()
    junk = [bielle.load_robot("fourbar").model for _ in range(20)]
    assert np.array_equal(axis, expected) and len(junk) == 20


def calc_mass(model):
    return model.mass_matrix(model.standing()).tobytes()


def return_it(value):
    return value


def test_every_value_survives_spawn():
    values = [make() for make in VALUES.values()]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        for value, twin in zip(values, pool.map(return_it, values)):
            assert type(twin) is type(value) and same(twin, value)


def test_plans_compare_and_differ():
    plan, again = make_plan(), make_plan()
    assert plan == again and plan.stages[0].costs[0].residual == again.stages[0].costs[0].residual
    deeper = bielle.Motion.plan(
        bielle.load_robot("fivebar_leg").model, bielle.Request(motion="squat", options={"depth": 0.9})
    )
    assert plan != deeper


def test_names_are_those_of_the_package():
    from typing import Dict, List

    assert Dict not in vars(bielle).values() and List not in vars(bielle).values()
    assert not hasattr(bielle, "Callback")


def test_spawned_processes(model):
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(calc_mass, [model, model]) == [calc_mass(model)] * 2


def read_memory():
    """Resident memory, bytes."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


@pytest.mark.long
def test_nothing_leaks():
    model = bielle.load_robot("fourbar").model
    state = pickle.dumps(model)

    def churn(count):
        for _ in range(count):
            twin = pickle.loads(state)
            twin.mass_matrix(twin.neutral())
            assert twin.joints[1].X_PJ.p.shape == (3,)

    churn(1000)
    gc.collect()
    before = read_memory()
    churn(10000)
    gc.collect()
    assert read_memory() - before < 1_000_000


@pytest.mark.long
def test_plans_do_not_leak():
    model = bielle.load_robot("fivebar_leg").model
    request = bielle.Request(motion="squat", options={"time_step": 0.1})

    def churn(count):
        for _ in range(count):
            plan = bielle.Motion.plan(model, request)
            assert bielle.Motion(model, plan).stage(0).costs[0].residual == plan.stages[0].costs[0].residual

    churn(20)
    gc.collect()
    before = read_memory()
    churn(200)
    gc.collect()
    assert read_memory() - before < 1_000_000
