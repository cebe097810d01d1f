"""A search that goes on with the tree of the turn before, where it can and nowhere else."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array, Ints
from dmplay.core import Labels, Memory, Percept, Policy
from dmplay.errors import BadPolicy, TooMuch
from dmplay.game.request import Branching, Resumption
from dmplay.game.start import branched, resumed
from dmplay.policies.search import FOUND, Search
from dmplay.solvers.search_subtree import under
from dmplay.solvers.search_tree import Tree
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


def visits(tree: Tree, trees: Memory) -> dict[tuple[int, ...], list[float]]:
    """How often each slot of a node was chosen in the first row, by what leads there."""
    hangs, edges = trees[0][0], tree.slots * tree.kinds
    ways: dict[int, tuple[int, ...]] = {0: ()}
    for node, place in enumerate(hangs.tolist()):
        if place >= 0:
            ways[node] = (*ways[place // edges], place % edges)
    return {way: trees[2][0, node].tolist() for node, way in ways.items()}


def trees_of(search: Search, memory: Memory) -> Memory:
    return memory[-search._tree.packed - FOUND : -FOUND]


def grown(agent: str, *turns: tuple[int, int]) -> tuple[Tree, Memory]:
    """The trees of an operator of the machine who did and saw this."""
    search = dmplay.agent(dmplay.load("machine-replacement"), 0, agent)
    assert isinstance(search, Search)
    memory = search.begin(np.full(1, -1))
    for did, saw in turns:
        told = Percept(np.full(1, did), np.full(1, saw), None, None)
        memory = search.update(memory, told)
    tree = search._tree
    return tree, trees_of(search, memory)


def test_what_is_kept_are_the_visits_below_what_was_done_and_seen() -> None:
    tree, trees = grown(SMALL)
    did, saw = 0, 0
    kept = visits(tree, under(tree, trees, np.full(1, did), np.full(1, saw)))
    first, before = did * tree.kinds + saw, visits(tree, trees)
    below = {way[1:]: count for way, count in before.items() if way[:1] == (first,)}
    assert len(below) > 4
    assert max(map(sum, below.values())) > 4
    assert kept == below | {(): [0.0] * tree.slots}  # actions are compared on equal luck


def test_a_kept_tree_goes_on_growing() -> None:
    (tree, before), (_, after) = grown(SMALL), grown(SMALL, (0, 0))
    kept = visits(tree, under(tree, before, np.zeros(1, int), np.zeros(1, int)))
    more = visits(tree, after)
    assert sum(more[()]) == 40
    for way, counts in kept.items():
        assert (np.array(more[way]) >= counts).all()


def test_nothing_is_kept_of_what_was_not_simulated() -> None:
    search = dmplay.agent(dmplay.load("simple-regulator"), 0, SMALL)
    assert isinstance(search, Search)
    tree = search._tree
    trees = trees_of(search, search.begin(np.array([[2.0]])))
    kept = under(tree, trees, np.array([0.123]), np.zeros(1, int))
    assert (kept[0] == -1).all()
    assert not any(part.any() for part in kept[1:])


def test_of_a_large_tree_the_nodes_stay_that_were_there_first() -> None:
    tree, trees = grown(SMALL)
    few = Tree(tree.problem, 0, 4, 5, 1.0, reuse=True)
    kept = visits(few, under(few, trees, np.zeros(1, int), np.zeros(1, int)))
    whole = visits(tree, under(tree, trees, np.zeros(1, int), np.zeros(1, int)))
    assert list(kept.items()) == list(whole.items())[:4]


def courses(name: str, seat: int, rows: Ints) -> list[Array]:
    """What the agent remembers and chooses in three turns of these of five games."""
    problem = dmplay.load(name)
    others = [dmplay.agent(problem, one, "random") for one in range(len(problem.agents))]
    search = dmplay.agent(problem, seat, SMALL)
    each: list[Policy] = [search if one == seat else other for one, other in enumerate(others)]
    luck = np.random.default_rng(2).random((4, 5, 200))
    s = problem.start(luck[0, rows, : problem.draws.start])
    memories = [one.begin(problem.first_sight(s, at)) for at, one in enumerate(each)]
    told = list[Array]()
    for turn in range(1, 4):
        u, legal = luck[turn, rows], problem.legal(s)
        joint = np.stack(
            [
                one.choose(memory, None if legal is None else legal[:, at], u[:, at : at + 1])
                for at, (one, memory) in enumerate(zip(each, memories, strict=True))
            ],
            axis=1,
        )
        outcome = problem.step(s, joint, u[:, 9 : 9 + problem.draws.step])
        memories = [
            one.update(memory, problem.percept(at, joint, outcome))
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
    if len(dmplay.load(name).agents) == 1:
        agent["others"] = ""
    whole = recorded(path, name, turns=6, **agent)  # type: ignore[arg-type]
    verified(path)
    parts = [whole.index(f"\n\nturn: {turn}\n") + 2 for turn in (3, 4)]
    path.write_text(whole[: parts[1]])
    game = resumed(Resumption(path))
    while game.unattended():
        pass
    game.finish()
    assert path.read_text() == whole
    other = branched(Branching(path, turn=3, record=tmp_path / "branch.dmt"))
    while other.unattended():
        pass
    other.finish()
    verified(tmp_path / "branch.dmt")


def test_an_over_game_is_not_searched() -> None:
    problem = dmplay.load("hexworld")
    over = np.flatnonzero(problem.terminal(problem.enumerated()))[:1]
    search = dmplay.agent(problem, 0, SMALL)
    assert isinstance(search, Search)
    assert not trees_of(search, search.begin(over))[2].any()  # visits


def test_so_many_games_that_their_trees_fill_the_memory_are_refused() -> None:
    tree = Search(dmplay.load("hexworld"), 0, reuse=True)._tree
    tree.hold(1000)
    with pytest.raises(TooMuch, match="try fewer games at a time"):
        tree.hold(100_000)


def test_reuse_is_refused_where_what_is_legal_is_hidden() -> None:
    Search(Locked(), 0)
    with pytest.raises(BadPolicy, match="reuse needs states that are seen, or all actions legal"):
        Search(Locked(), 0, reuse=True)
