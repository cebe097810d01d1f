"""Reasons, rules of thumb and puzzle games of a baby with several caregivers."""

from dmplay.core.text import join_words
from dmplay.game.position import Position
from dmplay.problems.crying_baby.teach import FEED_WHEN_CRYING
from dmplay.tutor.puzzle_mining import GameSetup


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the chance of a sated baby after each action, the explained one first.

    Return [] without a belief, and in the last turn, as no later hunger counts.
    """
    forecasts = {a: position.forecast(a) for a in (action, *position.legal_actions)}
    players, beliefs = forecasts[action].other_players, forecasts[action].beliefs
    if beliefs is None or position.turns_left == 1:
        return []
    chances = list[str]()
    for a, forecast in forecasts.items():
        assert forecast.beliefs is not None
        sated = float((forecast.probabilities @ forecast.beliefs)[0])
        chances.append(f"{sated:.2f} if you {position.labels[a]}")
    condition = players or f"if {position.problem.agents[1 - position.seat]} acts at random"
    chances[0] = f"with probability {chances[0]}"
    return [
        f"{condition[:1].upper()}{condition[1:]}, the baby is then sated {join_words(chances)}."
    ]


REASONS = give_reasons
RULES_OF_THUMB = [FEED_WHEN_CRYING]
PUZZLE_GAMES = [GameSetup({"caregiver2": "random"})]
PUZZLE_DAY = 7
