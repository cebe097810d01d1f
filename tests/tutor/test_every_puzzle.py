"""Every built-in puzzle is read again: its rule, its numbers and its text, without the miner."""

import json
import re
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from dmplay.agents.matrix_game_agents import HierarchicalSoftmax, Nash
from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import DIRECTIONS, Hex, hex_neighbours
from dmplay.core.problem import enumerate_outcomes
from dmplay.output.exercise_report import report_puzzle
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.problems.predator_prey.rules import PredatorPrey
from dmplay.problems.travelers_dilemma.agents import FixedClaim
from dmplay.tutor.action_question import ActionQuestion
from dmplay.tutor.exercise import Exercise, ExerciseRun
from dmplay.tutor.puzzles import (
    Puzzle,
    find_puzzle,
    list_puzzle_problems,
    list_puzzles,
    make_exercise,
)
from tests.oracles.belief_bounds import BeliefBounds
from tests.oracles.exhaustive_values import ExhaustiveValues

HIDDEN_PROBLEMS = {
    "catch": 20, "crying-baby": 100, "machine-replacement": 40, "multicaregiver-crying-baby": 100,
}  # with the resolution of the grid of beliefs  # fmt: skip
MAP_PROBLEMS = ("hexworld", "predator-prey")
SMALL_GAMES = ("prisoners-dilemma", "rock-paper-scissors")
MIN_PROVEN_SHARE = 0.9  # of the loss, with bounds on a grid of beliefs
ENDLESS_SWEEPS = 400
TOLERANCE = 1e-6


def list_all() -> list[Puzzle]:
    """Return all built-in puzzles."""
    return [puzzle for name in list_puzzle_problems() for puzzle in list_puzzles(name)]


@cache
def exercise_of(code: str) -> Exercise:
    """Return the exercise of a puzzle."""
    return make_exercise(find_puzzle(code))


def ask(puzzle: Puzzle) -> ActionQuestion:
    """Return the question of a puzzle."""
    return exercise_of(puzzle.code).question


def name_of(puzzle: Puzzle) -> str:
    """Return the name of the problem of a puzzle."""
    return puzzle.code.partition(":")[0]


# --- values, computed again ---------------------------------------------------------------------


class Sweeps(NamedTuple):
    """Backward induction over all states of a map, against the players of a puzzle."""

    p: Reals  # [A, S, E], the probability of each event
    rewards: Reals  # [A, S, E]
    next_states: Reals  # [A, S, E], indices
    is_last: Reals  # [A, S, E], whether the game ends
    q: list[Reals]  # [S, A], by turns left


@cache
def sweep(name: str, seats: tuple[tuple[str, str], ...], turns: int) -> Sweeps:
    """Return the values of all states with up to so many turns left."""
    puzzle = next(p for p in list_puzzles(name) if tuple(p.position.seats.items()) == seats)
    question = ask(puzzle)
    problem, seat = question.problem, question.seat
    states = problem.enumerate_states()
    actions = np.zeros((len(states), len(problem.agents)), np.int64)
    for other, seated in enumerate(question.game.session.seated_policies):
        if seated:
            actions[:, other] = seated.policy.choose((states,), None, np.zeros((len(states), 0)))
    rows = []
    for action in range(6):
        actions[:, seat] = action
        p, outcome = enumerate_outcomes(problem, states, actions)
        flat = outcome.state.reshape(p.size, *states.shape[1:])
        rows.append(
            (
                p,
                outcome.rewards[:, :, seat],
                problem.state_indices(flat).reshape(p.shape),
                problem.terminal(flat).reshape(p.shape),
            )
        )
    p, rewards, next_states, is_last = map(np.array, zip(*rows, strict=True))
    q = [np.zeros((len(states), 6))]
    for _ in range(turns):
        later = np.where(is_last, 0.0, q[-1].max(axis=1)[next_states])
        q.append((p * (rewards + problem.discount * later)).sum(axis=2).T)
    return Sweeps(p, rewards, next_states, is_last, q)


def sweep_of(puzzle: Puzzle, question: ActionQuestion) -> tuple[Sweeps, int, int]:
    """Return the sweeps for a puzzle on a map, its turns left, and the index of its state."""
    turns = question.position.turns_left or ENDLESS_SWEEPS
    seats = tuple(puzzle.position.seats.items())
    state = np.asarray(question.game.session.state)[None]
    return (
        sweep(name_of(puzzle), seats, turns),
        turns,
        int(question.problem.state_indices(state)[0]),
    )


@cache
def bounds_of(name: str) -> BeliefBounds:
    """Return bounds on the values of a problem with hidden states."""
    questions = [ask(puzzle) for puzzle in list_puzzles(name)]
    turns = max(question.position.turns_left or 0 for question in questions)
    first = questions[0]
    return BeliefBounds(first.problem, first.seat, turns, HIDDEN_PROBLEMS[name])


def bound_values(name: str, question: ActionQuestion, belief: Reals) -> tuple[Reals, Reals]:
    """Return a lower and an upper bound `[A]` on the values of the actions in a belief."""
    turns = question.position.turns_left
    assert turns
    bounds = bounds_of(name)
    return (
        bounds.compute_lower_bounds(belief[None], turns)[0],
        bounds.compute_upper_bounds(belief[None], turns)[0],
    )


def compute_values(puzzle: Puzzle, question: ActionQuestion) -> Reals:
    """Return the value of each action of a puzzle without hidden states."""
    name, session = name_of(puzzle), question.game.session
    if name in MAP_PROBLEMS:
        sweeps, turns, state = sweep_of(puzzle, question)
        return np.asarray(sweeps.q[turns][state])
    policies = [seated.policy if seated else None for seated in session.seated_policies]
    if name in SMALL_GAMES:
        values = ExhaustiveValues(question.problem, question.seat, policies)
        return np.array([*values.compute_values(session).values()])
    turns_left, opponent = question.position.turns_left, policies[1]
    assert turns_left is not None
    if isinstance(opponent, FixedClaim):
        chances = np.eye(99)[opponent.claim - 2]
    else:
        assert isinstance(opponent, Nash | HierarchicalSoftmax)
        chances = opponent.choice_probabilities((np.zeros(1, np.int64),))[0]
    claims = np.arange(2, 101)
    payoffs = np.minimum.outer(claims, claims) + 2 * np.sign(np.subtract.outer(claims, claims).T)
    one_round = payoffs @ chances  # the claims of these agents do not depend on yours
    return np.asarray(one_round + (turns_left - 1) * one_round.max())


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_the_action_of_the_rule_loses_what_the_puzzle_says(name: str) -> None:
    for puzzle in list_puzzles(name):
        question = ask(puzzle)
        wrong = question.labels.index(puzzle.rule_action)
        if name in HIDDEN_PROBLEMS:
            lower, upper = bound_values(name, question, own_belief(question))
            assert (lower <= question.values + TOLERANCE).all(), puzzle.code
            assert (upper >= question.values - TOLERANCE).all(), puzzle.code
            assert lower.max() - upper[wrong] >= MIN_PROVEN_SHARE * puzzle.loss, puzzle.code
        else:
            values = compute_values(puzzle, question)
            assert values.max() - values[wrong] == pytest.approx(puzzle.loss), puzzle.code
            np.testing.assert_allclose(question.values, values, atol=TOLERANCE)


# --- rules, read as a student reads them --------------------------------------------------------


def last_turn(question: ActionQuestion) -> tuple[str, str]:
    """Return the player's last action, and the last observation or the other's last action."""
    session, problem, seat = question.game.session, question.problem, question.seat
    turn = session.turns[-1]  # an IndexError if a rule speaks of a turn that was not played
    action = problem.format_action(seat, turn.actions[seat])
    if problem.partially_observable:
        return action, problem.observations[seat].format_observation(turn.observations[seat])
    return action, problem.format_action(1 - seat, turn.actions[1 - seat])


def own_belief(question: ActionQuestion) -> Reals:
    """Return the belief after the whole history, by Bayes' rule from the problem's arrays."""
    bounds = bounds_of(question.game.problem_name)
    session, seat = question.game.session, question.seat
    belief = np.asarray(session.view(seat).beliefs[0])  # type: ignore[index]
    for turn in session.turns:
        belief = bounds.update(belief, int(turn.actions[seat]), int(turn.observations[seat]))
    return belief


def list_best(values: Reals, labels: Sequence[str]) -> set[str]:
    """Return the labels of the greatest values."""
    best = np.flatnonzero(values >= values.max() - TOLERANCE).tolist()
    return {labels[action] for action in best}


def count_steps(hexes: Sequence[Hex], goal: Hex) -> dict[Hex, int]:
    """Return the number of steps to a goal from each hex of a map."""
    steps, border = {goal: 0}, [goal]
    for hex_ in border:  # the list grows during the loop
        for neighbour in hex_neighbours(hex_):
            if neighbour in hexes and neighbour not in steps:
                steps[neighbour] = steps[hex_] + 1
                border.append(neighbour)
    return steps


def list_steps(start: Hex, steps: dict[Hex, int], *, away: bool = False) -> set[str]:
    """Return the directions of the steps that get closest to a goal, or farthest away."""
    reached = {
        label: steps[hex_]
        for label, hex_ in zip(DIRECTIONS, hex_neighbours(start), strict=True)
        if hex_ in steps and (steps[hex_] > steps[start]) == away and steps[hex_] != steps[start]
    }
    return set(reached)


def read_walk(question: ActionQuestion, *, to_richest: bool) -> set[str]:
    """Return the steps on the shortest ways to the richest or the nearest good exit."""
    hunt = question.problem
    assert isinstance(hunt, HexWorld)
    start = hunt.hexes[int(question.game.session.state)]
    exits = {hex_: pay for hex_, pay in hunt.rewards if pay > 0}
    steps = {hex_: count_steps(hunt.hexes, hex_) for hex_ in exits}
    ranks = {hex_: -exits[hex_] if to_richest else steps[hex_][start] for hex_ in exits}
    goals = [hex_ for hex_ in exits if ranks[hex_] == min(ranks.values())]
    return set().union(*(list_steps(start, steps[goal]) for goal in goals))


def read_hunt(question: ActionQuestion, *, away: bool) -> set[str]:
    """Return the steps towards the prey, or away from the predator."""
    hunt, hexes = question.problem, question.game.session.state
    assert isinstance(hunt, PredatorPrey)
    assert question.problem.agents[question.seat] == ("prey" if away else "predator")
    start, other = (hunt.hexes[int(hexes[seat])] for seat in (question.seat, 1 - question.seat))
    return list_steps(start, count_steps(hunt.hexes, other), away=away)


def read_likeliest_outcomes(puzzle: Puzzle, question: ActionQuestion) -> set[str]:
    """Return the actions whose likeliest next state is worth most."""
    sweeps, turns, state = sweep_of(puzzle, question)
    values = np.zeros(6)
    for a in range(6):
        chances = np.bincount(sweeps.next_states[a, state], sweeps.p[a, state])
        assert np.sum(chances > chances.max() - TOLERANCE) == 1, puzzle.code
        likeliest = int(chances.argmax())
        events = sweeps.next_states[a, state] == likeliest
        weights = sweeps.p[a, state, events] / chances[likeliest]
        later = 0.0 if sweeps.is_last[a, state, events].all() else sweeps.q[turns - 1][likeliest]
        discount = question.problem.discount
        values[a] = weights @ sweeps.rewards[a, state, events] + discount * np.max(later)
    return list_best(values, question.labels)


def read_one_turn(puzzle: Puzzle, question: ActionQuestion) -> set[str]:
    """Return the actions with the greatest expected reward of this turn."""
    bounds = bounds_of(name_of(puzzle))
    return list_best(bounds.compute_lower_bounds(own_belief(question)[None], 1)[0], question.labels)


def read_likeliest_state(puzzle: Puzzle, question: ActionQuestion) -> set[str]:
    """Return the actions that are best in each of the likeliest states."""
    belief = own_belief(question)
    likeliest = np.flatnonzero(belief > belief.max() - TOLERANCE)
    best = set[str]()
    for state in likeliest:
        lower, _ = bound_values(name_of(puzzle), question, np.eye(len(belief))[state])
        best |= list_best(lower, question.labels)
    return best


def read_last_turn_alone(puzzle: Puzzle, question: ActionQuestion) -> set[str]:
    """Return the rule's action if it can be best after the last turn from equal probabilities."""
    name, turn = name_of(puzzle), question.game.session.turns[-1]
    bounds, count = bounds_of(name), question.problem.state_count
    assert isinstance(count, int)
    actions = int(turn.actions[question.seat]), int(turn.observations[question.seat])
    belief = bounds.update(np.full(count, 1 / count), *actions)
    assert (
        f"acts on the belief {question.format_belief(belief)}."
        in exercise_of(puzzle.code).learned[1]
    )
    lower, upper = bound_values(name, question, belief)
    possible = {question.labels[a] for a in np.flatnonzero(upper >= lower.max())}
    return possible & {puzzle.rule_action}


def read_counts(question: ActionQuestion) -> set[str]:
    """Return the best replies to the counts of the other's actions."""
    beaten_by = {"rock": "paper", "paper": "scissors", "scissors": "rock"}
    turns = question.game.session.turns
    assert len(turns) > 1
    counts = Counter(question.problem.format_action(1, turn.actions[1]) for turn in turns)
    scores = [
        counts[next(b for b in beaten_by if beaten_by[b] == label)] - counts[beaten_by[label]]
        for label in question.labels
    ]
    return list_best(np.array(scores, float), question.labels)


def read_win_stay(question: ActionQuestion) -> set[str]:
    """Return the last action if the other cooperated, else the other one."""
    action, reply = last_turn(question)
    return {action} if reply == "cooperate" else {*question.labels} - {action}


READINGS: dict[str, Callable[[Puzzle, ActionQuestion], set[str]]] = {
    "walk straight to the nearest good exit": lambda p, q: read_walk(q, to_richest=False),
    "walk straight to the richest exit": lambda p, q: read_walk(q, to_richest=True),
    "step towards the prey": lambda p, q: read_hunt(q, away=False),
    "step away from the predator": lambda p, q: read_hunt(q, away=True),
    (
        "look only at the likeliest outcome of each action, and take the action whose likeliest "
        "outcome is worth most"
    ): read_likeliest_outcomes,
    "take the greatest expected reward of this turn, and leave later turns aside": read_one_turn,
    "act as if the likeliest hidden state were certain": read_likeliest_state,
    "act on the last turn alone, as if all states had been equally likely before it": (
        read_last_turn_alone
    ),
    "throw the farthest, as it pays most": lambda p, q: {"100"},
    "repeat the last throw if it was caught": lambda p, q: {
        throw for throw, result in [last_turn(q)] if result == "caught"
    },
    "feed the baby after crying, and ignore it after quiet": lambda p, q: {
        {"crying": "feed", "quiet": "ignore"}[last_turn(q)[1]]
    },
    "manufacture, as it earns most": lambda p, q: {"manufacture"},
    "do what the other did last": lambda p, q: {last_turn(q)[1]},
    "repeat your last action if the other cooperated, else change it (win-stay, lose-shift)": (
        lambda p, q: read_win_stay(q)
    ),
    "cooperate, whatever the other does": lambda p, q: {"cooperate"},
    "defect, as it pays more in each single round": lambda p, q: {"defect"},
    "reply best to how often the other chose each action": lambda p, q: read_counts(q),
    "beat the other's last action": lambda p, q: {
        {"rock": "paper", "paper": "scissors", "scissors": "rock"}[last_turn(q)[1]]
    },
    "claim one less than the other's last claim": lambda p, q: {str(int(last_turn(q)[1]) - 1)},
    "claim the highest amount": lambda p, q: {"100"},
    "play the Nash equilibrium, from which no agent gains by a change of its own": (
        lambda p, q: {"2"}
    ),
}


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_the_rule_names_exactly_one_action_which_is_the_quoted_one(name: str) -> None:
    for puzzle in list_puzzles(name):
        question = ask(puzzle)
        assert READINGS[puzzle.rule.text](puzzle, question) == {puzzle.rule_action}, puzzle.code
        assert puzzle.rule_action in question.legal_labels, puzzle.code
        assert puzzle.rule_action not in question.right_actions, puzzle.code


@pytest.mark.parametrize("name", MAP_PROBLEMS)
def test_the_action_of_the_rule_does_not_run_into_a_wall(name: str) -> None:
    for puzzle in list_puzzles(name):
        question = ask(puzzle)
        problem = question.problem
        assert isinstance(problem, HexWorld | PredatorPrey)
        start = problem.hexes[int(np.atleast_1d(question.game.session.state)[question.seat])]
        direction = question.labels.index(puzzle.rule_action)
        assert hex_neighbours(start)[direction] in problem.hexes, puzzle.code


# --- texts --------------------------------------------------------------------------------------


def read_text(puzzle: Puzzle) -> list[str]:
    """Return the text of a puzzle as a player of plain lines reads it."""
    exercise = exercise_of(puzzle.code)
    question = exercise.question
    situation = question.describe_situation() if question.shows_board else []
    return [*question.describe_game(), *exercise.introduction, *situation, question.prompt()]


def test_there_are_at_least_110_puzzles_over_nine_problems_with_different_texts() -> None:
    puzzles = list_all()
    assert len(puzzles) >= 110
    assert len({name_of(puzzle) for puzzle in puzzles}) == 9
    texts = Counter("\n".join(read_text(puzzle)) for puzzle in puzzles)
    assert texts.most_common(1)[0][1] == 1


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_a_text_says_the_players_the_turns_left_and_what_a_turn_pays(name: str) -> None:
    for puzzle in list_puzzles(name):
        question, lines = ask(puzzle), read_text(puzzle)
        text = " ".join(lines)
        assert lines[0].startswith("You ")
        for agent in question.problem.agents:
            is_own = question.problem.agents[question.seat] == agent
            assert is_own or f"{agent} is the agent " in text, puzzle.code
        turns = question.position.turns_left
        is_repeated = question.problem.state_count == 1
        limit = f"You have {turns} {'round' if is_repeated else 'turn'}"
        limit = "The game has no turn limit." if turns is None else limit
        assert limit in text, puzzle.code
        assert re.search(r"\b(pays?|costs?|gets?) ", text), puzzle.code
        weight = re.compile(r"All (turn|round)s count the same|Each later turn counts 0.9 times")
        assert (weight.search(text) is not None) == (turns != 1), puzzle.code
        assert "opponent" not in text, puzzle.code
        assert "@" not in text, puzzle.code  # it is a mark on a map, which plain lines do not draw
        if is_repeated:
            rounds = len(question.game.session.turns)
            assert text.count("agent2 ") > rounds, puzzle.code
            assert f"round {rounds}: you " in text or "This is the first round." in text
        sentences = [sentence for line in lines for sentence in re.split(r"(?<=\.) ", line)]
        assert max(Counter(sentences).values()) == 1, puzzle.code
        report = json.loads(report_puzzle(puzzle.code, with_solution=False))
        assert report["text"] == lines


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_the_solution_names_the_best_actions_and_the_loss_of_the_others_that_are_right(
    name: str,
) -> None:
    for puzzle in list_puzzles(name):
        question = ask(puzzle)
        losses = dict(zip(question.labels, question.values.max() - question.values, strict=True))
        best = [label for label in question.labels if losses[label] < TOLERANCE]
        limit = max(losses.values()) / 100
        near = [label for label in question.labels if TOLERANCE <= losses[label] <= limit]
        line = question.describe_right_actions()
        named = re.fullmatch(r"solution: ([^.;]+?)( \(equally good\))?[.;](.*)", line)
        assert named, line
        assert set(named[1].split(" or ")) == set(best), puzzle.code
        assert set(question.right_actions) == {*best, *near}, puzzle.code
        assert ("right" in line) == bool(near), puzzle.code
        if near:
            greatest = max(losses[label] for label in near)
            loss = re.search(r"(?:only|at most) ([\d.]+) and counts? as right", line)
            assert loss, line
            assert float(loss[1]) == pytest.approx(greatest, abs=5e-4), puzzle.code


def test_the_same_claims_are_right_against_the_same_traveler() -> None:
    right: dict[str, list[str]] = {}
    for puzzle in list_puzzles("travelers-dilemma"):
        answers = ask(puzzle).right_actions
        assert right.setdefault(puzzle.position.seats["agent2"], answers) == answers
    assert right["claim:claim=90"] == ["89"]


@pytest.mark.parametrize("name", list_puzzle_problems())
def test_the_solution_is_the_same_in_lines_and_as_json(name: str) -> None:
    for puzzle in list_puzzles(name):
        exercise = exercise_of(puzzle.code)
        solution = json.loads(report_puzzle(puzzle.code, with_solution=True))["solution"]
        explanation = ExerciseRun(exercise).describe_solution()
        lines = [exercise.question.describe_right_actions(), *explanation]
        assert solution["explanation"] == lines
        assert solution["best"] == solution["right"][: len(solution["best"])]


# --- the other players, as their descriptions say ----------------------------------------------

# By a part of the description: the next action, given your actions and its own so far.
DESCRIBED_REPLIES: dict[str, Callable[[list[str], list[str]], str]] = {
    "cooperates first, then repeats your last action.": lambda you, it: [
        "cooperate", *you,
    ][-1],
    "defects first, then repeats your last action.": lambda you, it: ["defect", *you][-1],
    "cooperates until either agent defects, then always defects.": lambda you, it: (
        "defect" if "defect" in you + it else "cooperate"
    ),
    "cooperates first and after rounds in which both cooperated or both defected, else defects.": (
        lambda you, it: "cooperate" if you[-1:] == it[-1:] else "defect"
    ),
    "cooperates unless you defected in both of the last two rounds.": lambda you, it: (
        "defect" if you[-2:] == ["defect", "defect"] else "cooperate"
    ),
    "cooperates except in the two rounds after each defection by you.": lambda you, it: (
        "defect" if "defect" in you[-2:] else "cooperate"
    ),
    "cooperates unless you defected in more than half of the rounds so far.": lambda you, it: (
        "defect" if you.count("defect") > len(you) / 2 else "cooperate"
    ),
    "plays rock first, then the action that beats your last one.": lambda you, it: (
        {"rock": "paper", "paper": "scissors", "scissors": "rock"}[you[-1]] if you else "rock"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SMALL_GAMES)
def test_the_other_player_acts_as_its_description_says_from_the_first_round(name: str) -> None:
    for puzzle in list_puzzles(name):
        (line,) = [line for line in read_text(puzzle) if "is the agent " in line]
        description = line.partition(", which ")[2]
        if "(fictitious play)" in description:
            continue  # another rule of this file counts them
        reply = DESCRIBED_REPLIES[description]
        history = re.findall(r"round \d+: you (\w+), agent2 (\w+)", " ".join(read_text(puzzle)))
        for number, (_, action) in enumerate(history):
            you, it = ([pair[i] for pair in history[:number]] for i in (0, 1))
            assert reply(you, it) == action, (puzzle.code, number)


@pytest.mark.parametrize("name", MAP_PROBLEMS)
def test_the_text_contains_the_map(name: str) -> None:
    for puzzle in list_puzzles(name):
        problem, text = ask(puzzle).problem, " ".join(read_text(puzzle))
        assert isinstance(problem, HexWorld | PredatorPrey)
        rows = re.findall(r"r = (-?\d+): q = ([-\d, ]+)", text)
        hexes = {(int(q), int(r)) for r, row in rows for q in row.split(",")}
        assert hexes == set(problem.hexes), puzzle.code
        assert "with probability 0.15" in text
        assert ("and can swap hexes" in text) == (name == "predator-prey")


@pytest.mark.parametrize("name", HIDDEN_PROBLEMS)
def test_each_hidden_state_has_a_name_in_words(name: str) -> None:
    for puzzle in list_puzzles(name):
        exercise = exercise_of(puzzle.code)
        question = exercise.question
        lines = [*question.describe_game(), *question.describe_solution(), *exercise.learned]
        beliefs = [line for line in lines if "belief" in line or "hidden states" in line]
        assert len(beliefs) >= 2
        names = {
            state
            for line in beliefs
            for state in re.findall(r"(?:, |belief |are |now )([^,:]+): [\d.]+", line)
        }
        assert all(re.search("[a-z]{4}", state) for state in names), (puzzle.code, names)
