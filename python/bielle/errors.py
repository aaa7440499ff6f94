"""Errors of Bielle."""

from typing import Tuple, Type


class InputError(ValueError):
    """Invalid input: what is wrong with which element of which file, and the remedy.

    Fields: file ("" for what was built in a program), element, problem, remedy.
    """

    __module__ = "bielle"

    def __init__(self, message: str, file: str = "", element: str = "", problem: str = "", remedy: str = "") -> None:
        super().__init__(message)
        self.file = file
        self.element = element
        self.problem = problem
        self.remedy = remedy

    def __reduce__(self) -> Tuple[Type["InputError"], Tuple[str, str, str, str, str]]:
        return type(self), (str(self), self.file, self.element, self.problem, self.remedy)
