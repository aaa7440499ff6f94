"""Robots, models, and functions of states."""

import pickle
import warnings

import numpy as np
import pytest

import bielle


def differentiate(function, model, q, step=1e-6):
    """Central differences by the tangent of q."""
    columns = []
    for direction in np.eye(model.nv):
        ahead, behind = (function(model.integrate(q, s * direction)) for s in (step, -step))
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=-1)


def test_attributes(model):
    assert (model.nq, model.nv, model.nu) == (model.neutral().size, model.armature.size, len(model.motors))
    assert [motor.name for motor in model.motors] == list(model.u_names)
    assert len(model.q_names) == model.nq and len(model.v_names) == model.nv
    assert model.mass == pytest.approx(sum(body.inertia.mass for body in model.bodies))
    assert model.joints[1].kind == bielle.JointKind.FREE_FLYER
    assert model.mobility(model.standing())["mobility"] == 18


def test_arrays_are_read_only_views(model):
    limits = model.lower_limits
    assert not limits.flags.writeable and limits.base is not None
    with pytest.raises(ValueError):
        limits[0] = 0.0


def test_mass_matrix_is_that_of_inverse_dynamics(model, state):
    q, v, _ = state
    a = np.random.default_rng(2).standard_normal(model.nv)
    expected = model.inverse_dynamics(q, v, a)
    assert model.mass_matrix(q) @ a + model.bias(q, v) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert model.kinetic_energy(q, v) == pytest.approx(v @ model.mass_matrix(q) @ v / 2)


def test_forward_dynamics_meets_its_equations(model, state):
    q, v, u = state
    feet = ("foot_left",)
    result = model.forward_dynamics(q, v, u, feet)
    assert result.status == 0
    closures = model.num_closure_rows
    tau = np.zeros(model.nv)
    tau[[motor.dof for motor in model.motors]] = u
    # The contact's rows are those of the foot's twist in its own frame.
    J = np.vstack([model.closure_jacobian(q), model.frame_jacobian(q, "foot_left")])
    left = model.inverse_dynamics(q, v, result.a) - J.T @ result.forces
    assert result.forces.size == closures + 6
    assert left == pytest.approx(tau, abs=1e-8)


@pytest.mark.parametrize("contacts", [(), ("foot_left", "foot_right")])
def test_derivatives_of_forward_dynamics(model, state, contacts):
    q, v, u = state
    exact = model.forward_dynamics_derivatives(q, v, u, contacts)
    expected = differentiate(lambda x: model.forward_dynamics(x, v, u, contacts).a, model, q)
    scale = np.abs(expected).max()
    assert np.abs(exact.da_dq - expected).max() < 1e-6 * scale
    changed = exact.da_dq.copy()
    changed[7, 9] += 1e-3 * scale
    assert np.abs(changed - expected).max() > 1e-4 * scale
    a, b = (model.forward_dynamics(q, v + s * v, u, contacts).a for s in (1e-6, -1e-6))
    assert exact.da_dv @ v == pytest.approx((a - b) / 2e-6, abs=1e-6 * np.abs(exact.da_dv @ v).max())


def test_derivatives_of_impact(model, state):
    q, v, _ = state
    exact = model.impact_derivatives(q, v, ("foot_left",))
    expected = differentiate(lambda x: model.impact(x, v, ("foot_left",)).v, model, q)
    assert np.abs(exact.dv_dq - expected).max() < 1e-6 * np.abs(expected).max()
    landed = model.impact(q, v, ("foot_left",))
    assert model.frame_velocity(q, landed.v, "foot_left") == pytest.approx(np.zeros(6), abs=1e-9)


def test_derivatives_of_inverse_dynamics(model, state):
    q, v, _ = state
    a = np.ones(model.nv)
    exact = model.inverse_dynamics_derivatives(q, v, a)
    expected = differentiate(lambda x: model.inverse_dynamics(x, v, a), model, q)
    assert np.abs(exact.dq - expected).max() < 1e-6 * np.abs(expected).max()
    assert exact.da == pytest.approx(model.mass_matrix(q))


def test_distances_of_shapes(model, state):
    q = state[0]
    a, b, _ = next(pair for pair in model.shape_pairs if pair[2])
    expected = differentiate(lambda x: model.shape_distance(x, a, b), model, q)
    exact = model.shape_distance_gradient(q, a, b)
    assert np.abs(exact - expected).max() < 1e-6
    assert np.abs(exact).max() > 1e-2
    assert model.shape_distance(np.stack([q, q]), b, a) == pytest.approx([model.shape_distance(q, a, b)] * 2)
    assert all(shape.fitted and shape.radius >= 0 for shape in model.shapes)
    with pytest.raises(IndexError):
        model.shape_distance(q, a, len(model.shapes))


def test_jacobians(model, state):
    q, v, _ = state
    expected = differentiate(model.com, model, q)
    assert np.abs(model.com_jacobian(q) - expected).max() < 1e-8
    assert model.com_jacobian(q) @ v == pytest.approx(model.com_velocity(q, v))
    assert model.frame_jacobian(q, "foot_left") @ v == pytest.approx(model.frame_velocity(q, v, "foot_left"))
    assert model.closure_jacobian(q) @ v == pytest.approx(np.zeros(model.num_closure_rows), abs=1e-9)
    assert np.abs(model.closure_residual(q)).max() < 1e-11


def test_cut_at_balls_it_is_the_same_mechanism(model):
    cut = model.cut_at_balls()
    assert (cut.nv, cut.nu, cut.mobility(cut.standing())["mobility"]) == (36, model.nu, 18)
    assert cut.mass == pytest.approx(model.mass)
    assert set(cut.v_names) < set(model.v_names)


def test_batches_are_single_states_to_the_last_bit(model, state):
    q, v, u = state
    random = np.random.default_rng(3)
    qs = model.integrate(q, 0.01 * random.standard_normal((37, model.nv)))
    vs = random.standard_normal((37, model.nv))
    assert qs.shape == (37, model.nq)
    many = model.forward_dynamics(qs, vs, u, ("foot_left",))
    for i in range(37):
        one = model.forward_dynamics(qs[i], vs[i], u, ("foot_left",))
        assert np.array_equal(one.a, many.a[i]) and np.array_equal(one.forces, many.forces[i])
    assert model.placement(qs, "foot_left").shape == (37, 4, 4)
    assert model.potential_energy(qs).shape == (37,)
    assert model.com(np.empty((0, model.nq))).shape == (0, 3)
    assert np.array_equal(model.com(np.asfortranarray(qs)), model.com(qs))


def test_wrong_shapes_say_which_was_wanted(model):
    with pytest.raises(ValueError, match=rf"q: expected shape \({model.nq},\) or \(N, {model.nq}\), got \(3,\)"):
        model.com(np.zeros(3))
    with pytest.raises(ValueError, match="v: expected 2 states like the arguments before it, got 3"):
        model.com_velocity(np.tile(model.neutral(), (2, 1)), np.zeros((3, model.nv)))
    with pytest.raises(ValueError, match=r"SE3.p: expected shape \(3,\), got \(2,\)"):
        bielle.SE3(p=[0, 1])
    with pytest.raises(TypeError, match="q: expected numbers"):
        model.com("bipetto")
    with pytest.raises(TypeError, match="SE3 has no field 'q'; it has: R, p"):
        bielle.SE3(q=1)


def test_model_errors_have_fields():
    with pytest.raises(bielle.InputError) as caught:
        bielle.load_robot("no such robot")
    assert caught.value.problem and caught.value.remedy
    assert str(caught.value).endswith(caught.value.problem + "; " + caught.value.remedy)


def test_model_errors_name_the_file(tmp_path):
    path = tmp_path / "leg.urdf"
    path.write_text("<robot name='leg'><link name='a'/><joint name='j' type='revolute'/></robot>")
    with pytest.raises(bielle.InputError) as caught:
        bielle.load_robot(str(path))
    assert caught.value.file == str(path) and "j" in caught.value.element


def test_contacts_of_another_robot_are_refused(model):
    other = bielle.load_robot("fourbar").model
    with pytest.raises(ValueError, match="does not belong to the model"):
        other.static_torques(other.neutral(), model.constraints(("foot_left",)))
    with pytest.raises(bielle.InputError, match="there is no contact"):
        model.constraints(("hand",))


def test_a_linkage_built_from_nothing():
    """A pendulum of a point mass: a = -g/l sin(q)."""
    builder = bielle.ModelBuilder("pendulum")
    joint = bielle.Joint(name="pivot", kind=bielle.JointKind.REVOLUTE, axis=[0, 1, 0])
    builder.add_link("rod", "world", joint, bielle.Inertia(mass=2.0, com=[0, 0, -0.5]))
    builder.add_motor("pivot", effort_limit=3)
    pendulum = builder.build()
    angle = np.linspace(-1, 1, 11)[:, None]
    a = pendulum.forward_dynamics(angle, np.zeros(1), np.zeros(1)).a
    assert a == pytest.approx(-9.81 / 0.5 * np.sin(angle))
    assert pendulum.motors[0].effort_limit == 3


def test_couplers_and_springs_from_nothing():
    """Two pendulums on a belt of ratio 2, the first one on a spring."""
    builder = bielle.ModelBuilder("belt")
    for name in ("a", "b"):
        joint = bielle.Joint(name=name, kind=bielle.JointKind.REVOLUTE, axis=[0, 0, 1])
        builder.add_link(f"link_{name}", "world", joint, bielle.Inertia(mass=1, I_com=np.eye(3)))
    builder.add_coupler("belt", {"a": 2, "b": -1})
    builder.add_joint_force("a", bielle.JointForce(stiffness=10))
    model = builder.build()
    assert model.closure_residual([0.1, 0.2]) == pytest.approx([0])
    a = model.forward_dynamics([0.1, 0.2], np.zeros(2), []).a
    assert a == pytest.approx([-10 * 0.1 / (1 + 4), -2 * 10 * 0.1 / (1 + 4)])
    with pytest.raises(bielle.InputError):
        builder.add_coupler("slack", {"a": 1})


def test_a_rod_without_a_body():
    """A point on a planar table of two slides, held at a distance from the origin: it circles, and the rod pulls by m w^2 r."""
    builder = bielle.ModelBuilder("conker")
    builder.set_gravity([0, 0, 0])
    carriage = bielle.Joint(name="x", kind=bielle.JointKind.PRISMATIC, axis=[1, 0, 0])
    builder.add_link("carriage", "world", carriage, bielle.Inertia())
    joint = bielle.Joint(name="y", kind=bielle.JointKind.PRISMATIC, axis=[0, 1, 0])
    builder.add_link("mass", "carriage", joint, bielle.Inertia(mass=2, I_com=np.eye(3)))
    builder.add_distance("rod", "mass", "world", 0.5)
    model = builder.build()
    rod = model.closures[0]
    assert rod.kind == bielle.ClosureKind.DISTANCE and rod.length == 0.5 and model.num_closure_rows == 1
    assert model.closure_residual([0.3, 0.4]) == pytest.approx([0])
    motion = model.forward_dynamics([0.3, 0.4], [-0.8, 0.6], [])
    assert motion.a == pytest.approx([-0.6 * 2, -0.8 * 2])
    assert motion.forces == pytest.approx([2 * 1 / 0.5])
    for length in (0, -1, np.nan):
        with pytest.raises(bielle.InputError):
            builder.add_distance("none", "mass", "world", length)


def test_a_cam_from_nothing():
    """Two rotors with b = a^2 - 0.5 a^3, a constant torque on b."""
    builder = bielle.ModelBuilder("cam")
    for name in ("a", "b"):
        joint = bielle.Joint(name=name, kind=bielle.JointKind.REVOLUTE, axis=[0, 0, 1])
        builder.add_link(f"link_{name}", "world", joint, bielle.Inertia(mass=1, I_com=np.eye(3)))
    builder.add_coupler("cam", {"a": 0, "b": -1}, higher={"a": [1, -0.5]})
    builder.add_joint_force("b", bielle.JointForce(preload=3))
    model = builder.build()
    assert list(model.closures[0].terms[0].higher) == [1, -0.5]
    x = 0.6
    q, slope = [x, x**2 - 0.5 * x**3], 2 * x - 1.5 * x**2
    assert model.closure_residual(q) == pytest.approx([0])
    a = model.forward_dynamics(q, np.zeros(2), []).a
    assert a == pytest.approx([3 * slope / (1 + slope**2), 3 * slope**2 / (1 + slope**2)])


def test_a_spring_between_two_points():
    """A mass on a vertical slide, pulled by a spring from a point beside it."""
    builder = bielle.ModelBuilder("mass")
    joint = bielle.Joint(name="slide", kind=bielle.JointKind.PRISMATIC, axis=[0, 0, 1])
    builder.add_link("mass", "world", joint, bielle.Inertia(mass=2, I_com=np.eye(3)))
    spring = bielle.PointSpring(name="spring", point1=[0.3, 0, 0], stiffness=50, rest=0.2, preload=3, damping=4)
    builder.add_point_spring("world", "mass", spring)
    model = builder.build()
    assert model.point_springs[0].body2 == 1 and model.point_springs[0].signs == (-1,) and model.joint_forces == ()
    tension = 3 + 50 * 0.3 - 4 * 0.8 * 0.15
    assert model.forward_dynamics([0.4], [-0.15], []).a == pytest.approx([-9.81 - 0.8 * tension / 2])
    assert pickle.loads(pickle.dumps(model)).point_springs == model.point_springs
    assert spring.replace(rest=0.3).rest == 0.3
    with pytest.raises(bielle.InputError):
        builder.add_point_spring("mass", "mass", spring.replace(name="none"))


def test_generated_robots(tmp_path):
    assert "upper_length" in bielle.generators()["cleobot"]
    short = bielle.generate_robot("cleobot", str(tmp_path / "short"), upper_length=0.2)
    assert short.file.endswith("short.urdf") and short.model.nq == bielle.generate_robot("cleobot").model.nq
    with pytest.raises(bielle.InputError):
        bielle.generate_robot("cleobot", upper_length=-1)
    # As the command does: what would change nothing is refused.
    assert bielle.generate_robot("leg_biped", knee="four_bar", knee_crank=0.04).model
    with pytest.raises(bielle.InputError, match="knee_crank.*would change nothing.*choose `knee: four_bar`"):
        bielle.generate_robot("leg_biped", knee="belt", knee_crank=0.04)


def test_joints_are_held_while_loops_close(model):
    q = model.standing()
    knee = list(model.q_names).index("knee_left")
    bent = q.copy()
    bent[knee] += 0.2
    assert abs(model.close(bent)[knee] - bent[knee]) > 0.01
    closed = model.close(bent, hold=["knee_left"])
    assert closed[knee] == bent[knee] and np.abs(model.closure_residual(closed)).max() < 1e-10
    closer = bielle.LoopCloser(model, q, ["knee_left"])
    again, result = closer.close(bent)
    assert result.status == bielle.NumericalStatus.OK and result.gap == 0 and result.joint == ""
    assert np.abs(again - closed).max() < 1e-8
    assert closer.reset(q) and not closer.reset(bent)
    bent[knee] = 1.5  # between what two assembly modes reach
    far, result = closer.close(bent)
    assert result.status == bielle.NumericalStatus.NOT_CLOSED and result.joint == "knee_left"
    assert result.gap == pytest.approx(1.5 - far[knee]) and np.abs(model.closure_residual(far)).max() < 1e-10
    with pytest.raises(bielle.InputError, match="'knee_left' cannot be held at 1.5: the nearest value in reach is"):
        model.close(bent, hold=["knee_left"])
    with pytest.raises(bielle.InputError, match="choose some of"):
        model.close(q, hold=["knie_left"])


def test_motors_for_joints_and_back(model):
    q = model.standing()
    linkages = bielle.LinkageMap(model, q)
    assert linkages.motor_names == list(model.u_names) and set(linkages.joint_names) <= set(model.q_names)
    joints = np.array([q[list(model.q_names).index(name)] for name in linkages.joint_names])
    joints[linkages.joint_names.index("knee_left")] += 0.1
    motors, result = linkages.motors(joints)
    assert result.status == bielle.NumericalStatus.OK
    back, result = linkages.joints(motors)
    assert result.status == bielle.NumericalStatus.OK and np.abs(back - joints).max() < 1e-9
    assert np.abs(model.closure_residual(linkages.q)).max() < 1e-10
    assert linkages.reset(q)


def test_ratio_of_a_knee(model):
    sweep = bielle.sweep_ratio(model, "knee_left", model.standing())
    start = next(sample for sample in sweep.samples if sample.s == 0)
    q, index = model.standing(), list(model.v_names).index
    v = model.project_velocity(q, model.closure_jacobian(q)[0])  # some closed velocity
    joints = [v[index(name)] for name in sweep.joints]
    motors = [v[index(name)] for name in sweep.motors]
    assert start.ratio.R @ joints == pytest.approx(motors)


def test_dynamics_of_open_loops_are_told(model, state):
    q, _, u = state
    v = np.zeros(model.nv)
    opened = np.array(q)
    opened[list(model.q_names).index("knee_left")] += 0.05
    gap = np.abs(model.closure_residual(opened)).max()
    assert gap > 1e-4
    calls = [lambda q: model.forward_dynamics(q, v, u), lambda q: model.forward_dynamics_derivatives(q, v, u),
             lambda q: model.static_torques(q), lambda q: model.impact(q, v, ("foot_left",)),
             lambda q: model.impact_derivatives(q, v, ("foot_left",))]
    for call in calls:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(q)
            call(model.close(opened))  # the remedy
        for states in (opened, np.stack([q, opened])):
            with pytest.warns(RuntimeWarning, match="loops are open by up to .*e-.*close") as told:
                call(states)
            assert len(told) == 1
    moving = np.full(model.nv, 0.5)
    for call in (lambda v: model.forward_dynamics(q, v, u), lambda v: model.impact(q, v, ("foot_left",))):
        with pytest.warns(RuntimeWarning, match=r"velocities open loops by up to .*e.*project_velocity\(q, v\)"):
            call(moving)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(model.project_velocity(q, moving))
