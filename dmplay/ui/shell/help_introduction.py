"""The lesson at the beginning of `help`: role, objective, costs, and an example turn."""

import numpy as np

from dmplay.agents.base import summarize_agent
from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.session import Session
from dmplay.core.spaces import Interval
from dmplay.core.text import format_score
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.game import Game
from dmplay.game.score_comparison import RANDOM_AGENT, find_compared_agent
from dmplay.registry.agents import find_hint_provider, load_roster
from dmplay.views.protocol import Lesson, load_view_module

HIDDEN_REWARDS_NOTE = (
    "Your rewards are hidden until the game ends, because they would reveal the hidden state."
)
MAX_STATE_COLUMNS = 24  # columns of the state at the start of the example turn
UNTYPABLE_SEED = 2**63 + 1228  # larger than any seed of a game, so it reveals no game's uniforms


def lesson_lines(game: Game, *, shows_map: bool = False) -> list[str]:
    """Return sentences on the viewing seat's role, objective and costs, and an example turn.

    Another sentence says why rewards are hidden, if they are. The player's mark on the map is named
    if the player sees a map.
    """
    problem, view = game.problem, game.view()
    content = game.view_module.lesson(view)
    discount_note = "; there is no discount: the rewards of all turns count the same"
    if (gamma := problem.discount) < 1.0:
        discount_note = f"; a reward one turn later counts {gamma:g} times as much (gamma)"
    cost = content.costs + discount_note
    mark = f" On the map you are {content.map_mark}." if shows_map and content.map_mark else ""
    hidden_rewards = [] if problem.rewards_observable or game.reveal else [HIDDEN_REWARDS_NOTE]
    example = describe_example_turn(problem, view.seat, content)
    return [f"{content.role}.{mark}", f"{content.objective}.", f"{cost}.", *hidden_rewards, example]


def list_advising_agents(game: Game) -> list[tuple[str, str]]:
    """Return the name and description of each agent that hints and the result may name."""
    seat = game.viewing_seat
    if seat not in game.human_seats or game.hints_forbidden:
        return []
    provider = find_hint_provider(game.problem, game.advice_question(seat))
    if provider is None:
        return []
    names = dict.fromkeys((provider.base_name, find_compared_agent(provider), RANDOM_AGENT))
    available = load_roster(game.problem, seat).agents
    summaries = {name: available.get(name.partition(":")[0]) for name in names}
    return [(name, summarize_agent(agent)) for name, agent in summaries.items() if agent]


def describe_example_turn(problem: Problem, seat: int, lesson: Lesson) -> str:
    """Return a sentence on the first turn of an example game, with its hidden states."""
    session = Session(problem, SeededUniforms(UNTYPABLE_SEED), turn_limit=1)
    preferred_actions = (
        {seat: problem.parse_action(seat, lesson.example_action)} if lesson.example_action else {}
    )
    actions = [
        _choose_legal_action(session, index, preferred_actions.get(index))
        for index in range(len(problem.agents))
    ]
    initial_state = session.state
    reward = float(session.advance(actions).rewards[seat])
    shows_state = problem.state_count != 1 and not isinstance(problem.state_count, ContinuousStates)
    general_start = "with the hidden state {}" if problem.partially_observable else "in state {}"
    state_text = problem.format_state(initial_state)
    shows_state = shows_state and len(state_text) <= MAX_STATE_COLUMNS  # no whole board
    phrase = lesson.example_start or general_start
    words = state_text.split() if phrase.count("{}") > 1 else [state_text]
    start = phrase.format(*words)
    start = start if shows_state else "one turn"
    turn_text = load_view_module(problem).describe_turn(session.view(seat))
    return f"For example, {start}: {turn_text} The reward is {format_score(reward)}."


def _choose_legal_action(session: Session, seat: int, preferred: float | None) -> float:
    """Return the preferred action if it is legal; else the middle one of the legal actions."""
    actions, legal = session.problem.actions[seat], session.legal_actions_mask(seat)
    if isinstance(actions, Interval):
        return (actions.low + actions.high) / 2 if preferred is None else preferred
    legal_actions = np.arange(len(actions)) if legal is None else np.flatnonzero(legal)
    if preferred is not None and preferred in legal_actions:
        return preferred
    return float(legal_actions[len(legal_actions) // 2])
