"""The other side of the protocol: an agent of dmplay in a game that another program keeps."""

from collections.abc import Callable, Iterator
from typing import TextIO

import numpy as np

from dmplay.bots.protocol import GAMES, VERSION, Facts, choices, line, message, percept, seen
from dmplay.chance import Bools
from dmplay.core import Memory, Policy, Problem
from dmplay.errors import BadParameter

WORDS = 60  # characters of a bad line that are quoted
Seat = Callable[[Facts], tuple[Problem, int, Policy]]  # who plays where, by what hello says


class Speaker:
    """What an agent answers to each line."""

    def __init__(self, name: str, seat: Seat) -> None:
        self.over = False
        self._name = name
        self._sit = seat
        self._seated: tuple[Problem, int, Policy] | None = None
        self._memories: dict[int, Memory] = {}  # of each game

    def answer(self, text: str) -> str:
        """The answer to a line, '' where there is none to give; BadParameter where it is wrong."""
        try:
            return self._answer(message(text))
        except (KeyError, TypeError) as error:
            told = f"no {error}" if isinstance(error, KeyError) else str(error)
        except (ValueError, LookupError) as error:
            told = str(error)
        raise BadParameter(f"got {text.rstrip()[:WORDS]!r}: {told}")

    def _answer(self, said: Facts) -> str:
        kind = said["type"]
        if kind == "hello":
            return self._hello(said)
        if kind == "quit":
            self.over = True
        elif self._seated is None:
            raise BadParameter(f"expected hello before {kind}")
        elif kind == "turn":
            self._learn(said, *self._seated)
        elif kind == "act":
            return self._act(said, *self._seated)
        return ""

    def _hello(self, said: Facts) -> str:
        if said.get("protocol") != VERSION:
            raise BadParameter(f"protocol {said.get('protocol')!r}, expected {VERSION}")
        self._seated = self._sit(said)
        policy = self._seated[2]
        wants = [one for one in said.get("offers", []) if one == GAMES]
        facts = {"protocol": VERSION, "name": self._name, "draws": policy.draws, "wants": wants}
        return line("hello", facts)

    def _learn(self, said: Facts, problem: Problem, seat: int, policy: Policy) -> None:
        game = said.get("game", 0)
        if said["turn"]:
            told = percept(problem, seat, said)
            self._memories[game] = policy.update(self._memories[game], told)
        else:
            self._memories[game] = policy.begin(seen(problem, seat, said["observation"]))

    def _act(self, said: Facts, problem: Problem, seat: int, policy: Policy) -> str:
        luck = np.array([said.get("luck", [])], float)
        memory = self._memories[said.get("game", 0)]
        (chosen,) = policy.choose(memory, _legal(problem, seat, said["legal"]), luck)
        action = problem.actions[seat].fact(float(chosen))
        return line("act", {"id": said["id"], "action": action})


def _legal(problem: Problem, seat: int, told: object) -> Bools | None:
    """Which actions `[1, A]` may be done; None for all."""
    every = choices(problem, seat)
    if told == every or not isinstance(told, list):
        return None
    return np.array([[name in told for name in problem.actions[seat].labels]])


def speak(speaker: Speaker, lines: TextIO, out: TextIO) -> None:
    """Answers line by line until the other side has ended."""
    for text in _until(speaker, lines):
        answer = speaker.answer(text)
        if answer:
            out.write(answer)
            out.flush()


def _until(speaker: Speaker, lines: TextIO) -> Iterator[str]:
    while not speaker.over and (text := lines.readline()):
        yield text
