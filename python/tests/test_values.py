"""Values: pickle, copy, repr, ==, and views that keep their owner."""

import copy
import gc
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


@pytest.fixture(params=VALUES)
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
        except bielle.ModelError:
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


def test_spawned_processes(model):
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(calc_mass, [model, model]) == [calc_mass(model)] * 2


def read_memory():
    """Resident memory, bytes."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


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
