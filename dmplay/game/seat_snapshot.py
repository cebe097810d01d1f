"""Snapshots of a game: the facts that one seat may know at one moment."""

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from dmplay.core.arrays import readonly_copy
from dmplay.core.problem import Problem
from dmplay.core.session import Session, View
from dmplay.game.position import iter_memories

if TYPE_CHECKING:
    from dmplay.agents.best_response_in_team import PartnerBeliefPolicy


class SeatSnapshot:
    """A snapshot of what a seat may know now: the last turn, and the whole view on demand."""

    # computes the beliefs beside a partner whose rule the seat knows
    partner_policy: "PartnerBeliefPolicy | None" = None

    def __init__(
        self,
        session: Session,
        seat: int,
        *,
        rewards_visible: bool = False,
        agents_only: bool = False,
        shows_belief: bool = True,
    ) -> None:
        self.shows_belief = shows_belief
        self.agents_only = agents_only  # whether only agents play
        self.session, self.seat, self.turn = session, seat, len(session.turns)
        self.last_turn = session.turns[-1] if session.turns else None
        self.end_reason = session.end_reason
        self.rewards_visible = (
            rewards_visible or self.end_reason is not None or session.problem.rewards_observable
        )

    def is_current_for(self, seat: int) -> bool:
        """Return whether the snapshot is still current for a seat."""
        turns = self.session.turns
        is_same_turn = seat == self.seat and (turns[-1] if turns else None) is self.last_turn
        return is_same_turn and self.session.end_reason == self.end_reason

    @cached_property
    def view(self) -> View[Problem]:
        """The seat's view; if only agents play, its player label is the agent's name.

        Beside a partner whose rule is known, its beliefs are those of the advice.
        """
        agent = self.session.problem.agents[self.seat]
        view = self.session.view(
            self.seat,
            rewards_visible=self.rewards_visible,
            shows_belief=self.shows_belief,
            player_label=agent if self.agents_only else View.player_label,
        )
        policy = self.partner_policy
        if view.beliefs is None or policy is None:
            return view
        memories = iter_memories(policy, view, f"turn {self.turn + 1}")
        beliefs = tuple(readonly_copy(policy.state_belief(memory)[0]) for memory in memories)
        return replace(view, beliefs=beliefs, known_partner=policy.to)
