"""What goes wrong, with the engine's own messages."""

from __future__ import annotations

import numbers
import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._core import StepReport, StepsReport


class InputError(ValueError):
    """Input that cannot be used: a file, a name, a number, an array.

    The message says where, what was found, what was expected and what to do.
    """

    __module__ = "linden"


class StepError(RuntimeError):
    """A step that could not be taken; the state is that before it."""

    __module__ = "linden"

    report: StepReport | StepsReport
    """How the solve went: StepReport of step(), StepsReport of run()."""

    def __init__(self, message: str, report: StepReport | StepsReport) -> None:
        super().__init__(message)
        self.report = report


class InputWarning(UserWarning):
    """What a file or a scene says that was read with a grain of salt, or that does nothing."""

    __module__ = "linden"


def whole_number(argument: str, value: int) -> int:
    """The number; an InputError that names the argument for other numbers, a TypeError for what is none."""
    try:
        return operator.index(value)
    except TypeError:
        kind = InputError if isinstance(value, numbers.Number) else TypeError
        raise kind(f"{argument}: {value!r} is given; expected a whole number") from None


def name_list(argument: str, names: Sequence[str]) -> list[str]:
    """The names; an InputError for one that stands alone, which is a sequence of letters, and for what is no text."""
    if isinstance(names, str) or not all(isinstance(name, str) for name in names):
        raise InputError(f'{argument}: {names!r} is given; expected a list of names, such as ["q", "pose:hand"]')
    return list(names)
