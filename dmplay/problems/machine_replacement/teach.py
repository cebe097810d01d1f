"""Reasons for the actions of machine replacement, and its rules of thumb."""

from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import (
    TAKE_BEST_REWARD,
    TRUST_LAST_OBSERVATION,
    TRUST_LIKELIEST,
    RuleOfThumb,
)

from .agents import EXAMINE, INTERRUPT, MANUFACTURE, REPLACE
from .rules import MachineReplacement


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the pays that decide between production and repair, and within each of them."""
    problem, belief = position.problem, position.current_belief
    assert isinstance(problem, MachineReplacement)
    if belief is None:
        return []
    pays = [f"{pay:.2f}" for pay in belief @ problem.tables.rewards[:, :, 0]]
    if action in {INTERRUPT, REPLACE}:
        return [
            f"Both parts work with probability {belief[0]:.2f}, and after a repair in any case.",
            "Interrupt and replace lead to the same, so the one that pays more now is better: "
            f"interrupt pays {pays[INTERRUPT]} on average, replace {pays[REPLACE]}.",
            f"Manufacture would now pay {pays[MANUFACTURE]}.",
        ]
    name, later = position.labels[action], belief @ problem.tables.transition[:, action, 0]
    return [
        f"Both parts work with probability {belief[0]:.2f}, and with {later:.2f} after {name}.",
        f"{name.capitalize()} now pays {pays[action]} on average; the cheaper repair pays "
        f"{max(pays[INTERRUPT:], key=float)}, and then both parts work.",
        "Manufacture and examine wear the machine in the same way; examine pays "
        f"{float(pays[MANUFACTURE]) - float(pays[EXAMINE]):.2f} less, for a clue to what failed.",
    ]


REASONS = give_reasons
RULES_OF_THUMB = [
    RuleOfThumb("manufacture, as it earns most", lambda _: "manufacture"),
    TAKE_BEST_REWARD,
    TRUST_LIKELIEST,
    TRUST_LAST_OBSERVATION,
]
PUZZLE_DAY = 3
