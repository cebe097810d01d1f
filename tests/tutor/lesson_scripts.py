"""Scripts of the built-in lessons: right answers, and wrong ones with their reasons."""

import re
from typing import NamedTuple

# A prediction, or the actions of a game: `3*east` are three lines.
RIGHT_ANSWERS: dict[str, tuple[str, ...]] = {
    "first-walk": ("(8,2) 0.7 (7,2) 0.15 (8,1) 0.15", "game: e e ne e e se e", "(5,2)"),
    "discount": ("(8,1) (5,2) (1,1) (1,2)", "0.7", "game: 3*w sw sw e"),
    "watch-v-converge": ("-0.3", "5.92", "6", "4.256"),
    "straight-to-the-exit": ("0.15", "nw", "(1,1)", "game: nw w e"),
    "look-ahead": ("0.444", "20", "w", "right"),
    "momentum": ("-0.25", "game: 18*right 38*left 60*right", "game: 17*right 37*left 60*right"),
    "push-to-zero": (
        "-1",
        "game: -0.270 0.485 -0.273 -0.063 -0.503 -0.535 0.171 -0.080 -0.763 -0.649",
        "0.055",
    ),
    "how-good-is-the-catcher": ("0.44", "0.074", "70", "game: 50 30 8*20"),
    "bayes-at-the-cradle": ("0.907", "0", "feed", "game: feed 3*ignore feed 5*ignore"),
    "alpha-vectors": ("-9", "0.506", "0.283", "0.1715"),
    "when-to-look": ("0.531", "6", "0.27 0 0.73", "game: 8*manufacture interrupt 11*manufacture"),
    "collision-course": ("0.1875", "descend", "17", "game: 5*no-advisory 8*descend 28*no-advisory"),
    "best-replies": ("scissors", "game: 3*paper,rock,scissors paper", "paper", "1/3"),
    "rounds-matter": ("-27", "game: 9*cooperate defect", "-24", "tit-for-tat"),
    "undercutting": ("98", "95", "2", "game: 10*95"),
    "hunt-and-hide": ("game: w ne e ne ne 5*e", "game: w w nw ne e e sw sw w nw", "1/3"),
    "two-at-the-cradle": (
        "27.5",
        "feed",
        "game: feed 5*ignore feed 3*ignore",
        "game: w w sw se e nw e se",
    ),
}


class WrongAnswer(NamedTuple):
    """A wrong answer to a step, and a part of the reason, with its numbers."""

    step: int  # from 1
    answer: str
    reason: str


WRONG_ANSWERS: dict[str, tuple[WrongAnswer, ...]] = {
    "first-walk": (
        WrongAnswer(1, "(8,2) 0.7 (7,2) 0.3", "0.3 for (7,2) is too high. You give 2 next states"),
        WrongAnswer(1, "(8,2) 0.7 (8,1) 0.15", "your probabilities add up to 0.85"),
        WrongAnswer(3, "(6,2)", "The random number of that turn is 0.983"),
    ),
    "discount": (
        WrongAnswer(1, "(8,1) (1,1) (1,2) (5,2)", "2 of the 6 pairs are in the wrong order"),
        WrongAnswer(2, "0.9", "w, towards +5, is worth 2.454 and e, towards +10, is worth 3.013"),
        WrongAnswer(3, "game: 12*e 60*se", "The largest loss was in turn 1: 0.3, by the action e"),
    ),
    "watch-v-converge": (
        WrongAnswer(
            1, "0", "with V = 0 and 0 before sweep 1; each of these steps also has a reward"
        ),
        WrongAnswer(3, "3", "In sweep 3, the best two actions are worth -0.813 and -0.813"),
        WrongAnswer(
            4,
            "0.426",
            "0.901 times the residual of sweep 10; all later sweeps count, sweep 10 does not",
        ),
    ),
    "straight-to-the-exit": (
        WrongAnswer(1, "0.3", "3 next states can follow"),
        WrongAnswer(2, "w", "its worst next state is worth -10 and has probability 0.15"),
        WrongAnswer(3, "(2,1)", "loses 1.431; the answer is right if this number is at least 2"),
    ),
    "look-ahead": (
        WrongAnswer(
            2,
            "10",
            "miss it with probability 0.197; the answer is right if this number is at most 0.05",
        ),
        WrongAnswer(
            3, "sw", "sw is worth 3.747, but the averages of the searches contain bad actions later"
        ),
        WrongAnswer(
            4, "down", "down scores 4 now, and the best play adds 10.2 on average in 1 more turn"
        ),
    ),
    "momentum": (
        WrongAnswer(1, "0.6", "0.6 is too high. The greatest one is reached after 38 of 200"),
        WrongAnswer(1, "-0.52", "-0.52 is too low"),
        WrongAnswer(
            3, "game: 20*left 38*right 38*left 60*right", "ended after 115 turns (turn limit)"
        ),
    ),
    "push-to-zero": (
        WrongAnswer(
            1, "-0.5", "without noise, 10 turns cost 1.29 by this rule; the first one alone"
        ),
        WrongAnswer(2, "game: 10*0", "optimal scored -1.114 and you -6.065"),
        WrongAnswer(3, "0.09", "yours is 0.009 in each turn on average, but turn 1 costs 0 (you"),
    ),
    "how-good-is-the-catcher": (
        WrongAnswer(2, "0.065", "0.065 is the chance in the state 60 alone"),
        WrongAnswer(3, "50", "this throw scores 7.497 less than the best one"),
        WrongAnswer(4, "game: 10*50", "the discounted regret is 105.745; the limit is 3"),
    ),
    "bayes-at-the-cradle": (
        WrongAnswer(1, "0.8", "0.8 is P(crying | hungry); the question is P(hungry | crying)"),
        WrongAnswer(2, "0.5", "0.5 would follow if P(hungry) were 0.111 just before 'crying'"),
        WrongAnswer(
            4, "game: 10*feed", "The largest loss was in turn 2: 3.033, by the action feed"
        ),
    ),
    "alpha-vectors": (
        WrongAnswer(1, "-10", "it is 0.5 of the way from -5 (sure of sated) to -15"),
        WrongAnswer(3, "0.5", "At P(hungry) = 0.5, ignore is worth -13.352 and feed -10.81"),
        WrongAnswer(
            4, "0.5", "0.5 is too high. If it were right, the best action would be worth -8.31 here"
        ),
    ),
    "when-to-look": (
        WrongAnswer(
            1, "0.9", "only changes of the state count. After the first action, it was 0.81"
        ),
        WrongAnswer(
            2, "2", "With 2 turns left, replace is worth -1.098, and another action is worth 0.5"
        ),
        WrongAnswer(
            3, "0.5 0 0.5", "0.039 less than the best action there; the answer is right if"
        ),
    ),
    "collision-course": (
        WrongAnswer(1, "0.25", "in at least 9 of 10 cases from 46 to 58 m"),
        WrongAnswer(2, "climb", "the probability of a collision is 0.703"),
        WrongAnswer(4, "game: 41*descend", "you chose descend 41 times; 10 are allowed"),
    ),
    "best-replies": (
        WrongAnswer(
            1,
            "rock",
            "was paper. Had it played rock in that round, it would have got -1, and you 1",
        ),
        WrongAnswer(3, "scissors", "scissors pays 0.5 less on average than a best reply"),
        WrongAnswer(4, "0.5", "the reply paper earns agent2 0.25 more on average"),
    ),
    "rounds-matter": (
        WrongAnswer(1, "-30", "the 10 rounds do not all pay you the same, but from -3 to 0"),
        WrongAnswer(2, "game: 10*cooperate", "you scored -10; the goal is at least -9"),
        WrongAnswer(4, "grim", "grim would have played defect in round 4"),
    ),
    "undercutting": (
        WrongAnswer(1, "100", "100 pays 3 less than a best reply"),
        WrongAnswer(2, "2", "2 pays 93 less than a best reply"),
        WrongAnswer(3, "50", "if both play 50, each gets 50, and one that changes can get 51"),
    ),
    "hunt-and-hide": (
        WrongAnswer(1, "game: 10*nw", "you scored -6.513; the goal is at least -6"),
        WrongAnswer(2, "game: 10*w", "the goal is at least 0"),
        WrongAnswer(3, "0.5", "the reply sw earns prey 7.5 more on average than in"),
    ),
    "two-at-the-cradle": (
        WrongAnswer(1, "17.5", "the same actions cost 7.5 in all if the state is sated"),
        WrongAnswer(2, "ignore", "ignore is worth 2.5 less than the best action"),
        WrongAnswer(3, "game: 10*feed", "you scored -26.283; the goal is at least -21"),
    ),
}


def list_lines(answer: str) -> list[str]:
    """Return the lines of an answer: the typed answer, or one action a line."""
    if not answer.startswith("game: "):
        return [answer]
    lines: list[str] = []
    for word in answer.removeprefix("game: ").split():
        repeated = re.fullmatch(r"(\d+)\*(.+)", word)
        count, actions = (int(repeated[1]), repeated[2]) if repeated else (1, word)
        lines += actions.split(",") * count
    return lines
