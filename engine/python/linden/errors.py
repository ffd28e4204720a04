"""What goes wrong, with the engine's own messages."""

from __future__ import annotations

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
