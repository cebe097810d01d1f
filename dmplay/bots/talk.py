"""The referee: a conversation with one program, which is told what its seat may know and asked."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from dmplay.bots.protocol import GAMES, VERSION, Facts, choices, line, message
from dmplay.chance import Bools, Reals
from dmplay.core import Labels, Problem
from dmplay.errors import DmplayError, Forfeit

FIRST = 10.0  # seconds at least to say hello
UNASKED = 1000  # lines between a question and its answer that answer nothing
MOST_LUCK = 1000  # uniforms for a choice
WORDS = 60  # characters of a bad line that are quoted
AHEAD = 16  # questions that are asked before the first of them is answered


class Seen(NamedTuple):
    """What a seat learnt in a turn, after what it had learnt before."""

    before: "Seen | None"
    turn: int
    facts: Facts
    belief: Reals | None
    game: int = 0  # of those that are played at once

    def since(self, told: "Seen | None") -> "list[Seen]":
        """What is to be told after that: all of the game where that is not a part of it."""
        new, one = [self], self
        while one is not told and one.before is not None:
            one = one.before
            new.append(one)
        return [*reversed(new[:-1] if one is told else new)]

    @property
    def told(self) -> Facts:
        """The turn, as it is told."""
        return {"turn": self.turn, **self.facts}


class Asked(NamedTuple):
    """What a program is asked in a game that has come so far."""

    now: Seen
    legal: Bools | None
    luck: Reals


class Channel(Protocol):
    """How lines go to and from a program."""

    log: bytes

    def say(self, text: str, seconds: float) -> None:
        """Says lines, which are to be answered in so many seconds."""

    def line(self) -> str:
        """The next line that it says."""

    def close(self, farewell: str = "") -> None:
        """Has it end, after these last lines, or at once."""


class Talk:
    """What is said to a program and heard; Forfeit where it does not keep the protocol."""

    def __init__(self, channel: Channel, problem: Problem, seat: int, clock: float) -> None:
        self.channel = channel
        self.draws = 0  # uniforms that the program wants for a choice
        self._problem, self._seat, self._clock = problem, seat, clock
        self._wants: list[str] = []
        self._told: dict[int, Seen] = {}  # the last turn of each game, or of the one that it knows
        self._id = 0

    def meet(self, game: Facts, offers: list[str]) -> None:
        """Says hello, with these facts of the game, and hears what the program wants."""
        problem, seat = self._problem, self._seat
        facts = {
            "seat": problem.agents[seat],
            "agents": problem.agents,
            "actions": choices(problem, seat),
            "observations": _names(problem, seat),
            "discount": problem.discount,
            "horizon": problem.horizon,
            "clock": self._clock,
            "offers": offers,
        }
        hello = line("hello", {"protocol": VERSION, **game, **facts})
        self.channel.say(hello, max(self._clock, FIRST))
        answer = self._heard("hello")
        if answer.get("protocol") != VERSION:
            told = f"speaks protocol {answer.get('protocol')!r}, expected {VERSION}"
            raise Forfeit("garbled", told)
        draws, wants = answer.get("draws", 0), answer.get("wants", [])
        if type(draws) is not int or not 0 <= draws <= MOST_LUCK:
            raise Forfeit("garbled", f"wants {draws!r} draws, expected 0 to {MOST_LUCK}")
        if not isinstance(wants, list) or not all(one in offers for one in wants):
            raise Forfeit("garbled", f"wants {wants!r}, expected some of {', '.join(offers)}")
        self.draws, self._wants = draws, wants

    def asked(self, games: Sequence[Asked]) -> list[float]:
        """What the program does in each game: some are asked at once where it plays many."""
        ahead = AHEAD if GAMES in self._wants else 1
        parts = (games[first : first + ahead] for first in range(0, len(games), ahead))
        return [action for part in parts for action in self._answered(part)]

    def _answered(self, games: Sequence[Asked]) -> Iterator[float]:
        """What it does in some games; the clock begins anew with each answer."""
        first, self._id = self._id + 1, self._id + len(games)
        said = [self._question(number, one) for number, one in enumerate(games, first)]
        for number, one in enumerate(games, first):
            self.channel.say("".join(said), self._clock)
            said.clear()
            yield self._action(self._heard("act", number).get("action"), one.legal)

    def _question(self, number: int, asked: Asked) -> str:
        """What is new in a game, and what to do there."""
        now, legal, luck = asked
        said = self._new(now)
        ask: Facts = {"id": number, **self._game(now)}
        ask |= {"turn": now.turn + 1, "observation": now.facts["observation"]}
        ask["legal"] = choices(self._problem, self._seat, legal)
        if len(luck):
            ask["luck"] = luck.tolist()
        if "history" in self._wants:
            said, ask["history"] = "", [one.told for one in now.since(None)]
        if "belief" in self._wants and now.belief is not None:
            ask["belief"] = self._believed(now.belief)
        return said + line("act", ask)

    def _game(self, now: Seen) -> Facts:
        """Which game it is, for a program that plays many at once."""
        return {"game": now.game} if GAMES in self._wants else {}

    def _new(self, now: Seen) -> str:
        """The turns that the program was not told of yet."""
        known = self._game(now)
        place = now.game if known else 0
        new = now.since(self._told.get(place))
        self._told[place] = now
        return "".join(line("turn", known | one.told) for one in new)

    def _believed(self, probabilities: Reals) -> Facts:
        problem = self._problem
        each = zip(problem.enumerated(), probabilities.tolist(), strict=True)
        return {problem.notation(state): p for state, p in each if p}

    def _heard(self, kind: str, wanted: int = 0) -> Facts:
        """The answer to what was asked last; one to what nobody asks any more is passed over, and
        what is of another kind too.
        """
        for _ in range(UNASKED):
            text = self.channel.line()
            try:
                said = message(text)
            except ValueError as error:
                raise Forfeit("garbled", f"said {text[:WORDS]!r}: {error}") from None
            number = said.get("id")
            if said["type"] == kind and (kind == "hello" or number == wanted):
                return said
            if said["type"] == kind and (type(number) is not int or not 0 < number < wanted):
                raise Forfeit("garbled", f"answered id {number!r}, expected {wanted}")
        raise Forfeit("garbled", f"said {UNASKED} lines that answer nothing")

    def _action(self, told: object, legal: Bools | None) -> float:
        """The action that an answer names, if it can be done."""
        known = self._problem.actions[self._seat]
        if type(told) not in known.written:
            raise Forfeit("garbled", f"answered action {told!r}")
        try:
            action = self._problem.action(self._seat, str(told))
        except DmplayError as error:
            raise Forfeit("illegal", str(error)) from None
        if legal is not None and known.labels and not legal[int(action)]:
            raise Forfeit("illegal", f"got {told}, expected one of {known.words(legal)}")
        return action

    def over(self, end: Facts | None, last: Seen | None) -> bytes:
        """Ends the talk, with a farewell where there is something to say; what was logged."""
        farewell = ""
        if end is not None and last is not None:
            farewell = self._new(last) + line("over", end) + line("quit", {})
        self.channel.close(farewell)
        return self.channel.log


def _names(problem: Problem, seat: int) -> Labels | None:
    """What a seat may observe, by name; None where that is a state, numbers or text."""
    known = problem.observations[seat] if problem.hidden else None
    return known if isinstance(known, Labels) else None
