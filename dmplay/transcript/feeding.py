"""Feeding the blocks of a transcript to its session, the turns worked out many at once."""

from collections.abc import Sequence
from contextlib import suppress
from math import prod

import numpy as np

from dmplay.chance import Array, Bools
from dmplay.core import Labels, locked, own
from dmplay.errors import BadTranscript, DmplayError
from dmplay.session import Session, Turn
from dmplay.transcript.format import MOST_KNOWN
from dmplay.transcript.inputs import actions_of, count_of, draws_of, help_of
from dmplay.transcript.reading import Block, Transcript

FEW, MANY = 4, 256  # turns for which it pays, and that are worked out at once
ROOM = 2**21  # numbers that what may come of them all is held in


def feed(
    transcript: Transcript, block: Block, session: Session, actions: Sequence[float] = ()
) -> None:
    """Feeds one block's inputs to the session; raises BadTranscript where they cannot be.

    The actions of a turn are read from the block, unless that was done before.
    """
    try:
        if block.kind == "turn":
            expected = len(session.turns) + 1
            if block["turn"] != expected:
                raise transcript.fault(block.line, f"got turn {block['turn']}, expected {expected}")
            actions = actions or actions_of(transcript, block, session.problem)
            session.advance(actions, draws_of(transcript, block, session.problem.draws.step))
        elif block.kind == "help":
            session.help.update(help_of(transcript, block, session.problem))
        elif block.kind == "undo":
            session.undo(count_of(transcript, block, "undo"))
        else:
            session.undo()
            session.rerolls[len(session.turns) + 1] = count_of(transcript, block, "reroll")
    except BadTranscript:
        raise
    except DmplayError as error:
        raise transcript.fault(block.line, str(error)) from None


class Ahead:
    """Feeds blocks to a session, the turns worked out before they come.

    A state that the file tells of is taken for the one before the next turn; one of real numbers,
    which it rounds, is found from the one before it. A turn stands where all those before it led to
    the states that were taken: what is false in a file is not believed.
    """

    def __init__(self, transcript: Transcript, blocks: Sequence[Block], session: Session) -> None:
        self._transcript, self._blocks, self._session = transcript, blocks, session
        self._known: dict[str, Array] = {}  # states, by what the file calls them
        problem = session.problem
        each = [problem.states, *(len(o) for o in problem.observations if isinstance(o, Labels))]
        self._most = min(MANY, ROOM // prod(n for n in each if isinstance(n, int)))
        self._first = 0
        self._turns: list[Turn] = []  # worked out, the first of them at that place
        self._real = session.first.dtype.kind == "f"  # states that a file rounds

    def feed(self, place: int) -> None:
        """Feeds the block at this place; raises BadTranscript where that cannot be."""
        block, session = self._blocks[place], self._session
        if not 0 <= place - self._first < len(self._turns):
            many = self.turns(place)
            self._first, self._turns = place, [] if many is None else rows(many)
        if self._turns and block["turn"] == len(session.turns) + 1:
            session.repeat(self._turns[place - self._first : place - self._first + 1])
        else:
            feed(self._transcript, block, session)

    def turns(self, place: int) -> Turn | None:
        """As many turns from this place on as can be worked out at once `[T, ...]`, if any can."""
        self._learn(self._blocks[place - 1])
        with suppress(Exception):  # what is wrong is told where it is done turn by turn
            states = self._told(place)
            if len(states) >= FEW:
                return self._worked_out(self._blocks[place : place + len(states)], np.array(states))
        return None

    def _learn(self, block: Block) -> None:
        """Keeps what the file calls the present state, where it tells states exactly."""
        name, state = block.get("state"), self._session.state
        if isinstance(name, str) and len(self._known) < MOST_KNOWN and self._exact(state):
            self._known[name] = state

    def _exact(self, state: Array) -> bool:
        return state.dtype.kind in "iub" and state.dtype == self._session.first.dtype

    def _told(self, place: int) -> list[Array]:
        """The states before the turns from this place on, as far as they are known exactly."""
        session, keys = self._session, self._blocks[place].keys
        left = self._most if session.limit is None else session.limit - len(session.turns)
        named = keys.index("state") if "state" in keys else None
        known = self._real or self._exact(session.state)
        state = session.state if known else None
        states: list[Array] = []
        for at in range(place, min(place + min(left, self._most), len(self._blocks))):
            block = self._blocks[at]
            if state is None or block.keys is not keys:
                break
            states.append(state)
            if self._real:
                state = self._after(block, state)
            elif named is not None:
                name = block.values[named]
                state = self._known.get(name) if isinstance(name, str) else None
        return states

    def _after(self, block: Block, s: Array) -> Array:
        """The state that a turn leads to."""
        self._real, problem = False, self._session.problem  # unless it can be played
        u = draws_of(self._transcript, block, problem.draws.step)
        a = np.array([self._checked(block)])
        after: Array = problem.step(s[None], a, np.array([u])).state[0]
        self._real = True
        return after

    def _worked_out(self, blocks: Sequence[Block], s: Array) -> Turn | None:
        """The turns of these blocks from these states, as far as they follow each other."""
        problem, count = self._session.problem, self._session.problem.draws.step
        a = self._actions(blocks)
        many = _leading(self._able(s, a))
        if not many:
            return None
        draws = [draws_of(self._transcript, block, count) for block in blocks[:many]]
        s, a, u = locked(s[:many]), locked(a[:many]), locked(np.array(draws))
        real, self._real = self._real, False  # unless a batch brings the same bits
        state, rewards, observations = problem.step(s, a, u)
        follow = (state[:-1] == s[1:]).reshape(many - 1, -1).all(axis=1)
        many = 1 + _leading(follow)
        self._real = real and many == len(s)
        if self._real != real:
            return None
        after = own(state[:many])
        seen = own(observations[:many]) if problem.hidden else after
        turns = Turn(a[:many], u[:many], after, seen, locked(rewards[:many] + 0.0))
        return turns if {len(part) for part in turns} == {many} else None

    def _able(self, s: Array, a: Array) -> Bools:
        """In which of these states a turn can be played, and as it was `[T]`."""
        problem = self._session.problem
        able, legal = ~problem.terminal(s), problem.legal(s)
        if legal is not None:
            for seat in np.flatnonzero(problem.action_counts):  # not of those who choose a number
                able &= legal[np.arange(len(s)), seat, a[:, seat].astype(int)]
        return able

    def _actions(self, blocks: Sequence[Block]) -> Array:
        """The actions of turns `[T, n]`; what blocks share is read once."""
        at = blocks[0].keys.index("actions")
        different = {id(block.values[at]): block for block in blocks}
        read = {one: self._checked(block) for one, block in different.items()}
        return np.array([read[id(block.values[at])] for block in blocks])

    def _checked(self, block: Block) -> list[float]:
        """The actions of a turn, as they will act."""
        problem = self._session.problem
        told = actions_of(self._transcript, block, problem)
        return [known.check(did, "") for known, did in zip(problem.actions, told, strict=True)]


def _leading(holds: Bools) -> int:
    """How many hold before the first that does not."""
    return len(holds) if holds.all() else int(holds.argmin())


def rows(turns: Turn) -> list[Turn]:
    """Turns `[T, ...]` one by one; where states are seen, each is held once."""
    states = [*turns.state]
    seen = states if turns.observations is turns.state else turns.observations
    each = zip(turns.actions, turns.draws, states, seen, turns.rewards, strict=True)
    return [*map(Turn._make, each)]
