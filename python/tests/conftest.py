"""What the tests share: robots, and states of them that are closed."""

import numpy as np
import pytest

import bielle


def pytest_configure(config):
    config.addinivalue_line("markers", "long: of the second tier (tests/tiers.cmake)")


@pytest.fixture(scope="session")
def robot():
    return bielle.load_robot("bipetto")


@pytest.fixture(scope="session")
def model(robot):
    return robot.model


@pytest.fixture(scope="session")
def state(model):
    """A closed configuration away from standing, a velocity that keeps it closed, and torques."""
    random = np.random.default_rng(1)
    q = model.close(model.integrate(model.standing(), 0.02 * random.standard_normal(model.nv)))
    v = model.project_velocity(q, random.standard_normal(model.nv))
    return q, v, random.standard_normal(model.nu)
