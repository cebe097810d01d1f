"""A game played by people or agents: a session, the players of its seats, and a transcript."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, cast

from rich.text import Text

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.script import EndOfScript, Script
from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem, find_seat
from dmplay.core.safe_files import MAX_FILE_BYTES
from dmplay.core.session import (
    SeatedPolicy,
    Session,
    Turn,
    View,
    check_has_belief,
    count_turns_to_undo,
    is_waiting_for_others,
    list_active_seats,
)
from dmplay.core.text import describe_end_reason, escape_newlines, escape_unprintable
from dmplay.core.uniforms import SeededUniforms
from dmplay.core.work_budget import ComputationStopped
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, Forfeit
from dmplay.game import player_records
from dmplay.game.action_input import Keyboard
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.hints.ghost_agent import Ghost
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.launch_requests import GameRequest
from dmplay.game.narration import Narrator
from dmplay.game.position import Position
from dmplay.game.saves import SaveRemoval
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.game.seats import list_other_players, list_scripts, shorten_player_name
from dmplay.game.verdict import Standing, Verdict, compute_verdict
from dmplay.registry.agents import find_partner_policy, load_roster
from dmplay.registry.problem_name_kinds import names_bot
from dmplay.registry.problems import is_built_in
from dmplay.terminal.signals import defer_signals
from dmplay.transcript.concealment import RESUMABLE_END_REASONS, has_hidden_information
from dmplay.transcript.format import REPEATED_UNIFORMS_PREFIX
from dmplay.transcript.recorder import Recorder
from dmplay.views.protocol import draw_picture, fit_board, load_view_module

if TYPE_CHECKING:
    from dmplay.agents.best_response_in_team import PartnerBeliefPolicy
    from dmplay.game.predictions import EchoedBelief, Predictor, ScoredPrediction

PREDICTION_NOTE_PREFIX = "# prediction "
NO_CHOICES: Mapping[int, float] = {}
FULL_TRANSCRIPT_REASON = (
    f"the transcript is full, because dmplay reads at most {MAX_FILE_BYTES // 2**20} MB"
)
REPEATED_UNIFORMS_NOTE = f"{REPEATED_UNIFORMS_PREFIX}an earlier game had the same random numbers"


class Game:
    """A game in play: its session, players, keyboard, transcript, hints and undo history."""

    rewards_visible = False  # whether rewards are visible even if the problem hides them

    def __init__(  # noqa: PLR0913, PLR0917 - the parts of one game
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
        self.assumed_players: dict[int, str] = {}  # other players that advice assumes
        self.earlier_turns = 0  # first turns of a branch, in which other players had some seats
        self.human_seats = keyboard.human_seats
        self.keyboard = keyboard
        self.recorder = recorder
        self.request = request  # None for a replay
        self.view_module = load_view_module(session.problem)
        self.warning = ""  # displayed when the game is resumed or replayed
        self.is_resumed = False  # whether its first turns were played earlier
        self.end_notes = ""  # appended to the transcript at the end
        self.verdict = Verdict()  # computed after the game
        self.undo_count = 0  # times that turns were undone
        self._judged_turn: Turn | None = None  # the last turn when it was computed
        self.ghost: Ghost | None = None
        self.predictor: Predictor | None = None  # asks for predictions before each turn
        self._last_prediction: ScoredPrediction | EchoedBelief | None = (
            None  # scored and not reported yet
        )
        self.save_removal = SaveRemoval()  # old saves deleted to make room for this game
        self.repeats_uniforms = False  # whether a game with the same uniforms was played before
        # called between turns that need no player
        self.on_intermediate_turn: Callable[[], object] = lambda: None
        self.log_paths: list[Path] = []  # log files of bots, after the game
        agent_names = {
            escape_unprintable(label): None
            for seat, label in enumerate(player_names)
            if seat not in self.human_seats
        }
        label = " and ".join(agent_names) + (" are" if len(agent_names) > 1 else " is")
        if self.reveal:
            self.rewards_visible = True
        self._thinking_task_info = TaskInfo(f"{label} thinking", is_agent_move=True)
        self._pending_choices: dict[int, float] = {}
        self._stated_beliefs: dict[int, Reals] = {}  # of people, with their pending choices
        self._undone_turns: list[Turn] = []
        self._last_hint: tuple[int | None, Turn | None] = (None, None)  # seat, and the turn before
        self._attach_session(session)

    def _attach_session(self, session: Session) -> None:
        """Replace the session, with a new narrator and empty caches."""
        self.session = session
        self.narrator = Narrator(
            session, self.human_seats, reveal=self.reveal, player_names=self.player_names
        )
        self._hint_providers: dict[int, HintProvider] = {}
        self._snapshot: SeatSnapshot | None = None
        self._partner_policies: dict[int, PartnerBeliefPolicy | None] = {}  # by seat

    @property
    def problem(self) -> Problem:
        """The problem that is played."""
        return self.session.problem

    @property
    def transcript_path(self) -> Path | None:
        """The path of the transcript; None if none is written."""
        return self.recorder.path if self.recorder else None

    @property
    def settings(self) -> list[str]:
        """The parameters that differ from their defaults, as `NAME=VALUE` texts."""
        return [*self.request.settings] if self.request else []

    @property
    def strict(self) -> bool:
        """True if turns cannot be undone."""
        return self.request is not None and bool(self.request.strict)

    @property
    def other_players(self) -> list[tuple[str, str, str]]:
        """The agents that play beside the people: (agent, player, rule), as text."""
        return list_other_players(self.session, self.player_names)

    @property
    def hints_forbidden(self) -> bool:
        """True if hints are forbidden."""
        return self.request is not None and self.request.strict == "hints"

    @property
    def lesson_goal(self) -> str:
        """The goal of a lesson's game, which is judged by the lesson; '' for any other game."""
        return self.request.lesson_goal if self.request else ""

    @property
    def shows_belief(self) -> bool:
        """False if a lesson, or `--state-belief`, asks the player to keep the belief.

        The boards of some problems always show it.
        """
        if self.request is None or not self.request.states_belief:
            return self.request is None or self.request.shows_belief
        return bool(getattr(self.view_module, "NEEDS_BELIEF", False))

    @property
    def pauses_when_left(self) -> bool:
        """True if a player who leaves pauses the game, and does not end it.

        That is so if the game is to be handed in: it was assigned, or a game with the player's name
        is resumed.
        """
        is_handed_in = self.request is not None and self.request.is_handed_in
        return is_handed_in and self.recorder is not None and not self.session.over

    @property
    def has_known_mistakes(self) -> bool:
        """True if the game is over and recorded, and a person's choice lost a known amount.

        A choice that counts as right is no mistake, nor is one that is not among listed actions.
        """
        exact_seats = {
            choices.seat
            for choices in self.verdict.choices
            if choices.regret is not None
            and self.problem.actions[find_seat(self.problem, choices.seat)].labels
        }
        moves = self.verdict.moves if self.transcript_path is not None else ()
        return any(move.is_mistake and move.seat in exact_seats for move in moves)

    @property
    def reveal(self) -> bool:
        """True if hidden states are displayed during the game."""
        return self.request is not None and self.request.reveal

    @property
    def is_concealed(self) -> bool:
        """True if hidden information must not be disclosed, because the game can be resumed."""
        is_resumable = (self.session.end_reason or "") in RESUMABLE_END_REASONS
        return is_resumable and has_hidden_information(
            self.problem, self.player_names, reveal=self.reveal
        )

    @property
    def is_paused(self) -> bool:
        """True if the game was paused; this object does not continue it."""
        return self.narrator.is_paused

    @property
    def seed(self) -> int:
        """The seed of the uniforms."""
        return cast(SeededUniforms, self.session.uniform_source).seed

    @property
    def is_seed_visible(self) -> bool:
        """True if the player may see the seed; a new random one is shown only after the game."""
        return self.request is None or self.request.is_seed_visible or self.session.over

    @property
    def play_again_command(self) -> str:
        """The command that plays this game again with its random seed; '' if it was chosen."""
        has_new_seed = self.request is not None and self.request.has_fresh_seed
        if self.request and has_new_seed:
            return self.request.format_command(self.problem_name, self.seed)
        return ""

    @property
    def has_private_views(self) -> bool:
        """True if several people play a partially observable problem."""
        return len(self.human_seats) > 1 and self.problem.partially_observable

    @property
    def agents_only(self) -> bool:
        """True if only agents play."""
        return self.request is not None and not self.human_seats

    @property
    def viewing_seat(self) -> int:
        """The seat whose view is displayed: the person to choose next, else the first person or
        seat.
        """
        choosing_seat = self.choosing_seat
        return choosing_seat if choosing_seat is not None else (self.human_seats or [0])[0]

    @property
    def choosing_seat(self) -> int | None:
        """The next person's seat that must choose an action; None if there is none."""
        if not self.human_seats or self.session.over:
            return None
        undecided = (
            seat
            for seat in list_active_seats(self.session, self.human_seats)
            if seat not in self._pending_choices
        )
        return next(undecided, None)

    @property
    def hint_provider(self) -> HintProvider:
        """The hint provider of the viewing seat."""
        seat = self.viewing_seat
        if seat not in self._hint_providers:
            self._hint_providers[seat] = HintProvider(self.session, self.advice_question(seat))
        return self._hint_providers[seat]

    def position(self, seat: int) -> Position:
        """Return a seat's knowledge at this turn, which answers questions about its actions."""
        return Position.of_session(self.session, self.advice_question(seat))

    def advice_question(self, seat: int) -> AdviceQuestion:
        """Return the question that all advice for a seat answers: its turns and other players."""
        players = tuple(
            self.assumed_players.get(other, shorten_player_name(name))
            for other, name in enumerate(self.player_names)
        )
        return AdviceQuestion(
            seat,
            self.session.turn_limit,
            players,
            assumes_players=any(other != seat for other in self.assumed_players),
            earlier_turns=self.earlier_turns,
            scripts=self._list_script_policies(),
        )

    def _list_script_policies(self) -> tuple[Script, ...]:
        """Return the policies of the players that repeat listed actions."""
        return list_scripts(self.session, self.player_names)

    @property
    def advice_questions(self) -> list[AdviceQuestion]:
        """The question of each person's seat."""
        return [self.advice_question(seat) for seat in self.human_seats]

    def assume_players(self, assumed_players: Mapping[int, str]) -> None:
        """Give advice as if these agents played in these seats; {} for the players of the game."""
        self.assumed_players = dict(assumed_players)
        self._hint_providers = {}
        self._partner_policies, self._snapshot = {}, None

    def snapshot(self, seat: int | None = None) -> SeatSnapshot:
        """Return a snapshot of the game for a seat, by default the viewing seat.

        The viewing seat's snapshot is cached until a turn is played, the seat changes or the game
        ends.
        """
        if seat is not None:
            return self._take_snapshot(seat)
        viewing_seat = self.viewing_seat
        if self._snapshot is None or not self._snapshot.is_current_for(viewing_seat):
            self._snapshot = self._take_snapshot(viewing_seat)
        return self._snapshot

    def _take_snapshot(self, seat: int) -> SeatSnapshot:
        """Return a new snapshot of the game for a seat."""
        if seat not in self._partner_policies:
            is_team = self.problem.partially_observable and not self.agents_only
            self._partner_policies[seat] = (
                find_partner_policy(self.problem, self.advice_question(seat)) if is_team else None
            )
        snapshot = SeatSnapshot(
            self.session,
            seat,
            rewards_visible=self.rewards_visible,
            agents_only=self.agents_only,
            shows_belief=self.shows_belief,
        )
        snapshot.partner_policy = self._partner_policies[seat]
        return snapshot

    def is_action_key(self, key: str) -> bool:
        """Return whether a key plays an action of the viewing seat, or changes a typed number."""
        return key in self.keyboard.number_steps or bool(
            self.keyboard.find_key_action(self.viewing_seat, key)
        )

    def import_hint_agents(self) -> None:
        """Import the modules of the agents that may give hints to people in a built-in problem.

        Code of users is not run here, as it may fail, or not be safe in a second thread.
        """
        for seat in self.human_seats if is_built_in(self.problem) else []:
            load_roster(self.problem, seat)

    def view(self, seat: int | None = None) -> View[Problem]:
        """Return the view of a seat (by default the viewing seat) for policies and drawings."""
        return self.snapshot(seat).view

    def draw_board(self, options: DrawOptions, snapshot: SeatSnapshot | None = None) -> Text:
        """Return the drawn board, with the state if it is revealed and the ghost if it is shown."""
        snapshot = snapshot or self.snapshot()
        ghost = (
            self.ghost.session.state
            if self.ghost and self.ghost.is_shown_during_play
            else options.ghost_state
        )
        names = {**self.keyboard.get_keys_by_action(self.viewing_seat), **options.keys_by_action}
        options = options._replace(
            revealed_state=self._state_if_revealed, ghost_state=ghost, keys_by_action=names
        )
        return fit_board(self.view_module, snapshot.view, options)

    def describe_expected_reward(self, action: float) -> str:
        """Return the view's text on an action's expected reward, after a comma, or ''."""
        describe: Callable[[View[Problem], float], str] | None = getattr(
            self.view_module, "describe_expected_reward", None
        )
        return f", {describe(self.view(), action)}" if describe else ""

    @property
    def _state_if_revealed(self) -> Array | None:
        """The state if hidden information is revealed; else None."""
        is_revealed = self.reveal or (self.session.over and self.problem.partially_observable)
        return self.session.state if is_revealed else None

    def picture_rows(self) -> list[str]:
        """Return the rows of the picture that the view module draws; [] if it draws none."""
        picture = draw_picture(self.view_module, self.view(), self._state_if_revealed)
        return picture.plain.split("\n") if picture else []

    def choose(
        self, action: float, seat: int | None = None, *, stated_belief: Reals | None = None
    ) -> bool:
        """Store one person's choice; play the turn as soon as all people have chosen.

        Without `seat` it is the choice of the next person, who may state a belief `[S]` with it.
        Return whether a turn was played. Raise BadParameter if the game is over, no person plays,
        or no states are hidden of which there could be a belief.
        """
        choosing_seat = self.choosing_seat if seat is None else seat
        if self.session.over:
            raise BadParameter(f"the game is over ({describe_end_reason(self.session.end_reason)})")
        if choosing_seat is None:
            raise BadParameter("no person plays in this game")
        self.session.validate_action(choosing_seat, action)
        if stated_belief is None and self.predictor:
            stated_belief = self.predictor.pop_stated_belief()
        self._stated_beliefs.pop(choosing_seat, None)
        if stated_belief is not None:
            check_has_belief(self.session)
            self._stated_beliefs[choosing_seat] = stated_belief
        choices = {**self._pending_choices, choosing_seat: action}
        if len(choices) == len(list_active_seats(self.session, self.human_seats)):
            is_played = self.advance(choices)
            self.play_until_choice()
            return is_played
        self._pending_choices = choices
        return False

    def ask_for_prediction(self, action: float) -> str:
        """Return the question about an action of the person; '' to play it at once."""
        predictor = self.predictor
        if predictor is None or self.choosing_seat is None:
            return ""
        question = run_cancellable(
            TaskInfo("preparing a question"), lambda: predictor.ask(action, self.hint_provider)
        )
        return question.text if question else ""

    @property
    def open_question(self) -> str:
        """The question that waits for the person's prediction; '' if there is none."""
        question = self.predictor.question if self.predictor else None
        return question.text if question else ""

    def pop_scored_prediction(self) -> "ScoredPrediction | EchoedBelief | None":
        """Return the prediction that was scored since the last call, if any."""
        scored, self._last_prediction = self._last_prediction, None
        return scored

    def _score_prediction(self) -> None:
        """Score the prediction about the last turn, and record it as a note."""
        if self.predictor is None:
            return
        self._last_prediction = scored = self.predictor.score_turn(self.session.turns[-1])
        if scored and scored.note and self.recorder:
            self.recorder.write_note(f"{PREDICTION_NOTE_PREFIX}turn {scored.turn}: {scored.note}")

    def advance(self, choices: Mapping[int, float] = NO_CHOICES) -> bool:
        """Play one turn of people's choices and the agents' actions; return whether it was played.

        The game ends instead if a script has no action left ("quit") or an agent forfeits
        ("forfeit"). Pending choices are discarded in every case.
        """
        stated = {seat: b for seat, b in self._stated_beliefs.items() if seat in choices}
        self._stated_beliefs = {}
        try:
            actions = self._collect_joint_action(
                [choices.get(seat) for seat in range(len(self.player_names))]
            )
        except EndOfScript:
            self.session.end("quit")
            return False
        except Forfeit as forfeit:
            reason = escape_newlines(escape_unprintable(str(forfeit)))
            self.narrator.end_explanations["forfeit"] = reason
            self.session.end("forfeit")
            return False
        finally:
            self._pending_choices = {}
        with defer_signals():
            self.session.advance(actions, stated_beliefs=stated)
            self._undone_turns.clear()
            self._record_turn()
            self._score_prediction()
        self._advance_ghost()
        return True

    def play_until_choice(self) -> None:
        """Play turns until a person must choose or the game is over."""
        while is_waiting_for_others(self.session, self.human_seats):
            self.on_intermediate_turn()
            self.advance()

    def _collect_joint_action(self, actions: Sequence[float | None]) -> Sequence[float | None]:
        """Return the joint action: people's choices, and the agents', in a cancellable task."""
        if len(self.human_seats) == len(self.player_names):
            return actions
        return run_cancellable(
            self._thinking_task_info, lambda: self.session.fill_in_actions(actions)
        )

    def compute_verdict(self) -> Verdict:
        """Return the verdict on a finished game, computed once; it is empty if it was left."""
        last_turn = self.session.turns[-1] if self.session.over and self.session.turns else None
        if last_turn is not None and last_turn is self._judged_turn:
            return self.verdict
        self._judged_turn = last_turn
        self.verdict = (
            Verdict()
            if self.is_paused or self.lesson_goal
            else compute_verdict(
                self.session, self.advice_questions, self.ghost, self.find_standing()
            )
        )
        return self.verdict

    def find_standing(self) -> Standing:
        """Return the help that a finished game had, and a sentence on the player's record."""
        return player_records.find_standing(self)

    def closing_lines(self) -> list[str]:
        """Return the last lines of a game: hidden facts, the result and the verdict on it."""
        lines = self.narrator.closing_lines()
        if self.predictor and self.predictor.summary:
            lines.append(self.predictor.summary)
        return [*lines, *(line for line in self.compute_verdict().lines if line not in lines)]

    def recreate_agents(self) -> None:
        """Recreate the agents' memory and the hint providers, after a background task was
        abandoned.

        The abandoned task may still use the old ones. Pending choices and the ghost are removed as
        well.
        """
        session = self.session
        session.seated_policies = [
            seated_policy and SeatedPolicy(session, seated_policy.seat, seated_policy.policy)
            for seated_policy in session.seated_policies
        ]
        self._hint_providers, self._pending_choices, self._partner_policies = {}, {}, {}
        self.ghost = self.narrator.ghost = None

    def play_agent_turn(self) -> bool:
        """Play the next turn of a game without people; return False if the game is over."""
        return not self.session.over and self.advance()

    def iter_agent_turns(self) -> Iterator[int]:
        """Play a game without people to its end; yield, after each step, the turn count before it.

        The count can decrease in a replay, whose events may undo turns.
        """
        turn_count = len(self.session.turns)
        while self.play_agent_turn():
            yield turn_count
            turn_count = len(self.session.turns)

    def undo(self, turns: int = 1) -> None:
        """Undo turns and record that in the transcript; a pending choice is removed instead."""
        self._check_undo_allowed("undo")
        if self.predictor and self.predictor.question:  # The action is not played yet.
            self.predictor.cancel()
            return
        if self._pending_choices:  # A pending choice is undone before any played turn.
            self._pending_choices.clear()
            return
        with defer_signals():
            undone_turns = self.session.undo(
                count_turns_to_undo(self.session, self.human_seats, turns)
            )
            self._undone_turns += reversed(undone_turns)
            self.undo_count += 1
            if self.recorder:
                self.recorder.write_event("undo", len(undone_turns))
        self._advance_ghost()

    def redo(self) -> None:
        """Play the last undone turn again, and those after it that need no person.

        Raise BadParameter if no turn was undone.
        """
        if not self._undone_turns:
            raise BadParameter("redo: no turn was undone")
        self._pending_choices.clear()
        self._replay_undone_turn()
        while self._undone_turns and is_waiting_for_others(self.session, self.human_seats):
            self.on_intermediate_turn()
            self._replay_undone_turn()
        self.play_until_choice()

    def _replay_undone_turn(self) -> None:
        """Play the last undone actions again and write the turn to the transcript."""
        with defer_signals():
            turn = self._undone_turns[-1]
            self.session.advance(list(turn.actions), stated_beliefs=turn.stated_beliefs)
            self._undone_turns.pop()
            self._record_turn()
        self._advance_ghost()

    def reroll(self) -> None:
        """Play the last turn again with new uniforms, and record that in the transcript."""
        self._check_undo_allowed("reroll")
        if not self.session.turns:
            raise BadParameter("reroll: no turn has been played yet")
        self._pending_choices.clear()
        self._undone_turns.clear()
        with defer_signals():
            self.session.reroll()
            if self.recorder:
                self.recorder.write_event(
                    "reroll", self.session.reroll_counts[len(self.session.turns)]
                )
            self._record_turn()
        self._advance_ghost()
        self.play_until_choice()

    def set_ghost(self, ghost: Ghost | None) -> None:
        """Set or remove the ghost, and advance it to the current turn."""
        self.ghost = self.narrator.ghost = ghost
        self._advance_ghost()

    def note_repeated_uniforms(self) -> None:
        """Record, at most once, that a game with the same uniforms was played before."""
        if self.recorder and not self.repeats_uniforms:
            self.recorder.write_note(REPEATED_UNIFORMS_NOTE)
        self.repeats_uniforms = True

    def _advance_ghost(self) -> None:
        """Advance the ghost to the current turn if it is shown during the game."""
        ghost = self.ghost
        if ghost and ghost.is_shown_during_play:
            with suppress(ComputationStopped):
                run_cancellable(
                    TaskInfo(f"ghost {escape_unprintable(ghost.name)} is playing"), ghost.catch_up
                )

    def check_hints_allowed(self, command: str) -> None:
        """Raise BadParameter if this game forbids hints."""
        if self.hints_forbidden:
            reason = "this game forbids hints (--strict=hints)"
            if self.lesson_goal:
                reason = "this step of the lesson allows no hints"
            raise BadParameter(f"{command}: {reason}")

    @property
    def had_help(self) -> bool:
        """True if a person had a hint, or undid a turn."""
        return bool(self.undo_count or sum(self.session.hint_counts.values()))

    def record_hint(self) -> None:
        """Count a hint for the viewing person and record it in the transcript, once a turn."""
        turns, seat = self.session.turns, self.viewing_seat
        last_turn = turns[-1] if turns else None
        hinted_seat, turn_before_hint = self._last_hint
        is_again = seat == hinted_seat and last_turn is turn_before_hint
        if seat not in self.human_seats or is_again:
            return
        self._last_hint = seat, last_turn
        name = self.problem.agents[seat]
        with defer_signals():
            self.session.hint_counts[name] += 1
            if self.recorder:
                self.recorder.write_event("help", {name: 1})

    @property
    def undo_forbidden_reason(self) -> str:
        """The reason why turns cannot be undone; '' if they can."""
        if self.strict:
            return "this game is strict, so turns cannot be undone"
        is_disclosed = (
            self.session.over
            and self.problem.partially_observable
            and self.human_seats
            and not self.reveal
        )
        return "the hidden states have been shown" if is_disclosed else ""

    @property
    def has_choice_to_undo(self) -> bool:
        """True if a turn was played, or a choice waits for those of other people."""
        return bool(self.session.turns or self._pending_choices)

    def _check_undo_allowed(self, command: str) -> None:
        """Raise BadParameter, prefixed with the command, if turns cannot be undone."""
        if self.undo_forbidden_reason:
            raise BadParameter(f"{command}: {self.undo_forbidden_reason}")

    def _record_turn(self) -> None:
        """Write the last turn to the transcript, if there is one.

        The game ends when the transcript has no space for another turn.
        """
        if self.recorder:
            self.recorder.write_turn()
            if self.recorder.is_full:
                self.narrator.end_explanations["interrupted"] = FULL_TRANSCRIPT_REASON
                self.session.end("interrupted")

    def pause(self) -> None:
        """Close the transcript, and the bots, so that the game can be resumed later.

        The session is not over: nothing that is hidden may be shown.
        """
        with defer_signals():
            if self.recorder:
                self.recorder.write_end(reason="interrupted")
            self.narrator.is_paused = True
        self._close_bots()

    def finish(self, reason: str = "quit") -> None:
        """End the game, its transcript and the bots that play in it; do nothing if it is paused."""
        if self.narrator.is_paused:
            return
        with defer_signals():
            self.session.end(reason)
            if self.recorder:
                explanation = self.narrator.end_explanation
                note = f"# {explanation}\n" if explanation else ""
                self.recorder.write_end(f"{note}{self.end_notes}")
        self._close_bots()

    def _close_bots(self) -> None:
        """Close the bots that play in this game, and note their log files."""
        if any(map(names_bot, self.player_names)):
            from dmplay.external.bots.shutdown import close_bots  # imported only if a bot plays

            self.log_paths += close_bots(self.session, self.problem_name)
