"""The referee: a conversation with one program, which is told what its seat may know and asked."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from dmplay.bots.protocol import (
    MANY_GAMES_OFFER,
    PROTOCOL_VERSION,
    JsonObject,
    decode_message,
    describe_choices,
    encode_message,
)
from dmplay.chance import Bools, Reals
from dmplay.core import Labels, Problem
from dmplay.errors import DmplayError, Forfeit

MIN_HELLO_SECONDS = 10.0  # seconds at least to say hello
MAX_IGNORED_LINES = 1000  # lines between a question and its answer that answer nothing
MAX_UNIFORMS = 1000  # uniforms for a choice
MAX_QUOTED_CHARACTERS = 60  # characters of a bad line that are quoted
MAX_OPEN_REQUESTS = 16  # questions that are asked before the first of them is answered


class HistoryNode(NamedTuple):
    """What a seat learnt in a turn, after what it had learnt before."""

    previous: "HistoryNode | None"
    turn: int
    facts: JsonObject
    belief: Reals | None
    game_number: int = 0  # of those that are played at once

    def nodes_after(self, last_sent: "HistoryNode | None") -> "list[HistoryNode]":
        """What is to be told after that: all of the game where that is not a part of it."""
        new, one = [self], self
        while one is not last_sent and one.previous is not None:
            one = one.previous
            new.append(one)
        return [*reversed(new[:-1] if one is last_sent else new)]

    @property
    def turn_message(self) -> JsonObject:
        """The turn, as it is told."""
        return {"turn": self.turn, **self.facts}


class ActionRequest(NamedTuple):
    """What a program is asked in a game that has come so far."""

    history: HistoryNode
    legal_actions_mask: Bools | None
    uniforms: Reals


class BotChannel(Protocol):
    """How lines go to and from a program."""

    log: bytes

    def send(self, text: str, seconds: float) -> None:
        """Says lines, which are to be answered in so many seconds."""

    def read_line(self) -> str:
        """The next line that it says."""

    def close(self, farewell: str = "") -> None:
        """Has it end, after these last lines, or at once."""


class BotConversation:
    """What is said to a program and heard; Forfeit where it does not keep the protocol."""

    def __init__(self, channel: BotChannel, problem: Problem, seat: int, clock: float) -> None:
        self.channel = channel
        self.uniform_count = 0  # uniforms that the program wants for a choice
        self._problem, self._seat, self._clock = problem, seat, clock
        self._wants: list[str] = []
        self._last_sent: dict[
            int, HistoryNode
        ] = {}  # the last turn of each game, or of the one that it knows
        self._last_id = 0

    def exchange_hello(self, game_facts: JsonObject, offers: list[str]) -> None:
        """Says hello, with these facts of the game, and hears what the program wants."""
        problem, seat = self._problem, self._seat
        facts = {
            "seat": problem.agents[seat],
            "agents": problem.agents,
            "actions": describe_choices(problem, seat),
            "observations": _observation_labels(problem, seat),
            "discount": problem.discount,
            "horizon": problem.horizon,
            "clock": self._clock,
            "offers": offers,
        }
        hello = encode_message("hello", {"protocol": PROTOCOL_VERSION, **game_facts, **facts})
        self.channel.send(hello, max(self._clock, MIN_HELLO_SECONDS))
        answer = self._read_answer("hello")
        if answer.get("protocol") != PROTOCOL_VERSION:
            told = f"speaks protocol {answer.get('protocol')!r}, expected {PROTOCOL_VERSION}"
            raise Forfeit("garbled", told)
        draws, wants = answer.get("draws", 0), answer.get("wants", [])
        if type(draws) is not int or not 0 <= draws <= MAX_UNIFORMS:
            raise Forfeit("garbled", f"wants {draws!r} draws, expected 0 to {MAX_UNIFORMS}")
        if not isinstance(wants, list) or not all(one in offers for one in wants):
            raise Forfeit("garbled", f"wants {wants!r}, expected some of {', '.join(offers)}")
        self.uniform_count, self._wants = draws, wants

    def request_actions(self, requests: Sequence[ActionRequest]) -> list[float]:
        """What the program does in each game: some are asked at once where it plays many."""
        ahead = MAX_OPEN_REQUESTS if MANY_GAMES_OFFER in self._wants else 1
        parts = (requests[first : first + ahead] for first in range(0, len(requests), ahead))
        return [action for part in parts for action in self._request_batch(part)]

    def _request_batch(self, requests: Sequence[ActionRequest]) -> Iterator[float]:
        """What it does in some games; the clock begins anew with each answer."""
        first, self._last_id = self._last_id + 1, self._last_id + len(requests)
        said = [self._encode_request(number, one) for number, one in enumerate(requests, first)]
        for number, one in enumerate(requests, first):
            self.channel.send("".join(said), self._clock)
            said.clear()
            yield self._parse_action(
                self._read_answer("act", number).get("action"), one.legal_actions_mask
            )

    def _encode_request(self, request_id: int, request: ActionRequest) -> str:
        """What is new in a game, and what to do there."""
        now, legal, luck = request
        said = self._encode_new_turns(now)
        ask: JsonObject = {"id": request_id, **self._game_field(now)}
        ask |= {"turn": now.turn + 1, "observation": now.facts["observation"]}
        ask["legal"] = describe_choices(self._problem, self._seat, legal)
        if len(luck):
            ask["luck"] = luck.tolist()
        if "history" in self._wants:
            said, ask["history"] = "", [one.turn_message for one in now.nodes_after(None)]
        if "belief" in self._wants and now.belief is not None:
            ask["belief"] = self._encode_belief(now.belief)
        return said + encode_message("act", ask)

    def _game_field(self, history: HistoryNode) -> JsonObject:
        """Which game it is, for a program that plays many at once."""
        return {"game": history.game_number} if MANY_GAMES_OFFER in self._wants else {}

    def _encode_new_turns(self, history: HistoryNode) -> str:
        """The turns that the program was not told of yet."""
        known = self._game_field(history)
        place = history.game_number if known else 0
        new = history.nodes_after(self._last_sent.get(place))
        self._last_sent[place] = history
        return "".join(encode_message("turn", known | one.turn_message) for one in new)

    def _encode_belief(self, probabilities: Reals) -> JsonObject:
        problem = self._problem
        each = zip(problem.enumerate_states(), probabilities.tolist(), strict=True)
        return {problem.format_state(state): p for state, p in each if p}

    def _read_answer(self, kind: str, request_id: int = 0) -> JsonObject:
        """The answer to what was asked last; one to what nobody asks any more is passed over, and
        what is of another kind too.
        """
        for _ in range(MAX_IGNORED_LINES):
            text = self.channel.read_line()
            try:
                said = decode_message(text)
            except ValueError as error:
                raise Forfeit(
                    "garbled", f"said {text[:MAX_QUOTED_CHARACTERS]!r}: {error}"
                ) from None
            number = said.get("id")
            if said["type"] == kind and (kind == "hello" or number == request_id):
                return said
            if said["type"] == kind and (type(number) is not int or not 0 < number < request_id):
                raise Forfeit("garbled", f"answered id {number!r}, expected {request_id}")
        raise Forfeit("garbled", f"said {MAX_IGNORED_LINES} lines that answer nothing")

    def _parse_action(self, answer: object, legal: Bools | None) -> float:
        """The action that an answer names, if it can be done."""
        known = self._problem.actions[self._seat]
        if type(answer) not in known.json_types:
            raise Forfeit("garbled", f"answered action {answer!r}")
        try:
            action = self._problem.parse_action(self._seat, str(answer))
        except DmplayError as error:
            raise Forfeit("illegal", str(error)) from None
        if legal is not None and known.labels and not legal[int(action)]:
            raise Forfeit(
                "illegal", f"got {answer}, expected one of {known.describe_actions(legal)}"
            )
        return action

    def close(self, end_facts: JsonObject | None, last: HistoryNode | None) -> bytes:
        """Ends the talk, with a farewell where there is something to say; what was logged."""
        farewell = ""
        if end_facts is not None and last is not None:
            farewell = (
                self._encode_new_turns(last)
                + encode_message("over", end_facts)
                + encode_message("quit", {})
            )
        self.channel.close(farewell)
        return self.channel.log


def _observation_labels(problem: Problem, seat: int) -> Labels | None:
    """What a seat may observe, by name; None where that is a state, numbers or text."""
    known = problem.observations[seat] if problem.partially_observable else None
    return known if isinstance(known, Labels) else None
