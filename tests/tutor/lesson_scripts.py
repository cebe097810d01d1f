"""Scripts of the built-in lessons: right answers, and wrong ones with their reasons."""

import re
from typing import NamedTuple

# A prediction, or the actions of a game: `3*east` are three lines.
RIGHT_ANSWERS: dict[str, tuple[str, ...]] = {
    "first-walk": ("(8,2) 0.7 (7,2) 0.15 (8,1) 0.15", "game: se se e", "(8,2)"),
    "discount": ("(5,0) (4,0) (2,0) (0,0)", "0.7", "game: 3*w sw sw e"),
    "watch-v-converge": ("-0.3", "5.92", "6", "10"),
    "greedy-is-wrong": ("nw", "(2,0)", "(4,2)", "game: nw w e"),
    "look-ahead": (
        "50",
        "(1,2)",
        "game: up down up left left down left up left right down down right up right up left "
        "right left up left 4*down left right down up down right down up right down left up "
        "left down up",
    ),
    "momentum": ("-0.25", "game: 18*right 38*left 60*right", "game: 17*right 37*left 60*right"),
    "push-to-zero": (
        "-1",
        "game: -0.270 0.485 -0.273 -0.063 -0.503 -0.535 0.171 -0.080 -0.763 -0.649",
        "0.055",
    ),
    "how-good-is-the-catcher": ("0.44", "0.074", "70", "game: 50 9*70"),
    "bayes-at-the-cradle": ("0.907", "0", "feed", "game: feed 3*ignore feed 5*ignore"),
    "alpha-vectors": ("-9", "0.506", "0.283", "hungry 0.25 sated 0.75"),
    "when-to-look": (
        "0.531",
        "0.25 0 0.75",
        "6",
        "game: 8*manufacture interrupt 11*manufacture",
    ),
    "collision-course": (
        "0.1875",
        "descend",
        "17",
        "game: 5*no-advisory 8*descend 28*no-advisory",
    ),
    "best-replies": ("scissors", "game: 3*paper,rock,scissors paper", "paper", "1/3"),
    "rounds-matter": (
        "defect",
        "game: 10*cooperate",
        "game: 9*cooperate defect",
        "tit-for-tat",
    ),
    "undercutting": ("98", "95", "2", "game: 5*96"),
    "hunt-and-hide": ("game: sw 3*se e e ne e e w w e", "game: 3*e se nw se nw w w e", "e"),
    "two-at-the-cradle": (
        "27.5",
        "feed",
        "game: 9*feed ignore",
        "game: e w w nw w se nw ne e se sw sw",
    ),
}


class WrongAnswer(NamedTuple):
    """A wrong answer to a step, and a part of the reason, with its numbers."""

    step: int  # from 1
    answer: str
    reason: str


WRONG_ANSWERS: dict[str, tuple[WrongAnswer, ...]] = {
    "first-walk": (
        WrongAnswer(1, "(8,2) 1", "1 for (8,2) is too high. You give 1 next state"),
        WrongAnswer(1, "(8,2) 0.7 (8,1) 0.15", "your probabilities add up to 0.85"),
        WrongAnswer(3, "(7,2)", "The random number of that turn is 0.612"),
    ),
    "discount": (
        WrongAnswer(1, "(4,0) (5,0) (2,0) (0,0)", "(4,0) is worth 1.537 less than (5,0)"),
        WrongAnswer(2, "0.9", "+5 in 4 steps would count 3.28 now"),
        WrongAnswer(3, "game: 12*e 60*se", "Turn 9 lost most: e was worth 2.032 less"),
    ),
    "watch-v-converge": (
        WrongAnswer(1, "0", "Before sweep 1, the best action leads to"),
        WrongAnswer(2, "6.3", "(6,0) with V = 10 or (5,0) with V = -0.3"),
        WrongAnswer(3, "3", "In sweep 3, a wrong action is best or ties with the best in 3 states"),
    ),
    "greedy-is-wrong": (
        WrongAnswer(1, "w", "its worst next state is worth -10 and has probability 0.15"),
        WrongAnswer(2, "(1,1)", "(1,1) has probability 0.7 and is worth 4.308"),
        WrongAnswer(3, "(1,1)", "there, the straight way loses 0; the goal is at least 1"),
    ),
    "look-ahead": (
        WrongAnswer(1, "5", "18 chose w"),
        WrongAnswer(2, "(8,1)", "20 chose se"),
        WrongAnswer(3, "game: 40*right,left,up", "corner scored 248"),
    ),
    "momentum": (
        WrongAnswer(1, "0.6", "0.6 is too high. The greatest one is reached after 38 of 200"),
        WrongAnswer(1, "-0.52", "-0.52 is too low"),
        WrongAnswer(3, "game: 20*left 38*right 38*left 60*right", "and 115 are allowed"),
    ),
    "push-to-zero": (
        WrongAnswer(1, "-0.5", "this one costs more by 0.305"),
        WrongAnswer(2, "game: 10*0", "optimal scored -1.114 and you -6.065"),
        WrongAnswer(3, "0.09", "turn 10 0.0039; yours is 0.009 a turn in 10 turns"),
    ),
    "how-good-is-the-catcher": (
        WrongAnswer(1, "0.25", "0.25 would follow if P(80) were 0.124 just before 'caught'"),
        WrongAnswer(3, "50", "50 scores 7.497 less on average than the best action"),
        WrongAnswer(4, "game: 10*50", "discounted regret 32.625 of at most 3"),
    ),
    "bayes-at-the-cradle": (
        WrongAnswer(1, "0.8", "0.8 would follow if P(hungry) were 0.333 just before 'crying'"),
        WrongAnswer(2, "0.5", "0.5 would follow if P(hungry) were 0.111 just before 'crying'"),
        WrongAnswer(4, "game: 10*feed", "Turn 10 lost most"),
    ),
    "alpha-vectors": (
        WrongAnswer(1, "-10", "it is 0.5 of the way from -5 (sure of sated) to -15"),
        WrongAnswer(3, "0.5", "At P(hungry) = 0.5, ignore is worth -13.352 and feed -10.81"),
        WrongAnswer(4, "hungry 0.5 sated 0.5", "singing loses 2.446"),
    ),
    "when-to-look": (
        WrongAnswer(1, "0.9", "only changes of the state count"),
        WrongAnswer(2, "0.5 0 0.5", "examine loses 0.039"),
        WrongAnswer(
            3, "2", "With 2 turns left, replace is worth -1.098, and another action is worth 0.5"
        ),
    ),
    "collision-course": (
        WrongAnswer(1, "0.25", "the height at the pass is 52 m on average, from 46 to 58 m"),
        WrongAnswer(2, "climb", "the probability of a collision is 0.703"),
        WrongAnswer(4, "game: 41*descend", "you chose descend 41 times; 10 are allowed"),
    ),
    "best-replies": (
        WrongAnswer(1, "rock", "beats the opponent's last one (its opponent is you)"),
        WrongAnswer(3, "scissors", "scissors pays 0.5 less on average than a best reply"),
        WrongAnswer(4, "0.5", "the reply paper earns the other agent 0.25"),
    ),
    "rounds-matter": (
        WrongAnswer(2, "game: 10*defect", "you scored -27; the goal is at least -10"),
        WrongAnswer(3, "game: 10*cooperate", "you scored -10; the goal is at least -9"),
        WrongAnswer(4, "grim", "grim would have played defect in round 4"),
    ),
    "undercutting": (
        WrongAnswer(1, "100", "100 pays 3 less than a best reply"),
        WrongAnswer(2, "2", "2 pays 93 less than a best reply"),
        WrongAnswer(3, "50", "if both play 50, each gets 50, and one that changes can get 51"),
    ),
    "hunt-and-hide": (
        WrongAnswer(1, "game: 12*nw", "you scored -7.176"),
        WrongAnswer(2, "game: 10*w", "the goal is at least 0"),
        WrongAnswer(3, "ne", "it plays this move with probability 0.333; the goal is at least 0.4"),
    ),
    "two-at-the-cradle": (
        WrongAnswer(1, "22.5", "each of the 2 agents would lose 11.25 on average"),
        WrongAnswer(2, "ignore", "P(sated) = 0.5, P(hungry) = 0.5"),
        WrongAnswer(3, "game: 10*ignore", "the goal is at least -27"),
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
