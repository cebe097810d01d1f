"""Decide the effect of a key pressed while a background task runs."""

from enum import Enum, auto

from dmplay.game.background_tasks import TaskInfo

QUIT_KEYS = ("q", "c-d")
CANCEL_KEYS = ("c-c", "escape")
# keys that undo or stop an agent's turn; during it they cancel it
STOP_MOVE_KEYS = ("backspace", "P", "A")


# keys that a finished game offers
AFTER_GAME_KEYS = ("enter", "left", "X", "pageup", "pagedown", "home", "end", "?")


class BusyKeyAction(Enum):
    """The effect of a key on the running task."""

    IGNORE = auto()
    RUN_LATER = auto()  # handle the key when the task has finished
    CANCEL = auto()
    CANCEL_THEN_RUN = auto()  # cancel the task, then handle the key


def is_command_key(key: str) -> bool:
    """Return whether a key is a command in every game: capitals and punctuation are."""
    return len(key) == 1 and not (key.islower() or key.isdigit())


def classify_busy_key(key: str, task_info: TaskInfo, trigger_key: str) -> BusyKeyAction:
    """Return the effect of a key pressed while a background task runs.

    The cancel keys cancel any task. While an agent chooses, only the quit keys have another effect.
    While a finished game is reviewed, its keys wait, or skip a part that can be skipped, and keys
    of actions, which a fast player pressed too late, have no effect. The quit keys wait for the
    medal. Otherwise, as for a hint, every key but `trigger_key`, which started the task, cancels it
    and runs.
    """
    if key in CANCEL_KEYS or (task_info.is_agent_move and key in STOP_MOVE_KEYS):
        return BusyKeyAction.CANCEL
    waits = key in AFTER_GAME_KEYS or (key in QUIT_KEYS and task_info.delays_quit)
    if task_info.is_after_game and waits:
        can_skip = task_info.can_be_skipped
        return BusyKeyAction.CANCEL_THEN_RUN if can_skip else BusyKeyAction.RUN_LATER
    if task_info.is_agent_move or (task_info.is_after_game and not is_command_key(key)):
        is_ignored = key not in QUIT_KEYS
    else:
        is_ignored = key == trigger_key
    return BusyKeyAction.IGNORE if is_ignored else BusyKeyAction.CANCEL_THEN_RUN
