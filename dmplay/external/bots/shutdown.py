"""The end of a game for its bots: they receive the result, exit, and their logs are saved."""

import contextlib
import os
import re
from pathlib import Path

from dmplay.core import safe_files
from dmplay.core.session import Session
from dmplay.errors import DmplayError
from dmplay.external.bots.bot_policy import Bot
from dmplay.external.bots.protocol import JsonObject
from dmplay.transcript.concealment import RESUMABLE_END_REASONS


def close_bots(session: Session, game_name: str) -> list[Path]:
    """Send the result of a game to its bots, close them, and return the paths of their logs.

    Returns and totals are sent only if rewards are observable or the game cannot be resumed.
    """
    end_facts: JsonObject = {"reason": session.end_reason, "turns": len(session.turns)}
    rewards_visible = (
        session.problem.rewards_observable or session.end_reason not in RESUMABLE_END_REASONS
    )
    logs = []
    for seated_policy in session.seated_policies:
        bot = seated_policy and seated_policy.policy
        if not seated_policy or not isinstance(bot, Bot):
            continue
        if bot.is_running:
            sums = {"return": session.returns(), "total": session.total_rewards()}
            sum_facts = {}
            if rewards_visible:
                sum_facts = {name: float(values[bot.seat]) for name, values in sums.items()}
            bot.close(end_facts | sum_facts, seated_policy.current_memory())
        logs += _save_log(f"{game_name} {session.problem.agents[bot.seat]}", bot.log)
    return logs


def _save_log(name: str, log: str) -> list[Path]:
    """Write a bot's log in place of an earlier one, and return its path in a list.

    The list is empty if the log is empty or cannot be written.
    """
    folder = safe_files.user_folder(os.environ, "XDG_STATE_HOME", ".local", "state")
    words = re.findall(r"\w+", name)
    path = folder / f"{'-'.join(words)}.log"
    if log:
        with contextlib.suppress(DmplayError, OSError):
            folder.mkdir(parents=True, exist_ok=True)
            safe_files.write_file(path, [log], continues=True, private=True)
            return [path]
    return []
