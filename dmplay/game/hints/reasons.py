"""Reasons for an action in the words of its problem, which its code defines as REASONS."""

from collections.abc import Sequence

from dmplay.errors import BadParameter
from dmplay.game.position import Position
from dmplay.registry.problem_module_exports import find_export, locate_export


def list_reasons(position: Position, action: float) -> tuple[str, ...]:
    """Return sentences on an action from REASONS, a function of a position and an action.

    The action is an index, or a number if the actions are numbers. The sentences are true of this
    action in this position, and use only what the seat knows. Empty if the problem's code defines
    none. Raise BadParameter if it returns anything but a list of texts.
    """
    problem = position.problem
    give_reasons = find_export(problem, "REASONS")
    if give_reasons is None:
        return ()
    if not callable(give_reasons):
        location = locate_export(problem, "REASONS")
        raise BadParameter(f"{location}: got {give_reasons!r}, expected a function")
    reasons: Sequence[object] = give_reasons(position, action)
    is_list = isinstance(reasons, Sequence) and not isinstance(reasons, str)
    if not is_list or not all(isinstance(reason, str) for reason in reasons):
        name = position.format_action(action)
        got = f"{name}: got {reasons!r}, expected a list of texts"
        raise BadParameter(f"{locate_export(problem, 'REASONS')}: {got}")
    return tuple(map(str, reasons))
