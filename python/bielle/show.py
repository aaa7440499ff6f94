"""How results show themselves: in one line; in notebooks the page of the report, which needs no network, in a frame."""

import html
import tempfile

from ._bielle import Result, make_report


def make_frame(page: str, height: int) -> str:
    """A page inside of another one."""
    return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="{height}" style="border: 0"></iframe>'


def show_result(result: Result) -> str:
    """The 3D replay and the plots of a result."""
    with tempfile.TemporaryDirectory() as directory:
        result.write(directory)
        return make_frame(make_report([directory]), 720)


def format_result(result: Result) -> str:
    """In one line: motion, robot and outcome."""
    stages = len(result.record.u)
    outcome = result.solver.termination.name.lower()
    return f"<Result '{result.motion}' of {result.run.robot}: {outcome}, {stages} stages>"


setattr(Result, "__repr__", format_result)
setattr(Result, "_repr_html_", show_result)
