"""The program's side of the bot protocol: a policy that plays in another program's game."""

from collections.abc import Callable
from typing import TextIO

import numpy as np

from dmplay.core.arrays import Bools, Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.errors import BadParameter
from dmplay.external.bots.protocol import (
    MANY_GAMES_OFFER,
    PROTOCOL_VERSION,
    JsonObject,
    decode_message,
    decode_observation,
    decode_percept,
    describe_choices,
    encode_message,
    make_value_error,
)

MAX_QUOTED_CHARACTERS = 60  # maximum characters of a bad line in an error message
# from the facts of a hello message
SeatFactory = Callable[[JsonObject], tuple[Problem, int, Policy]]


class BotServer:
    """A policy that answers the messages of the bot protocol."""

    def __init__(self, agent_name: str, make_seat: SeatFactory) -> None:
        self.over = False
        self._agent_name = agent_name
        self._make_seat = make_seat
        self._seat: tuple[Problem, int, Policy] | None = None
        self._memories: dict[int, Memory] = {}  # by game number
        self._line_number = 0

    def answer(self, text: str) -> str:
        """Return the answer to a line, '' if it needs none; raise BadParameter if it is invalid.

        The error has the number of the line and its beginning.
        """
        self._line_number += 1
        try:
            return self._answer_message(decode_message(text))
        except (KeyError, TypeError) as error:
            reason = f"field {error} is missing" if isinstance(error, KeyError) else str(error)
        except (ValueError, LookupError) as error:
            reason = str(error)
        quoted = repr(text.rstrip()[:MAX_QUOTED_CHARACTERS])
        raise BadParameter(f"line {self._line_number}: got {quoted}: {reason}")

    def _answer_message(self, message: JsonObject) -> str:
        """Return the answer to a message, '' if none; raise BadParameter before `hello`."""
        kind = message["type"]
        if kind == "hello":
            return self._answer_hello(message)
        if kind == "quit":
            self.over = True
        elif self._seat is None:
            raise BadParameter(f"got {kind}, expected hello first")
        elif kind == "turn":
            self._update_memory(message, *self._seat)
        elif kind == "act":
            return self._answer_act(message, *self._seat)
        return ""

    def _answer_hello(self, message: JsonObject) -> str:
        """Choose problem, seat and policy by a `hello` message, and return the answer."""
        if message.get("protocol") != PROTOCOL_VERSION:
            raise BadParameter(
                f"protocol: got {message.get('protocol')!r}, expected {PROTOCOL_VERSION}"
            )
        _check_hello(message)
        self._seat = self._make_seat(message)
        facts = {
            "protocol": PROTOCOL_VERSION,
            "name": self._agent_name,
            "draws": self._seat[2].uniform_count,
            "wants": [offer for offer in message.get("offers", []) if offer == MANY_GAMES_OFFER],
        }
        return encode_message("hello", facts)

    def _update_memory(
        self, message: JsonObject, problem: Problem, seat: int, policy: Policy
    ) -> None:
        """Update the policy's memory of a game by a `turn` message."""
        game, turn = _decode_count(message, "game", 0), _decode_count(message, "turn")
        if turn:
            memory = self._get_game_memory(game)
            turn_percept = decode_percept(problem, seat, message)
            for name in getattr(policy.update_memory, "required_fields", ()):
                if getattr(turn_percept, name) is None:
                    raise KeyError(name)
            self._memories[game] = policy.update_memory(memory, turn_percept)
        else:
            observation = decode_observation(problem, seat, message["observation"], initial=True)
            self._memories[game] = policy.initial_memory(observation)

    def _get_game_memory(self, game: int) -> Memory:
        """Return the memory of a game; raise BadParameter before its turn 0."""
        if game not in self._memories:
            raise BadParameter(f"game {game} has no turn 0; send its turn 0 first")
        return self._memories[game]

    def _answer_act(self, message: JsonObject, problem: Problem, seat: int, policy: Policy) -> str:
        """Return the policy's action as the answer to an `act` message."""
        uniforms = _decode_uniforms(message.get("luck", []), policy.uniform_count)
        memory = self._get_game_memory(_decode_count(message, "game", 0))
        legal = _decode_legal_mask(problem, seat, message["legal"])
        (choice,) = policy.choose(memory, legal, uniforms)
        action = problem.actions[seat].to_json_value(float(choice))
        facts = {"id": message["id"], "action": action}
        state_belief = getattr(policy, "stated_belief", None)
        beliefs = state_belief(memory) if state_belief else None
        if beliefs is not None and not np.isnan(beliefs).any():
            facts["belief"] = np.asarray(beliefs)[0].tolist()
        return encode_message("act", facts)


def _check_hello(message: JsonObject) -> None:
    """Raise KeyError if a field of a `hello` message is missing, BadParameter if it is invalid."""
    parameters, seat, turns = (message[name] for name in ("parameters", "seat", "turns"))
    offers = message.get("offers", [])
    for name, value, is_valid, expected in (
        ("parameters", parameters, isinstance(parameters, dict), "an object"),
        ("seat", seat, isinstance(seat, str), "a name"),
        (
            "turns",
            turns,
            turns is None or (type(turns) is int and turns >= 1),
            "a whole number, 1 or more, or null",
        ),
        ("offers", offers, isinstance(offers, list), "a list"),
    ):
        if not is_valid:
            raise BadParameter(f"{name} {value!r}, expected {expected}")


def _decode_legal_mask(problem: Problem, seat: int, value: object) -> Bools | None:
    """Return the mask `[1, A]` of the legal actions in a message; None if all are legal."""
    labels = problem.actions[seat].labels
    if value == describe_choices(problem, seat) or not labels:
        return None
    if not isinstance(value, list) or not value or any(name not in labels for name in value):
        raise make_value_error("legal", value, f"a list of one or more of {', '.join(labels)}")
    return np.array([[name in value for name in labels]])


def _decode_count(message: JsonObject, key: str, default: int | None = None) -> int:
    """Return a whole number of a message, 0 or more; raise BadParameter for any other value.

    Without a default, raise KeyError if the message does not have it.
    """
    value = message[key] if default is None else message.get(key, default)
    if type(value) is not int or value < 0:
        raise make_value_error(key, value, "a whole number, 0 or more")
    return value


def _decode_uniforms(values: object, count: int) -> Reals:
    """Return the uniforms `[1, count]` of an `act` message; raise BadParameter if they differ."""
    is_valid = (
        isinstance(values, list)
        and len(values) == count
        and all(type(value) in (int, float) and 0 <= value <= 1 for value in values)
    )
    if not is_valid:
        numbers = format_count(count, "number")
        raise make_value_error("luck", values, f"a list of {numbers} from 0 to 1")
    return np.array([values], float)


def serve_lines(server: BotServer, lines: TextIO, output: TextIO) -> None:
    """Read lines and write the answers until the input ends or the game sends `quit`."""
    while not server.over and (text := lines.readline()):
        answer = server.answer(text)
        if answer:
            output.write(answer)
            output.flush()
