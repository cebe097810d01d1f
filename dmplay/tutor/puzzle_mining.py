"""The search for puzzles: games with fixed seeds, in which rules of thumb lose."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.session import SeatedPolicy
from dmplay.core.text import VALUE_DECIMALS
from dmplay.core.violation import has_shape
from dmplay.errors import BadParameter
from dmplay.game.position import Position, find_exact_agent
from dmplay.game.rules_of_thumb import RuleOfThumb, apply_rule, is_repeated_game, list_rules
from dmplay.registry import agents
from dmplay.registry.problem_module_exports import load_exported_list
from dmplay.registry.problems import LoadedProblem, resolve_problem
from dmplay.tutor.action_question import describe_history
from dmplay.tutor.lesson import PositionText
from dmplay.tutor.positions import PositionInGame, open_loaded_position

MAX_PUZZLES = 24  # of one problem
MAX_SIMILAR = 4  # puzzles against the same players with the same rule's action and best action
GAMES_PER_SETUP = 32
MAX_WALK_TURNS = 20  # turns before a position, if the state is visible
MAX_HISTORY_TURNS = 7  # turns before a position, if the player must remember them
SHORT_GAME_TURNS = 6  # turn limit of some of the games
MIN_LOSS_SHARE = 0.05  # loss of a rule, as a share of the difference of the best and worst values
MIN_LOSS = 1e-3  # of a rule, at a scale of 1
RANDOM_SHARE = 0.4  # of the turns that lead to a position


class GameSetup(NamedTuple):
    """A kind of game in which puzzles are mined: the other players and the turn limit."""

    seats: Mapping[str, str] = {}
    turns: int | None = None


REPEATED_GAME_OPPONENTS = ("frequency", "tit-for-tat", "grim", "win-stay-lose-shift")


class Candidate(NamedTuple):
    """A position in which a rule of thumb loses."""

    position: PositionText
    rule: RuleOfThumb
    rule_action: str  # the label of the rule's action
    best_action: str  # the label of the first of the best actions
    loss: float  # the best value minus that of the rule's action
    situation: object  # equal in positions that are nearly the same puzzle
    question_key: object  # equal in positions with the same question

    @property
    def lesson_key(self) -> object:
        """A key that is equal for puzzles with the same players, rule's action and best action."""
        return (*self.position.seats.items(), self.rule_action, self.best_action)


def mine_candidates(name: str) -> list[Candidate]:
    """Return positions of a problem in which rules of thumb lose, in the order of the puzzles.

    For each rule of thumb the greatest losses come first, and the rules take turns. No question
    occurs twice. Raise
    BadParameter if no exact values are known, or no rule of thumb loses anything.
    """
    loaded = resolve_problem(name, {}, trusted=True)  # the player typed its name
    candidates: dict[object, Candidate] = {}
    is_exact = False
    for setup in list_setups(loaded.problem):
        game = open_game(loaded, setup, 0)
        hint_agent = find_exact_agent(game.session, game.question)
        if hint_agent is None:
            continue
        is_exact = True
        for candidate in _iter_candidates(loaded, setup, hint_agent):
            key = candidate.situation, candidate.lesson_key
            if key not in candidates or candidates[key].loss < candidate.loss:
                candidates[key] = candidate
    if not candidates:
        reason = "no rule of thumb loses in it"
        if not is_exact:
            reason = "no agent knows the exact value of each action"
        raise BadParameter(f"{name} has no puzzles, because {reason}")
    ordered = _interleave_by_rule(_select_varied_candidates([*candidates.values()]))
    by_question: dict[object, Candidate] = {}
    for candidate in ordered:
        by_question.setdefault(candidate.question_key, candidate)
    return [*by_question.values()][:MAX_PUZZLES]


def list_setups(problem: Problem) -> Sequence[GameSetup]:
    """Return the games in which the puzzles of a problem are mined: PUZZLE_GAMES, or general ones.

    Raise BadParameter if PUZZLE_GAMES is not a list of them.
    """
    setups = load_exported_list(problem, "PUZZLE_GAMES", GameSetup)
    if setups is None and is_repeated_game(problem):
        names = agents.load_roster(problem, 1).agents
        opponents = [name for name in REPEATED_GAME_OPPONENTS if name in names]
        setups = [GameSetup({problem.agents[1]: name}) for name in opponents]
    elif setups is None:
        partners = {
            agent: agents.load_roster(problem, seat).default_partner
            for seat, agent in enumerate(problem.agents)
            if seat
        }
        setups = [GameSetup(partners)]
    return [*setups, *(setup._replace(turns=SHORT_GAME_TURNS) for setup in setups)]


def open_game(loaded: LoadedProblem, setup: GameSetup, seed: int) -> PositionInGame:
    """Return the start of a game with this seed."""
    position = PositionText(loaded.name, seed=seed, turns=setup.turns, seats=setup.seats)
    return open_loaded_position(loaded, position, trusted=True)


def _iter_candidates(
    loaded: LoadedProblem, setup: GameSetup, hint_agent: agents.HintAgent
) -> Iterator[Candidate]:
    """Yield the candidates in games of a setup; each situation is examined once."""
    visited: set[object] = set()
    for seed in range(GAMES_PER_SETUP):
        game = open_game(loaded, setup, seed)
        start = PositionText(loaded.name, {}, seed, setup.turns, setup.seats)
        rules = list_rules(game.problem)
        if not rules:
            return
        for position in iter_positions(game, hint_agent, rules, seed):
            exact_situation = _make_exact_situation_key(position)
            if exact_situation not in visited:
                visited.add(exact_situation)
                yield from _examine_position(game, position, start, rules)


def iter_positions(
    game: PositionInGame, hint_agent: agents.HintAgent, rules: Sequence[RuleOfThumb], seed: int
) -> Iterator[Position]:
    """Play a game, and yield its position before each turn.

    The player's actions are random in some turns, and follow one of the rules of thumb in others.
    """
    session, seat = game.session, game.seat
    follower = SeatedPolicy(session, seat, hint_agent.policy)
    is_visible = not game.problem.partially_observable and game.problem.state_count != 1
    max_turns = MAX_WALK_TURNS if is_visible else MAX_HISTORY_TURNS
    while not session.over and len(session.turns) <= max_turns:
        actions: list[float | None] = [None] * len(game.problem.agents)
        if not session.is_inactive(seat):
            memory = follower.current_memory()
            position = Position.with_agent(session, game.question, hint_agent, memory)
            yield position
            actions[seat] = _choose_next_action(game, position, rules[seed % len(rules)])
        session.advance(actions)


def _examine_position(
    game: PositionInGame, position: Position, start: PositionText, rules: Sequence[RuleOfThumb]
) -> Iterator[Candidate]:
    """Yield a candidate for each action that a rule of thumb chooses and that loses enough."""
    problem, values, scale = (
        position.problem,
        _find_exact_values(position),
        position.problem.reward_scale,
    )
    after = tuple(problem.format_action(position.seat, a) for a in position.view.actions)
    for action, rule in find_losing_rules(position, rules):
        yield Candidate(
            replace(start, after=after),
            rule,
            position.labels[action],
            position.labels[int(np.nanargmax(values))],
            scale * round(float(np.nanmax(values) - values[action]) / scale, VALUE_DECIMALS),
            describe_situation(position),
            _make_question_key(game, position),
        )


def find_losing_rules(
    position: Position, rules: Sequence[RuleOfThumb]
) -> Iterator[tuple[int, RuleOfThumb]]:
    """Yield the legal actions that lose, each with the first rule that chooses it."""
    values = _find_exact_values(position)
    best, spread = float(np.nanmax(values)), float(np.nanmax(values) - np.nanmin(values))
    min_loss = max(MIN_LOSS * position.problem.reward_scale, MIN_LOSS_SHARE * spread)
    if spread < min_loss:
        return
    tried_actions = set[int]()
    for rule in rules:
        action = apply_rule(position, rule)
        if action is None or action in tried_actions or not position.legal_actions_mask[action]:
            continue
        if rule.excludes is not None and rule.excludes(position, action):
            continue
        tried_actions.add(action)
        if best - values[action] >= min_loss:
            yield action, rule


def _find_exact_values(position: Position) -> Reals:
    """Return the values `[A]` of a position whose agent has exact ones, nan if illegal."""
    values = position.values()
    assert values is not None
    return values.q


def find_rule_belief(position: Position, rule: RuleOfThumb) -> Reals | None:
    """Return the belief `[S]` on which a rule of thumb acts; None if it is the player's own.

    Raise BadParameter for anything else.
    """
    if rule.find_belief is None:
        return None
    belief = rule.find_belief(position)
    if not has_shape(belief, position.view.belief.shape):
        expected = "expected an array with a probability of each state"
        raise BadParameter(f"rule of thumb {rule.text!r}: got the belief {belief!r}, {expected}")
    return belief


def _make_question_key(game: PositionInGame, position: Position) -> object:
    """Return a key that is equal in positions with the same question."""
    problem = position.problem
    state = "" if problem.partially_observable else problem.format_state(position.state)
    return position.question.players, position.turns_left, state, describe_history(game)


def describe_situation(position: Position) -> object:
    """Return a key that is equal in positions that are nearly the same puzzle."""
    problem, players = position.problem, position.question.players
    if problem.partially_observable:
        if position.turns_left == 1:  # what is learned in the last turn is of no use
            return "last turn"
        return tuple(np.round(position.view.belief, 1))
    if problem.state_count != 1:
        return players, problem.format_state(position.state)
    others = [seat for seat in range(len(problem.agents)) if seat != position.seat]
    predicted = map(position.predict_actions, others)
    predictions = tuple(() if p is None else tuple(np.round(p, 1)) for p in predicted)
    return players, position.turns_left == 1, predictions


def _make_exact_situation_key(position: Position) -> object:
    """Return a key that is equal in positions whose values are equal."""
    problem = position.problem
    if problem.partially_observable:
        return position.turns_left, position.view.belief.tobytes()
    if problem.state_count != 1:
        return position.turns_left, problem.format_state(position.state)
    return position.turns_left, _find_exact_values(position).tobytes()


def _choose_next_action(game: PositionInGame, position: Position, rule: RuleOfThumb) -> int:
    """Return the player's action on the way: a random one, or that of a rule, or the best."""
    session = game.session
    stream = 1 + position.seat  # the player's own, which nothing else uses
    u, v = session.uniform_source.generate_uniforms(stream, len(session.turns) + 1, 0, 2)[0]
    legal = position.legal_actions
    if u < RANDOM_SHARE:
        return legal[int(v * len(legal))]
    action = apply_rule(position, rule)
    return int(np.nanargmax(_find_exact_values(position))) if action not in legal else action


def _select_varied_candidates(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates, greatest loss first, with at most four of each `lesson_key`."""
    counts = Counter[object]()
    selected = []
    for candidate in sorted(candidates, key=lambda candidate: -candidate.loss):
        counts[candidate.lesson_key] += 1
        if counts[candidate.lesson_key] <= MAX_SIMILAR:
            selected.append(candidate)
    return selected


def _interleave_by_rule(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates such that the rules of thumb take turns, each in the same order."""
    by_rule: dict[RuleOfThumb, list[Candidate]] = {}
    for candidate in candidates:
        by_rule.setdefault(candidate.rule, []).append(candidate)
    ranks = [(rank, item) for group in by_rule.values() for rank, item in enumerate(group)]
    return [item for _, item in sorted(ranks, key=lambda pair: (pair[0], -pair[1].loss))]
