"""How a game is told: a turn, the situation, the end, and what only the end brings out."""

from collections.abc import Mapping, Sequence

from dmplay.advice.ghost import Ghost
from dmplay.describe import describe_end_reason, format_count, score_label
from dmplay.game import facts
from dmplay.session import Session
from dmplay.transcript.format import collect_end_facts, collect_turn_facts, round_number
from dmplay.transcript.seal import RESUMABLE_END_REASONS
from dmplay.views.kept import SeatSnapshot, ViewCache
from dmplay.views.style import DrawOptions, expand_for_picture, fit_board, load_view_module

NO_FACTS: Mapping[str, object] = {}
TRANSCRIPT_DRAW_OPTIONS = DrawOptions(width=80, height=24)


def render_transcript_frame(session: Session) -> str:
    """What the first seat's screen shows, as the transcript's plain-text frame."""
    style, view = load_view_module(session.problem), session.view(0)
    width, height = expand_for_picture(
        style, view, TRANSCRIPT_DRAW_OPTIONS.width, TRANSCRIPT_DRAW_OPTIONS.height
    )
    drawn = fit_board(style, view, TRANSCRIPT_DRAW_OPTIONS._replace(width=width, height=height))
    return "\n".join(row.rstrip() for row in drawn.plain.split("\n"))


class Narrator:
    """What is said of a session, to people who may know their view of it, or all if revealed."""

    def __init__(self, session: Session, human_seats: Sequence[int], *, reveal: bool) -> None:
        self.session = session
        self.human_seats = human_seats
        self.reveal = reveal
        self.shows_uniforms = True  # whether draws may be told
        self.ghost: Ghost | None = None
        self.last_forfeit = ""  # the last there was: whose, and why
        self.view_cache = ViewCache(session.problem)
        self._debrief_cache: tuple[object, list[dict[str, object]]] = (None, [])

    def describe_turn(self, snapshot: SeatSnapshot) -> str:
        """The last turn in one line: number, what happened, reward and score where seen."""
        rerolled = ", under other dice" if snapshot.turn in self.session.reroll_counts else ""
        parts = [f"turn {snapshot.turn}{rerolled}.", self.view_cache.describe_turn(snapshot)]
        if snapshot.rewards_visible and snapshot.last_turn:
            reward = snapshot.last_turn.rewards.item(snapshot.seat)
            parts.append(f"reward {reward:.6g}. score {self.seat_return(snapshot):.6g}.")
        if self.ghost and self.ghost.is_shown_during_play:
            parts.append(f"ghost {self.ghost.score:.6g}, lead {self.ghost.player_lead:+.6g}.")
        return " ".join(parts)

    def describe_change(self, snapshot: SeatSnapshot, previous_turn_count: int) -> str:
        """What happened since there were so many turns: how far back the game is, or a turn."""
        return (
            f"undone. turn {snapshot.turn}."
            if snapshot.turn < previous_turn_count
            else self.describe_turn(snapshot)
        )

    def seat_return(self, snapshot: SeatSnapshot) -> float:
        """The discounted sum of the rewards of the seat so far."""
        return self.session.seat_return(snapshot.seat)

    def describe_situation(self, snapshot: SeatSnapshot) -> str:
        """Where the game stands, in sentences."""
        words = self.view_cache.describe_situation(snapshot)
        if self.reveal and self.session.problem.partially_observable:
            words += f" truly {self.session.problem.format_state(self.session.state)}."
        return words

    def visible_turn_facts(self, snapshot: SeatSnapshot) -> dict[str, object]:
        """The last turn as data: all of it if no person plays or all is revealed, else what the
        seat of the view may know.
        """
        if not self.human_seats or self.reveal:
            return self.all_turn_facts()
        return facts.visible_turn_facts(self.session, snapshot)

    def all_turn_facts(self) -> dict[str, object]:
        """All of the last turn, but for its draws where nobody may know the dice."""
        told = collect_turn_facts(self.session)
        return {key: value for key, value in told.items() if self.shows_uniforms or key != "draws"}

    def describe_result(self) -> str:
        """How it ended: reason, turns, score and total of each seat."""
        session = self.session
        agents = session.problem.agents
        sums = zip(agents, session.returns(), session.total_rewards(), strict=True)
        name = score_label(session.problem)
        each = "; ".join(
            f"{who} {name} {round_number(r):g}, total {round_number(t):g}" for who, r, t in sums
        )
        turns = f"{describe_end_reason(session.end_reason)} after {format_count(len(session.turns), 'turn')}."
        turns += f" {self.forfeit_reason.rstrip('?.')}." if self.forfeit_reason else ""
        known = (
            not self.human_seats or self.reveal or session.end_reason not in RESUMABLE_END_REASONS
        )
        return f"{turns} {each}." if known or not session.problem.partially_observable else turns

    def result_facts(self, extra_facts: Mapping[str, object] = NO_FACTS) -> dict[str, object]:
        """The ending as data, with what else is known of it, and turn by turn what was hidden."""
        facts = {**collect_end_facts(self.session), **extra_facts}
        if self.forfeit_reason:
            facts["why"] = self.forfeit_reason
        rows = self.debrief_rows()
        return facts | ({"debrief": rows} if rows else {})

    @property
    def forfeit_reason(self) -> str:
        """Which seat forfeited the game, and why; '' where none did."""
        return self.last_forfeit if self.session.end_reason == "forfeit" else ""

    def closing_lines(self) -> list[str]:
        """How it ended and, turn by turn, what was hidden, a line each."""
        return [
            f"over: {self.describe_result()}",
            *self._ghost_comparison_lines(),
            *map(facts.format_facts, self.debrief_rows()),
        ]

    def _ghost_comparison_lines(self) -> list[str]:
        """What the ghost made of the same dice, once that tells no secret."""
        if not self.ghost or (self.session.end_reason or "") in RESUMABLE_END_REASONS:
            return []
        self.ghost.play_to_end()
        return [self.ghost.describe_comparison()]

    def debrief_rows(self) -> list[dict[str, object]]:
        """Turn by turn what was hidden, once it is over: state, observation, belief and reward."""
        session = self.session
        if not (session.problem.partially_observable and session.over):
            return []
        key = (len(session.turns), session.end_reason)
        if self._debrief_cache[0] != key:
            self._debrief_cache = key, facts.build_debrief(session)
        return self._debrief_cache[1]
