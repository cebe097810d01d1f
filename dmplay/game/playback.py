"""A recorded game, to look at turn by turn."""

from pathlib import Path

from dmplay.describe import format_count
from dmplay.displayed import NotebookDisplay
from dmplay.errors import BadParameter
from dmplay.game.checking import describe_problem_change, load_transcript_problem
from dmplay.game.game import Game
from dmplay.game.request import format_settings
from dmplay.game.saves import load_transcript
from dmplay.game.seats import list_human_seats
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES
from dmplay.session import Session
from dmplay.transcript.feeding import BatchReplayer
from dmplay.transcript.replay import start_session
from dmplay.transcript.seal import disclose_transcript


class Playback(NotebookDisplay, Game):
    """A recorded game to step through; nothing in it is hidden any more."""

    agents_only = True  # who played is called by name; who plays on from there is "you"
    rewards_visible = True

    def __init__(self, path: Path, *, trusted: bool = False, peek: bool = False) -> None:
        transcript = load_transcript(path)
        found = load_transcript_problem(transcript, trusted=trusted)
        self.transcript = disclose_transcript(transcript, found.problem, peek=peek)
        self._problem = found.problem
        opening, *blocks = self.transcript.blocks
        helped = [block for block in blocks if block.kind == "help"]
        played = [block for block in blocks if block.kind != "help"]
        self._blocks = [opening, *helped, *played]
        self._first_index = self._next_index = 1 + len(helped)
        seats = list(self.transcript.header.seats.values())
        keyboard = Keyboard(found.problem, [], DEFAULT_KEY_PREFERENCES)  # nobody plays
        super().__init__(
            found.name, self._session_before(self._first_index), seats, keyboard
        )
        self.warning = describe_problem_change(transcript, found)

    def _session_before(self, block_index: int) -> Session:
        """The game before the block at this place."""
        session = start_session(
            self.transcript, self._problem, self.transcript.header.uniform_source
        )
        self._batch_replayer = BatchReplayer(self.transcript, self._blocks, session)
        for before in range(1, block_index):
            self._batch_replayer.apply_block(before)
        return session

    @property
    def settings(self) -> list[str]:
        """The parameters that differ from the default, as they are typed."""
        return format_settings(self.transcript.header.parameters)

    def _attach_session(self, session: Session) -> None:
        super()._attach_session(session)
        self.narrator.shows_uniforms = self.is_seed_visible

    def play_agent_turn(self) -> bool:
        """Shows the next turn or event; False at the end of the file."""
        if self.is_at_end:
            self.session.end(self.transcript.player_end_reason or "unfinished")
            return False
        self._play_next_block()
        if self._blocks[self._next_index - 1].kind == "reroll" and not self.is_at_end:
            self._play_next_block()  # the turn that came of it
        return True

    def _play_next_block(self) -> None:
        self._batch_replayer.apply_block(self._next_index)
        self._next_index += 1

    @property
    def step_count(self) -> int:
        """How many turns and events there are to be shown: a reroll and its turn are one."""
        return self._count_steps(len(self._blocks))

    def _count_steps(self, block_index: int) -> int:
        """How many there are before a place."""
        blocks = self._blocks[self._first_index : block_index]
        return len(blocks) - sum(block.kind == "reroll" for block in blocks[:-1])

    @property
    def is_at_end(self) -> bool:
        """Whether all of it was shown."""
        return self._next_index >= len(self._blocks)

    @property
    def reveal(self) -> bool:
        """Nothing is hidden."""
        return True

    @property
    def is_seed_visible(self) -> bool:
        """Whether it is no secret: of a game that people still play it may be one."""
        known = self.transcript.end_block is not None or self.transcript.header.peeked
        return known or not list_human_seats(self.player_names)

    @property
    def transcript_path(self) -> Path | None:
        """The file that is looked at."""
        return Path(self.transcript.path)

    def redo(self) -> None:
        """A recording is only looked at."""
        raise BadParameter("a recording is only looked at; branch plays on")

    def reroll(self) -> None:
        """A recording is only looked at."""
        self.redo()

    def undo(self, turns: int = 1) -> None:
        """Shows the place so many turns or events back."""
        shown = self._count_steps(self._next_index)
        if shown < turns:
            told = f"undo {turns}: the beginning is {format_count(shown, 'step')} back"
            raise BadParameter(told if shown else "this is the beginning")
        for _ in range(turns):
            self._next_index -= 1
            if self._blocks[self._next_index].kind == "turn":
                self.session.undo()
            if self._blocks[self._next_index - 1].kind == "reroll":
                self._next_index -= 1
            if self._blocks[self._next_index].kind != "turn":  # what it took back is played again
                self._attach_session(self._session_before(self._next_index))
