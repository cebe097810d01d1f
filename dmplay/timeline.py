"""Looking back at a game that is over: its turns one by one, and what each move lost."""

from collections.abc import Sequence
from contextlib import suppress
from math import ceil

import numpy as np

from dmplay.advice import review
from dmplay.advice.adviser import Hint, HintProvider, count_decimals, format_fixed
from dmplay.advice.ghost import describe_ghost_result
from dmplay.advice.review import ReviewedAction
from dmplay.budget import ComputationStopped
from dmplay.errors import DmplayError
from dmplay.game.game import Game
from dmplay.session import Turn
from dmplay.views.canvas import BAR_LEVELS

MAX_WORST_TURNS = 3  # moves that are named
MIN_BAR_COLUMNS = 16  # columns of the row of regret beside its bars, at least


class GameTimeline(Game):
    """A game that is over as it stood before one of its turns; nothing in it is hidden."""

    rewards_visible = True

    def __init__(self, game: Game, moves: Sequence[ReviewedAction] = ()) -> None:
        self.finished_game = game
        self.turn_count = len(game.session.turns)
        self._moves_by_turn: list[list[ReviewedAction]] = [
            [] for _ in range(self.turn_count)
        ]  # by turn
        for move in moves:
            self._moves_by_turn[move.turn - 1].append(move)
        begun = game.session.copy_at_start()
        begun.reroll_counts = game.session.reroll_counts
        super().__init__(game.problem_name, begun, game.player_names, game.keyboard)

    @property
    def reveal(self) -> bool:
        """Nothing is hidden."""
        return True

    @property
    def choosing_seat(self) -> int | None:
        """Nobody chooses."""
        return None

    @property
    def hints_forbidden(self) -> bool:
        """There is no hint to ask for; what the moves were worth is shown where it is known."""
        return self.move_hints is None

    @property
    def strict(self) -> bool:
        """Whether nobody plays on from a turn."""
        return self.finished_game.strict

    @property
    def undo_forbidden_reason(self) -> str:
        """Why the end cannot be taken back."""
        return self.finished_game.undo_forbidden_reason

    @property
    def hint_provider(self) -> HintProvider:
        """That of the whole game, whose overlays stand."""
        return self.finished_game.hint_provider

    @property
    def turns_played(self) -> int:
        """How many turns were played."""
        return len(self.session.turns)

    def go_to_turn(self, turn: int) -> None:
        """Stands before another turn, as many having been played."""
        if turn < self.turns_played:
            self.session.undo(self.turns_played - turn)
        self.session.append_turns(self.finished_game.session.turns[self.turns_played : turn])

    @property
    def move_hints(self) -> Hint | None:
        """What the actions of the one who is shown were worth here."""
        name, labels = (
            self.problem.agents[self.viewing_seat],
            self.problem.actions[self.viewing_seat].labels,
        )
        move = next(
            (one for one in self._moves_by_turn[self.turns_played] if one.seat == name),
            None,
        )
        if move is None:
            return None
        values = np.array([move.values.get(label, np.nan) for label in labels])
        return Hint(" or ".join(move.best), labels, values)

    def review_rows(self, width: int) -> list[str]:
        """What led here, the regret of every turn, and what was done next."""
        return [*self._last_turn_rows(), *self._regret_rows(width), self._next_choice_row()]

    def _last_turn_rows(self) -> list[str]:
        """The last turn."""
        return [self.narrator.describe_turn(self.snapshot())] if self.turns_played else []

    def _next_choice_row(self) -> str:
        """Where this is, and the choice that was made, with the better one."""
        here, made = self.turns_played, self._moves_by_turn[self.turns_played]
        told = [_describe_choice(move) for move in made]
        if not made:
            seats, chosen = self.human_seats, self.finished_game.session.turns[here].actions
            told = [
                f"chose {self.problem.format_action(seat, chosen[seat])}" for seat in seats
            ]
        names = [self.problem.agents[seat] for seat in self.human_seats]
        if len(names) > 1:
            told = [f"{name} {words}" for name, words in zip(names, told, strict=True)]
        return f"turn {here + 1} of {self.turn_count}: {'; '.join(told)}."

    @property
    def _turn_regrets(self) -> list[float]:
        """The regret of every turn."""
        return [sum(move.regret for move in made) for made in self._moves_by_turn]

    @property
    def _worst_turns(self) -> list[int]:
        """The turns that lost the most, the worst first."""
        lost = self._turn_regrets
        ranked = sorted(range(self.turn_count), key=lambda turn: (-lost[turn], turn))
        return [turn + 1 for turn in ranked[:MAX_WORST_TURNS] if lost[turn] > 0]

    def _regret_rows(self, width: int) -> list[str]:
        """A bar a turn, as many as there is room for around this one, which is in brackets."""
        worst, lost = self._worst_turns, self._turn_regrets
        if not worst:
            return []
        tail = f"  worst: turn {', '.join(map(str, worst))}"
        room = max(width - MIN_BAR_COLUMNS - len(tail), 1)
        first = max(min(self.turns_played - room // 2, self.turn_count - room), 0)
        most = max(lost)
        bars = [BAR_LEVELS[ceil((len(BAR_LEVELS) - 1) * (one / most))] for one in lost]
        bars[self.turns_played] = f"[{bars[self.turns_played]}]"
        return [f"regret {''.join(bars[first : first + room])}{tail}"]


def _describe_choice(move: ReviewedAction) -> str:
    """A choice, and the better one with what it would have saved."""
    if move.chosen in move.best:
        return f"chose {move.chosen}, the best"
    lost = format_fixed(move.regret, count_decimals([*move.values.values()]))
    return f"chose {move.chosen}; {' or '.join(move.best)} was better by {lost}"


class PostGameReview:
    """Judges a game once it is over, and has its turns to step through."""

    def __init__(self) -> None:
        self.timeline: GameTimeline | None = None
        self._reviewed_turn: Turn | None = None  # of the game that was judged

    def review_game(self, game: Game) -> None:
        """Looks back at each end that people come to, at as much as somebody waits for."""
        turns = game.session.turns if game.session.over and game.human_seats else []
        last = turns[-1] if turns else None
        if last is self._reviewed_turn:
            return
        self._reviewed_turn, game.review_lines = last, ()
        self.timeline = GameTimeline(game) if last else None
        if last:
            with suppress(ComputationStopped):
                game.review_lines = self._review_choices(game)
                dice = describe_ghost_result(
                    game.session, game.human_seats, game.player_names, game.ghost
                )
                game.review_lines = [*game.review_lines, *filter(None, [dice])]

    def _review_choices(self, game: Game) -> list[str]:
        """What the moves were worth."""
        try:
            made = review.run_review(game.session, game.human_seats, game.player_names)
        except DmplayError as error:
            return [f"review: {error}"]
        self.timeline = GameTimeline(game, made)
        return [review.format_summary(made)] if made else []

    def turn_for_key(self, key: str, current_turn: int | None) -> int | None:
        """The turn that a key leads to from this one, None from the end; None for another key."""
        if self.timeline is None:
            return None
        many = self.timeline.turn_count
        here = many if current_turn is None else current_turn
        more = (
            {"enter": here - 1}
            if current_turn is None
            else {"right": here + 1, "home": 0, "end": many}
        )
        to = ({"left": here - 1} | more).get(key)
        return None if to is None else min(max(to, 0), many)
