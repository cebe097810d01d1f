"""Puzzles: positions in which a rule of thumb loses most, mined from the exact values of a game."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dmplay.core.problem import Problem
from dmplay.errors import BadParameter
from dmplay.registry import agents
from dmplay.registry.problem_name_kinds import CURRENT_FOLDER
from dmplay.registry.problems import builtin_stem, resolve_problem
from dmplay.tutor.action_question import ActionQuestion
from dmplay.tutor.exercise import Exercise
from dmplay.tutor.lesson import Position
from dmplay.tutor.positions import PositionInGame, open_position
from dmplay.tutor.repetition import load_question_progress
from dmplay.tutor.rules_of_thumb import Chooser, list_rules
from dmplay.tutor.truth import format_number
from dmplay.tutor.valued_position import ValuedPosition, find_exact_agent

# The built-in problems with exact values, in the order in which the puzzles of the day take turns.
PUZZLE_PROBLEMS = (
    "hexworld", "crying-baby", "catch", "machine-replacement", "prisoners-dilemma",
    "predator-prey", "rock-paper-scissors", "multicaregiver-crying-baby", "travelers-dilemma",
)  # fmt: skip
KEY_PREFIX = "puzzle "  # of keys in the file of progress
MAX_PUZZLES = 24  # of one problem
MAX_SIMILAR = 4  # puzzles against the same players with the same rule's action and best action
GAMES_PER_SETUP = 24
MAX_WALK_TURNS = 20  # turns before a position, if the state is visible
MAX_HISTORY_TURNS = 7  # turns before a position, if the player must remember them
SHORT_GAME_TURNS = 6  # turn limit of some of the games
MIN_LOSS_SHARE = 0.05  # loss of a rule, as a share of the difference of the best and worst values
MIN_LOSS = 1e-3
RANDOM_SHARE = 0.4  # of the turns that lead to a position
ANSWER_TOLERANCE_SHARE = 0.02  # of the loss of the rule: actions that lose less count as right


class GameSetup(NamedTuple):
    """A kind of game in which puzzles are mined: the other players and the turn limit."""

    seats: Mapping[str, str] = {}
    turns: int | None = None


# The games of problems with several agents, by the file name of the problem.
SETUPS: Mapping[str, Sequence[GameSetup]] = {
    "multicaregiver_crying_baby": [GameSetup({"caregiver2": "random"})],
    "predator_prey": [
        GameSetup({"prey": "flee"}, 12),
        GameSetup({"prey": "random"}, 12),
        GameSetup({"predator": "chase"}, 12),
    ],
    "prisoners_dilemma": [
        GameSetup({"agent2": name})
        for name in (
            "tit-for-tat", "grim", "tit-for-two-tats", "win-stay-lose-shift", "two-tits-for-tat",
            "majority", "suspicious-tit-for-tat",
        )
    ],
    "rock_paper_scissors": [GameSetup({"agent2": name}) for name in ("beat-last", "frequency")],
    "travelers_dilemma": [
        GameSetup({"agent2": name}) for name in ("level-k", "claim:claim=90", "nash")
    ],
}  # fmt: skip


class Puzzle(NamedTuple):
    """A position, and a rule of thumb that loses there."""

    code: str  # such as "catch:7"
    position: Position
    rule: str
    rule_action: str  # the label of the rule's action
    loss: float  # the best value minus that of the rule's action

    @property
    def answer_tolerance(self) -> float:
        """The difference to the best value up to which an answer is right."""
        return ANSWER_TOLERANCE_SHARE * self.loss


def find_puzzle(code: str) -> Puzzle:
    """Return the puzzle of a code such as `catch:7`; raise BadParameter if there is none."""
    name, number = split_code(code)
    puzzles = list_puzzles(name)
    if number is None or not 1 <= number <= len(puzzles):
        raise BadParameter(f"puzzle {code}: expected {name}:1 to {name}:{len(puzzles)}")
    return puzzles[number - 1]


def split_code(code: str) -> tuple[str, int | None]:
    """Return the name of the problem and the number of a code; None if it has no number."""
    name, colon, number = code.rpartition(":")
    return (name, int(number)) if colon and number.isdecimal() else (code, None)


def find_puzzle_of_the_day(day: date) -> Puzzle:
    """Return the puzzle of a day, the same for all: a problem a day, then its next puzzle."""
    round_number, index = divmod(day.toordinal(), len(PUZZLE_PROBLEMS))
    puzzles = list_puzzles(PUZZLE_PROBLEMS[index])
    return puzzles[round_number % len(puzzles)]


def list_puzzles(name: str) -> list[Puzzle]:
    """Return the puzzles of a problem, in the order of their numbers.

    For each rule of thumb the greatest losses come first, and the rules take turns. Raise
    BadParameter if no exact values are known, or no rule of thumb loses anything.
    """
    return list(_mine_puzzles(name))


@lru_cache(maxsize=len(PUZZLE_PROBLEMS))
def _mine_puzzles(name: str) -> tuple[Puzzle, ...]:
    """Return the puzzles of a problem, mined in games with fixed seeds."""
    loaded = resolve_problem(name, {}, trusted=True)  # the player typed its name
    candidates: dict[tuple[object, ...], Puzzle] = {}
    is_exact = False
    for setup in _list_setups(loaded.problem):
        miner = _open_game(loaded.name, setup, 0)
        hint_agent = find_exact_agent(loaded.problem, miner.question)
        if hint_agent is None:
            continue
        is_exact = True
        visited: set[object] = set()
        for seed in range(GAMES_PER_SETUP):
            game = _open_game(loaded.name, setup, seed)
            for key, puzzle in _mine_game(game, hint_agent, setup, seed, visited):
                if key not in candidates or candidates[key].loss < puzzle.loss:
                    candidates[key] = puzzle
    if not candidates:
        reason = (
            "no rule of thumb loses in it"
            if is_exact
            else "no agent knows the exact value of each action"
        )
        problems = ", ".join(PUZZLE_PROBLEMS)
        raise BadParameter(f"{name} has no puzzles, because {reason}; puzzles: {problems}")
    ordered = _alternate_rules(_select_different(candidates))[:MAX_PUZZLES]
    return tuple(
        puzzle._replace(code=f"{loaded.name}:{number}") for number, puzzle in enumerate(ordered, 1)
    )


def _list_setups(problem: Problem) -> Sequence[GameSetup]:
    """Return the games in which the puzzles of a problem are mined."""
    partners = {
        agent: agents.load_roster(problem, seat).default_partner
        for seat, agent in enumerate(problem.agents)
        if seat
    }
    setups = SETUPS.get(builtin_stem(problem), [GameSetup(partners)])
    return [*setups, *(setup._replace(turns=SHORT_GAME_TURNS) for setup in setups)]


def _open_game(name: str, setup: GameSetup, seed: int) -> PositionInGame:
    """Return the start of a game with this seed."""
    position = Position(name, seed=seed, turns=setup.turns, seats=setup.seats)
    return open_position(position, CURRENT_FOLDER, trusted=True)


def _mine_game(
    game: PositionInGame,
    hint_agent: agents.HintAgent,
    setup: GameSetup,
    seed: int,
    visited: set[object],
) -> Iterator[tuple[tuple[object, ...], Puzzle]]:
    """Play a game, and yield the puzzles on the way, each with the key of its situation.

    The player's actions are random in some turns, and follow one of the rules of thumb in others.
    """
    session, seat = game.session, game.seat
    position = ValuedPosition(game, hint_agent)
    rules = list_rules(game.problem, seat)
    choosers = [rule.start(position) for rule in rules]
    actions: list[str] = []
    is_visible = not game.problem.partially_observable and game.problem.state_count != 1
    max_turns = MAX_WALK_TURNS if is_visible else MAX_HISTORY_TURNS
    while not session.over and len(session.turns) <= max_turns:
        if session.is_inactive(seat):
            session.advance()
            actions.append(session.format_action(seat, session.turns[-1].actions[seat]))
            continue
        values = position.values
        situation = _describe_situation(position)
        exact_situation = _describe_exact_situation(position)
        if exact_situation not in visited:
            visited.add(exact_situation)
            start = Position(game.problem_name, {}, seed, setup.turns, setup.seats, tuple(actions))
            best = int(np.argmax(values))
            for action, index in _find_losing_rules(position, choosers):
                loss = float(values.max() - values[action])
                label = position.labels[action]
                yield (situation, action, best), Puzzle("", start, rules[index].text, label, loss)
        action = _choose_next_action(position, choosers[seed % len(choosers)])
        actions.append(game.problem.format_action(seat, action))
        session.advance([action if s == seat else None for s in range(len(game.problem.agents))])


def _find_losing_rules(
    position: ValuedPosition, choosers: Sequence[Chooser]
) -> Iterator[tuple[int, int]]:
    """Yield the actions that lose, each with the index of the first rule that chooses it."""
    values = position.values
    finite = values[np.isfinite(values)]
    min_loss = max(MIN_LOSS, MIN_LOSS_SHARE * float(finite.max() - finite.min()))
    if finite.max() - finite.min() < min_loss:
        return
    tried_actions = set[int]()
    for index, choose in enumerate(choosers):
        action = choose()
        if action is None or action in tried_actions or not position.legal_actions_mask[action]:
            continue
        tried_actions.add(action)
        if values.max() - values[action] >= min_loss:
            yield action, index


def _describe_situation(position: ValuedPosition) -> object:
    """Return a key that is equal in positions that are nearly the same puzzle."""
    session, problem = position.session, position.problem
    if problem.partially_observable:
        if position.turns_left == 1:  # what is learned in the last turn is of no use
            return "last turn"
        return tuple(np.round(session.view(position.seat).belief, 1))
    if problem.state_count != 1:
        return position.position.question.players, problem.format_state(session.state)
    players, policy = position.position.question.players, position.hint_agent.policy
    predicted = [
        policy.predict_actions(position.memory, other)
        for other in range(len(problem.agents))
        if other != position.seat
    ]
    predictions = tuple(() if p is None else tuple(np.round(p[0], 1)) for p in predicted)
    return players, position.turns_left == 1, predictions


def _describe_exact_situation(position: ValuedPosition) -> object:
    """Return a key that is equal in positions whose values are equal."""
    session, problem = position.session, position.problem
    if problem.partially_observable:
        return position.turns_left, session.view(position.seat).belief.tobytes()
    if problem.state_count != 1:
        return position.turns_left, problem.format_state(session.state)
    return position.turns_left, position.values.tobytes()


def _choose_next_action(position: ValuedPosition, choose: Chooser) -> int:
    """Return the player's action on the way: a random one, or that of a rule, or the best."""
    session = position.session
    stream = 1 + position.seat  # the player's own, which nothing else uses
    u, v = session.uniform_source.generate_uniforms(stream, len(session.turns) + 1, 0, 2)[0]
    legal = np.flatnonzero(position.legal_actions_mask)
    if u < RANDOM_SHARE:
        return int(legal[int(v * len(legal))])
    action = choose()
    return int(np.argmax(position.values)) if action is None or action not in legal else action


def _select_different(candidates: Mapping[tuple[object, ...], Puzzle]) -> list[Puzzle]:
    """Return the puzzles with the greatest losses, at most four similar ones."""
    counts = Counter[object]()
    selected = []
    for (_, *similarity), puzzle in sorted(candidates.items(), key=lambda item: -item[1].loss):
        key = tuple(similarity), tuple(puzzle.position.seats.items())
        counts[key] += 1
        if counts[key] <= MAX_SIMILAR:
            selected.append(puzzle)
    return selected


def _alternate_rules(puzzles: Sequence[Puzzle]) -> list[Puzzle]:
    """Return the puzzles such that the rules of thumb take turns, each in the same order."""
    by_rule: dict[str, list[Puzzle]] = {}
    for puzzle in puzzles:
        by_rule.setdefault(puzzle.rule, []).append(puzzle)
    ranks = [(rank, puzzle) for group in by_rule.values() for rank, puzzle in enumerate(group)]
    return [puzzle for _, puzzle in sorted(ranks, key=lambda pair: (pair[0], -pair[1].loss))]


def choose_puzzle(name: str, today: date) -> Puzzle:
    """Return the puzzle that a player should solve next.

    Of a problem, or of all problems if `name` is empty, it is one that was missed and is due. Else
    it is the puzzle of the day, or the next one that was never asked.
    """
    progress = load_question_progress()
    due_codes = [
        key.removeprefix(KEY_PREFIX)
        for key, entry in progress.items()
        if key.startswith(KEY_PREFIX) and entry.is_due(today)
    ]
    if not name:
        puzzle = find_puzzle_of_the_day(today)
        if _key_of(puzzle) not in progress:
            return puzzle
        own_codes = [code for code in due_codes if split_code(code)[0] in PUZZLE_PROBLEMS]
        if own_codes:
            return find_puzzle(own_codes[0])
        name = split_code(puzzle.code)[0]
    puzzles = list_puzzles(name)
    due = [puzzle for puzzle in puzzles if puzzle.code in due_codes]
    new = [puzzle for puzzle in puzzles if _key_of(puzzle) not in progress]
    return [*due, *new, *puzzles][0]


def _key_of(puzzle: Puzzle) -> str:
    """Return the key of a puzzle in the file of progress."""
    return f"{KEY_PREFIX}{puzzle.code}"


def make_exercise(puzzle: Puzzle) -> Exercise:
    """Return the exercise of a puzzle."""
    position = open_position(puzzle.position, CURRENT_FOLDER, trusted=True)
    hint_agent = find_exact_agent(position.problem, position.question)
    assert hint_agent is not None  # a puzzle has exact values
    labels = position.session.action_labels(position.seat)
    question = ActionQuestion(
        position,
        hint_agent,
        tolerance=puzzle.answer_tolerance,
        obvious_action=labels.index(puzzle.rule_action),
    )
    loss = format_number(puzzle.loss)
    learned = (
        f"Rule of thumb: {puzzle.rule}. Here it says {puzzle.rule_action} and loses {loss}.",
    )
    introduction = tuple(filter(None, [question.describe_history()]))
    return Exercise(
        _key_of(puzzle),
        f"puzzle {puzzle.code}",
        question,
        tuple(filter(None, introduction)),
        learned,
    )
