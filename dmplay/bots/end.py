"""The end of a game for the programs in it."""

from dmplay.bots.bot import Bot
from dmplay.bots.protocol import Facts
from dmplay.session import Session
from dmplay.transcript.seal import LEFT


def dismissed(session: Session) -> dict[str, str]:
    """What the programs in a game said on their standard error; they are told its end, and end."""
    logs: dict[str, str] = {}
    over: Facts = {"reason": session.ending, "turns": len(session.turns)}
    known = session.problem.rewards_observed or session.ending not in LEFT
    for follower in session.followers:
        bot = follower and follower.policy
        if not follower or not isinstance(bot, Bot):
            continue
        if bot.running:
            sums = {"return": session.returns(), "total": session.totals()}
            earned = {name: float(each[bot.seat]) for name, each in sums.items()} if known else {}
            bot.close(over | earned, follower.memory())
        logs[session.problem.agents[bot.seat]] = bot.log
    return logs
