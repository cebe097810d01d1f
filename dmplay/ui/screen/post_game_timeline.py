"""A view of a finished game for stepping through its turns, with the regret of each choice."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from dmplay.core.action_values import Accuracy, ActionValues
from dmplay.core.session import Turn
from dmplay.core.work_budget import ComputationStopped
from dmplay.errors import BadParameter
from dmplay.game.background_tasks import run_cancellable
from dmplay.game.game import Game
from dmplay.game.hints import review
from dmplay.game.hints.hint_provider import Hint, HintProvider, choose_decimals, format_fixed
from dmplay.game.hints.review import ReviewedAction
from dmplay.game.share_line import mark_losses
from dmplay.game.verdict import Verdict, iter_verdicts
from dmplay.ui.screen.event_log import mark_turn_row
from dmplay.ui.shell.game_commands import HINT_TASK

MAX_WORST_TURNS = 3  # worst turns that are named
MIN_CAPTION_COLUMNS = 72  # columns of the screen from which the rows on regrets are complete
RELATIVE_TOLERANCE = 1e-9  # share by which equal regrets may differ
MARGIN_COLUMNS = 7  # columns of the regret row for its margins, the bracket and two ellipses


class GameTimeline(Game):
    """A finished game as it was before one of its turns, with nothing hidden."""

    rewards_visible = True

    def __init__(
        self,
        game: Game,
        moves: Sequence[ReviewedAction] = (),
        reviewed_seats: Sequence[int] | None = None,
    ) -> None:
        self.finished_game = game
        self._reviewed_seats = reviewed_seats  # those of people if None
        self.shown_worst_turn: int | None = None  # the bad choice that a replay went to last
        self.turn_count = len(game.session.turns)
        # indexed by turn
        self._moves_by_turn: list[list[ReviewedAction]] = [[] for _ in range(self.turn_count)]
        for move in moves:
            self._moves_by_turn[move.turn - 1].append(move)
        session = game.session.copy_at_start()
        session.reroll_counts = game.session.reroll_counts
        super().__init__(game.problem_name, session, game.player_names, game.keyboard)
        self.verdict = replace(game.verdict, moves=tuple(moves))

    @property
    def reveal(self) -> bool:
        """True, because nothing is hidden after the end."""
        return True

    @property
    def choosing_seat(self) -> int | None:
        """None, because nobody chooses in a finished game."""
        return None

    @property
    def hints_forbidden(self) -> bool:
        """True if there are no action values to show for this turn; hints cannot be requested."""
        return self.move_hints is None

    @property
    def reviewed_seats(self) -> Sequence[int]:
        """The seats whose choices are reviewed: those of people, or those that were given."""
        return self.human_seats if self._reviewed_seats is None else self._reviewed_seats

    @property
    def strict(self) -> bool:
        """True if it is forbidden to play on from an earlier turn."""
        return self.finished_game.strict

    @property
    def undo_forbidden_reason(self) -> str:
        """The reason why the end of the game cannot be undone."""
        return self.finished_game.undo_forbidden_reason

    @property
    def hint_provider(self) -> HintProvider:
        """The hint provider of the finished game, with its cached overlays."""
        return self.finished_game.hint_provider

    @property
    def turns_played(self) -> int:
        """The number of turns played before the current position."""
        return len(self.session.turns)

    def go_to_turn(self, turn: int) -> None:
        """Move to the position after the given number of turns."""
        if turn < self.turns_played:
            self.session.undo(self.turns_played - turn)
        self.session.append_turns(self.finished_game.session.turns[self.turns_played : turn])

    @property
    def move_hints(self) -> Hint | None:
        """The reviewed action values of the viewing seat in this turn, or None."""
        name = self.problem.agents[self.viewing_seat]
        labels = self.problem.actions[self.viewing_seat].labels
        move = next(
            (
                candidate
                for candidate in self._moves_by_turn[self.turns_played]
                if candidate.seat == name
            ),
            None,
        )
        if move is None or not labels:
            return None
        values = np.array([move.values.get(label, np.nan) for label in labels])
        errors = (
            None
            if move.errors is None
            else np.array([move.errors.get(label, np.inf) for label in labels])
        )
        return Hint(
            "",
            " or ".join(move.best),
            labels,
            ActionValues(
                values, move.basis._replace(has_regrets=move.regret is not None), errors=errors
            ),
            game=move.about,
        )

    def review_rows(self, width: int) -> list[str]:
        """Return the rows below the board: previous turn, regret bars and next choice."""
        choices = self.describe_next_choices(width)
        beliefs = [
            move.stated_belief.format_line(move.decimal_count)
            for move in self._moves_by_turn[self.turns_played]
            if move.stated_belief
        ]
        return [*self._last_turn_rows(), *self.regret_rows(width), choices, *beliefs]

    def _last_turn_rows(self) -> list[str]:
        """Return one row that describes the previous turn, or none before the first turn."""
        if not self.turns_played:
            return []
        mark = self.verdict.marks.get(self.turns_played, "")
        return [mark_turn_row(self.narrator.describe_turn(self.snapshot()), mark)]

    def describe_next_choices(self, width: int | None = None) -> str:
        """Return a line of text on the turn that comes next in the review.

        It has the turn's number, the choice of each person, and the better choice if there is one,
        with what this lost, and what the score lost if that fits in `width` columns.
        """
        lines = [self._format_next_choices(with_score=with_score) for with_score in (True, False)]
        return lines[width is not None and len(lines[0]) >= width]

    def _format_next_choices(self, *, with_score: bool) -> str:
        """Return the line of text on the turn that comes next."""
        turn, moves = self.turns_played, self._moves_by_turn[self.turns_played]
        texts = [_describe_choice(move, with_score=with_score) for move in moves]
        if not moves:
            seats, chosen = self.reviewed_seats, self.finished_game.session.turns[turn].actions
            texts = [f"chose {self.problem.format_action(seat, chosen[seat])}" for seat in seats]
        names = [self.problem.agents[seat] for seat in self.reviewed_seats]
        if len(names) > 1:
            texts = [f"{name} {text}" for name, text in zip(names, texts, strict=True)]
        return f"next, turn {turn + 1}: {'; '.join(texts)}."

    def explain_choice(self) -> list[str]:
        """Return why the viewing seat's action in this turn is worth what it is, in lines."""
        from dmplay.game.hints.explanation import explain_action  # imported only if asked for

        seat = self.viewing_seat
        provider = HintProvider(self.session, self.finished_game.advice_question(seat))
        action = self.finished_game.session.turns[self.turns_played].actions.item(seat)
        reasons = run_cancellable(HINT_TASK, lambda: explain_action(provider, action))
        return [reasons.heading, *reasons.sentences]

    @property
    def _turn_regrets(self) -> list[float]:
        """The loss in each turn, summed over the human seats."""
        return [sum(move.loss for move in moves) for moves in self._moves_by_turn]

    @property
    def worst_turns(self) -> list[int]:
        """The numbers of the turns with the largest regrets, the largest first."""
        regrets, turns = self._turn_regrets, {move.turn for move in self.verdict.costly_choices}
        ranked = sorted(range(self.turn_count), key=lambda turn: (-regrets[turn], turn))
        return [turn + 1 for turn in ranked if turn + 1 in turns][:MAX_WORST_TURNS]

    @property
    def no_worst_turn_reason(self) -> str:
        """The reason why there are no worst turns."""
        moves, medal = self.verdict.moves, self.verdict.medal
        if any(move.basis.accuracy.is_bound for move in moves):
            return "no choice is judged, because only bounds are known; ← and → show each turn"
        ratings = [move for move in moves if move.basis.accuracy is Accuracy.RATING]
        if moves and all(move.regret is not None or move in ratings for move in moves):
            are_clear = not any(move.is_too_close or move.lost_something for move in moves)
            clear = "every choice was right" if are_clear else "no choice clearly lost much"
            if medal and not medal.is_best:
                return f"{clear}; {medal}"
            return f"nothing to improve: {clear}" if are_clear else clear
        return "no choice has a known regret; ← and → show each turn"

    def find_next_worst_turn(self, current: int) -> int:
        """Return the turn with the largest regret; after it was shown, the next largest.

        Raise BadParameter if there is none.
        """
        turns = self.worst_turns
        if not turns:
            raise BadParameter(self.no_worst_turn_reason)
        is_repeated = self.shown_worst_turn == current and current in turns
        index = turns.index(current) + 1 if is_repeated else 0
        self.shown_worst_turn = turns[index % len(turns)]
        return self.shown_worst_turn

    def regret_rows(self, width: int) -> list[str]:
        """Return the row of regret bars, one per turn, with the current turn in brackets.

        As many turns are shown around the current one as fit in `width` columns. Without any regret
        there is no row.
        """
        worst, regrets = self.worst_turns, self._turn_regrets
        if not worst:
            return []
        least = regrets[worst[-1] - 1] * (1.0 - RELATIVE_TOLERANCE)
        has_more = sum(regret >= least for regret in regrets) > len(worst)  # equal ones
        turns = f"turn{'s' * (len(worst) > 1)} {', '.join(map(str, worst))}{', ...' * has_more}"
        accuracies = {move.basis.accuracy for moves in self._moves_by_turn for move in moves}
        noun = "rating lost" if Accuracy.RATING in accuracies else "value lost"
        captions = [
            (f"{noun} each turn ", f"  [ ] = next turn; most in {turns}"),
            (f"{noun} ", f"  most in {turns}"),
        ]
        free_columns = [width - len("".join(pair)) - MARGIN_COLUMNS for pair in captions]
        # The short caption, if the bars of all turns fit only beside it.
        is_short = free_columns[0] < self.turn_count <= free_columns[1]
        prefix, suffix = captions[is_short or width < MIN_CAPTION_COLUMNS]
        bar_columns = max(width - len(prefix) - len(suffix) - MARGIN_COLUMNS, 1)
        first = max(min(self.turns_played - bar_columns // 2, self.turn_count - bar_columns), 0)
        bars = [*mark_losses(self.verdict, self.turn_count)]
        bars[self.turns_played] = f"[{bars[self.turns_played]}]"
        last = first + bar_columns
        row = f"{'…' * (first > 0)}{''.join(bars[first:last])}{'…' * (last < self.turn_count)}"
        return [f"{prefix}{row}{suffix}"]


def _describe_choice(move: ReviewedAction, *, with_score: bool) -> str:
    """Return a choice as text, with the better action and its gain if there was one.

    With a discount and `with_score`, the text also says how much the score lost.
    """
    if move.is_too_close:
        return f"chose {move.chosen}, {review.NOT_JUDGED}"
    if move.chosen in move.best:
        rank = "the best action" if len(move.best) == 1 else f"one of {len(move.best)} best actions"
        rank = "the action of the best bound" if move.basis.accuracy.is_bound else rank
        return f"chose {move.chosen}, {review.append_game(rank, move.basis.scope)}"
    best = " or ".join(move.best)
    if move.basis.accuracy.is_bound:
        return f"chose {move.chosen}; {best} has the best bound, which does not judge a choice"
    if move.basis.accuracy is Accuracy.RATING:
        return f"chose {move.chosen}; {best} was rated higher"
    gain = ""
    if move.regret is not None:
        losses = [move.regret, *[move.discounted_regret] * (move.discount_factor < 1.0)]
        numbers = [
            format_fixed(lost, max(move.decimal_count, choose_decimals([lost], move.scale)))
            for lost in losses
        ]
        share = f", {numbers[-1]} of the score" * (with_score and len(numbers) > 1)
        gain = f" by {numbers[0]}{share}"
    return (
        f"chose {move.chosen}; {best} {review.append_game(f'was better{gain}', move.basis.scope)}"
    )


def _last_turn_if_over(game: Game) -> Turn | None:
    """Return the last turn of a finished game with people; None of any other game.

    The game of a lesson counts as any other: the lesson judges it, and must not give the answer.
    """
    is_reviewed = game.session.over and game.human_seats and not game.lesson_goal
    turns = game.session.turns if is_reviewed else []
    return turns[-1] if turns else None


class PostGameReview:
    """The review of a finished game, and the timeline for stepping through its turns."""

    def __init__(self) -> None:
        self.timeline: GameTimeline | None = None
        self._reviewed_turn: Turn | None = None  # last turn of the reviewed game

    def is_due(self, game: Game) -> bool:
        """Return whether the game has ended, or goes on again, since the last review."""
        return _last_turn_if_over(game) is not self._reviewed_turn

    def review_game(self, game: Game) -> None:
        """Review the game when it has ended, unless this end was reviewed before.

        Stores the verdict in the game; if the user cancels, the parts that are complete.
        """
        if not self.is_due(game):
            return
        last_turn = _last_turn_if_over(game)
        self._reviewed_turn, game.verdict = last_turn, Verdict()
        self.timeline = GameTimeline(game) if last_turn else None
        if last_turn:
            verdicts = iter_verdicts(
                game.session, game.advice_questions, game.ghost, game.find_standing()
            )
            with suppress(ComputationStopped):
                for game.verdict in verdicts:
                    self.timeline = GameTimeline(game, game.verdict.moves)

    def turn_for_key(self, key: str, current_turn: int | None) -> int | None:
        """Return the turn that a key leads to, or None if the key does not move through the turns.

        `current_turn` is None at the end of the game. The result is from 0 to the number of turns.
        """
        if self.timeline is None:
            return None
        turn_count = self.timeline.turn_count
        turn = turn_count if current_turn is None else current_turn
        targets = (
            {"enter": turn - 1}
            if current_turn is None
            else {"right": turn + 1, "home": 0, "end": turn_count}
        )
        target = ({"left": turn - 1} | targets).get(key)
        return None if target is None else min(max(target, 0), turn_count)
