"""Tests of search-tree reuse: a search continues with the tree of the previous turn."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.search import N_RESULT_ARRAYS, TreeSearch
from dmplay.chance import Array, Ints
from dmplay.core import Labels, Memory, Percept, Policy
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.game.game_setup import branch_game, resume_game
from dmplay.game.launch_requests import BranchRequest, ResumeRequest
from dmplay.solvers.search_config import SearchConfig
from dmplay.solvers.search_tree_reuse import extract_subtrees
from tests.support.games import assert_verified, record_game
from tests.support.user_problems import Key

SMALL_SEARCH = "search:simulations=40,depth=5,reuse=true"
#: problems with few, many, real or hidden states, and with several agents; the seat that searches
SEAT_BY_PROBLEM = {
    "hexworld": 0,
    "2048": 0,
    "mountain-car": 0,
    "simple-regulator": 0,
    "machine-replacement": 0,
    "predator-prey": 1,
    "travelers-dilemma": 0,
    "multicaregiver-crying-baby": 1,
}


@dataclass(frozen=True)
class UnobservedKeyProblem(Key):
    """The key problem without observations of the key."""

    observations = (Labels(("dark",)),)


def count_visits(tree: SearchConfig, trees: Memory) -> dict[tuple[int, ...], list[float]]:
    """Return the visit counts of each node in the first row, by the path that leads to the node."""
    parent_edges, edge_count = trees[0][0], tree.action_slots * tree.observation_slots
    paths: dict[int, tuple[int, ...]] = {0: ()}
    for node, edge in enumerate(parent_edges.tolist()):
        if edge >= 0:
            paths[node] = (*paths[edge // edge_count], edge % edge_count)
    return {path: trees[2][0, node].tolist() for node, path in paths.items()}


def extract_trees(search: TreeSearch, memory: Memory) -> Memory:
    return memory[-search._config.packed_array_count - N_RESULT_ARRAYS : -N_RESULT_ARRAYS]


def grow_trees(agent: str, *turns: tuple[int, int]) -> tuple[SearchConfig, Memory]:
    """Return the search trees of a machine operator after these actions and observations."""
    search = dmplay.load_agent(dmplay.load_problem("machine-replacement"), 0, agent)
    assert isinstance(search, TreeSearch)
    memory = search.initial_memory(np.full(1, -1))
    for action, observation in turns:
        percept = Percept(np.full(1, action), np.full(1, observation), None, None)
        memory = search.update_memory(memory, percept)
    tree = search._config
    return tree, extract_trees(search, memory)


def test_reuse_retains_the_visits_below_the_action_and_observation() -> None:
    tree, trees = grow_trees(SMALL_SEARCH)
    action, observation = 0, 0
    retained = count_visits(
        tree, extract_subtrees(tree, trees, np.full(1, action), np.full(1, observation))
    )
    edge, before = action * tree.observation_slots + observation, count_visits(tree, trees)
    expected = {path[1:]: count for path, count in before.items() if path[:1] == (edge,)}
    assert len(expected) > 4
    assert max(map(sum, expected.values())) > 4
    # actions are compared on common random numbers
    assert retained == expected | {(): [0.0] * tree.action_slots}


def test_a_retained_tree_continues_to_grow() -> None:
    (tree, before), (_, after) = grow_trees(SMALL_SEARCH), grow_trees(SMALL_SEARCH, (0, 0))
    retained = count_visits(
        tree, extract_subtrees(tree, before, np.zeros(1, int), np.zeros(1, int))
    )
    later = count_visits(tree, after)
    assert sum(later[()]) == 40
    for path, counts in retained.items():
        assert (np.array(later[path]) >= counts).all()


def test_nothing_is_retained_for_an_action_that_was_not_simulated() -> None:
    search = dmplay.load_agent(dmplay.load_problem("simple-regulator"), 0, SMALL_SEARCH)
    assert isinstance(search, TreeSearch)
    tree = search._config
    trees = extract_trees(search, search.initial_memory(np.array([[2.0]])))
    retained = extract_subtrees(tree, trees, np.array([0.123]), np.zeros(1, int))
    assert (retained[0] == -1).all()
    assert not any(part.any() for part in retained[1:])


def test_a_large_tree_retains_its_oldest_nodes() -> None:
    tree, trees = grow_trees(SMALL_SEARCH)
    small_tree = SearchConfig(tree.problem, 0, 4, 5, 1.0, reuse_trees=True)
    retained = count_visits(
        small_tree, extract_subtrees(small_tree, trees, np.zeros(1, int), np.zeros(1, int))
    )
    complete = count_visits(tree, extract_subtrees(tree, trees, np.zeros(1, int), np.zeros(1, int)))
    assert list(retained.items()) == list(complete.items())[:4]


def play_three_turns(name: str, seat: int, rows: Ints) -> list[Array]:
    """Return the actions and the agent's memories of three turns, for these rows of five games."""
    problem = dmplay.load_problem(name)
    others = [dmplay.load_agent(problem, player, "random") for player in range(len(problem.agents))]
    search = dmplay.load_agent(problem, seat, SMALL_SEARCH)
    policies: list[Policy] = [
        search if player == seat else other for player, other in enumerate(others)
    ]
    uniforms = np.random.default_rng(2).random((4, 5, 200))
    s = problem.sample_initial_states(uniforms[0, rows, : problem.uniform_counts.start])
    memories = [
        player.initial_memory(problem.initial_observation(s, index))
        for index, player in enumerate(policies)
    ]
    records = list[Array]()
    for turn in range(1, 4):
        u, legal = uniforms[turn, rows], problem.legal_actions_mask(s)
        joint = np.stack(
            [
                player.choose(
                    memory, None if legal is None else legal[:, index], u[:, index : index + 1]
                )
                for index, (player, memory) in enumerate(zip(policies, memories, strict=True))
            ],
            axis=1,
        )
        outcome = problem.step(s, joint, u[:, 9 : 9 + problem.uniform_counts.step])
        memories = [
            player.update_memory(memory, problem.build_percept(index, joint, outcome))
            for index, (player, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        s = outcome.state
        records += [joint, *memories[seat]]
    return records


@pytest.mark.slow
@pytest.mark.parametrize("name", SEAT_BY_PROBLEM)
def test_trees_are_the_same_alone_and_in_a_batch(name: str) -> None:
    batch = play_three_turns(name, SEAT_BY_PROBLEM[name], np.arange(5))
    for row in range(5):
        for whole, single in zip(
            batch, play_three_turns(name, SEAT_BY_PROBLEM[name], np.array([row])), strict=True
        ):
            np.testing.assert_array_equal(single, whole[[row]])


@pytest.mark.slow
@pytest.mark.parametrize("name", SEAT_BY_PROBLEM)
def test_verify_resume_and_branch_restore_the_search_trees(name: str, tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    agents = dict.fromkeys(("agent", "other_agent"), SMALL_SEARCH)
    if len(dmplay.load_problem(name).agents) == 1:
        agents["other_agent"] = ""
    text = record_game(path, name, turns=6, **agents)  # type: ignore[arg-type]
    assert_verified(path)
    offsets = [text.index(f"\n\nturn: {turn}\n") + 2 for turn in (3, 4)]
    path.write_text(text[: offsets[1]])
    game = resume_game(ResumeRequest(path))
    while game.play_agent_turn():
        pass
    game.finish()
    assert path.read_text() == text
    branch = branch_game(BranchRequest(path, turn=3, record_path=tmp_path / "branch.dmt"))
    while branch.play_agent_turn():
        pass
    branch.finish()
    assert_verified(tmp_path / "branch.dmt")


def test_a_finished_game_is_not_searched() -> None:
    problem = dmplay.load_problem("hexworld")
    terminal_states = np.flatnonzero(problem.terminal(problem.enumerate_states()))[:1]
    search = dmplay.load_agent(problem, 0, SMALL_SEARCH)
    assert isinstance(search, TreeSearch)
    assert not extract_trees(search, search.initial_memory(terminal_states))[2].any()  # visits


def test_games_whose_trees_exceed_the_memory_limit_are_refused() -> None:
    tree = TreeSearch(dmplay.load_problem("hexworld"), 0, reuse=True)._config
    tree.check_memory(1000)
    with pytest.raises(BudgetExceeded, match="try fewer games at a time"):
        tree.check_memory(100_000)


def test_reuse_is_refused_if_legal_actions_are_hidden() -> None:
    TreeSearch(UnobservedKeyProblem(), 0)
    with pytest.raises(BadPolicy, match="reuse needs states that are seen, or all actions legal"):
        TreeSearch(UnobservedKeyProblem(), 0, reuse=True)
