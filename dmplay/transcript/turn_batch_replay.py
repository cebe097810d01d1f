"""Replay of the blocks of a transcript in its session, with many turns computed at once."""

from collections.abc import Sequence
from contextlib import suppress
from math import prod

import numpy as np

from dmplay.core.arrays import Array, Bools, make_readonly, readonly_copy
from dmplay.core.session import Session, Turn
from dmplay.core.spaces import Labels
from dmplay.errors import BadTranscript, DmplayError
from dmplay.transcript.draws_and_actions import (
    read_actions,
    read_count,
    read_hint_counts,
    read_stated_beliefs,
    read_uniforms,
)
from dmplay.transcript.format import MAX_CACHED_LINES
from dmplay.transcript.reader import Block, Transcript

MIN_BATCH_TURNS, MAX_BATCH_TURNS = (4, 256)  # minimum and maximum turns that are computed at once
MAX_BATCH_NUMBERS = 2**21  # maximum numbers in the arrays that a batch may need


def apply_block(
    transcript: Transcript, block: Block, session: Session, actions: Sequence[float] = ()
) -> None:
    """Apply one block's inputs to the session; raise BadTranscript if that is impossible.

    The actions of a turn are read from the block, unless the caller has read them already.
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
                actions,
                read_uniforms(transcript, block, session.problem.uniform_counts.step),
                stated_beliefs=read_stated_beliefs(transcript, block, session.problem),
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
    """A replayer of the blocks of a transcript, which computes many turns at once.

    The state in a block of the file is assumed to be the state before the next turn. A state that
    is new, or has real numbers, which the file rounds, is computed from the previous state instead.
    A turn is accepted only if all turns before it led to the assumed states, so a false state in
    the file has no effect.
    """

    def __init__(self, transcript: Transcript, blocks: Sequence[Block], session: Session) -> None:
        self._transcript, self._blocks, self._session = transcript, blocks, session
        self._states_by_text: dict[str, Array] = {}  # states by their text in the file
        self._actions_by_id: dict[int, list[float]] = {}  # by the id of the value of a block
        problem = session.problem
        sizes = [
            problem.state_count,
            *(len(o) for o in problem.observations if isinstance(o, Labels)),
        ]
        self._max_batch_turns = min(
            MAX_BATCH_TURNS, MAX_BATCH_NUMBERS // prod(n for n in sizes if isinstance(n, int))
        )
        self._batch_start = 0
        # computed turns, the first of which is at `_batch_start`
        self._batch_turns: list[Turn] = []
        # False once a computed state was wrong, or could not be computed
        self._computes_states = session.initial_state.dtype.kind in "iubf"

    def apply_block(self, position: int) -> None:
        """Apply the block at a position; raise BadTranscript if that is impossible."""
        block, session = self._blocks[position], self._session
        if not 0 <= position - self._batch_start < len(self._batch_turns):
            batch = self.compute_turns_at_once(position)
            self._batch_start = position
            self._batch_turns = [] if batch is None else split_turns(batch)
        if self._batch_turns and block["turn"] == len(session.turns) + 1:
            session.append_turns(
                self._batch_turns[position - self._batch_start : position - self._batch_start + 1]
            )
        else:
            apply_block(self._transcript, block, session)

    def compute_turns_at_once(self, position: int) -> Turn | None:
        """Return as many turns from a position as can be computed at once `[T, ...]`; else None."""
        self._cache_state(self._blocks[position - 1], self._session.state)
        with suppress(Exception):  # errors are reported when turns are played one by one
            states = self._collect_states_before(position)
            if len(states) >= MIN_BATCH_TURNS:
                return self._step_blocks(
                    self._blocks[position : position + len(states)], np.array(states)
                )
        return None

    def _cache_state(self, block: Block, state: Array) -> None:
        """Cache the state after a block by its text in the file, if the text is exact."""
        state_text = block.get_value("state")
        if (
            isinstance(state_text, str)
            and len(self._states_by_text) < MAX_CACHED_LINES
            and self._is_exact_state(state)
        ):
            self._states_by_text[state_text] = state

    def _is_exact_state(self, state: Array) -> bool:
        """Return whether a state consists of integers or Booleans, like the initial state."""
        return state.dtype.kind in "iub" and state.dtype == self._session.initial_state.dtype

    def _collect_states_before(self, position: int) -> list[Array]:
        """Return the states before the turns from a position, as far as they are exact."""
        session, keys = self._session, self._blocks[position].keys
        remaining = (
            self._max_batch_turns
            if session.turn_limit is None
            else session.turn_limit - len(session.turns)
        )
        state_column = keys.index("state") if "state" in keys else None
        is_known = self._computes_states or self._is_exact_state(session.state)
        state = session.state if is_known else None
        states: list[Array] = []
        for index in range(
            position, min(position + min(remaining, self._max_batch_turns), len(self._blocks))
        ):
            block = self._blocks[index]
            if state is None or block.keys is not keys or "stated" in keys:
                break
            states.append(state)
            state_text = None if state_column is None else block.values[state_column]
            state = self._states_by_text.get(state_text) if isinstance(state_text, str) else None
            if state is None and self._computes_states:
                state = self._compute_next_state(block, states[-1])
                self._cache_state(block, state)
        return states

    def _compute_next_state(self, block: Block, s: Array) -> Array:
        """Return the state after a turn, computed from the state before it."""
        # This stays False if the turn cannot be played.
        self._computes_states, problem = False, self._session.problem
        u = read_uniforms(self._transcript, block, problem.uniform_counts.step)
        a = np.array([self._read_block_actions(block)])
        next_state: Array = problem.step(s[None], a, np.array([u])).state[0]
        self._computes_states = next_state.dtype == s.dtype
        return next_state

    def _step_blocks(self, blocks: Sequence[Block], s: Array) -> Turn | None:
        """Return the turns of blocks from assumed states, as far as each leads to the next state.

        Return None if there are none, or if a computed state was wrong.
        """
        problem, uniform_count = self._session.problem, self._session.problem.uniform_counts.step
        a = np.array([*map(self._read_block_actions, blocks)])
        turn_count = _count_leading_true(self._playable_mask(s, a))
        if not turn_count:
            return None
        uniforms = [
            read_uniforms(self._transcript, block, uniform_count) for block in blocks[:turn_count]
        ]
        s = make_readonly(s[:turn_count])
        a = make_readonly(a[:turn_count])
        u = make_readonly(np.array(uniforms))
        computed_states = self._computes_states
        self._computes_states = False  # This stays False unless a batch leads to the same bits.
        state, rewards, observations = problem.step(s, a, u)
        is_followed = (state[:-1] == s[1:]).reshape(turn_count - 1, -1).all(axis=1)
        turn_count = 1 + _count_leading_true(is_followed)
        self._computes_states = computed_states and turn_count == len(s)
        if self._computes_states != computed_states:
            return None
        next_states = readonly_copy(state[:turn_count])
        copied_observations = next_states
        if problem.partially_observable:
            copied_observations = readonly_copy(observations[:turn_count])
        turns = Turn(
            a[:turn_count],
            u[:turn_count],
            next_states,
            copied_observations,
            make_readonly(rewards[:turn_count] + 0.0),
        )
        lengths = {len(array) for array in turns if isinstance(array, np.ndarray)}
        return turns if lengths == {turn_count} else None

    def _playable_mask(self, s: Array, a: Array) -> Bools:
        """Return the mask `[T]` of turns that can be played: not over, and the actions legal."""
        problem = self._session.problem
        mask, legal = ~problem.terminal(s), problem.legal_actions_mask(s)
        if legal is not None:
            # Agents that choose a number have no mask.
            for seat in np.flatnonzero(problem.action_counts):
                mask &= legal[np.arange(len(s)), seat, a[:, seat].astype(int)]
        return mask

    def _read_block_actions(self, block: Block) -> list[float]:
        """Return the validated actions of a turn; a value that blocks share is read once."""
        value_id = id(block["actions"])
        actions = self._actions_by_id.get(value_id)
        if actions is None:
            problem = self._session.problem
            actions = [
                space.validate_action(action, "")
                for space, action in zip(
                    problem.actions, read_actions(self._transcript, block, problem), strict=True
                )
            ]
            if len(self._actions_by_id) < MAX_CACHED_LINES:
                self._actions_by_id[value_id] = actions
        return actions


def _count_leading_true(mask: Bools) -> int:
    """Return the number of True values before the first False."""
    return len(mask) if mask.all() else int(mask.argmin())


def split_turns(turns: Turn) -> list[Turn]:
    """Return turns `[T, ...]` as single turns.

    If states are observed, the observations are the same arrays as the states.
    """
    states = [*turns.state]
    observations = states if turns.observations is turns.state else turns.observations
    return [*map(Turn, turns.actions, turns.uniforms, states, observations, turns.rewards)]
