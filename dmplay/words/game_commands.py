"""What can be asked of a game, and done to it, in words: each takes what was typed after it."""

from collections.abc import Callable
from itertools import islice

import numpy as np

from dmplay.advice.adviser import HintProvider
from dmplay.describe import describe_end_reason, format_count
from dmplay.errors import BadParameter
from dmplay.finding.typed import parse_whole_number
from dmplay.game.answer import TurnReports, format_reply
from dmplay.game.game import Game
from dmplay.keys.keyboard import describe_number_range
from dmplay.thought import TaskInfo, run_cancellable
from dmplay.transcript.format import format_lines

MAX_BELIEF_STATES = 8  # states that the belief is told of
HINT_TASK = TaskInfo("thinking of a hint")
LOOKAHEAD_TASK = TaskInfo("looking ahead")


def parse_turn_count(argument: str, command: str, default: int = 1) -> int:
    """A number of turns that was typed."""
    if not argument:
        return default
    number = parse_whole_number(argument)
    if not number:
        raise BadParameter(f"{command}: got {argument!r}, expected a number of turns, as 2")
    return number


def undo_turns(game: Game, argument: str) -> str:
    """Takes back turns, or a choice."""
    before = len(game.session.turns)
    game.undo(parse_turn_count(argument, "undo"))
    now = len(game.session.turns)
    if now == before:
        return "your choice is taken back."
    return game.narrator.describe_change(game.snapshot(), before)


def redo_turns(game: Game, argument: str) -> str:
    """Plays again what was taken back, and tells each turn."""
    told = []
    for _ in range(parse_turn_count(argument, "redo")):
        game.redo()
        told.append(game.narrator.describe_turn(game.snapshot()))
    return TurnReports("\n".join(told)) if len(told) > 1 else told[0]


def reroll_turn(game: Game, argument: str) -> str:
    """Throws the last turn's dice anew."""
    game.reroll()
    return game.narrator.describe_turn(game.snapshot())


def step_turns(game: Game, argument: str) -> str:
    """So many turns of a game that plays by itself, one if no number is given."""
    return _play_agent_turns(game, "step", parse_turn_count(argument, "step"))


def autoplay_turns(game: Game, argument: str) -> str:
    """All turns, or so many, of a game that plays by itself."""
    return _play_agent_turns(game, "auto", parse_turn_count(argument, "auto", default=0))


def _play_agent_turns(game: Game, command: str, turn_count: int) -> str:
    """Plays turns of agents, all if the number is 0, and tells each."""
    if game.human_seats:
        raise BadParameter(f"{command}: people play here; agent SEAT NAME seats an agent")
    run = islice(game.iter_agent_turns(), turn_count or None)
    told = [game.narrator.describe_change(game.snapshot(), before) for before in run]
    if len(told) > 1:
        return TurnReports("\n".join(told))
    return told[0] if told else f"the game is over ({describe_end_reason(game.session.end_reason)})"


def show_situation(game: Game, argument: str) -> str:
    """The situation in sentences, below the picture where the problem brings one."""
    return format_reply([*game.picture_rows(), game.narrator.describe_situation(game.snapshot())])


def show_legal_actions(game: Game, argument: str) -> str:
    """The actions that can be played."""
    seat = game.viewing_seat
    actions = game.problem.actions[seat]
    if not actions.labels:
        return f"legal: {actions.describe_actions()}."
    if game.keyboard.is_number_entry(seat):
        return f"legal: {describe_number_range(actions.labels)}."
    able = [
        f"{label} ({key})" if key and _name_typed_action(game, key) == label else label
        for key, label, able in game.keyboard.list_actions_with_keys(game.view())
        if able
    ]
    return f"legal: {', '.join(able) or 'none'}."


def _name_typed_action(game: Game, word: str) -> str:
    """The action that a typed word plays: a name before a key."""
    return game.session.format_action(
        game.viewing_seat, game.keyboard.parse_action(game.view(), word)
    )


def show_belief(game: Game, argument: str) -> str:
    """The likeliest hidden states with their probabilities."""
    view = game.view()
    if view.beliefs is None:
        if game.problem.partially_observable:
            return "belief: too many states to tell."
        return "belief: every agent sees the state here."
    belief, states = view.beliefs[-1], game.problem.enumerate_states()
    order = np.argsort(-belief, kind="stable")[:MAX_BELIEF_STATES]
    told = [f"{game.problem.format_state(states[i])} {belief[i]:.3f}" for i in order]
    rest = len(states) - len(order)
    if rest:
        told.append(
            f"{format_count(rest, 'other state')} {max(1.0 - belief[order].sum(), 0.0):.3f}"
        )
    return f"belief: {', '.join(told)}."


def show_state(game: Game, argument: str) -> str:
    """The state in one line, where it may be known."""
    if game.problem.partially_observable and not (game.reveal or game.session.over):
        return "state: hidden until the game is over, or with --reveal."
    return f"state: {game.problem.format_state(game.session.state)}"


def _ask_hint_provider(game: Game, command: str, question: Callable[[HintProvider], str]) -> str:
    """What the adviser answers, which is counted; or why there is nothing to say."""
    game.check_hints_allowed(command)
    adviser = game.hint_provider
    why = run_cancellable(HINT_TASK, adviser.explain_unavailable)
    told = "" if why else run_cancellable(HINT_TASK, lambda: question(adviser))
    if told:
        game.record_hint()
    return told or f"no {command}: {why or 'the adviser knows none'}"


def show_hint(game: Game, argument: str) -> str:
    """What a good player would do, and what each action is worth."""
    return _ask_hint_provider(game, "hint", HintProvider.create_hint)


def show_values(game: Game, argument: str) -> str:
    """What each action is worth."""
    return _ask_hint_provider(game, "values", HintProvider.describe_values)


def show_best_action(game: Game, argument: str) -> str:
    """What a good player would do."""
    return _ask_hint_provider(game, "policy", lambda adviser: f"policy {adviser.describe_choice()}")


def preview_typed_action(game: Game, argument: str) -> str:
    """What an action may bring about, before it is played."""
    if not argument:
        raise BadParameter("whatif: expected an action")
    return preview_action(game, game.keyboard.parse_action(game.view(), argument))


def preview_action(game: Game, action: float) -> str:
    """What an action of the watcher may bring about; counted as help."""
    game.check_hints_allowed("whatif")
    told = run_cancellable(LOOKAHEAD_TASK, lambda: game.hint_provider.forecast_action(action))
    game.record_hint()
    return told


def show_review(game: Game, argument: str) -> str:
    """What each move of the people was worth; kept as notes once the transcript ends."""
    from dmplay.advice import review as reviewing  # not needed before

    if not game.session.over or not game.human_seats:
        raise BadParameter("review: it values the moves of people, once the game is over")
    found = reviewing.run_review(game.session, game.human_seats, game.player_names)
    game.end_notes = "".join(reviewing.format_notes(found))
    return format_reply(reviewing.format_table(found))


def show_transcript(game: Game, argument: str) -> str:
    """Where the transcript is, and its last turn without what is hidden."""
    if game.transcript_path is None:
        return "transcript: none is written; --record FILE writes one"
    held = "in" if game.recorder else "shown of"
    path = (
        f"transcript: {format_count(len(game.session.turns), 'turn')} {held} {game.transcript_path}"
    )
    return format_reply(
        [path, "", *format_lines(game.narrator.visible_turn_facts(game.snapshot()))]
    )
