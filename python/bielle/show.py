"""How things show themselves: in one line; in notebooks by a page in a frame, which needs no network."""

import html
import tempfile
from pathlib import Path

from ._bielle import Result, Robot, Solution, load_robot, make_report, make_result, make_view


def make_frame(page: str, height: int) -> str:
    """A page inside of another one."""
    return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="{height}" style="border: 0"></iframe>'


def show_result(result: Result) -> str:
    """The 3D replay and the plots of a result."""
    with tempfile.TemporaryDirectory() as directory:
        result.write(directory)
        return make_frame(make_report([directory]), 720)


def show_robot(robot: Robot) -> str:
    """The robot in 3D, with a slider for each motor."""
    return make_frame(make_view(robot), 560)


def show_solution(solution: Solution) -> str:
    """The 3D replay and the plots of a solution."""
    with tempfile.TemporaryDirectory() as directory:
        files = str(Path(directory) / "robot")
        model = solution.motion.model
        Robot(name=model.name, model=model).write(files)
        return show_result(make_result(solution, load_robot(files)))


def format_result(result: Result) -> str:
    """In one line: motion, robot and outcome."""
    stages = len(result.record.u)
    outcome = result.solver.termination.name.lower()
    return f"<Result '{result.motion}' of {result.run.robot}: {outcome}, {stages} stages>"


setattr(Result, "__repr__", format_result)
setattr(Result, "_repr_html_", show_result)
setattr(Robot, "_repr_html_", show_robot)
setattr(Solution, "_repr_html_", show_solution)
