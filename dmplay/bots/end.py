"""The end of a game for the programs in it: they are told of it, and what they logged is kept."""

import contextlib
import os
import re
from pathlib import Path

from dmplay import disk
from dmplay.bots.bot import Bot
from dmplay.bots.protocol import JsonObject
from dmplay.errors import DmplayError
from dmplay.session import Session
from dmplay.transcript.seal import RESUMABLE_END_REASONS


def close_bots(session: Session, game_name: str) -> list[Path]:
    """The logs of the programs in a game of this name; they are told its end, and end."""
    over: JsonObject = {"reason": session.end_reason, "turns": len(session.turns)}
    known = session.problem.rewards_observable or session.end_reason not in RESUMABLE_END_REASONS
    logs = []
    for follower in session.seated_policies:
        bot = follower and follower.policy
        if not follower or not isinstance(bot, Bot):
            continue
        if bot.is_running:
            sums = {"return": session.returns(), "total": session.total_rewards()}
            earned = {name: float(each[bot.seat]) for name, each in sums.items()} if known else {}
            bot.close(over | earned, follower.current_memory())
        logs += _save_log(f"{game_name} {session.problem.agents[bot.seat]}", bot.log)
    return logs


def _save_log(name: str, log: str) -> list[Path]:
    """The file of what was said on the standard error, in place of what was said there before."""
    place = disk.user_folder(os.environ, "XDG_STATE_HOME", ".local", "state")
    words = re.findall(r"\w+", name)
    path = place / f"{'-'.join(words)}.log"
    if log:
        with contextlib.suppress(DmplayError, OSError):
            place.mkdir(parents=True, exist_ok=True)
            disk.write_file(path, [log], force=True, private=True)
            return [path]
    return []
