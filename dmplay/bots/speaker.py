"""The other side of the protocol: an agent of dmplay in a game that another program keeps."""

from collections.abc import Callable, Iterator
from typing import TextIO

import numpy as np

from dmplay.bots.protocol import (
    MANY_GAMES_OFFER,
    PROTOCOL_VERSION,
    JsonObject,
    decode_message,
    decode_observation,
    decode_percept,
    describe_choices,
    encode_message,
)
from dmplay.chance import Bools
from dmplay.core import Memory, Policy, Problem
from dmplay.errors import BadParameter

MAX_QUOTED_CHARACTERS = 60  # characters of a bad line that are quoted
SeatFactory = Callable[
    [JsonObject], tuple[Problem, int, Policy]
]  # who plays where, by what hello says


class BotServer:
    """What an agent answers to each line."""

    def __init__(self, agent_name: str, make_seat: SeatFactory) -> None:
        self.over = False
        self._agent_name = agent_name
        self._make_seat = make_seat
        self._seat: tuple[Problem, int, Policy] | None = None
        self._memories: dict[int, Memory] = {}  # of each game

    def answer(self, text: str) -> str:
        """The answer to a line, '' where there is none to give; BadParameter where it is wrong."""
        try:
            return self._answer_message(decode_message(text))
        except (KeyError, TypeError) as error:
            told = f"no {error}" if isinstance(error, KeyError) else str(error)
        except (ValueError, LookupError) as error:
            told = str(error)
        raise BadParameter(f"got {text.rstrip()[:MAX_QUOTED_CHARACTERS]!r}: {told}")

    def _answer_message(self, message: JsonObject) -> str:
        kind = message["type"]
        if kind == "hello":
            return self._answer_hello(message)
        if kind == "quit":
            self.over = True
        elif self._seat is None:
            raise BadParameter(f"expected hello before {kind}")
        elif kind == "turn":
            self._update_memory(message, *self._seat)
        elif kind == "act":
            return self._answer_act(message, *self._seat)
        return ""

    def _answer_hello(self, message: JsonObject) -> str:
        if message.get("protocol") != PROTOCOL_VERSION:
            raise BadParameter(f"protocol {message.get('protocol')!r}, expected {PROTOCOL_VERSION}")
        self._seat = self._make_seat(message)
        policy = self._seat[2]
        wants = [one for one in message.get("offers", []) if one == MANY_GAMES_OFFER]
        facts = {
            "protocol": PROTOCOL_VERSION,
            "name": self._agent_name,
            "draws": policy.uniform_count,
            "wants": wants,
        }
        return encode_message("hello", facts)

    def _update_memory(
        self, message: JsonObject, problem: Problem, seat: int, policy: Policy
    ) -> None:
        game = message.get("game", 0)
        if message["turn"]:
            told = decode_percept(problem, seat, message)
            self._memories[game] = policy.update_memory(self._memories[game], told)
        else:
            self._memories[game] = policy.initial_memory(
                decode_observation(problem, seat, message["observation"])
            )

    def _answer_act(self, message: JsonObject, problem: Problem, seat: int, policy: Policy) -> str:
        luck = np.array([message.get("luck", [])], float)
        memory = self._memories[message.get("game", 0)]
        (chosen,) = policy.choose(memory, _decode_legal_mask(problem, seat, message["legal"]), luck)
        action = problem.actions[seat].to_json_value(float(chosen))
        return encode_message("act", {"id": message["id"], "action": action})


def _decode_legal_mask(problem: Problem, seat: int, value: object) -> Bools | None:
    """Which actions `[1, A]` may be done; None for all."""
    every = describe_choices(problem, seat)
    if value == every or not isinstance(value, list):
        return None
    return np.array([[name in value for name in problem.actions[seat].labels]])


def serve_lines(server: BotServer, lines: TextIO, output: TextIO) -> None:
    """Answers line by line until the other side has ended."""
    for text in _read_until_quit(server, lines):
        answer = server.answer(text)
        if answer:
            output.write(answer)
            output.flush()


def _read_until_quit(server: BotServer, lines: TextIO) -> Iterator[str]:
    while not server.over and (text := lines.readline()):
        yield text
