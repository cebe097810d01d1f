"""Looking back at a game that is over: its turns one by one, and what each move lost."""

from collections.abc import Sequence
from contextlib import suppress
from math import ceil

import numpy as np

from dmplay.advice import review
from dmplay.advice.adviser import Advice, Adviser, decimals, fixed
from dmplay.advice.ghost import same_dice
from dmplay.advice.review import Move
from dmplay.budget import Stopped
from dmplay.errors import DmplayError
from dmplay.game.game import Game
from dmplay.session import Turn
from dmplay.views.canvas import BARS

WORST = 3  # moves that are named
AROUND = 16  # columns of the row of regret beside its bars, at least


class Past(Game):
    """A game that is over as it stood before one of its turns; nothing in it is hidden."""

    paid = True

    def __init__(self, game: Game, made: Sequence[Move] = ()) -> None:
        self.whole = game
        self.many = len(game.session.turns)
        self._made: list[list[Move]] = [[] for _ in range(self.many)]  # by turn
        for move in made:
            self._made[move.turn - 1].append(move)
        begun = game.session.anew()
        begun.rerolls = game.session.rerolls
        super().__init__(game.name, begun, game.seats, game.keyboard)

    @property
    def reveal(self) -> bool:
        """Nothing is hidden."""
        return True

    @property
    def waiting(self) -> int | None:
        """Nobody chooses."""
        return None

    @property
    def unaided(self) -> bool:
        """There is no hint to ask for; what the moves were worth is shown where it is known."""
        return self.advice is None

    @property
    def strict(self) -> bool:
        """Whether nobody plays on from a turn."""
        return self.whole.strict

    @property
    def final(self) -> str:
        """Why the end cannot be taken back."""
        return self.whole.final

    @property
    def adviser(self) -> Adviser:
        """That of the whole game, whose overlays stand."""
        return self.whole.adviser

    @property
    def turn(self) -> int:
        """How many turns were played."""
        return len(self.session.turns)

    def go(self, turn: int) -> None:
        """Stands before another turn, as many having been played."""
        if turn < self.turn:
            self.session.undo(self.turn - turn)
        self.session.repeat(self.whole.session.turns[self.turn : turn])

    @property
    def advice(self) -> Advice | None:
        """What the actions of the one who is shown were worth here."""
        name, labels = self.problem.agents[self.watcher], self.problem.actions[self.watcher].labels
        move = next((one for one in self._made[self.turn] if one.seat == name), None)
        if move is None:
            return None
        values = np.array([move.values.get(label, np.nan) for label in labels])
        return Advice(" or ".join(move.best), labels, values)

    def rows(self, width: int) -> list[str]:
        """What led here, the regret of every turn, and what was done next."""
        return [*self._before(), *self._regret(width), self._next()]

    def _before(self) -> list[str]:
        """The last turn."""
        return [self.account.said(self.moment())] if self.turn else []

    def _next(self) -> str:
        """Where this is, and the choice that was made, with the better one."""
        here, made = self.turn, self._made[self.turn]
        told = [_judged(move) for move in made]
        if not made:
            seats, chosen = self.people, self.whole.session.turns[here].actions
            told = [f"chose {self.problem.action_name(seat, chosen[seat])}" for seat in seats]
        names = [self.problem.agents[seat] for seat in self.people]
        if len(names) > 1:
            told = [f"{name} {words}" for name, words in zip(names, told, strict=True)]
        return f"turn {here + 1} of {self.many}: {'; '.join(told)}."

    @property
    def _lost(self) -> list[float]:
        """The regret of every turn."""
        return [sum(move.regret for move in made) for made in self._made]

    @property
    def _worst(self) -> list[int]:
        """The turns that lost the most, the worst first."""
        lost = self._lost
        ranked = sorted(range(self.many), key=lambda turn: (-lost[turn], turn))
        return [turn + 1 for turn in ranked[:WORST] if lost[turn] > 0]

    def _regret(self, width: int) -> list[str]:
        """A bar a turn, as many as there is room for around this one, which is in brackets."""
        worst, lost = self._worst, self._lost
        if not worst:
            return []
        tail = f"  worst: turn {', '.join(map(str, worst))}"
        room = max(width - AROUND - len(tail), 1)
        first = max(min(self.turn - room // 2, self.many - room), 0)
        most = max(lost)
        bars = [BARS[ceil((len(BARS) - 1) * (one / most))] for one in lost]
        bars[self.turn] = f"[{bars[self.turn]}]"
        return [f"regret {''.join(bars[first : first + room])}{tail}"]


def _judged(move: Move) -> str:
    """A choice, and the better one with what it would have saved."""
    if move.chosen in move.best:
        return f"chose {move.chosen}, the best"
    lost = fixed(move.regret, decimals([*move.values.values()]))
    return f"chose {move.chosen}; {' or '.join(move.best)} was better by {lost}"


class Verdict:
    """Judges a game once it is over, and has its turns to step through."""

    def __init__(self) -> None:
        self.past: Past | None = None
        self._last: Turn | None = None  # of the game that was judged

    def judge(self, game: Game) -> None:
        """Looks back at each end that people come to, at as much as somebody waits for."""
        turns = game.session.turns if game.session.over and game.people else []
        last = turns[-1] if turns else None
        if last is self._last:
            return
        self._last, game.verdict = last, ()
        self.past = Past(game) if last else None
        if last:
            with suppress(Stopped):
                game.verdict = self._valued(game)
                dice = same_dice(game.session, game.people, game.seats, game.ghost)
                game.verdict = [*game.verdict, *filter(None, [dice])]

    def _valued(self, game: Game) -> list[str]:
        """What the moves were worth."""
        try:
            made = review.of(game.session, game.people, game.seats)
        except DmplayError as error:
            return [f"review: {error}"]
        self.past = Past(game, made)
        return [review.summary(made)] if made else []

    def led(self, key: str, now: int | None) -> int | None:
        """The turn that a key leads to from this one, None from the end; None for another key."""
        if self.past is None:
            return None
        many = self.past.many
        here = many if now is None else now
        more = {"enter": here - 1} if now is None else {"right": here + 1, "home": 0, "end": many}
        to = ({"left": here - 1} | more).get(key)
        return None if to is None else min(max(to, 0), many)
