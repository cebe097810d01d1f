"""Descriptions of a game: a turn, the situation, the result, and hidden facts after the end."""

import math
from collections.abc import Mapping, Sequence

from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.text import describe_end_reason, escape_unprintable, format_count, format_reward
from dmplay.draw.options import DrawOptions
from dmplay.game import turn_facts
from dmplay.game.hints.ghost_agent import Ghost
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.game.seats import shorten_player_name
from dmplay.transcript.concealment import RESUMABLE_END_REASONS
from dmplay.transcript.format import NATURAL_END_REASONS, collect_end_facts, collect_turn_facts
from dmplay.views.protocol import FinishedGame, expand_for_picture, fit_board, load_view_module

PLAYER_NOUNS = {  # the subject of a sentence about a player that is no agent
    "human": "the player", "mcp": "the model", "script": "the script", "replay": "the replay",
}  # fmt: skip
NO_FACTS: Mapping[str, object] = {}
TRANSCRIPT_DRAW_OPTIONS = DrawOptions(width=80, height=24)


def render_transcript_frame(session: Session) -> str:
    """Return the first seat's view of the game as plain text, for the frames of a transcript."""
    view_module, view = load_view_module(session.problem), session.view(0)
    width, height = expand_for_picture(
        view_module, view, TRANSCRIPT_DRAW_OPTIONS.width, TRANSCRIPT_DRAW_OPTIONS.height
    )
    board = fit_board(
        view_module, view, TRANSCRIPT_DRAW_OPTIONS._replace(width=width, height=height)
    )
    return "\n".join(row.rstrip() for row in board.plain.split("\n"))


class Narrator:
    """A narrator of a session to people who see only their views, or all of it if revealed."""

    def __init__(
        self,
        session: Session,
        human_seats: Sequence[int],
        *,
        reveal: bool,
        player_names: Sequence[str] = (),
    ) -> None:
        self.session = session
        self.player_names = player_names
        self.human_seats = human_seats
        self.reveal = reveal
        self.shows_uniforms = True  # False if uniforms must not be shown
        self.ghost: Ghost | None = None
        self.is_paused = False  # whether the game was left and can be resumed as if it never was
        # explanations of ends that are not natural, by end reason
        self.end_explanations = dict[str, str]()
        self.view_module = load_view_module(session.problem)
        self._debrief_cache: tuple[object, list[dict[str, object]]] = (None, [])

    def describe_turn(self, snapshot: SeatSnapshot) -> str:
        """Return the last turn in one line: number, events, and reward and score if visible.

        With a discount, the line tells what the reward adds to the score.
        """
        discount = self.session.problem.discount
        reroll_text = ", rerolled" if snapshot.turn in self.session.reroll_counts else ""
        parts = [
            f"turn {snapshot.turn}{reroll_text}.",
            self.view_module.describe_turn(snapshot.view),
        ]
        if snapshot.rewards_visible and snapshot.last_turn:
            reward = snapshot.last_turn.rewards.item(snapshot.seat)
            score, factor = self.seat_return(snapshot), discount ** (snapshot.turn - 1)
            part = reward * factor
            decimals = max(2, 1 - math.floor(math.log10(abs(part)))) if part else 0
            text = f"{part:.{decimals}f}".rstrip("0").rstrip(".")
            added = f" (adds {text})" * (part != 0.0 and factor < 1.0)
            parts.append(f"reward {format_reward(reward)}{added}. score {format_reward(score)}.")
        if self.ghost and self.ghost.is_shown_during_play:
            lead = format_reward(self.ghost.player_lead, sign="+")
            parts.append(f"ghost {format_reward(self.ghost.score)}, lead {lead}.")
        return " ".join(parts)

    def describe_change(self, snapshot: SeatSnapshot, previous_turn_count: int) -> str:
        """Return the last turn in one line, or the current turn number if turns were undone."""
        if snapshot.turn < previous_turn_count:
            return f"undone. turn {snapshot.turn}."
        return self.describe_turn(snapshot)

    def seat_return(self, snapshot: SeatSnapshot) -> float:
        """Return the seat's discounted sum of rewards so far."""
        return self.session.seat_return(snapshot.seat)

    def describe_situation(self, snapshot: SeatSnapshot) -> str:
        """Return the current situation in sentences, with the hidden state if it is revealed."""
        words = self.view_module.describe_situation(snapshot.view)
        if self.reveal and self.session.problem.partially_observable:
            words += f" hidden state: {self.session.problem.format_state(self.session.state)}."
        return words

    def visible_turn_facts(self, snapshot: SeatSnapshot) -> dict[str, object]:
        """Return the facts of the last turn that the viewing seat may know.

        These are all facts if no person plays or all is revealed.
        """
        if not self.human_seats or self.reveal:
            return self.all_turn_facts()
        return turn_facts.visible_turn_facts(self.session, snapshot)

    def all_turn_facts(self) -> dict[str, object]:
        """Return all facts of the last turn, except for uniforms that must not be shown."""
        all_facts = collect_turn_facts(self.session)
        return {
            key: value for key, value in all_facts.items() if self.shows_uniforms or key != "draws"
        }

    def describe_result(self, *, names_seat: bool = False) -> str:
        """Return the result as text: how the game ended, and the scores of each seat.

        The score of the only person is "your score", that of a team "your team's score", unless
        `names_seat`. For a paused game, return only the number of turns.
        """
        session = self.session
        if self.is_paused:
            return f"paused after {format_count(len(session.turns), 'turn')}."
        agents = session.problem.agents
        seat_sums = zip(agents, session.returns(), session.total_rewards(), strict=True)
        is_discounted = session.problem.discount < 1.0
        names = [*agents]
        if len(self.human_seats) == 1 and not names_seat:
            names[self.human_seats[0]] = "your"
        if self.human_seats and session.problem.shared_reward and not names_seat:
            names = ["your team's" if len(agents) > 1 else "your"]
        scores = "; ".join(
            f"{name} score {format_reward(r)}"
            + f" (undiscounted {format_reward(t)})" * is_discounted
            for name, (_, r, t) in zip(names, seat_sums, strict=False)
        )
        summary = f"{self.describe_end(names_seat=names_seat)}."
        if not session.turns and session.end_reason == "terminal":
            summary = f"{summary[:-1]}: it started in a state that ends a game."
        summary += f" {self.end_explanation.rstrip('?.')}." if self.end_explanation else ""
        is_visible = (
            not self.human_seats or self.reveal or session.end_reason not in RESUMABLE_END_REASONS
        )
        if is_visible or not session.problem.partially_observable:
            return f"{summary} {scores}."
        return summary

    def describe_end(self, *, names_seat: bool = False) -> str:
        """Return the sentence on the end of the game, without a full stop.

        After a natural end this is in the words of its problem, about the only person, or else the
        agent in the first seat; people are called by their seat if `names_seat`.
        """
        session = self.session
        turns = format_count(len(session.turns), "turn")
        reason = session.end_reason or ""
        if reason not in NATURAL_END_REASONS or not session.turns:
            return f"{describe_end_reason(reason)} after {turns}"
        seat = self.human_seats[0] if self.human_seats else 0
        player = session.problem.agents[seat]
        if len(self.human_seats) == 1 and not names_seat:
            player = "you"
        elif not self.human_seats and self.player_names:
            name = escape_unprintable(shorten_player_name(self.player_names[seat]))
            name = PLAYER_NOUNS.get(name, name.partition(":")[0] if "=" in name else name)
            player = f"{player} ({name})" if len(session.problem.agents) > 1 else name
        game = FinishedGame[Problem].of_session(session, seat, player)
        return escape_unprintable(self.view_module.describe_end(game))

    def result_facts(self, extra_facts: Mapping[str, object] = NO_FACTS) -> dict[str, object]:
        """Return the result as data, with extra facts and the hidden facts of every turn."""
        result = {**collect_end_facts(self.session), **extra_facts}
        result["ending"] = self.describe_end()
        if self.end_explanation:
            result["why"] = self.end_explanation
        rows = self.debrief_rows()
        return result | ({"debrief": rows} if rows else {})

    @property
    def end_explanation(self) -> str:
        """The seat that forfeited and its reason, or that the transcript is full; else ''."""
        return self.end_explanations.get(self.session.end_reason or "", "")

    def closing_lines(self) -> list[str]:
        """Return lines with the hidden facts of every turn, the result, and the ghost's result."""
        if self.is_paused:
            return [self.describe_result()]
        return [
            *self.debrief_lines(),
            f"over: {self.describe_result()}",
            *self._format_ghost_comparison(),
        ]

    def _format_ghost_comparison(self) -> list[str]:
        """Return the ghost's result on the same uniforms; [] while it would reveal hidden facts."""
        if not self.ghost or (self.session.end_reason or "") in RESUMABLE_END_REASONS:
            return []
        self.ghost.play_to_end()
        return [self.ghost.describe_comparison()]

    def debrief_lines(self) -> list[str]:
        """Return the facts of every turn as lines of text, once the game is over; else []."""
        names = turn_facts.list_few_state_names(self.session.problem)
        return [turn_facts.format_facts(row, names) for row in self.debrief_rows()]

    def debrief_table(self) -> list[str]:
        """Return the facts of every turn as an aligned table, once the game is over; else []."""
        rows = self.debrief_rows()
        return turn_facts.format_debrief_table(self.session.problem, rows) if rows else []

    def debrief_rows(self) -> list[dict[str, object]]:
        """Return the facts of every turn, hidden ones included, once the game is over; else [].

        They include state, observation, belief and reward. The list is empty if no states are
        hidden.
        """
        session = self.session
        if not (session.problem.partially_observable and session.over):
            return []
        key = (len(session.turns), session.end_reason)
        if self._debrief_cache[0] != key:
            self._debrief_cache = key, turn_facts.build_debrief(session)
        return self._debrief_cache[1]
