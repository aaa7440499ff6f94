"""Arguments that no function can use: each is refused with an exception. Every function, constructor and attribute of the
module is given them, in a process of its own: one that crashes there is found by its last line."""

import inspect
import math
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest

import bielle
from bielle import _bielle


class Seen(bielle.Residual):
    size = 1
    depends_on = ("q",)
    nodes = []

    def calc(self, node):
        self.nodes.append(node)
        return [0]


def make_samples():
    """Arguments by type, and by name where any object will do: such that a call fails by the one that is bad alone."""
    robot = bielle.load_robot("bipetto")
    model = robot.model
    plan = bielle.Motion.plan(model, bielle.Request(motion="squat", options={"time_step": 0.1}))
    cost = bielle.Cost("seen", 1, bielle.Activation.quadratic([1]), Seen())
    motion = bielle.Motion(model, plan.replace(stages=[plan.stages[0].replace(costs=[cost]), *plan.stages[1:]]))
    motion.costs(0)
    solution = motion.solve(bielle.SolverOptions(max_iterations=1))
    world = bielle.World(model)
    variable = bielle.DesignVariable(name="upper", lower=0.1, upper=0.3, parameter="upper_length")
    by_type = {name: list(kind.__members__.values())[0] if hasattr(kind, "__members__") else kind()
               for name, kind in list_classes().items() if hasattr(kind, "__members__") or hasattr(kind, "_fields")}  # fmt: skip
    by_type.update(
        Robot=robot, Model=model, Motion=motion, World=world, Sensors=bielle.Sensors(world), MotionPlan=plan,
        ModelBuilder=bielle.ModelBuilder("m"), Estimator=bielle.Estimator(model, model.standing()), Node=Seen.nodes[0],
        LoopCloser=bielle.LoopCloser(model, model.standing(), ["knee_left"]), LinkageMap=bielle.LinkageMap(model, model.standing()),
        Request=bielle.Request(motion="squat"), Controller=bielle.Controller.policy(solution, gains=False), Solution=solution,
        Parametrization=bielle.Parametrization.generated("fivebar_leg", [variable]), Trajectory=motion.guess,
        LibraryResidual=bielle.residuals.com_position(np.zeros(3)), ConstraintSet=model.constraints(["foot_left"]),
        SerialModel=bielle.SerialModel(model=model, q_reference=model.standing()),
        str="x", float=1.0, int=0, bool=True, list=[], tuple=(), dict={}, List=[], Dict={}, function=len)  # fmt: skip
    q, v = model.standing(), np.zeros(model.nv)
    by_name = {"q": q, "q0": q, "q1": q, "v": v, "dq": v, "a": v, "u": np.zeros(model.nu), "losses": np.zeros(model.nu),
               "joints": np.zeros(model.nu), "motors": np.zeros(model.nu),
               "x": [0.2], "contacts": (), "R_WT": np.eye(3), "twist": np.zeros(6), "weights": [1.0], "lower": [0.0],
               "upper": [0.0], "start": [0.0], "made_of": plan, "options": bielle.ProblemOptions(), "warm_start": solution}  # fmt: skip
    return by_type, by_name


# What functions also take as an object of any type.
BEHIND_OBJECTS = {"contacts": "ConstraintSet", "warm_start": "Record"}


def is_property(key, attribute):
    return isinstance(attribute, property) and not key.startswith("__")  # __doc__ of enumerations


def list_classes():
    kinds = {name: kind for name, kind in vars(_bielle).items() if inspect.isclass(kind)}
    base = _bielle.SE3.__mro__[1]
    assert base.__name__ == "pybind11_object" and set(base.__subclasses__()) <= set(kinds.values())
    return kinds


def list_functions():
    """(name, function, owner, whether it is an attribute) of all that the module has."""
    for name, member in list(vars(_bielle).items()) + list(vars(_bielle._residuals).items()):
        if not inspect.isclass(member):
            if callable(member):
                yield name, member, None, False
            continue
        for key, attribute in vars(member).items():
            if is_property(key, attribute):
                for function in filter(None, (attribute.fget, attribute.fset)):
                    yield f"{name}.{key}", function, member, True
            else:
                function = getattr(attribute, "__func__", attribute)
                if callable(function) and re.match(r"\w+\(", function.__doc__ or ""):
                    yield f"{name}.{key}", function, member, False


def split_arguments(text):
    """At the commas that are in no bracket."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([{<") - (character in ")]}>")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [part.strip() for part in parts if part.strip()]


def parse(function):
    """(name, type, has a default, may be None) of each argument, from the signature in the docstring."""
    signature = function.__doc__.strip().split("\n")[0]
    found = re.match(r"\w*\((.*)\) -> .*", signature)
    for argument in split_arguments(found[1]):
        if not argument.startswith("*"):
            name, kind, default = re.match(r"(\w+): ([^=]*?)(?: = (.*))?$", argument).groups()
            yield name, kind.strip(), default is not None, default == "None"


def list_calls(samples):
    """(name, function, arguments, index, its type) of every call with one argument to be replaced by a bad one."""
    by_type, by_name = samples
    for name, function, owner, is_attribute in list_functions():
        if owner and hasattr(owner, "__members__") or not function.__doc__:
            continue  # those of enumerations are pybind11's
        parsed = list(parse(function))
        if is_attribute:
            parsed[0] = ("self", f"bielle.{owner.__name__}", False, False)
        required = [argument for argument in parsed if not argument[2]]
        for i, (key, kind, _, may_be_none) in enumerate(parsed):
            short, operator = kind.replace("bielle.", ""), ".__" in name and "__init__" not in name
            if may_be_none or (operator and kind in ("object", "dict")):
                continue  # object: whatever is compared or copied
            given = parsed[: i + 1] if i >= len(required) else required
            arguments = [make_sample(a, by_type, by_name, name) for a in given]
            if name.endswith(("__init__", "__setstate__")):
                arguments[0] = owner.__new__(owner)
            yield name, function, arguments, i, short


def make_sample(argument, by_type, by_name, function):
    key, kind = argument[0], argument[1].replace("bielle.", "").split("[")[0]
    if key == "frame":
        return "foot_left"
    if kind not in ("object", "handle"):
        return by_type[kind]
    if key == "reference" and function in ("contact_force", "frame_velocity"):
        return np.zeros(6)
    return by_name.get(key, np.zeros(3))


def expect(errors, name, call):
    """Prints what was tried, and how it failed unless by one of the errors."""
    print(name, flush=True)
    try:
        call()
    except errors:
        return
    except Exception as error:
        print("WRONG:", name, repr(error)[:300])
    else:
        print("WRONG:", name, "was accepted")


def attempt(name, call):
    """Of calls that may succeed or fail, but not crash."""
    print(name, flush=True)
    try:
        return call()
    except Exception:
        return None


def try_none():
    samples = make_samples()
    for name, function, arguments, i, _ in list_calls(samples):
        bad = arguments[:i] + [None] + arguments[i + 1 :]
        expect(TypeError, f"{name}, argument {i}: None", lambda: function(*bad))
    for name, kind in list_classes().items():
        for field in getattr(kind, "_fields", {}):
            if getattr(kind(), field) is not None:
                expect(TypeError, f"{name}({field}=None)", lambda: kind(**{field: None}))
                expect(TypeError, f"{name}.replace({field}=None)", lambda: kind().replace(**{field: None}))


def try_unmade():
    """Objects whose __init__ was never called, as attributes' and functions' own and as their arguments."""
    refused = (TypeError, RuntimeError)
    kinds = list_classes()
    for name, kind in kinds.items():
        for key, attribute in vars(kind).items():
            if is_property(key, attribute):
                expect(refused, f"{name}.__new__({name}).{key}", lambda: attribute.fget(kind.__new__(kind)))
        for use in (repr, pickle.dumps, lambda o: o.__reduce_ex__(2)):
            if kind.__repr__ is not object.__repr__ or use is not repr:
                expect(refused, f"{use} of {name}.__new__({name})", lambda: use(kind.__new__(kind)))
        for field, of in getattr(kind, "_fields", {}).items():
            if of in kinds:
                expect(refused, f"{name}({field}=...)", lambda: kind(**{field: kinds[of].__new__(kinds[of])}))
    for name, function, arguments, i, kind in list_calls(make_samples()):
        key = list(parse(function))[i][0]
        kind = kinds.get(BEHIND_OBJECTS.get(key, kind) if kind == "object" else kind)
        if kind and not (i == 0 and name.endswith(("__init__", "__setstate__"))):
            bad = arguments[:i] + [kind.__new__(kind)] + arguments[i + 1 :]
            expect(refused, f"{name}, argument {i}: {kind.__name__} without __init__", lambda: function(*bad))


def try_empty():
    """Values with nothing filled in, wherever one is taken: no crash, whatever the function makes of them."""
    samples = make_samples()
    for name, function, arguments, i, kind in list_calls(samples):
        kind = getattr(_bielle, kind, None)
        if hasattr(kind, "_fields") and not (i == 0 and name.endswith("__")) and arguments[i] != kind():
            bad = arguments[:i] + [kind()] + arguments[i + 1 :]
            attempt(f"{name}, argument {i}: {kind.__name__}()", lambda: function(*bad))


def list_bad(value):
    """What may stand in a state in place of a value."""
    yield from (None, "x", -1, 2**31 - 1, math.nan, 1e300, (), {}, value, [value] * 3)


def restore(kind, state):
    made = kind.__new__(kind)
    made.__setstate__(state)
    return made


def try_pickles():
    """States that no pickle of ours has. A state that is taken must make an object that can be used."""
    by_type, _ = make_samples()
    for name, kind in list_classes().items():
        if not hasattr(kind, "__setstate__") or hasattr(kind, "__members__"):
            continue
        state = by_type[name].__getstate__()
        states = list(list_bad(by_type[name])) + [b"", 1j, object()]
        if isinstance(state, tuple):
            states += [state[:i] + (bad,) + state[i + 1 :] for i in range(len(state)) for bad in list_bad(state[i])]
            states += [state[:i] for i in range(len(state))]
        if isinstance(state, dict):
            states += [{**state, key: bad} for key, value in state.items() for bad in list_bad(value)] + [{"x": 1}]
        for i, bad in enumerate(states):
            made = attempt(f"{name}, state {i}", lambda: restore(kind, bad))
            if made is not None:
                use(made)


def use(made):
    assert repr(made)
    pickle.loads(pickle.dumps(made))
    for key, attribute in vars(type(made)).items():
        if isinstance(attribute, property):
            attempt(key, lambda: getattr(made, key))


def change_numbers(value, change):
    """All values that are this one with one number of it changed, and how they are told apart."""
    for field in value._fields:
        entry = getattr(value, field)
        if isinstance(entry, (int, float)) and not isinstance(entry, bool):
            for bad in change:
                yield field, value.replace(**{field: bad if isinstance(entry, int) else float(bad)})
        elif isinstance(entry, tuple) and entry and isinstance(entry[0], int):
            for bad in change:
                yield field, value.replace(**{field: (*entry[:-1], bad)})
            yield field, value.replace(**{field: entry[:-1]})
        elif hasattr(entry, "_fields") and not isinstance(entry, tuple):
            for key, changed in change_numbers(entry, change):
                yield f"{field}.{key}", value.replace(**{field: changed})
        elif isinstance(entry, tuple):
            for i, item in enumerate(entry[:3]):
                if hasattr(item, "_fields"):
                    for key, changed in change_numbers(item, change):
                        yield f"{field}[{i}].{key}", value.replace(**{field: (*entry[:i], changed, *entry[i + 1 :])})
            yield field, value.replace(**{field: entry[:-1]})
            yield field, value.replace(**{field: (*entry, *entry)})
        elif isinstance(entry, np.ndarray) and entry.ndim == 1:
            yield field, value.replace(**{field: np.full(entry.shape, np.nan)})


def try_models():
    """Parts of a robot with one number out of place: it is refused, or can be computed with."""
    model = bielle.load_robot("fivebar_leg").model
    q, v, u = model.standing(), np.zeros(model.nv), np.zeros(model.nu)

    def compute(parts):
        made = restore(bielle.Model, parts)
        made.forward_dynamics(q, v, u, [contact.name for contact in made.contacts])
        made.closure_jacobian(q), made.close(q), made.standing(), made.q_names, made.v_names
        bielle.sweep_ratio(made, made.joints[made.serial_joints[0]].name, q, step=0.5)
        bielle.make_serial_model(made, q)

    for name, parts in change_numbers(model.__getstate__(), (-1, 1000, 2**31 - 1, -(2**31))):
        attempt(name, lambda: compute(parts))


def try_plans():
    """Stages with one number out of place: they are refused, or can be evaluated."""
    model = bielle.load_robot("fivebar_leg").model
    plan = bielle.Motion.plan(model, bielle.Request(motion="squat", options={"time_step": 0.1}))

    def compute(stage):
        motion = bielle.Motion(model, plan.replace(stages=[plan.stages[0], stage, *plan.stages[2:]]))
        motion.costs(1)
        motion.solve(bielle.SolverOptions(max_iterations=1))

    for name, stage in change_numbers(plan.stages[1], (-1, 1000, 2**31 - 1, -(2**31))):
        attempt(name, lambda: compute(stage))


@pytest.mark.parametrize("trial", ["none", "unmade", "empty", "pickles", "models", "plans"])
def test_trial(trial, tmp_path):
    done = subprocess.run([sys.executable, __file__, trial], cwd=tmp_path, capture_output=True, text=True)
    lines = done.stdout.splitlines()
    wrong = [line for line in lines if line.startswith("WRONG")]
    assert done.returncode == 0, f"{lines[-1:]} ended it with {done.returncode}\n{done.stderr[-3000:]}"
    assert not wrong, "\n".join(wrong)
    assert len(lines) > 50


def test_options_keep_to_their_bounds(model):
    """20000 threads would take all memory, and more end the process. Options are refused where they are given."""
    motion = bielle.Motion.make(model, bielle.Request(motion="squat", options={"depth": 0.95}))
    for kind in (bielle.SolverOptions, bielle.PredictiveOptions):
        for threads in (-1, 1025, 20000, 100000):
            with pytest.raises(bielle.InputError, match=kind.__name__ + ": field 'threads': .*, 0 .. 1024"):
                kind(threads=threads)
            with pytest.raises(bielle.InputError, match="threads"):
                kind().replace(threads=threads)
    for nodes in (-1, 0, 1001):
        with pytest.raises(ValueError, match="nodes': .* 10 .. 1000"):
            bielle.PredictiveOptions(nodes=nodes)
    for changed in ({"acceptance": 0}, {"min_regularization": 0}, {"gap_tolerance": math.nan}, {"long_step": math.inf}):
        with pytest.raises(bielle.InputError, match=f"'{next(iter(changed))}'"):
            bielle.SolverOptions(**changed)
    with pytest.raises(TypeError, match="SolverOptions.threads: expected int"):
        bielle.SolverOptions(threads=1.5)
    with pytest.raises(TypeError, match="no field 'thread'; it has: max_iterations, "):
        bielle.SolverOptions(thread=1)
    assert "    threads: number of threads; 0: all; results do not depend on it [1], 0 .. 1024, default 0\n" in bielle.SolverOptions.__doc__
    assert motion.solve(bielle.SolverOptions(threads=1024, max_iterations=1)).summary.iterations == 1


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_numbers_are_finite(model, bad):
    q, v, u = model.standing(), np.zeros(model.nv), np.zeros(model.nu)
    for world in (bielle.World(model), bielle.World(model, count=2)):
        start = world.reset(q, v)
        for changed in ({"q": np.full_like(q, bad), "v": v}, {"q": q, "v": [bad, *v[1:]]}):
            with pytest.raises(ValueError, match="[qv]: expected finite numbers"):
                world.reset(**changed)
        if world.count is None:
            with pytest.raises(ValueError, match="u: expected finite"):
                world.step(np.full(u.shape, bad), 0.01)
            with pytest.raises(ValueError, match="push: expected finite"):
                world.step(u, 0.01, [0, bad, 0])
        else:  # each of many breaks off by itself
            assert world.step([u, np.full(u.shape, bad)], 0.01).ok.tolist() == [True, False]
            assert world.step([u, u], 0.01, [[0, bad, 0], [0, 0, 0]]).ok.tolist() == [False, False]
        assert np.array_equal(world.reset(q, v).q, start.q)
    plan = bielle.Motion.plan(model, bielle.Request(motion="squat", options={"time_step": 0.1}))
    for spoil in (lambda s: s.replace(costs=[s.costs[0].replace(weight=bad), *s.costs[1:]]),
                  lambda s: s.replace(state=s.state.replace(weight=bad)),
                  lambda s: s.replace(control=s.control.replace(weight=bad))):  # fmt: skip
        with pytest.raises(bielle.InputError, match="stage 2: .* is negative or not finite"):
            bielle.Motion(model, plan.replace(stages=[*plan.stages[:2], spoil(plan.stages[2]), *plan.stages[3:]]))


if __name__ == "__main__":
    globals()[f"try_{sys.argv[1]}"]()
