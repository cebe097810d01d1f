"""The replay of a recorded game, turn by turn."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from dmplay.agents.base import SCRIPTED_PLAYERS
from dmplay.agents.script import Script
from dmplay.core.notebook_display import NotebookDisplay
from dmplay.core.problem import find_seat
from dmplay.core.session import Session
from dmplay.core.text import format_count
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.action_input import Keyboard
from dmplay.game.game import Game
from dmplay.game.hints.review import Review, review_actions
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.game.launch_requests import format_settings
from dmplay.game.saves import load_transcript
from dmplay.game.seats import list_human_seats, list_scripts
from dmplay.game.transcript_verification import describe_problem_change, load_transcript_problem
from dmplay.registry.problems import LoadedProblem, ProblemLike
from dmplay.transcript.concealment import mark_peeked_if_concealed
from dmplay.transcript.header import collect_header_facts
from dmplay.transcript.replay import start_session
from dmplay.transcript.turn_batch_replay import BatchReplayer

SEED_KEYS = ("seed", "episode")


class Playback(NotebookDisplay, Game):
    """A recorded game that is stepped through; hidden information is visible."""

    agents_only = True  # Players are called by their names, not "you".
    rewards_visible = True

    def __init__(
        self,
        path: Path,
        *,
        problem: ProblemLike | None = None,
        trusted: bool = False,
        peek: bool = False,
        loaded_problems: dict[object, LoadedProblem] | None = None,
    ) -> None:
        transcript = load_transcript(path)
        # by name and parameters, so that games of one problem share what is computed for it
        loaded_problems = {} if loaded_problems is None else loaded_problems
        header = transcript.header
        key = Path(transcript.path).parent, header.problem, repr(header.parameters)
        if key not in loaded_problems:
            loaded = load_transcript_problem(transcript, trusted=trusted, problem=problem)
            loaded_problems[key] = loaded
        loaded_problem = loaded_problems[key]
        self.transcript = mark_peeked_if_concealed(transcript, loaded_problem.problem, peek=peek)
        self._problem = loaded_problem.problem
        first_block, *blocks = self.transcript.blocks
        hint_blocks = [block for block in blocks if block.kind == "help"]
        other_blocks = [block for block in blocks if block.kind != "help"]
        self._blocks = [first_block, *hint_blocks, *other_blocks]
        self._first_index = self._next_index = 1 + len(hint_blocks)
        seats = list(self.transcript.header.seats.values())
        self._scripts: tuple[Script, ...] = ()
        if {*seats} & {*SCRIPTED_PLAYERS}:
            with suppress(DmplayError):  # The game is shown up to the error.
                self._scripts = list_scripts(self._make_session_before(len(self._blocks)), seats)
        keyboard = Keyboard(loaded_problem.problem, [], DEFAULT_KEY_PREFERENCES)  # no human seats
        super().__init__(
            loaded_problem.name, self._make_session_before(self._first_index), seats, keyboard
        )
        self.earlier_turns = self.transcript.header.turns_before_these_players
        earlier = self.transcript.header.describe_earlier_players()
        notes = [describe_problem_change(transcript, loaded_problem), earlier]
        self.warning = "; ".join(filter(None, notes))

    def _make_session_before(self, block_index: int) -> Session:
        """Return a session in the state before the block with this index."""
        session = start_session(
            self.transcript, self._problem, self.transcript.header.uniform_source
        )
        self._batch_replayer = BatchReplayer(self.transcript, self._blocks, session)
        for index in range(1, block_index):
            self._batch_replayer.apply_block(index)
        return session

    def _list_script_policies(self) -> tuple[Script, ...]:
        return self._scripts

    @property
    def settings(self) -> list[str]:
        """The parameters that differ from their defaults, as `NAME=VALUE` texts."""
        return format_settings(self.transcript.header.parameters)

    def _attach_session(self, session: Session) -> None:
        super()._attach_session(session)
        self.narrator.shows_uniforms = self.is_seed_visible

    def play_agent_turn(self) -> bool:
        """Play the next turn or event; return False at the end of the file.

        A reroll is played together with the turn that follows it.
        """
        if self.is_at_end:
            self.session.end(self.transcript.player_end_reason or "unfinished")
            return False
        self._play_next_block()
        if self._blocks[self._next_index - 1].kind == "reroll" and not self.is_at_end:
            self._play_next_block()  # the turn played by the reroll
        return True

    def _play_next_block(self) -> None:
        """Apply the next block of the transcript to the session."""
        self._batch_replayer.apply_block(self._next_index)
        self._next_index += 1

    @property
    def step_count(self) -> int:
        """The number of turns and events to step through; a reroll and its turn count as one."""
        return self._count_steps_before(len(self._blocks))

    def _count_steps_before(self, block_index: int) -> int:
        """Return the number of steps before the block with this index."""
        blocks = self._blocks[self._first_index : block_index]
        return len(blocks) - sum(block.kind == "reroll" for block in blocks[:-1])

    @property
    def is_at_end(self) -> bool:
        """True if all blocks have been played."""
        return self._next_index >= len(self._blocks)

    @property
    def reveal(self) -> bool:
        """True, because a recorded game is not concealed."""
        return True

    @property
    def is_seed_visible(self) -> bool:
        """True if the game has ended, was peeked into, or was played by agents alone."""
        is_disclosed = self.transcript.end_block is not None or self.transcript.header.peeked
        return is_disclosed or not list_human_seats(self.player_names)

    @property
    def transcript_path(self) -> Path | None:
        """The path of the replayed transcript."""
        return Path(self.transcript.path)

    @property
    def header(self) -> dict[str, object]:
        """The facts of the header by key: problem, parameters that were set, seats, seed, ...

        A seed that the player may not know yet is left out.
        """
        facts = collect_header_facts(self.transcript.header).items()
        return {key: value for key, value in facts if self.is_seed_visible or key not in SEED_KEYS}

    def go_to_turn(self, turn: int) -> None:
        """Step to the position after this number of turns.

        Raise BadParameter if the game has fewer turns.
        """
        turn_count = self.count_turns()
        if not 0 <= turn <= turn_count:
            raise BadParameter(f"turn: got {turn}, expected 0 to {turn_count}")
        while len(self.session.turns) > turn and self._count_steps_before(self._next_index):
            self.undo()
        while len(self.session.turns) < turn and not self.is_at_end:
            self.play_agent_turn()

    def go_to_start(self) -> None:
        """Go back to the position before the first turn or event."""
        self._next_index = self._first_index
        self._attach_session(self._make_session_before(self._first_index))

    def count_turns(self) -> int:
        """Return the number of turns at the end of the file."""
        turns = [block for block in self._blocks[self._first_index :] if block.kind == "turn"]
        number = turns[-1]["turn"] if turns else 0
        return number if isinstance(number, int) else 0

    def iter_turn_facts(self) -> Iterator[dict[str, object]]:
        """Play to the end; yield the facts of this position and of every turn, undo or reroll."""
        yield self.narrator.all_turn_facts()
        for turns_before in self.iter_agent_turns():
            added_turns = len(self.session.turns) - turns_before
            event = {1: {}, 0: {"event": "reroll"}}.get(added_turns, {"event": "undo"})
            yield self.narrator.all_turn_facts() | event

    def review_choices(self, seat: str = "") -> Review:
        """Play to the end of the file, and return the review of each choice of one seat.

        Without a seat, these are the choices of people and language models, or of all agents if
        agents alone played.
        """
        list(self.iter_agent_turns())
        problem = self.session.problem
        seats = list_human_seats(self.player_names) or [*range(len(problem.agents))]
        seats = [find_seat(problem, seat)] if seat else seats
        questions = [self.advice_question(reviewed_seat) for reviewed_seat in seats]
        return Review(review_actions(self.session, questions, can_sample=True))

    def redo(self) -> None:
        """Raise BadParameter, because a recorded game cannot be changed."""
        raise BadParameter("this is a replay; branch starts a game from this turn")

    def reroll(self) -> None:
        """Raise BadParameter, because a recorded game cannot be changed."""
        self.redo()

    def undo(self, turns: int = 1) -> None:
        """Step back by this number of turns and events.

        Raise BadParameter if there are fewer steps before the current one.
        """
        steps_back = self._count_steps_before(self._next_index)
        if steps_back < turns:
            message = f"undo {turns}: the start is only {format_count(steps_back, 'step')} back"
            raise BadParameter(message if steps_back else "this is the start of the replay")
        for _ in range(turns):
            self._next_index -= 1
            if self._blocks[self._next_index].kind == "turn":
                self.session.undo()
            if self._blocks[self._next_index - 1].kind == "reroll":
                self._next_index -= 1
            # Turns that an event had undone are played again from the start.
            if self._blocks[self._next_index].kind != "turn":
                self._attach_session(self._make_session_before(self._next_index))


def review(
    path: Path | str,
    *,
    problem: ProblemLike | None = None,
    seat: str = "",
    trusted: bool = False,
    peek: bool = False,
) -> Review:
    """Return each choice of a seat in a recorded game, with its values and its regret.

    Without a seat, these are the choices of people and language models, or of all agents if agents
    alone played. A `problem`, by name, class, function or object, takes the place of the recorded
    name. Code that the file names is imported only if it is `trusted`. `peek` shows hidden
    information of an unfinished game.
    """
    playback = Playback(Path(path), problem=problem, trusted=trusted, peek=peek)
    return playback.review_choices(seat)
