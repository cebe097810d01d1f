"""How a game is told: a turn, the situation, the end, and what only the end brings out."""

from collections.abc import Mapping, Sequence

from dmplay.advice.ghost import Ghost
from dmplay.describe import counted, ended, score
from dmplay.game import facts
from dmplay.session import Session
from dmplay.transcript.format import end_facts, number, turn_facts
from dmplay.transcript.seal import LEFT
from dmplay.views.kept import Kept, Moment
from dmplay.views.style import Look, fit, style_of, whole

NOTHING: Mapping[str, object] = {}
FRAME = Look(width=80, height=24)


def frame(session: Session) -> str:
    """What the first seat's screen shows, as the transcript's plain-text frame."""
    style, view = style_of(session.problem), session.view(0)
    width, height = whole(style, view, FRAME.width, FRAME.height)
    drawn = fit(style, view, FRAME._replace(width=width, height=height))
    return "\n".join(row.rstrip() for row in drawn.plain.split("\n"))


class Account:
    """What is said of a session, to people who may know their view of it, or all if revealed."""

    def __init__(self, session: Session, people: Sequence[int], *, reveal: bool) -> None:
        self.session = session
        self.people = people
        self.reveal = reveal
        self.dice = True  # whether draws may be told
        self.ghost: Ghost | None = None
        self.forfeit = ""  # the last there was: whose, and why
        self.kept = Kept(session.problem)
        self._hidden: tuple[object, list[dict[str, object]]] = (None, [])

    def said(self, now: Moment) -> str:
        """The last turn in one line: number, what happened, reward and score where seen."""
        rerolled = ", under other dice" if now.turn in self.session.rerolls else ""
        parts = [f"turn {now.turn}{rerolled}.", self.kept.told(now)]
        if now.paid and now.last:
            reward = now.last.rewards.item(now.seat)
            parts.append(f"reward {reward:.6g}. score {self.returned(now):.6g}.")
        if self.ghost and self.ghost.early:
            parts.append(f"ghost {self.ghost.score:.6g}, lead {self.ghost.lead:+.6g}.")
        return " ".join(parts)

    def change(self, now: Moment, before: int) -> str:
        """What happened since there were so many turns: how far back the game is, or a turn."""
        return f"undone. turn {now.turn}." if now.turn < before else self.said(now)

    def returned(self, now: Moment) -> float:
        """The discounted sum of the rewards of the seat so far."""
        return self.session.returned(now.seat)

    def situation(self, now: Moment) -> str:
        """Where the game stands, in sentences."""
        words = self.kept.situation(now)
        if self.reveal and self.session.problem.hidden:
            words += f" truly {self.session.problem.notation(self.session.state)}."
        return words

    def public(self, now: Moment) -> dict[str, object]:
        """The last turn as data: all of it if no person plays or all is revealed, else what the
        seat of the view may know.
        """
        if not self.people or self.reveal:
            return self.turn()
        return facts.public(self.session, now)

    def turn(self) -> dict[str, object]:
        """All of the last turn, but for its draws where nobody may know the dice."""
        told = turn_facts(self.session)
        return {key: value for key, value in told.items() if self.dice or key != "draws"}

    def result(self) -> str:
        """How it ended: reason, turns, score and total of each seat."""
        session = self.session
        agents = session.problem.agents
        sums = zip(agents, session.returns(), session.totals(), strict=True)
        name = score(session.problem)
        each = "; ".join(f"{who} {name} {number(r):g}, total {number(t):g}" for who, r, t in sums)
        turns = f"{ended(session.ending)} after {counted(len(session.turns), 'turn')}."
        turns += f" {self.forfeited.rstrip('?.')}." if self.forfeited else ""
        known = not self.people or self.reveal or session.ending not in LEFT
        return f"{turns} {each}." if known or not session.problem.hidden else turns

    def end(self, known: Mapping[str, object] = NOTHING) -> dict[str, object]:
        """The ending as data, with what else is known of it, and turn by turn what was hidden."""
        facts = {**end_facts(self.session), **known}
        if self.forfeited:
            facts["why"] = self.forfeited
        rows = self.debrief()
        return facts | ({"debrief": rows} if rows else {})

    @property
    def forfeited(self) -> str:
        """Which seat forfeited the game, and why; '' where none did."""
        return self.forfeit if self.session.ending == "forfeit" else ""

    def closing(self) -> list[str]:
        """How it ended and, turn by turn, what was hidden, a line each."""
        return [f"over: {self.result()}", *self._ghostly(), *map(facts.sentence, self.debrief())]

    def _ghostly(self) -> list[str]:
        """What the ghost made of the same dice, once that tells no secret."""
        if not self.ghost or (self.session.ending or "") in LEFT:
            return []
        self.ghost.finish()
        return [self.ghost.compared()]

    def debrief(self) -> list[dict[str, object]]:
        """Turn by turn what was hidden, once it is over: state, observation, belief and reward."""
        session = self.session
        if not (session.problem.hidden and session.over):
            return []
        key = (len(session.turns), session.ending)
        if self._hidden[0] != key:
            self._hidden = key, facts.debrief(session)
        return self._hidden[1]
