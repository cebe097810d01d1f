"""Feeding the blocks of a transcript to its session, the turns worked out many at once."""

from collections.abc import Sequence
from contextlib import suppress
from math import prod

import numpy as np

from dmplay.chance import Array, Bools
from dmplay.core import Labels, make_readonly, readonly_copy
from dmplay.errors import BadTranscript, DmplayError
from dmplay.session import Session, Turn
from dmplay.transcript.format import MAX_CACHED_LINES
from dmplay.transcript.inputs import read_actions, read_count, read_hint_counts, read_uniforms
from dmplay.transcript.reading import Block, Transcript

MIN_BATCH_TURNS, MAX_BATCH_TURNS = (
    4,
    256,
)  # turns for which it pays, and that are worked out at once
MAX_BATCH_NUMBERS = 2**21  # numbers that what may come of them all is held in


def apply_block(
    transcript: Transcript, block: Block, session: Session, actions: Sequence[float] = ()
) -> None:
    """Feeds one block's inputs to the session; raises BadTranscript where they cannot be.

    The actions of a turn are read from the block, unless that was done before.
    """
    try:
        if block.kind == "turn":
            expected = len(session.turns) + 1
            if block["turn"] != expected:
                raise transcript.error_at(
                    block.line, f"got turn {block['turn']}, expected {expected}"
                )
            actions = actions or read_actions(transcript, block, session.problem)
            session.advance(
                actions, read_uniforms(transcript, block, session.problem.uniform_counts.step)
            )
        elif block.kind == "help":
            session.hint_counts.update(read_hint_counts(transcript, block, session.problem))
        elif block.kind == "undo":
            session.undo(read_count(transcript, block, "undo"))
        else:
            session.undo()
            session.reroll_counts[len(session.turns) + 1] = read_count(transcript, block, "reroll")
    except BadTranscript:
        raise
    except DmplayError as error:
        raise transcript.error_at(block.line, str(error)) from None


class BatchReplayer:
    """Feeds blocks to a session, the turns worked out before they come.

    A state that the file tells of is taken for the one before the next turn; one of real numbers,
    which it rounds, is found from the one before it. A turn stands where all those before it led to
    the states that were taken: what is false in a file is not believed.
    """

    def __init__(self, transcript: Transcript, blocks: Sequence[Block], session: Session) -> None:
        self._transcript, self._blocks, self._session = transcript, blocks, session
        self._states_by_text: dict[str, Array] = {}  # states, by what the file calls them
        problem = session.problem
        each = [
            problem.state_count,
            *(len(o) for o in problem.observations if isinstance(o, Labels)),
        ]
        self._max_batch_turns = min(
            MAX_BATCH_TURNS, MAX_BATCH_NUMBERS // prod(n for n in each if isinstance(n, int))
        )
        self._batch_start = 0
        self._batch_turns: list[Turn] = []  # worked out, the first of them at that place
        self._has_real_states = session.initial_state.dtype.kind == "f"  # states that a file rounds

    def apply_block(self, position: int) -> None:
        """Feeds the block at this place; raises BadTranscript where that cannot be."""
        block, session = self._blocks[position], self._session
        if not 0 <= position - self._batch_start < len(self._batch_turns):
            many = self.compute_turns(position)
            self._batch_start, self._batch_turns = (
                position,
                [] if many is None else split_turns(many),
            )
        if self._batch_turns and block["turn"] == len(session.turns) + 1:
            session.append_turns(
                self._batch_turns[position - self._batch_start : position - self._batch_start + 1]
            )
        else:
            apply_block(self._transcript, block, session)

    def compute_turns(self, position: int) -> Turn | None:
        """As many turns from this place on as can be worked out at once `[T, ...]`, if any can."""
        self._cache_state(self._blocks[position - 1])
        with suppress(Exception):  # what is wrong is told where it is done turn by turn
            states = self._collect_states_before(position)
            if len(states) >= MIN_BATCH_TURNS:
                return self._step_blocks(
                    self._blocks[position : position + len(states)], np.array(states)
                )
        return None

    def _cache_state(self, block: Block) -> None:
        """Keeps what the file calls the present state, where it tells states exactly."""
        name, state = block.get("state"), self._session.state
        if (
            isinstance(name, str)
            and len(self._states_by_text) < MAX_CACHED_LINES
            and self._is_exact(state)
        ):
            self._states_by_text[name] = state

    def _is_exact(self, state: Array) -> bool:
        return state.dtype.kind in "iub" and state.dtype == self._session.initial_state.dtype

    def _collect_states_before(self, position: int) -> list[Array]:
        """The states before the turns from this place on, as far as they are known exactly."""
        session, keys = self._session, self._blocks[position].keys
        left = (
            self._max_batch_turns
            if session.turn_limit is None
            else session.turn_limit - len(session.turns)
        )
        named = keys.index("state") if "state" in keys else None
        known = self._has_real_states or self._is_exact(session.state)
        state = session.state if known else None
        states: list[Array] = []
        for at in range(
            position, min(position + min(left, self._max_batch_turns), len(self._blocks))
        ):
            block = self._blocks[at]
            if state is None or block.keys is not keys:
                break
            states.append(state)
            if self._has_real_states:
                state = self._compute_next_state(block, state)
            elif named is not None:
                name = block.values[named]
                state = self._states_by_text.get(name) if isinstance(name, str) else None
        return states

    def _compute_next_state(self, block: Block, s: Array) -> Array:
        """The state that a turn leads to."""
        self._has_real_states, problem = False, self._session.problem  # unless it can be played
        u = read_uniforms(self._transcript, block, problem.uniform_counts.step)
        a = np.array([self._read_block_actions(block)])
        after: Array = problem.step(s[None], a, np.array([u])).state[0]
        self._has_real_states = True
        return after

    def _step_blocks(self, blocks: Sequence[Block], s: Array) -> Turn | None:
        """The turns of these blocks from these states, as far as they follow each other."""
        problem, count = self._session.problem, self._session.problem.uniform_counts.step
        a = self._read_joint_actions(blocks)
        many = _count_leading_true(self._playable_mask(s, a))
        if not many:
            return None
        draws = [read_uniforms(self._transcript, block, count) for block in blocks[:many]]
        s, a, u = make_readonly(s[:many]), make_readonly(a[:many]), make_readonly(np.array(draws))
        real, self._has_real_states = (
            self._has_real_states,
            False,
        )  # unless a batch brings the same bits
        state, rewards, observations = problem.step(s, a, u)
        follow = (state[:-1] == s[1:]).reshape(many - 1, -1).all(axis=1)
        many = 1 + _count_leading_true(follow)
        self._has_real_states = real and many == len(s)
        if self._has_real_states != real:
            return None
        after = readonly_copy(state[:many])
        seen = readonly_copy(observations[:many]) if problem.partially_observable else after
        turns = Turn(a[:many], u[:many], after, seen, make_readonly(rewards[:many] + 0.0))
        return turns if {len(part) for part in turns} == {many} else None

    def _playable_mask(self, s: Array, a: Array) -> Bools:
        """In which of these states a turn can be played, and as it was `[T]`."""
        problem = self._session.problem
        able, legal = ~problem.terminal(s), problem.legal_actions_mask(s)
        if legal is not None:
            for seat in np.flatnonzero(problem.action_counts):  # not of those who choose a number
                able &= legal[np.arange(len(s)), seat, a[:, seat].astype(int)]
        return able

    def _read_joint_actions(self, blocks: Sequence[Block]) -> Array:
        """The actions of turns `[T, n]`; what blocks share is read once."""
        at = blocks[0].keys.index("actions")
        different = {id(block.values[at]): block for block in blocks}
        read = {one: self._read_block_actions(block) for one, block in different.items()}
        return np.array([read[id(block.values[at])] for block in blocks])

    def _read_block_actions(self, block: Block) -> list[float]:
        """The actions of a turn, as they will act."""
        problem = self._session.problem
        told = read_actions(self._transcript, block, problem)
        return [
            known.validate_action(did, "") for known, did in zip(problem.actions, told, strict=True)
        ]


def _count_leading_true(mask: Bools) -> int:
    """How many hold before the first that does not."""
    return len(mask) if mask.all() else int(mask.argmin())


def split_turns(turns: Turn) -> list[Turn]:
    """Turns `[T, ...]` one by one; where states are seen, each is held once."""
    states = [*turns.state]
    seen = states if turns.observations is turns.state else turns.observations
    each = zip(turns.actions, turns.uniforms, states, seen, turns.rewards, strict=True)
    return [*map(Turn._make, each)]
