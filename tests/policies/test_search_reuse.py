"""A search that goes on with the tree of the turn before, where it can and nowhere else."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array, Ints
from dmplay.core import Labels, Memory, Percept, Policy
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.game.request import BranchRequest, ResumeRequest
from dmplay.game.start import branch_game, resume_game
from dmplay.policies.search import N_RESULT_ARRAYS, TreeSearch
from dmplay.solvers.search_subtree import extract_subtrees
from dmplay.solvers.search_tree import SearchConfig
from tests.support.brought import Key
from tests.support.games import recorded, verified

SMALL = "search:simulations=40,depth=5,reuse=true"
#: states that are few, many, real, hidden, or of several, who act at once or see something else
KINDS = {
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
class Locked(Key):
    """The same where nobody sees whether the key was taken."""

    observations = (Labels(("dark",)),)


def visits(tree: SearchConfig, trees: Memory) -> dict[tuple[int, ...], list[float]]:
    """How often each slot of a node was chosen in the first row, by what leads there."""
    hangs, edges = trees[0][0], tree.action_slots * tree.observation_slots
    ways: dict[int, tuple[int, ...]] = {0: ()}
    for node, place in enumerate(hangs.tolist()):
        if place >= 0:
            ways[node] = (*ways[place // edges], place % edges)
    return {way: trees[2][0, node].tolist() for node, way in ways.items()}


def trees_of(search: TreeSearch, memory: Memory) -> Memory:
    return memory[-search._config.packed_array_count - N_RESULT_ARRAYS : -N_RESULT_ARRAYS]


def grown(agent: str, *turns: tuple[int, int]) -> tuple[SearchConfig, Memory]:
    """The trees of an operator of the machine who did and saw this."""
    search = dmplay.load_agent(dmplay.load_problem("machine-replacement"), 0, agent)
    assert isinstance(search, TreeSearch)
    memory = search.initial_memory(np.full(1, -1))
    for did, saw in turns:
        told = Percept(np.full(1, did), np.full(1, saw), None, None)
        memory = search.update_memory(memory, told)
    tree = search._config
    return tree, trees_of(search, memory)


def test_what_is_kept_are_the_visits_below_what_was_done_and_seen() -> None:
    tree, trees = grown(SMALL)
    did, saw = 0, 0
    kept = visits(tree, extract_subtrees(tree, trees, np.full(1, did), np.full(1, saw)))
    first, before = did * tree.observation_slots + saw, visits(tree, trees)
    below = {way[1:]: count for way, count in before.items() if way[:1] == (first,)}
    assert len(below) > 4
    assert max(map(sum, below.values())) > 4
    assert kept == below | {(): [0.0] * tree.action_slots}  # actions are compared on equal luck


def test_a_kept_tree_goes_on_growing() -> None:
    (tree, before), (_, after) = grown(SMALL), grown(SMALL, (0, 0))
    kept = visits(tree, extract_subtrees(tree, before, np.zeros(1, int), np.zeros(1, int)))
    more = visits(tree, after)
    assert sum(more[()]) == 40
    for way, counts in kept.items():
        assert (np.array(more[way]) >= counts).all()


def test_nothing_is_kept_of_what_was_not_simulated() -> None:
    search = dmplay.load_agent(dmplay.load_problem("simple-regulator"), 0, SMALL)
    assert isinstance(search, TreeSearch)
    tree = search._config
    trees = trees_of(search, search.initial_memory(np.array([[2.0]])))
    kept = extract_subtrees(tree, trees, np.array([0.123]), np.zeros(1, int))
    assert (kept[0] == -1).all()
    assert not any(part.any() for part in kept[1:])


def test_of_a_large_tree_the_nodes_stay_that_were_there_first() -> None:
    tree, trees = grown(SMALL)
    few = SearchConfig(tree.problem, 0, 4, 5, 1.0, reuse_trees=True)
    kept = visits(few, extract_subtrees(few, trees, np.zeros(1, int), np.zeros(1, int)))
    whole = visits(tree, extract_subtrees(tree, trees, np.zeros(1, int), np.zeros(1, int)))
    assert list(kept.items()) == list(whole.items())[:4]


def courses(name: str, seat: int, rows: Ints) -> list[Array]:
    """What the agent remembers and chooses in three turns of these of five games."""
    problem = dmplay.load_problem(name)
    others = [dmplay.load_agent(problem, one, "random") for one in range(len(problem.agents))]
    search = dmplay.load_agent(problem, seat, SMALL)
    each: list[Policy] = [search if one == seat else other for one, other in enumerate(others)]
    luck = np.random.default_rng(2).random((4, 5, 200))
    s = problem.sample_initial_states(luck[0, rows, : problem.uniform_counts.start])
    memories = [
        one.initial_memory(problem.initial_observation(s, at)) for at, one in enumerate(each)
    ]
    told = list[Array]()
    for turn in range(1, 4):
        u, legal = luck[turn, rows], problem.legal_actions_mask(s)
        joint = np.stack(
            [
                one.choose(memory, None if legal is None else legal[:, at], u[:, at : at + 1])
                for at, (one, memory) in enumerate(zip(each, memories, strict=True))
            ],
            axis=1,
        )
        outcome = problem.step(s, joint, u[:, 9 : 9 + problem.uniform_counts.step])
        memories = [
            one.update_memory(memory, problem.build_percept(at, joint, outcome))
            for at, (one, memory) in enumerate(zip(each, memories, strict=True))
        ]
        s = outcome.state
        told += [joint, *memories[seat]]
    return told


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_trees_are_the_same_alone_and_beside_others(name: str) -> None:
    together = courses(name, KINDS[name], np.arange(5))
    for row in range(5):
        for whole, alone in zip(together, courses(name, KINDS[name], np.array([row])), strict=True):
            np.testing.assert_array_equal(alone, whole[[row]])


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_a_game_is_verified_resumed_and_branched_with_the_trees_it_had(
    name: str, tmp_path: Path
) -> None:
    path = tmp_path / "game.dmt"
    agent = dict.fromkeys(("agent", "others"), SMALL)
    if len(dmplay.load_problem(name).agents) == 1:
        agent["others"] = ""
    whole = recorded(path, name, turns=6, **agent)  # type: ignore[arg-type]
    verified(path)
    parts = [whole.index(f"\n\nturn: {turn}\n") + 2 for turn in (3, 4)]
    path.write_text(whole[: parts[1]])
    game = resume_game(ResumeRequest(path))
    while game.play_agent_turn():
        pass
    game.finish()
    assert path.read_text() == whole
    other = branch_game(BranchRequest(path, turn=3, record_path=tmp_path / "branch.dmt"))
    while other.play_agent_turn():
        pass
    other.finish()
    verified(tmp_path / "branch.dmt")


def test_an_over_game_is_not_searched() -> None:
    problem = dmplay.load_problem("hexworld")
    over = np.flatnonzero(problem.terminal(problem.enumerate_states()))[:1]
    search = dmplay.load_agent(problem, 0, SMALL)
    assert isinstance(search, TreeSearch)
    assert not trees_of(search, search.initial_memory(over))[2].any()  # visits


def test_so_many_games_that_their_trees_fill_the_memory_are_refused() -> None:
    tree = TreeSearch(dmplay.load_problem("hexworld"), 0, reuse=True)._config
    tree.check_memory(1000)
    with pytest.raises(BudgetExceeded, match="try fewer games at a time"):
        tree.check_memory(100_000)


def test_reuse_is_refused_where_what_is_legal_is_hidden() -> None:
    TreeSearch(Locked(), 0)
    with pytest.raises(BadPolicy, match="reuse needs states that are seen, or all actions legal"):
        TreeSearch(Locked(), 0, reuse=True)
