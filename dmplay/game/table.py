"""The table: the game that is played now, and how the next one begins."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

from dmplay.describe import format_count
from dmplay.errors import BadParameter
from dmplay.game import saves
from dmplay.game.answer import Page
from dmplay.game.errand import CliInterpreter
from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.start import start_game, start_new_game
from dmplay.thought import TaskInfo, run_cancellable
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.seal import GameKey, make_game_key

NO_ALIASES: Mapping[str, str] = {}
NUMBERED_STEM = re.compile(r"(.*)-(\d+)")


class GameController:
    """Holds one game at a time; each is ended, and its transcript with it, before the next."""

    def __init__(
        self,
        game: Game | None = None,
        cli_interpreter: CliInterpreter | None = None,
        aliases: Mapping[str, str] = NO_ALIASES,
        on_game_end: Callable[[Recorder], object] | None = None,
    ) -> None:
        self.is_interactive = False  # whether people type here; else a script is done
        self.finished_games: dict[Recorder, str] = {}  # of the games so far, and what was played
        self._previous_recorders: list[Recorder] = []  # of the game before this one, if it is kept
        self.removed_save_count = 0  # older games that had to make room for them
        self.open_screen: Callable[[], str] | None = None  # where there is one to open
        self.aliases = aliases
        self.on_intermediate_turn: Callable[[], object] = lambda: (
            None
        )  # a turn that another follows
        self._cli_interpreter, self._on_game_end = (
            cli_interpreter,
            on_game_end,
        )  # does what words say; hears of each end
        self._game: Game | None = None
        self._disclosed_games: set[GameKey] = (
            set()
        )  # of games whose secrets are told once they are left
        self._path_by_game_key: dict[
            GameKey, Path | None
        ] = {}  # of all games, with the file of the last
        self._pending_confirmation = (
            "",
            0,
        )  # the line that would end a game, and after how many turns
        self._seat_at_terminal = 0  # the seat of who sits at the terminal
        if game:
            self.set_game(game)

    @property
    def game(self) -> Game:
        """The game that is played now; raises BadParameter where none is."""
        if self._game is None:
            raise BadParameter("no game is played; play PROBLEM begins one, list names them")
        return self._game

    @property
    def has_game(self) -> bool:
        """Whether there is a game."""
        return self._game is not None

    @property
    def is_input_hidden(self) -> bool:
        """Whether what is typed is not for all eyes: several people choose."""
        return self.is_interactive and self.has_game and len(self.game.human_seats) > 1

    def set_game(self, game: Game) -> None:
        """Plays this game from now on."""
        many = len(self.finished_games)
        self.end_game()
        self._previous_recorders = [*self.finished_games][many:]
        self._game = game
        self.removed_save_count += game.removed_save_count
        dice = make_game_key(game.problem_name, game.session.uniform_source)
        if self._repeats_uniforms(game, dice):
            game.note_repeated_uniforms()
        self._path_by_game_key[dice] = game.transcript_path
        game.play_until_choice()
        game.on_intermediate_turn = lambda: self.on_intermediate_turn()  # noqa: PLW0108 - whoever is told then
        if game.problem.partially_observable:
            self._disclosed_games.add(dice)
        self.complete_handover()

    def _repeats_uniforms(self, game: Game, game_key: GameKey) -> bool:
        """Whether these dice were played in another game; a branch tells of that by itself."""
        if not game.session.turns:
            return game_key in self._path_by_game_key
        branch = game.request is not None and game.request.branched is not None
        return (
            not branch
            and self._path_by_game_key.get(game_key, game.transcript_path) != game.transcript_path
        )

    @property
    def awaiting_handover(self) -> bool:
        """Whether another than who sits here is to choose, who alone may see what comes."""
        game = self._game
        private = game is not None and game.has_private_views and game.choosing_seat is not None
        return private and self.game.viewing_seat != self._seat_at_terminal

    def complete_handover(self) -> None:
        """Who is to choose next sits at the terminal."""
        self._seat_at_terminal = self.game.viewing_seat

    def end_game(self, reason: str = "quit") -> None:
        """Ends the game, if there is one, and its transcript."""
        if self._game is None:
            return
        self._game.finish(reason)
        recorder = self._game.recorder
        if (
            recorder
            and recorder not in self.finished_games
            and not saves.remove_unplayed_save(recorder)
        ):
            self.finished_games[recorder] = self._game.problem_name
            if self._on_game_end:
                self._on_game_end(recorder)

    def confirmation_question(self, line: str) -> str:
        """What is asked before a typed line ends a game that goes on; '' the second time."""
        turns = len(self.game.session.turns)
        asked, self._pending_confirmation = self._pending_confirmation, (line, turns)
        if self.is_interactive and turns and not self.game.session.over and asked != (line, turns):
            name = line.partition(" ")[0]
            played = format_count(turns, "turn")
            return f"{name}: that ends this game of {played}; once more does it"
        return ""

    def restart_with_new_seed(self, **changes: object) -> str:
        """Begins the same game anew but for these changes, with fresh dice if none are given."""
        return self.restart(
            **{"seed": None, "is_seed_visible": True, "has_fresh_seed": False, **changes}
        )

    def restart(self, **changes: object) -> str:
        """Begins the same game again but for these changes under the same dice, known or not as
        before.
        """
        asked = self._require_request()
        record = asked.record_path and next_numbered_path(asked.record_path)
        keep = asked.keep_save or self.game.recorder is not None
        wanted = replace(
            asked, record_path=record, force=False, keep_save=keep, has_rate_option=False
        )
        wanted = replace(wanted, **changes)  # type: ignore[arg-type] # fields of a request
        self.set_game(start_new_game(wanted, self._disclosed_games))
        return self.describe_new_game()

    def _require_request(self) -> GameRequest:
        if self.game.request is None:
            raise BadParameter("a recording is only looked at; branch plays on")
        return self.game.request

    def describe_new_game(self) -> str:
        """What game began, and where the one before it is."""
        seed = f", seed {self.game.seed}" if self.game.is_seed_visible else ""
        kept = "".join(f" kept: {one.path}" for one in self._previous_recorders)
        return f"new game of {self.game.problem_name}{seed}.{kept}"

    def choose_branch_path(self, path: Path) -> Path:
        """A name for a game that goes on from this file: beside it, or where games are kept."""
        if self.game.recorder:
            return next_numbered_path(path)
        self.removed_save_count += saves.remove_old_saves()
        return saves.create_save(self.game.problem_name) or next_numbered_path(path)

    def run_cli_words(self, words: Sequence[str]) -> str:
        """Does what the command line would do with these words: a game is played here, a report
        is told.
        """
        if self._cli_interpreter is None:
            raise BadParameter(f"{words[0]}: only the command line knows it")
        program = self._cli_interpreter
        errand = run_cancellable(TaskInfo(f"working on {words[0]}"), lambda: program(words))
        if isinstance(errand, str):
            return Page(errand)
        self.set_game(start_game(errand.interactive_request, self._disclosed_games))
        return ""


def next_numbered_path(path: Path) -> Path:
    """A free name for the next game's file: `game.dmt`, `game-2.dmt`, `game-3.dmt`; a device's own.

    The number goes on from the one that the name ends with.
    """
    if path.exists() and not path.is_file():
        return path
    found = NUMBERED_STEM.fullmatch(path.stem)
    stem, number = (found[1], int(found[2])) if found else (path.stem, 1)
    names = (path.with_stem(f"{stem}-{n}") for n in count(number + 1))
    return next(name for name in names if not name.exists())
