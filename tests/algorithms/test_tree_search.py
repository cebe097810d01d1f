"""Monte Carlo tree search in steps: visits, means, UCB1 scores, and the best action."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

import dmplay
from dmplay.algorithms.step import Step, TreeNode, WatchRequest
from dmplay.algorithms.tree_search import ALGORITHM
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import EpisodeOver
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp
from tests.support.formulas import assert_formula_adds_up
from tests.support.games import make_session, play_actions
from tests.support.literature_pomdps import make_tiger
from tests.support.problem_cases import CASE_NAMES, load_problem
from tests.support.tic_tac_toe import Toe
from tests.support.turn_based_games import Nim
from tests.support.user_problems import Gamble, Heap, Key, Vault

USER_PROBLEMS: dict[str, Problem] = {
    "tiger": make_tiger(),
    "nim": Nim(),
    "tic-tac-toe": Toe(),
    "key": Key(),
    "heap": Heap(),
    "vault": Vault(),
    "gamble": Gamble(),
}
PHASES = ["selection", "expansion", "playout", "backup"]


def watch(
    problem: Problem, simulations: int = 6, session: Session | None = None, seat: int = 0
) -> list[Step]:
    assert not ALGORITHM.explain_misfit(problem)
    request = WatchRequest(problem, seat, session, simulations, seed=5)
    return list(ALGORITHM.iterate_steps(request))


def read_tree(step: Step) -> TreeNode:
    (tree,) = step.pictures
    assert isinstance(tree, TreeNode)
    return tree


def iter_nodes(node: TreeNode) -> Iterator[TreeNode]:
    yield node
    for child in node.children:
        yield from iter_nodes(child)


def sum_returns(root: TreeNode) -> float:
    """Return the sum of the returns of all simulations, from the means of the root's actions."""
    return sum(child.visits * child.value for child in root.children if child.value is not None)


def iter_state_nodes(root: TreeNode) -> Iterator[TreeNode]:
    yield root
    for action in root.children:
        for outcome in action.children:
            yield from iter_state_nodes(outcome)


def find_best_action(problem: Problem, simulations: int, session: Session | None = None) -> str:
    children = read_tree(watch(problem, simulations, session)[-1]).children
    return max(children, key=lambda child: child.visits).label


@pytest.mark.parametrize("name", [*CASE_NAMES, *USER_PROBLEMS])
def test_visits_means_and_formulas_agree_in_every_problem(name: str) -> None:
    problem = USER_PROBLEMS[name] if name in USER_PROBLEMS else load_problem(name)
    steps = watch(problem)
    for step in steps:
        if step.formula:
            assert_formula_adds_up(step.formula)
    backups = [step for step in steps if step.title.endswith("backup")]
    assert [read_tree(step).visits for step in backups] == [1, 2, 3, 4, 5, 6]
    root = read_tree(backups[-1])
    assert sum(child.visits for child in root.children) == 6
    start = "The return from the root is "
    sums = [
        sentence.removeprefix(start).partition(":")[0]
        for step in backups
        for sentence in step.sentences
        if sentence.startswith(start)
    ]
    assert len(sums) == 6
    for text in sums:
        assert_formula_adds_up(f"return = {text}")
    total = sum(float(text.rpartition(" = ")[2]) for text in sums)
    assert sum_returns(root) == pytest.approx(total, rel=5e-3, abs=1e-2)


@pytest.mark.parametrize("name", [*CASE_NAMES, *USER_PROBLEMS])
def test_the_count_of_a_state_is_the_sum_of_those_of_its_actions(name: str) -> None:
    problem = USER_PROBLEMS[name] if name in USER_PROBLEMS else load_problem(name)
    for step in watch(problem, 20):
        for node in iter_state_nodes(read_tree(step)):
            assert node.visits == sum(action.visits for action in node.children)
            assert (node.value, node.score) == (None, None)
            for action in node.children if step.title.endswith("backup") else ():
                # The simulation that adds an outcome tries no action there.
                later = sum(outcome.visits for outcome in action.children)
                assert later <= action.visits - len(action.children)


@pytest.mark.parametrize("name", ["hexworld", "catch", "predator-prey", "2048"])
def test_scores_follow_the_formula_with_the_counts_of_the_rows(name: str) -> None:
    steps = watch(load_problem(name), 40)
    trees = [read_tree(step) for step in steps if step.title.endswith("backup")]
    totals = [0.0, *map(sum_returns, trees)]
    returns = [after - before for before, after in pairwise(totals)]
    c = max(returns) - min(returns)
    deep_scores = 0
    for node in iter_state_nodes(trees[-1]):
        for action in node.children:
            assert action.value is not None
            bonus = c * math.sqrt(math.log(node.visits) / action.visits)
            assert action.score == pytest.approx(action.value + bonus, rel=1e-9)
            deep_scores += node is not trees[-1]
    assert deep_scores or name in ("catch", "2048"), "some simulations went deeper than the root"


def test_the_last_step_chooses_the_action_of_the_highest_mean_as_in_the_book() -> None:
    last = watch(load_problem("hexworld"), 50)[-1]
    means = {child.label: child.value or 0.0 for child in read_tree(last).children}
    best = max(means, key=means.__getitem__)
    assert last.sentences[:2] == (
        f"The search ends, and chooses {best}, the root's action with the highest Q.",
        "Q is usually below the value of optimal play, because playouts act at random.",
    )


def test_the_first_steps_say_what_is_counted_and_where_a_playout_ends() -> None:
    _, select, expand, playout, backup, *_ = watch(load_problem("hexworld"), 50)
    assert select.sentences[1:] == ("e was untried in the root, and untried actions come first.",)
    assert expand.sentences[1:] == (
        "The rows show, by turns, an action and the outcomes to which it led.",
    )
    assert playout.sentences[0].endswith(("to the game's end.", "to the limit of the simulation."))
    assert playout.sentences[2] == (
        "value = sum of (0.9 to the power of the turn x reward), with turns from 0; "
        "rewards of 0 are left out."
    )
    assert backup.sentences[1:3] == (
        "N counts how often an action was tried. In a new state, no action was: N = 0.",
        "New Q = old Q + (return - old Q) / N, so Q is the mean return.",
    )


def test_the_marked_path_is_the_path_of_the_simulation() -> None:
    steps = watch(load_problem("hexworld"), 30)
    for select, backup in zip(steps, steps[3:], strict=False):
        if not (select.title.endswith("selection") and backup.title.endswith("backup")):
            continue
        marked = [node.label for node in iter_nodes(read_tree(backup)) if node.is_on_path]
        path = select.sentences[0].removeprefix("Path: ").removesuffix(".")
        words = path.replace(", then ", " to ").split(" to ")
        assert marked[1 : 1 + len(words)] == words[: len(marked) - 1]


def test_a_simulation_has_four_phases_in_the_order_of_the_book() -> None:
    titles = [step.title for step in watch(load_problem("hexworld"), 2)]
    assert titles == ["start", *(f"simulation {k}: {phase}" for k in (1, 2) for phase in PHASES)]


def test_it_finds_the_optimal_action_of_an_mdp() -> None:
    problem = dmplay.load_problem("hexworld:straight-line")
    session = Session(problem, SeededUniforms(0))
    session.initial_state = problem.parse_state("(4,0)")
    q = mdp_values.compute_optimal_q(tabulate(problem), problem.discount)
    best = problem.format_action(0, int(np.argmax(q[4])))
    assert find_best_action(problem, 200, session) == best == "e"


def test_it_finds_the_optimal_action_for_a_belief() -> None:
    session = make_session("crying-baby", [0.9], [0.5], [0.5])
    problem = session.problem
    play_actions(problem, session, "ignore")
    belief = session.view(0).belief
    assert belief == pytest.approx([0.0928, 0.9072], abs=1e-4)
    stages = exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, 19)
    (q,) = exact_pomdp.compute_action_values(stages[-1], belief[None])
    best = problem.format_action(0, int(np.argmax(q)))
    assert find_best_action(problem, 200, session) == best == "feed"


def test_the_mean_of_a_sure_reward_is_exact_with_one_turn_left() -> None:
    problem = dmplay.load_problem("machine-replacement")
    session = Session(problem, SeededUniforms(0), turn_limit=1)
    tree = read_tree(watch(problem, 20, session)[-1])
    rewards = tabulate(problem).rewards[0, :, 0]  # the machine starts with no failed component
    assert [child.value for child in tree.children] == pytest.approx(rewards.tolist())


def test_hidden_states_come_from_the_belief_and_never_from_the_game() -> None:
    steps = []
    for first_draw in (0.1, 0.9):  # sated and hungry babies that nobody has heard yet
        session = make_session("crying-baby", [first_draw])
        steps.append(
            [(s.title, s.sentences, s.formula) for s in watch(session.problem, 20, session)]
        )
    assert steps[0] == steps[1]
    states = {sentence for _, sentences, _ in steps[0] for sentence in sentences[:1]}
    assert {"The belief gave the state hungry.", "The belief gave the state sated."} < states


def test_nodes_of_a_hidden_problem_are_actions_and_observations() -> None:
    tree = read_tree(watch(load_problem("crying-baby"), 60)[-1])
    assert tree.label == "belief"
    assert {action.label for action in tree.children} == {"feed", "sing", "ignore"}
    outcomes = {outcome.label for action in tree.children for outcome in action.children}
    assert outcomes == {"crying", "quiet"}


def test_the_first_step_names_the_partner_model() -> None:
    first, *_ = watch(load_problem("collaborative-predator-prey"), 1)
    assert first.sentences == (
        "The root of the tree is the start of a game, for predator1.",
        "Each simulation adds at most one node, and plays at most 50 turns.",
        "Its state is drawn from the belief of predator1, not from the game.",
        "A node is a history of actions and observations.",
        "All values are against predator2 acting uniformly at random.",
    )


def test_values_of_a_round_are_against_random_play() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    session = Session(problem, SeededUniforms(0), turn_limit=1)
    tree = read_tree(watch(problem, 300, session)[-1])
    silent, blame = tree.children
    assert silent.value == pytest.approx(-2.5, abs=0.5)  # the mean of -1 and -4
    assert blame.value == pytest.approx(-1.5, abs=0.5)  # the mean of 0 and -3


def test_a_finished_game_has_nothing_to_search() -> None:
    session = make_session("crying-baby", [0.1])
    session.end("quit")
    with pytest.raises(EpisodeOver, match="needs a turn to play, but the game is over"):
        watch(session.problem, 1, session)


def test_every_built_in_problem_fits() -> None:
    assert not [name for name in CASE_NAMES if ALGORITHM.explain_misfit(load_problem(name))]
