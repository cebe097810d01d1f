"""The game's side of the bot protocol: a bot receives its seat's information, and requests."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from dmplay.core.arrays import Bools, Reals
from dmplay.core.problem import Problem
from dmplay.core.session import belief_size
from dmplay.core.spaces import Labels
from dmplay.core.typed_text import read_belief
from dmplay.errors import BadParameter, DmplayError, Forfeit
from dmplay.external.bots.protocol import (
    MANY_GAMES_OFFER,
    PROTOCOL_VERSION,
    JsonObject,
    decode_message,
    describe_choices,
    encode_message,
)

MIN_HELLO_SECONDS = 10.0  # minimum time limit for the answer to hello
MAX_IGNORED_LINES = 1000  # maximum lines between a request and its answer
MAX_UNIFORMS = 1000  # per choice
MAX_QUOTED_CHARACTERS = 60  # maximum characters of a bad line in an error message
MAX_OPEN_REQUESTS = 16  # requests that are sent before the first one is answered


class HistoryNode(NamedTuple):
    """A seat's percept and belief in one turn, linked to the node of the previous turn."""

    previous: "HistoryNode | None"
    turn: int
    facts: JsonObject
    belief: Reals | None
    game_number: int = 0  # index among the games that are played at once

    def list_nodes_after(self, last_sent: "HistoryNode | None") -> "list[HistoryNode]":
        """Return the nodes after another one, oldest first; all if that is not in this history."""
        nodes, node = [self], self
        while node is not last_sent and node.previous is not None:
            node = node.previous
            nodes.append(node)
        return [*reversed(nodes[:-1] if node is last_sent else nodes)]

    @property
    def turn_message(self) -> JsonObject:
        """The turn as the fields of a message."""
        return {"turn": self.turn, **self.facts}


class ActionRequest(NamedTuple):
    """A request for an action in a game with a certain history."""

    history: HistoryNode
    legal_actions_mask: Bools | None
    uniforms: Reals


class BotChannel(Protocol):
    """A connection that exchanges lines with a program."""

    log: bytes

    def send(self, text: str, seconds: float) -> None:
        """Send lines, which must be answered within `seconds`."""

    def read_line(self) -> str:
        """Return the next line from the program."""

    def close(self, farewell: str = "") -> None:
        """End the program, after these last lines or at once."""


class BotConversation:
    """A conversation with one program; Forfeit is raised if it violates the protocol."""

    def __init__(self, channel: BotChannel, problem: Problem, seat: int, clock: float) -> None:
        self.channel = channel
        self.uniform_count = 0  # number that the program requests for each choice
        self._problem, self._seat, self._clock = problem, seat, clock
        self._wants: list[str] = []
        self._last_sent: dict[
            int, HistoryNode
            # node of the last turn that was sent, by game; 0 for all games if there is one at a
            # time
        ] = {}
        self._last_id = 0
        # the node before the last action of each game, and the belief stated with that action
        self._stated: dict[int, tuple[HistoryNode, Reals | None]] = {}

    def exchange_hello(self, game_facts: JsonObject, offers: list[str]) -> None:
        """Send hello with the facts of a game, and store the requests in the program's answer."""
        problem, seat = self._problem, self._seat
        space = problem.observations[seat] if problem.partially_observable else None
        facts = {
            "seat": problem.agents[seat],
            "agents": problem.agents,
            "actions": describe_choices(problem, seat),
            "observations": space if isinstance(space, Labels) else None,
            "discount": problem.discount,
            "horizon": problem.horizon,
            "clock": self._clock,
            "offers": offers,
        }
        hello = encode_message("hello", {"protocol": PROTOCOL_VERSION, **game_facts, **facts})
        self.channel.send(hello, max(self._clock, MIN_HELLO_SECONDS))
        answer = self._read_answer("hello")
        if answer.get("protocol") != PROTOCOL_VERSION:
            explanation = f"got protocol {answer.get('protocol')!r}, expected {PROTOCOL_VERSION}"
            raise Forfeit("garbled", explanation)
        uniform_count, wants = answer.get("draws", 0), answer.get("wants", [])
        if type(uniform_count) is not int or not 0 <= uniform_count <= MAX_UNIFORMS:
            raise Forfeit("garbled", f"got draws {uniform_count!r}, expected 0 to {MAX_UNIFORMS}")
        if not isinstance(wants, list) or not all(request in offers for request in wants):
            raise Forfeit(
                "garbled", f"got wants {wants!r}, expected a list of offers: {', '.join(offers)}"
            )
        self.uniform_count, self._wants = uniform_count, wants

    def request_actions(self, requests: Sequence[ActionRequest]) -> list[float]:
        """Return the program's action for each request.

        If it plays many games at once, several requests are sent before the first is answered.
        """
        batch_size = MAX_OPEN_REQUESTS if MANY_GAMES_OFFER in self._wants else 1
        batches = (
            requests[start : start + batch_size] for start in range(0, len(requests), batch_size)
        )
        return [action for batch in batches for action in self._request_batch(batch)]

    def _request_batch(self, requests: Sequence[ActionRequest]) -> Iterator[float]:
        """Yield the actions for several requests; each answer restarts the time limit."""
        first_id, self._last_id = self._last_id + 1, self._last_id + len(requests)
        messages = [
            self._encode_request(request_id, request)
            for request_id, request in enumerate(requests, first_id)
        ]
        for request_id, request in enumerate(requests, first_id):
            try:
                self.channel.send("".join(messages), self._clock)
                messages.clear()
                answer = self._read_answer("act", request_id)
                stated = self._parse_belief(answer.get("belief"))
                self._stated[request.history.game_number] = request.history, stated
                yield self._parse_action(answer.get("action"), request.legal_actions_mask)
            except Forfeit as error:
                error.episode = request.history.game_number
                raise

    def _encode_request(self, request_id: int, request: ActionRequest) -> str:
        """Return the messages of a request: the game's new turns, then `act`."""
        history, legal, uniforms = request
        turn_messages = self._encode_new_turns(history)
        fields: JsonObject = {"id": request_id, **self._make_game_field(history)}
        fields |= {"turn": history.turn + 1, "observation": history.facts["observation"]}
        fields["legal"] = describe_choices(self._problem, self._seat, legal)
        if len(uniforms):
            fields["luck"] = uniforms.tolist()
        if "history" in self._wants:
            turn_messages = ""
            fields["history"] = [node.turn_message for node in history.list_nodes_after(None)]
        if "belief" in self._wants and history.belief is not None:
            problem = self._problem
            pairs = zip(problem.enumerate_states(), history.belief.tolist(), strict=True)
            fields["belief"] = {problem.format_state(state): p for state, p in pairs if p}
        return turn_messages + encode_message("act", fields)

    def _make_game_field(self, history: HistoryNode) -> JsonObject:
        """Return the index of the game as a field if the program plays many at once, else {}."""
        return {"game": history.game_number} if MANY_GAMES_OFFER in self._wants else {}

    def _encode_new_turns(self, history: HistoryNode) -> str:
        """Return messages for the turns that were not sent yet, and record them as sent."""
        game_field = self._make_game_field(history)
        key = history.game_number if game_field else 0
        nodes = history.list_nodes_after(self._last_sent.get(key))
        self._last_sent[key] = history
        return "".join(encode_message("turn", game_field | node.turn_message) for node in nodes)

    def _read_answer(self, kind: str, request_id: int = 0) -> JsonObject:
        """Return the answer to a request; skip answers to earlier ones and other messages.

        Raises Forfeit for a malformed line, a wrong id, or too many other lines.
        """
        for _ in range(MAX_IGNORED_LINES):
            text = self.channel.read_line()
            try:
                answer = decode_message(text)
            except ValueError as error:
                raise Forfeit(
                    "garbled", f"the bot sent {text[:MAX_QUOTED_CHARACTERS]!r}: {error}"
                ) from None
            answer_id = answer.get("id")
            if answer["type"] == kind and (kind == "hello" or answer_id == request_id):
                return answer
            if answer["type"] == kind and (
                type(answer_id) is not int or not 0 < answer_id < request_id
            ):
                raise Forfeit("garbled", f"got id {answer_id!r}, expected {request_id}")
        raise Forfeit("garbled", f"the bot sent {MAX_IGNORED_LINES} lines without an answer")

    def _parse_belief(self, value: object) -> Reals | None:
        """Return the belief `[S]` in an answer, None if there is none; raise Forfeit if invalid."""
        if value is None:
            return None
        try:
            if math.isinf(belief_size(self._problem)):
                raise BadParameter("got one, but there is no belief over hidden states")
            return read_belief(self._problem, value)
        except DmplayError as error:
            raise Forfeit("garbled", f"belief: {error}") from None

    def stated_belief(self, history: HistoryNode) -> Reals | None:
        """Return the belief `[S]` stated with the action after a history; None if none was."""
        node, stated = self._stated.get(history.game_number, (None, None))
        return stated if node is history else None

    def _parse_action(self, answer: object, legal: Bools | None) -> float:
        """Return the action in an answer; raise Forfeit if it is malformed or illegal."""
        space = self._problem.actions[self._seat]
        if type(answer) not in space.json_types:
            expected = "the name of an action" if space.labels else "a number"
            raise Forfeit("garbled", f"got action {answer!r}, expected {expected}")
        try:
            action = self._problem.parse_action(self._seat, str(answer))
        except DmplayError as error:
            raise Forfeit("illegal", str(error)) from None
        if legal is not None and space.labels and not legal[int(action)]:
            raise Forfeit(
                "illegal", f"got {answer}, expected one of {space.describe_actions(legal)}"
            )
        return action

    def close(self, end_facts: JsonObject | None, last: HistoryNode | None) -> bytes:
        """End the conversation, with the result if there is one, and return the program's log."""
        farewell = ""
        if end_facts is not None and last is not None:
            farewell = (
                self._encode_new_turns(last)
                + encode_message("over", end_facts)
                + encode_message("quit", {})
            )
        self.channel.close(farewell)
        return self.channel.log
