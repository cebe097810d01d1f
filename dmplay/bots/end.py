"""The end of a game for the programs in it: they are told of it, and what they logged is kept."""

import contextlib
import os
import re
from pathlib import Path

from dmplay import disk
from dmplay.bots.bot import Bot
from dmplay.bots.protocol import Facts
from dmplay.errors import DmplayError
from dmplay.session import Session
from dmplay.transcript.seal import LEFT


def dismissed(session: Session, game: str) -> list[Path]:
    """The logs of the programs in a game of this name; they are told its end, and end."""
    over: Facts = {"reason": session.ending, "turns": len(session.turns)}
    known = session.problem.rewards_observed or session.ending not in LEFT
    logs = []
    for follower in session.followers:
        bot = follower and follower.policy
        if not follower or not isinstance(bot, Bot):
            continue
        if bot.running:
            sums = {"return": session.returns(), "total": session.totals()}
            earned = {name: float(each[bot.seat]) for name, each in sums.items()} if known else {}
            bot.close(over | earned, follower.memory())
        logs += _kept(f"{game} {session.problem.agents[bot.seat]}", bot.log)
    return logs


def _kept(name: str, log: str) -> list[Path]:
    """The file of what was said on the standard error, in place of what was said there before."""
    place = disk.user_folder(os.environ, "XDG_STATE_HOME", ".local", "state")
    words = re.findall(r"\w+", name)
    path = place / f"{'-'.join(words)}.log"
    if log:
        with contextlib.suppress(DmplayError, OSError):
            place.mkdir(parents=True, exist_ok=True)
            disk.write(path, [log], force=True, private=True)
            return [path]
    return []
