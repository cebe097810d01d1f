"""The controller of a series of games: the current game, and how the next one starts."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from dmplay.core.text import format_count
from dmplay.errors import BadParameter
from dmplay.game import saves
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.command_line_results import CliInterpreter, PlayCommand, TutorCommand
from dmplay.game.command_reply import Page
from dmplay.game.game import Game
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.player_records import LOST_MEDAL, can_earn_medal
from dmplay.transcript.concealment import GameKey, make_game_key
from dmplay.transcript.recorder import Recorder

if TYPE_CHECKING:  # Most games need no algorithms.
    from dmplay.game.watching import WatchedSteps

NO_ALIASES: Mapping[str, str] = {}
NUMBERED_STEM = re.compile(r"(.*)-(\d+)")


class GameController:
    """A controller that runs one game at a time and ends each game before the next."""

    def __init__(
        self,
        game: Game | None = None,
        cli_interpreter: CliInterpreter | None = None,
        aliases: Mapping[str, str] = NO_ALIASES,
        on_game_end: Callable[[Recorder, str], object] | None = None,
    ) -> None:
        self.is_interactive = False  # whether people type; else a script is run
        self.finished_games: dict[Recorder, str] = {}  # problem names by transcript of ended games
        self._previous_recorders: list[Recorder] = []  # the previous game's transcript, if saved
        self.save_removal = saves.SaveRemoval()  # old saves deleted for these games
        self.open_screen: Callable[[], None] | None = None  # set if a full screen is available
        # runs a lesson; set while a person types in the shell
        self.open_lesson: Callable[[TutorCommand], object] | None = None
        # shows the steps of an algorithm and returns a reply; set if a full screen is available
        self.open_viewer: Callable[[WatchedSteps], str] | None = None
        self.aliases = aliases
        # called between turns that need no player
        self.on_intermediate_turn: Callable[[], object] = lambda: None
        # runs CLI words; called at each end
        self.last_unaided_game: Game | None = None  # that a person finished without help
        self.cli_interpreter, self._on_game_end = cli_interpreter, on_game_end
        self._game: Game | None = None
        self._helped_game: Game | None = None  # the last one that had help, or had it before
        self._game_key: GameKey | None = None  # the key of the current game
        self._disclosed_games: set[GameKey] = set()  # games whose hidden information was shown
        # all games, with the latest transcript
        self._path_by_game_key: dict[GameKey, Path | None] = {}
        self._pending_confirmation = ("", 0)  # the line that would end the game, and its turn count
        self._seat_at_terminal = 0  # seat of the person at the terminal
        if game:
            self.set_game(game)

    @property
    def game(self) -> Game:
        """The current game; raises BadParameter if there is none."""
        if self._game is None:
            raise BadParameter(
                "no game is running; play PROBLEM starts one, list shows the problems"
            )
        return self._game

    @property
    def has_game(self) -> bool:
        """True if there is a current game."""
        return self._game is not None

    @property
    def is_input_hidden(self) -> bool:
        """True if several people type choices, which must then not be shown."""
        return self.is_interactive and self.has_game and len(self.game.human_seats) > 1

    def set_game(self, game: Game) -> None:
        """End the current game and make this one current; play up to a person's first choice."""
        ended_count = len(self.finished_games)
        self.end_game()
        self._previous_recorders = [*self.finished_games][ended_count:]
        self._game = game
        self._helped_game = game if game.had_help else None
        self.save_removal = self.save_removal.followed_by(game.save_removal)
        game_key = make_game_key(game.problem_name, game.session.uniform_source)
        if self._repeats_uniforms(game, game_key):
            game.note_repeated_uniforms()
        self._path_by_game_key[game_key] = game.transcript_path
        game.play_until_choice()
        game.on_intermediate_turn = lambda: self.on_intermediate_turn()  # noqa: PLW0108
        self._game_key = game_key
        self.complete_handover()

    @property
    def _list_known_games(self) -> set[GameKey]:
        """The games whose hidden information is known when another game starts.

        The current game is one of them: it then ends and is shown, unless it is paused.
        """
        game = self._game
        is_current_known = game and game.problem.partially_observable and not game.is_paused
        if is_current_known and self._game_key:
            return {*self._disclosed_games, self._game_key}
        return self._disclosed_games

    def _repeats_uniforms(self, game: Game, game_key: GameKey) -> bool:
        """Return whether the uniforms of this game were used by an earlier game.

        False for a branch, whose transcript records that in its header.
        """
        if not game.session.turns:
            return game_key in self._path_by_game_key
        is_branch = game.request is not None and game.request.branched is not None
        return (
            not is_branch
            and self._path_by_game_key.get(game_key, game.transcript_path) != game.transcript_path
        )

    @property
    def awaiting_handover(self) -> bool:
        """True if the next person to choose is not at the terminal and must see a private view."""
        game = self._game
        has_private_choice = (
            game is not None and game.has_private_views and game.choosing_seat is not None
        )
        return has_private_choice and self.game.viewing_seat != self._seat_at_terminal

    def complete_handover(self) -> None:
        """Record that the viewing seat's person is now at the terminal."""
        self._seat_at_terminal = self.game.viewing_seat

    def end_game(self, reason: str = "quit") -> None:
        """End the current game and its transcript; delete a save without turns.

        A game that is to be handed in is paused if its player leaves it.
        """
        if self._game is None:
            return
        if reason == "quit" and self._game.pauses_when_left:
            self._game.pause()
        self._game.finish(reason)
        self._disclosed_games = self._list_known_games
        recorder = self._game.recorder
        if recorder is None or recorder in self.finished_games:
            return
        if saves.remove_unplayed_save(recorder):
            self._game.recorder = None  # The next game may have a file of the same name.
            return
        self.finished_games[recorder] = self._game.problem_name
        if self._game.verdict.has_facts and not self._game.verdict.standing.aids:
            self.last_unaided_game = self._game
        self.record_result()

    def record_result(self) -> None:
        """Record the result and the medal of the current game if it is finished."""
        game = self._game
        if game and game.recorder and self._on_game_end and game.session.over:
            medal = game.verdict.earned_medal
            self._on_game_end(game.recorder, medal.name if medal else "")

    def take_write_notice(self) -> str:
        """Return one line if the transcript began to fail, or works again; '' if nothing changed.

        A notice waits while a handover hides or clears the terminal.
        """
        recorder = self._game.recorder if self._game else None
        is_hidden = self.is_interactive and self.awaiting_handover
        return "" if recorder is None or is_hidden else recorder.pop_write_notice()

    def pop_medal_notice(self) -> str:
        """Return a line after the first help of a game that costs the medal; else ''."""
        game = self._game
        if game is None or game is self._helped_game or not game.had_help:
            return ""
        self._helped_game = game
        return LOST_MEDAL if can_earn_medal(game) and not game.session.over else ""

    def confirmation_question(self, line: str) -> str:
        """Return a question before a typed line ends an unfinished game; '' if none is needed.

        None is needed if the same line is typed again at the same turn.
        """
        turn_count = len(self.game.session.turns)
        previous, self._pending_confirmation = self._pending_confirmation, (line, turn_count)
        if (
            self.is_interactive
            and turn_count
            and not self.game.session.over
            and previous != (line, turn_count)
        ):
            command = line.partition(" ")[0]
            turns_text = format_count(turn_count, "turn")
            return f"{command}: this ends the game after {turns_text}; repeat it to confirm"
        return ""

    def restart_with_new_seed(self, **changes: object) -> str:
        """Start the same game with these changes, and with a new seed unless one is given."""
        return self.restart(
            **{"seed": None, "is_seed_visible": True, "has_fresh_seed": False, **changes}
        )

    def restart(self, **changes: object) -> str:
        """Start the same game with these changes and the same seed; return its description.

        Whether the seed may be shown does not change. Raise BadParameter if the current game is to
        be handed in, unless the seed is another: playing it would reveal its random numbers.
        """
        if self.game.request is None:
            raise BadParameter("this is a replay; branch starts a game from this turn")
        old_request = self.game.request
        record = old_request.record_path and next_numbered_path(old_request.record_path)
        keep_save = old_request.keep_save or self.game.recorder is not None
        new_request = replace(
            old_request,
            record_path=record,
            force=False,
            keep_save=keep_save,
            typed_options=old_request.typed_options - {"rate"},
        )
        new_request = replace(new_request, **changes)  # type: ignore[arg-type] # fields of a request
        uses_same_seed = self.game.pauses_when_left and new_request.seed == old_request.seed
        if uses_same_seed and new_request.is_handed_in:
            raise BadParameter(
                "this game is to be handed in, so its random numbers are used only once; "
                "new starts a game with another seed"
            )
        new_game = start_new_game(new_request, self._list_known_games)
        if uses_same_seed:  # An agent takes the seat and reveals these uniforms.
            self.game.finish()
        self.set_game(new_game)
        return self.describe_new_game()

    def describe_new_game(self) -> str:
        """Return a line with the game that was started or resumed, its seed, and the transcripts of
        the previous game.
        """
        seed = f", seed {self.game.seed}" if self.game.is_seed_visible else ""
        saved_paths = "".join(
            f" {recorder.describe_write_error() or f'saved: {recorder.path}'}"
            for recorder in self._previous_recorders
        )
        if self.game.is_resumed:
            turn = len(self.game.session.turns)
            return f"resumed {self.game.problem_name}{seed}. turn {turn}.{saved_paths}"
        return f"new game of {self.game.problem_name}{seed}.{saved_paths}"

    def choose_branch_path(self, path: Path) -> Path:
        """Return a free path for a game that continues the one in this file.

        It is numbered in the same folder, or a new save if the current game has no transcript.
        """
        if self.game.recorder:
            return next_numbered_path(path)
        return saves.create_save(self.game.problem_name) or next_numbered_path(path)

    def run_command_words(self, words: Sequence[str]) -> str:
        """Run words of the command line: play the game and return '', or return the report."""
        if self.cli_interpreter is None:
            raise BadParameter(f"{words[0]}: not available here; run it from the command line")
        interpreter = self.cli_interpreter
        result = run_cancellable(TaskInfo(f"running {words[0]}"), lambda: interpreter(words))
        if isinstance(result, str):
            return Page(result)
        if not isinstance(result, PlayCommand):
            if self.open_lesson is None:
                raise BadParameter("learn: a lesson needs the shell; leave, then run dmplay learn")
            self.open_lesson(result)
            return ""
        self.set_game(start_game(result.interactive_request, self._list_known_games))
        return ""


def next_numbered_path(path: Path) -> Path:
    """Return the next free numbered path: `game.dmt`, `game-2.dmt`, `game-3.dmt`.

    A number at the end of the name is continued. Return the path of a device unchanged.
    """
    if path.exists() and not path.is_file():
        return path
    match = NUMBERED_STEM.fullmatch(path.stem)
    stem, number = (match[1], int(match[2])) if match else (path.stem, 1)
    names = (path.with_stem(f"{stem}-{n}") for n in count(number + 1))
    return next(name for name in names if not name.exists())
