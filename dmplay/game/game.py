"""A game that people play: a session, who sits where, and its transcript."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import cast

from rich.text import Text

from dmplay.advice.adviser import HintProvider
from dmplay.advice.ghost import Ghost
from dmplay.budget import ComputationStopped
from dmplay.chance import Array
from dmplay.core import Problem
from dmplay.describe import describe_end_reason, escape_newlines
from dmplay.dice import SeededUniforms
from dmplay.errors import BadParameter, Forfeit
from dmplay.finding.ways import names_bot
from dmplay.game.account import Narrator
from dmplay.game.request import GameRequest
from dmplay.keys.keyboard import Keyboard
from dmplay.policies.script import EndOfScript
from dmplay.session import SeatedPolicy, Session, View
from dmplay.signals import TURN_GATE
from dmplay.terminal import escape_unprintable
from dmplay.thought import TaskInfo, run_cancellable
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.seal import RESUMABLE_END_REASONS, has_hidden_information
from dmplay.views.kept import SeatSnapshot
from dmplay.views.style import DrawOptions, draw_picture, load_view_module

NO_CHOICES: Mapping[int, float] = {}
REPEATED_UNIFORMS_NOTE = "# again: under dice that were played before"


class Game:
    """What is played and recorded; its account tells of it, its keyboard says which keys act."""

    rewards_visible = False  # whether rewards are told that the game does not show

    def __init__(  # noqa: PLR0913, PLR0917 - what is played, who sits there, and where it is kept
        self,
        problem_name: str,
        session: Session,
        player_names: Sequence[str],
        keyboard: Keyboard,
        recorder: Recorder | None = None,
        request: GameRequest | None = None,
    ) -> None:
        self.problem_name = problem_name
        self.player_names = tuple(player_names)
        self.human_seats = keyboard.human_seats
        self.keyboard = keyboard
        self.recorder = recorder
        self.request = request  # None for a recording
        self.view_module = load_view_module(session.problem)
        self.warning = ""  # for whoever goes on with it, or looks at it
        self.end_notes = ""  # for the end of the transcript
        self.review_lines: Sequence[str] = ()  # what its moves and dice were worth, once it is over
        self.ghost: Ghost | None = None
        self.removed_save_count = 0  # older games that had to make room for it where games are kept
        self.repeats_uniforms = False  # whether one of the same dice was played before it
        self.on_intermediate_turn: Callable[[], object] = lambda: (
            None
        )  # after a turn that another follows
        self.log_paths: list[Path] = []  # of programs that play, once it is over
        agents = {
            escape_unprintable(who): None
            for seat, who in enumerate(player_names)
            if seat not in self.human_seats
        }
        who = " and ".join(agents) + (" are" if len(agents) > 1 else " is")
        self._thinking_task_info = TaskInfo(f"{who} thinking", is_agent_move=True)
        self._pending_choices: dict[int, float] = {}
        self._undone_actions: list[list[float]] = []
        self._attach_session(session)

    def _attach_session(self, session: Session) -> None:
        """Plays this session from now on."""
        self.session = session
        self.narrator = Narrator(session, self.human_seats, reveal=self.reveal)
        self._hint_providers: dict[int, HintProvider] = {}
        self._snapshot: SeatSnapshot | None = None
        self._board_cache: tuple[SeatSnapshot, DrawOptions, Text] | None = None

    @property
    def problem(self) -> Problem:
        """The problem played."""
        return self.session.problem

    @property
    def transcript_path(self) -> Path | None:
        """The file that holds the game."""
        return self.recorder.path if self.recorder else None

    @property
    def settings(self) -> list[str]:
        """The parameters that differ from the default, as they are typed."""
        return self.request.all_settings if self.request else []

    @property
    def strict(self) -> bool:
        """Whether nothing may be taken back."""
        return self.request is not None and bool(self.request.strict)

    @property
    def hints_forbidden(self) -> bool:
        """Whether nobody may be given advice."""
        return self.request is not None and self.request.strict == "hints"

    @property
    def reveal(self) -> bool:
        """Whether what is hidden is shown."""
        return self.request is not None and self.request.reveal

    @property
    def is_concealed(self) -> bool:
        """Whether there are secrets and the game can be played on, so that they must stay so."""
        left = (self.session.end_reason or "") in RESUMABLE_END_REASONS
        return left and has_hidden_information(self.problem, self.player_names, reveal=self.reveal)

    @property
    def seed(self) -> int:
        """The seed of the dice."""
        return cast(SeededUniforms, self.session.uniform_source).seed

    @property
    def is_seed_visible(self) -> bool:
        """Whether the player knows the seed: a fresh one is told after the game."""
        return self.request is None or self.request.is_seed_visible or self.session.over

    @property
    def play_again_command(self) -> str:
        """The command that plays a game of fresh dice once more; '' for another."""
        fresh = self.request is not None and self.request.has_fresh_seed
        return (
            self.request.format_command(self.problem_name, self.seed)
            if self.request and fresh
            else ""
        )

    @property
    def has_private_views(self) -> bool:
        """Whether several people play of whom each may know something else."""
        return len(self.human_seats) > 1 and self.problem.partially_observable

    @property
    def agents_only(self) -> bool:
        """Whether agents alone play it, now."""
        return self.request is not None and not self.human_seats

    @property
    def viewing_seat(self) -> int:
        """The seat whose view is shown: the person to choose, else the first."""
        waiting = self.choosing_seat
        return waiting if waiting is not None else (self.human_seats or [0])[0]

    @property
    def choosing_seat(self) -> int | None:
        """The person who chooses next."""
        if not self.human_seats or self.session.over:
            return None
        left = (
            seat
            for seat in self.session.active_seats(self.human_seats)
            if seat not in self._pending_choices
        )
        return next(left, None)

    @property
    def hint_provider(self) -> HintProvider:
        """Who gives hints to the watcher."""
        seat = self.viewing_seat
        if seat not in self._hint_providers:
            self._hint_providers[seat] = HintProvider(
                self.session, seat, self.player_names
            )
        return self._hint_providers[seat]

    def snapshot(self, seat: int | None = None) -> SeatSnapshot:
        """What the watcher, or another seat, may know now.

        The watcher's is made anew only when a turn, the seat or the end is new.
        """
        if seat is not None:
            return SeatSnapshot(
                self.session,
                seat,
                rewards_visible=self.rewards_visible,
                agents_only=self.agents_only,
            )
        watcher = self.viewing_seat
        if self._snapshot is None or not self._snapshot.is_current_for(watcher):
            self._snapshot = SeatSnapshot(
                self.session,
                watcher,
                rewards_visible=self.rewards_visible,
                agents_only=self.agents_only,
            )
        return self._snapshot

    def view(self, seat: int | None = None) -> View[Problem]:
        """The same as policies and drawings are given it."""
        return self.snapshot(seat).view

    def draw_board(self, options: DrawOptions, snapshot: SeatSnapshot | None = None) -> Text:
        """The board in the room there is; the state too where it is revealed.

        It is drawn anew only for another moment or look; nobody writes into it.
        """
        snapshot = snapshot or self.snapshot()
        ghost = (
            self.ghost.session.state
            if self.ghost and self.ghost.is_shown_during_play
            else options.ghost_state
        )
        names = {**self.keyboard.get_keys_by_action(self.viewing_seat), **options.keys_by_action}
        options = options._replace(
            revealed_state=self._revealed_state, ghost_state=ghost, keys_by_action=names
        )
        if not (
            self._board_cache
            and self._board_cache[0] is snapshot
            and self._board_cache[1].is_equal_to(options)
        ):
            self._board_cache = (
                snapshot,
                options,
                self.narrator.view_cache.fit_board(snapshot, options),
            )
        return self._board_cache[2]

    def describe_expected_reward(self, action: float) -> str:
        """What an action costs, behind a blank; '' where its view does not say."""
        told: Callable[[View[Problem], float], str] | None = getattr(
            self.view_module, "describe_expected_reward", None
        )
        return f" {told(self.view(), action)}" if told else ""

    @property
    def _revealed_state(self) -> Array | None:
        """The state where what is hidden is told."""
        told = self.reveal or (self.session.over and self.problem.partially_observable)
        return self.session.state if told else None

    def picture_rows(self) -> list[str]:
        """The rows of the picture that a problem brings of what the watcher may see; else none."""
        drawn = draw_picture(self.view_module, self.view(), self._revealed_state)
        return drawn.plain.split("\n") if drawn else []

    def choose(self, action: float, seat: int | None = None) -> bool:
        """Takes a person's choice, the next one's to choose unless `seat` says whose.

        Plays the turn once everybody's is in.
        """
        waiting = self.choosing_seat if seat is None else seat
        if self.session.over:
            raise BadParameter(f"the game is over ({describe_end_reason(self.session.end_reason)})")
        if waiting is None:
            raise BadParameter("no person plays here")
        self.session.validate_action(waiting, action)
        chosen = {**self._pending_choices, waiting: action}
        if len(chosen) == len(self.session.active_seats(self.human_seats)):
            played = self.advance(chosen)
            self.play_until_choice()
            return played
        self._pending_choices = chosen
        return False

    def advance(self, choices: Mapping[int, float] = NO_CHOICES) -> bool:
        """Plays a turn of these choices and the agents'; none is kept of one that is not played."""
        try:
            actions = self._fill_in_actions(
                [choices.get(seat) for seat in range(len(self.player_names))]
            )
        except EndOfScript:
            self.session.end("quit")
            return False
        except Forfeit as forfeit:
            self.narrator.last_forfeit = escape_newlines(escape_unprintable(str(forfeit)))
            self.session.end("forfeit")
            return False
        finally:
            self._pending_choices = {}
        with TURN_GATE:
            self.session.advance(actions)
            self._undone_actions.clear()
            self._record_turn()
        self._advance_ghost()
        return True

    def play_until_choice(self) -> None:
        """Plays the turns of others until a person is asked."""
        while self.session.is_waiting_for_others(self.human_seats):
            self.on_intermediate_turn()
            self.advance()

    def _fill_in_actions(self, actions: Sequence[float | None]) -> Sequence[float | None]:
        """The choices of people, and of the agents, who may think for long."""
        if len(self.human_seats) == len(self.player_names):
            return actions
        return run_cancellable(
            self._thinking_task_info, lambda: self.session.fill_in_actions(actions)
        )

    def recreate_agents(self) -> None:
        """Has agents and advisers think anew: one of them may still be thinking."""
        session = self.session
        session.seated_policies = [
            follower and SeatedPolicy(session, follower.seat, follower.policy)
            for follower in session.seated_policies
        ]
        self._hint_providers, self._pending_choices = {}, {}
        self.ghost = self.narrator.ghost = None

    def play_agent_turn(self) -> bool:
        """Plays a turn of a game without people; False once it is over."""
        return not self.session.over and self.advance()

    def iter_agent_turns(self) -> Iterator[int]:
        """Plays a game without people to its end; before each turn, or event of a recording, which
        may take turns back, how many turns there were.
        """
        before = len(self.session.turns)
        while self.play_agent_turn():
            yield before
            before = len(self.session.turns)

    def undo(self, turns: int = 1) -> None:
        """Takes back turns; the transcript keeps that it was done."""
        self._check_undo_allowed("undo")
        if self._pending_choices:  # a first choice of two is taken back before any turn is
            self._pending_choices.clear()
            return
        with TURN_GATE:
            taken = self.session.undo(self.session.turns_to_undo(self.human_seats, turns))
            self._undone_actions += [list(turn.actions) for turn in reversed(taken)]
            if self.recorder:
                self.recorder.write_event("undo", len(taken))
        self._advance_ghost()

    def redo(self) -> None:
        """Plays the turn last taken back again."""
        if not self._undone_actions:
            raise BadParameter("redo: nothing was taken back")
        self._pending_choices.clear()
        self._replay_undone_turn()
        while self._undone_actions and self.session.is_waiting_for_others(self.human_seats):
            self.on_intermediate_turn()
            self._replay_undone_turn()
        self.play_until_choice()

    def _replay_undone_turn(self) -> None:
        with TURN_GATE:
            self.session.advance(self._undone_actions[-1])
            self._undone_actions.pop()
            self._record_turn()
        self._advance_ghost()

    def reroll(self) -> None:
        """Plays the last turn again under other dice; the transcript says so."""
        self._check_undo_allowed("reroll")
        if not self.session.turns:
            raise BadParameter("reroll: no turn was played yet")
        self._pending_choices.clear()
        self._undone_actions.clear()
        with TURN_GATE:
            self.session.reroll()
            if self.recorder:
                self.recorder.write_event(
                    "reroll", self.session.reroll_counts[len(self.session.turns)]
                )
            self._record_turn()
        self._advance_ghost()
        self.play_until_choice()

    def set_ghost(self, ghost: Ghost | None) -> None:
        """Has this ghost play beside, up to the present turn."""
        self.ghost = self.narrator.ghost = ghost
        self._advance_ghost()

    def note_repeated_uniforms(self) -> None:
        """Has its transcript say at once, and once, that its dice were played before."""
        if self.recorder and not self.repeats_uniforms:
            self.recorder.write_note(REPEATED_UNIFORMS_NOTE)
        self.repeats_uniforms = True

    def _advance_ghost(self) -> None:
        """Has the ghost play as far as the person did, where it may be seen before the end."""
        ghost = self.ghost
        if ghost and ghost.is_shown_during_play:
            with suppress(ComputationStopped):
                run_cancellable(
                    TaskInfo(f"{escape_unprintable(ghost.name)} plays beside you"), ghost.catch_up
                )

    def check_hints_allowed(self, command: str) -> None:
        """Refuses advice where nobody may be given any."""
        if self.hints_forbidden:
            raise BadParameter(f"{command}: this game is strict about help")

    def record_hint(self) -> None:
        """Counts that the watcher was given advice; the transcript keeps it."""
        if self.viewing_seat not in self.human_seats:
            return
        name = self.problem.agents[self.viewing_seat]
        with TURN_GATE:
            self.session.hint_counts[name] += 1
            if self.recorder:
                self.recorder.write_event("help", {name: 1})

    @property
    def undo_forbidden_reason(self) -> str:
        """Why it would not be fair to take turns back; '' where they may be."""
        if self.strict:
            return "this game is strict"
        shown = (
            self.session.over
            and self.problem.partially_observable
            and self.human_seats
            and not self.reveal
        )
        return "the game is over and what was hidden is shown" if shown else ""

    def _check_undo_allowed(self, command: str) -> None:
        """Refuses to take back where that is not fair."""
        if self.undo_forbidden_reason:
            raise BadParameter(f"{command}: {self.undo_forbidden_reason}")

    def _record_turn(self) -> None:
        if self.recorder:
            self.recorder.write_turn()

    def finish(self, reason: str = "quit") -> None:
        """Ends the game and its transcript, and the programs that play in it."""
        with TURN_GATE:
            self.session.end(reason)
            if self.recorder:
                why = f"# {self.narrator.forfeit_reason}\n" if self.narrator.forfeit_reason else ""
                self.recorder.write_end(f"{why}{self.end_notes}")
        if any(map(names_bot, self.player_names)):
            from dmplay.bots.end import close_bots  # not needed where none plays

            self.log_paths += close_bots(self.session, self.problem_name)
