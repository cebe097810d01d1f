"""Decide the effect of a key pressed while a background task runs."""

from enum import Enum, auto

from dmplay.game.background_tasks import TaskInfo

QUIT_KEYS = ("q", "c-d")
CANCEL_KEYS = ("c-c", "escape")
# keys that undo or stop an agent's turn; during it they cancel it
STOP_MOVE_KEYS = ("backspace", "P", "A")


# keys that a finished game offers; pressed during its review, they wait for it
AFTER_GAME_KEYS = ("enter", "left", "pageup", "pagedown", "home", "end", "?")


class BusyKeyAction(Enum):
    """The effect of a key on the running task."""

    IGNORE = auto()
    RUN_LATER = auto()  # handle the key when the task has finished
    CANCEL = auto()
    CANCEL_THEN_RUN = auto()  # cancel the task, then handle the key


def classify_busy_key(key: str, task_info: TaskInfo, trigger_key: str) -> BusyKeyAction:
    """Return the effect of a key pressed while a background task runs.

    The cancel keys cancel any task. While an agent chooses, only the quit keys have another effect.
    While a finished game is reviewed, its keys wait. Otherwise, as for a hint, every key but
    `trigger_key`, which started the task, cancels it and runs.
    """
    if key in CANCEL_KEYS or (task_info.is_agent_move and key in STOP_MOVE_KEYS):
        return BusyKeyAction.CANCEL
    if task_info.is_after_game and key in AFTER_GAME_KEYS:
        return BusyKeyAction.RUN_LATER
    is_ignored = key not in QUIT_KEYS if task_info.is_agent_move else key == trigger_key
    return BusyKeyAction.IGNORE if is_ignored else BusyKeyAction.CANCEL_THEN_RUN
