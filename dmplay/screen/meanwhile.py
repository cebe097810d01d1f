"""What a key does while something is thought of."""

from enum import Enum, auto

from dmplay.thought import TaskInfo

QUIT_KEYS = ("q", "c-d")
CANCEL_KEYS = ("c-c", "escape")
STOP_MOVE_KEYS = ("backspace", "P", "A")  # what undoes or stops an agent's move does it before


class BusyKeyAction(Enum):
    """What becomes of the key, and of the thought."""

    IGNORE = auto()
    CANCEL = auto()
    CANCEL_THEN_RUN = auto()  # after it cancelled


def classify_busy_key(key: str, task_info: TaskInfo, trigger_key: str) -> BusyKeyAction:
    """An agent's move can only be cancelled or left; a hint, by any key but the one that asked."""
    if key in CANCEL_KEYS or (task_info.is_agent_move and key in STOP_MOVE_KEYS):
        return BusyKeyAction.CANCEL
    waits = key not in QUIT_KEYS if task_info.is_agent_move else key == trigger_key
    return BusyKeyAction.IGNORE if waits else BusyKeyAction.CANCEL_THEN_RUN
