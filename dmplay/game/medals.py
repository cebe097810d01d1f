"""Medals: what a finished game lost, compared with agents that play from the same start.

Gold is for at most 1 % of the loss of random play, silver for at most the loss of a rule of thumb,
and bronze for less than that of random play. Where random play is absurd, a problem names another
careless agent in its place. The loss is the regret if it is known exactly, else the score that a
strong agent reaches more on average. Where random play is about as good as the best, luck decides,
and there is no medal; nor where half of the random games score as much as gold demands.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from dmplay.core.text import format_count
from dmplay.game.hints.hint_provider import MIN_DECIMALS, choose_decimals, format_fixed

MEDALS = ("gold", "silver", "bronze")
MAX_DECIMALS = 6  # of numbers that differ little
GOLD_SHARE = 0.01  # of the loss of random play
LOSS_TOLERANCE = 1e-9  # of the scale of rewards
NO_REASONS: Mapping[str, str] = {}
CLEAR_STANDARD_ERRORS = 2.0  # smallest difference of mean scores that is no matter of luck
NEGLIGIBLE_SHARE = 1e-3  # of the scale of rewards: a regret of random play that hardly matters


class AgentValue(NamedTuple):
    """The expected score of an agent from the start of a game, or its mean score in some games."""

    agent: str
    score: float
    is_exact: bool
    error: float = 0.0  # the standard error of the mean score
    rule: str = ""  # a clause on how it plays
    median: float = -math.inf  # the median score of these games

    def __str__(self) -> str:
        """Return the agent as a player in a sentence: its name, and how it plays."""
        if self.agent == "random":
            return "random play"
        return f"the rule {self.agent}{self.explanation}"

    @property
    def explanation(self) -> str:
        """The clause on its way to play, in brackets; '' if there is none."""
        rule = self.rule.partition(";")[0].partition(" (")[0]
        return f" ({rule})" if rule else ""


class Medal(NamedTuple):
    """The medal that a game earned, '' if none, and the largest loss for each medal.

    There are no limits if luck decides.
    """

    name: str
    loss: float
    best: AgentValue  # of the agent whose score loses nothing
    limits: Mapping[str, tuple[float, str]]  # by medal: the largest loss, and who loses it
    game_count: int  # games of each agent whose mean is used; 0 if all values are exact
    scale: float  # of the problem's rewards
    random: AgentValue
    missing: Mapping[str, str] = NO_REASONS  # by medal that cannot be won here: the reason
    rule: AgentValue | None = None  # the rule of thumb

    @property
    def is_best(self) -> bool:
        """True if it is gold."""
        return self.name == MEDALS[0]

    def __str__(self) -> str:
        """Return the medal, and the limit of the next better one, as one line.

        If there is no better one, it is the medal's own limit.
        """
        if not self.limits:
            return "no medals here: no play is clearly better than random"
        is_regret = self.best.is_exact
        better = MEDALS[: MEDALS.index(self.name)] if self.name else MEDALS
        name = next((name for name in reversed(better) if name in self.limits), self.name)
        limit, _ = self.limits[name]
        number = limit if is_regret else self.best.score - limit
        result = self.loss if is_regret else self.best.score - self.loss
        least = MIN_DECIMALS if is_regret else 0  # scores are often whole numbers
        decimals = _choose_distinct_decimals([result, number, 0.0], least)
        lost = f"{format_fixed(result, decimals)} (the regret)" if self.loss else "nothing"
        score = format_fixed(result, decimals)
        line = f"{self.name or 'no'} medal: "
        line += f"your choices lost {lost}" if is_regret else f"you scored {score}"
        if is_regret and not self.loss and self.is_best:
            return line
        degree = f"at {'most' if is_regret else 'least'}"
        if name == "bronze":
            degree = f"{'less' if is_regret else 'more'} than"
        player = {"silver": self.rule, "bronze": self.random}.get(name)
        source = f", the {'loss' if is_regret else 'average'} of {player}" if player else ""
        line += f"; {name} is for {degree} {format_fixed(number, decimals)}{source}"
        if name == self.name:
            line += "".join(f"; no {medal}: {self.missing[medal]}" for medal in better[::-1])
        return f"{line}; averages of {self.game_count} games each" if self.game_count else line

    def describe_score(self, limit_turns: int = 0) -> str:
        """Return the rank of the score among the mean scores of agents.

        `limit_turns` are those of a game that its turn limit ended.
        """
        best = self.best.agent
        if not self.limits:
            return self._describe_luck(limit_turns)
        has_rule = "silver" in self.limits and self.rule is not None
        rule = str(self.rule) if has_rule else best
        if self.rule and self.rule.agent == best:
            best = rule
        degree = "close to" if self.loss > 0 else "as good as"
        if self.loss < -LOSS_TOLERANCE * self.scale:
            degree = "above"
        ranks = {
            "gold": f"score {degree} the average of {best}",
            "silver": f"score above the average of {rule}, below that of {best}",
            "bronze": f"score above the average of {self.random}, below that of {rule}",
        }
        if rule == best:
            ranks["silver"] = ranks["gold"]
        return ranks.get(self.name, f"score not above the average of {self.random}")

    def _describe_luck(self, limit_turns: int) -> str:
        """Return the small difference of the scores of the best agent and of random play."""
        best, random = self.best.score, self.random.score
        turns = format_count(limit_turns, "turn")
        period = f"in {turns}, " if limit_turns else ""
        is_same = abs(best - random) <= LOSS_TOLERANCE * self.scale
        if self.best.is_exact or (is_same and not (self.best.error or self.random.error)):
            return f"{period}every way to play is about as good{' here' * (not period)}"
        decimals = choose_decimals([best, random], self.scale)
        means = f"{self.random} scored {format_fixed(random, decimals)}"
        rule = f"the agent {self.best.agent}"
        if self.rule and self.rule.agent == self.best.agent:
            rule = str(self.rule)
        means += f", {rule} {format_fixed(best, decimals)}"
        judgment = f"{period}luck counts for more than choices"
        if limit_turns and not self.best.error:  # every game of the best agent scores the same
            judgment = f"{turns} are too few to tell good play from bad"
        return f"{judgment}: on average of {self.game_count} games, {means}"

    @property
    def data(self) -> dict[str, object]:
        """The medal as data."""
        limits = {
            name: {"loss": loss, "agent": agent} for name, (loss, agent) in self.limits.items()
        }
        facts = {"medal": self.name or None, "loss": self.loss, "limits": limits}
        return {**facts, "exact": not self.game_count, "games": self.game_count}


def _choose_distinct_decimals(numbers: Sequence[float], least: int) -> int:
    """Return the number of decimals, at least this, that print different numbers differently."""
    decimals, different = least, len({*numbers})
    while decimals < MAX_DECIMALS and different > len(
        {format_fixed(number, decimals) for number in numbers}
    ):
        decimals += 1
    return decimals


def award_medal(  # noqa: PLR0913, PLR0917 - the values of the players
    loss: float,
    best: AgentValue,
    rule: AgentValue | None,
    random: AgentValue,
    game_count: int,
    scale: float,
) -> Medal:
    """Return the medal for a loss, without limits if random play loses hardly anything.

    Nor are there limits if half of the random games reach the score for gold.

    A rule of thumb that is worse than random play, or worth gold, gives no limit. `game_count` is
    that of the mean scores; the medal says so if one of them is used.
    """
    tolerance = LOSS_TOLERANCE * max(scale, abs(best.score))
    stake = best.score - random.score
    error = CLEAR_STANDARD_ERRORS * math.hypot(best.error, random.error)
    is_common = random.median >= best.score - GOLD_SHARE * stake and not best.is_exact
    least = max(error, tolerance if best.is_exact else 0.0, NEGLIGIBLE_SHARE * scale)
    if is_common or stake <= least:
        return Medal("", loss, best, {}, game_count, scale, random, rule=rule)
    limits, missing = {"gold": (GOLD_SHARE * stake, "")}, {}
    if rule and rule.agent == best.agent:
        limits = {"silver": (0.0, rule.agent)}
        missing["gold"] = "no better agent is quick enough to compare"
    elif rule is None:
        missing["silver"] = "no rule of thumb is known"
    elif best.score - rule.score <= limits["gold"][0]:
        missing["silver"] = f"{rule} wins gold"
    elif best.score - rule.score >= stake - tolerance:
        missing["silver"] = f"{rule} is no better than {random}"
    else:
        limits["silver"] = (best.score - rule.score, rule.agent)
    limits["bronze"] = (stake, random.agent)
    earned = [name for name, (limit, _) in limits.items() if loss <= limit + tolerance]
    if loss >= stake - tolerance:  # no better than random play
        earned = []
    values = [best, random, *[rule] * (rule is not None and "silver" in limits)]
    is_exact = all(value.is_exact for value in values if value)
    return Medal(
        (earned or [""])[0],
        loss,
        best,
        limits,
        0 if is_exact else game_count,
        scale,
        random,
        missing,
        rule,
    )
