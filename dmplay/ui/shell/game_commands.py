"""Shell commands that query or change the current game, as functions of the typed argument."""

from collections.abc import Callable
from itertools import islice

import numpy as np

from dmplay.core.parameter_parsing import parse_whole_number
from dmplay.core.problem import find_seat
from dmplay.core.text import describe_end_reason, format_count
from dmplay.errors import BadParameter
from dmplay.game.action_input import describe_number_range
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.command_reply import DataReply, TurnReports, make_reply
from dmplay.game.game import Game
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.seats import make_seat_policy
from dmplay.transcript.format import format_lines

ACTUAL_PLAYERS = "actual"  # the word for the players of the game
MAX_BELIEF_STATES = 8  # maximum number of listed belief states
HINT_TASK = TaskInfo("computing a hint")
LOOKAHEAD_TASK = TaskInfo("computing the outcomes")


def parse_turn_count(argument: str, command: str, default: int = 1) -> int:
    """Return the typed number of turns, or the default if nothing is typed.

    Raise BadParameter unless it is a positive whole number.
    """
    if not argument:
        return default
    number = parse_whole_number(argument)
    if not number:
        raise BadParameter(f"{command}: got {argument!r}, expected a number of turns, such as 2")
    return number


def undo_turns(game: Game, argument: str) -> str:
    """Undo the typed number of turns (1 by default), or a pending choice; return a report."""
    previous_count = len(game.session.turns)
    game.undo(parse_turn_count(argument, "undo"))
    turn_count = len(game.session.turns)
    if turn_count == previous_count:
        return "your choice is undone."
    return game.narrator.describe_change(game.snapshot(), previous_count)


def redo_turns(game: Game, argument: str) -> str:
    """Play undone turns again, 1 by default; return one report per turn."""
    reports = []
    for _ in range(parse_turn_count(argument, "redo")):
        game.redo()
        reports.append(game.narrator.describe_turn(game.snapshot()))
    return TurnReports("\n".join(reports)) if len(reports) > 1 else reports[0]


def reroll_turn(game: Game, argument: str) -> str:
    """Play the last turn again with new uniforms; return its report."""
    game.reroll()
    return game.narrator.describe_turn(game.snapshot())


def step_turns(game: Game, argument: str) -> str:
    """Play the typed number of agents' turns, 1 by default; return the reports."""
    return _play_agent_turns(game, "step", parse_turn_count(argument, "step"))


def autoplay_turns(game: Game, argument: str) -> str:
    """Play the typed number of agents' turns, all by default; return the reports."""
    return _play_agent_turns(game, "auto", parse_turn_count(argument, "auto", default=0))


def _play_agent_turns(game: Game, command: str, turn_count: int) -> str:
    """Play this number of agents' turns, all if it is 0; return one report per turn.

    Raise BadParameter if people play.
    """
    if game.human_seats:
        raise BadParameter(
            f"{command}: a person plays this game; agent SEAT NAME lets an agent play"
        )
    steps = islice(game.iter_agent_turns(), turn_count or None)
    reports = [
        game.narrator.describe_change(game.snapshot(), previous_count) for previous_count in steps
    ]
    if not reports:
        return f"the game is over ({describe_end_reason(game.session.end_reason)})"
    return TurnReports("\n".join(reports)) if len(reports) > 1 else reports[0]


def show_situation(game: Game, argument: str) -> str:
    """Return the situation in sentences, after the problem's picture if there is one."""
    return make_reply([*game.picture_rows(), game.narrator.describe_situation(game.snapshot())])


def show_legal_actions(game: Game, argument: str) -> str:
    """Return the legal actions, with the keys that can be typed for them."""
    seat = game.viewing_seat
    actions = game.problem.actions[seat]
    if not actions.labels:
        return f"legal: {actions.describe_actions()}."
    if game.keyboard.is_number_entry(seat):
        return f"legal: {describe_number_range(actions.labels)}."
    available = [
        f"{label} ({key})" if key and _name_typed_action(game, key) == label else label
        for key, label, available in game.keyboard.list_actions_with_keys(game.view())
        if available
    ]
    return f"legal: {', '.join(available) or 'none'}."


def _name_typed_action(game: Game, word: str) -> str:
    """Return the name of the action that a typed word plays; names take precedence over keys."""
    return game.session.format_action(
        game.viewing_seat, game.keyboard.parse_action(game.view(), word)
    )


def show_belief(game: Game, argument: str) -> str:
    """Return the most probable hidden states with their probabilities, at most eight.

    Beside other agents, the first belief assumes that these act at random, unless the rule of the
    only one is known. If a person assumes another partner, the belief with that one follows.
    """
    view = game.view()
    if not game.shows_belief:
        activity = "step of the lesson" if game.lesson_goal else "game"
        return f"belief: not shown in this {activity}; keep it yourself."
    if view.beliefs is None:
        if game.problem.partially_observable:
            return "belief: not computed; too many states."
        return "belief: not needed; every agent sees the state."
    belief, states = view.beliefs[-1], game.problem.enumerate_states()
    order = np.argsort(-belief, kind="stable")[:MAX_BELIEF_STATES]
    entries = [f"{game.problem.format_state(states[i])} {belief[i]:.3f}" for i in order]
    omitted_count = len(states) - len(order)
    if omitted_count:
        omitted = format_count(omitted_count, "other state")
        entries.append(f"{omitted} {max(1.0 - belief[order].sum(), 0.0):.3f}")
    other_count = len(game.problem.agents) - 1
    others = "the other agents act" if other_count > 1 else "the other agent acts"
    model = f", if {others} at random" if other_count else ""
    if view.known_partner:
        model = f", as {game.problem.agents[1 - view.seat]} plays {view.known_partner}"
    assumed = ""
    if game.assumed_players:
        provider = game.hint_provider
        assumed = run_cancellable(HINT_TASK, provider.describe_model)
        assumed = assumed and f" {provider.values_basis.players}: {assumed}."
    return f"belief{model}: {', '.join(entries)}.{assumed}"


def show_state(game: Game, argument: str) -> str:
    """Return the state as text, or a message if it is hidden."""
    if game.problem.partially_observable and not (game.reveal or game.session.over):
        return "state: hidden until the game is over, or with --reveal."
    return f"state: {game.problem.format_state(game.session.state)}"


def _count_hint_and_reply(game: Game, command: str, question: Callable[[HintProvider], str]) -> str:
    """Return the hint provider's reply, counted as a hint; else the reason why there is none.

    Raise BadParameter if the game forbids hints.
    """
    game.check_hints_allowed(command)
    provider = game.hint_provider
    reason = run_cancellable(HINT_TASK, provider.explain_unavailable)
    reply = "" if reason else run_cancellable(HINT_TASK, lambda: question(provider))
    if reply:
        game.record_hint()
    return reply or f"no {command}: {reason or 'the agent that gives hints has none'}"


def show_hint(game: Game, argument: str) -> str:
    """Return the recommended action and the value of each action."""
    return _count_hint_and_reply(game, "hint", HintProvider.create_hint)


def show_values(game: Game, argument: str) -> str:
    """Return the value of each action."""

    def describe(provider: HintProvider) -> str:
        """Return the values as text with their numbers."""
        hint = provider.format_values()
        facts = {
            "seat": game.problem.agents[game.viewing_seat],
            "about": hint.game,
            **hint.values_data,
            **hint.values_basis.accuracy.data,
        }
        text = hint.full_values_text
        return text and DataReply(text, "values", facts, [])

    return _count_hint_and_reply(game, "values", describe)


def show_best_action(game: Game, argument: str) -> str:
    """Return the recommended action."""
    return _count_hint_and_reply(
        game, "policy", lambda provider: f"policy {provider.describe_choice()}"
    )


def explain_action(game: Game, argument: str) -> str:
    """Return the reasons for the recommended or the typed action; this counts as a hint."""
    from dmplay.game.hints import explanation  # imported only if an explanation is requested

    action = game.keyboard.parse_action(game.view(), argument) if argument else None

    def explain(provider: HintProvider) -> str:
        """Return the explanation as text with its numbers."""
        reasons = explanation.explain_action(provider, action)
        seat = game.problem.agents[game.viewing_seat]
        data = {"seat": seat, **reasons.data}
        return DataReply(str(reasons), "why", data, [reasons.heading, *reasons.sentences])

    return _count_hint_and_reply(game, "why", explain)


def assume_player(game: Game, argument: str) -> str:
    """Give advice as if the typed agent played another seat; without one, show who is assumed.

    The word `actual` returns to the players of the game. Raise BadParameter if the advice does not
    depend on that player, or cannot assume that agent.
    """
    own_seat, names = game.viewing_seat, game.problem.agents
    other_seats = [seat for seat in range(len(names)) if seat != own_seat]
    if not other_seats:
        raise BadParameter("assume: no other agent plays in this game")
    words = argument.split()
    if words:
        seat = find_seat(game.problem, words[0]) if len(words) > 1 else other_seats[0]
        previous = game.assumed_players
        agent_name = words[-1]
        if agent_name == ACTUAL_PLAYERS:
            game.assume_players({})
        else:
            make_seat_policy(game.problem, seat, agent_name)  # raises an error for unknown names
            game.assume_players({**previous, seat: agent_name})
            agent = game.hint_provider.position.agent
            if agent is None or agent.basis_with_players is None:
                game.assume_players(previous)
                raise BadParameter(f"assume: the advice in this game cannot assume {agent_name}")
    provider = game.hint_provider
    players = run_cancellable(HINT_TASK, lambda: provider.values_basis.players)
    return f"hints now give advice {players or 'without a model of the other agents'}"


def preview_typed_action(game: Game, argument: str) -> str:
    """Return the possible outcomes of the typed action, before it is played."""
    if not argument:
        raise BadParameter("whatif: expected an action")
    return preview_action(game, game.keyboard.parse_action(game.view(), argument))


def preview_action(game: Game, action: float) -> str:
    """Return the possible outcomes of an action of the viewing seat; this counts as a hint.

    Raise BadParameter if the game forbids hints.
    """
    game.check_hints_allowed("whatif")
    forecast = run_cancellable(LOOKAHEAD_TASK, lambda: game.hint_provider.forecast_action(action))
    game.record_hint()
    return forecast


def show_review(game: Game, argument: str) -> str:
    """Return the review table of people's choices, and store it as notes for the transcript.

    Raise BadParameter before the game is over, or if no people play.
    """
    from dmplay.game.hints import review as reviewing  # imported only if a review is requested

    if not game.session.over or not game.human_seats:
        raise BadParameter("review: available after the game, and only if a person played")
    reviewed_actions = reviewing.run_review(game.session, game.advice_questions, can_sample=True)
    game.end_notes = "".join(reviewing.format_notes(reviewed_actions))
    return make_reply(reviewing.format_table(reviewed_actions))


def show_transcript(game: Game, argument: str) -> str:
    """Return the transcript's path and the visible facts of its last turn."""
    if game.transcript_path is None:
        return "transcript: this game is not recorded; --record FILE records it from the start"
    relation = "in" if game.recorder else "replayed from"
    count = format_count(len(game.session.turns), "turn")
    path = f"transcript: {count} {relation} {game.transcript_path}"
    return make_reply([path, "", *format_lines(game.narrator.visible_turn_facts(game.snapshot()))])
