"""Nothing that a seat is shown distinguishes histories that the rules do not let it distinguish."""

import shutil
from collections.abc import Hashable, Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra gymnasium")
pytest.importorskip("pettingzoo", reason="needs the extra pettingzoo")
pytest.importorskip("pyspiel", reason="needs the extra openspiel")

import dmplay
from dmplay.core.problem import (
    WAIT_LABEL,
    build_percept,
    find_wait_action,
    make_initial_observation,
)
from dmplay.core.session import Session, list_active_seats
from dmplay.external.openspiel import OpenSpielEnvironment
from tests.privacy.indistinguishable_pairs import SECRET_PROBLEM_PARAMS, SHARED_TURNS, find_pair
from tests.privacy.information_sets import (
    Node,
    assert_equal_in_equal_moments,
    file_moments,
    iter_leaf_paths,
    library_moments,
    read_tree,
)
from tests.privacy.turn_by_turn import (
    LEARNING_DOORS,
    LINE_DOORS,
    TURN_DOORS,
    Door,
    Play,
    make_session,
)

pytestmark = pytest.mark.extra("gymnasium", "openspiel", "pettingzoo")

FOLDER = Path(__file__).parent
POKER, HORSE = "full_poker.efg", "seltens_horse.efg"
SEEDS = range(60)  # contain every deal
DOORS: dict[str, Door] = TURN_DOORS | LINE_DOORS
every_door = pytest.mark.parametrize("door", DOORS)
every_turn_door = pytest.mark.parametrize("door", TURN_DOORS)


@pytest.fixture(autouse=True)
def files(game_folder: Path) -> Path:
    """A folder to play in with the files of both games."""
    for name in (POKER, HORSE):
        shutil.copy(FOLDER / name, game_folder)
    return game_folder


def make_play(name: str, seed: int, path: tuple[str, ...]) -> Play:
    """Return the play in which the players take the actions of a path in the tree."""
    problem, actions, labels = dmplay.load_problem(name), list(path), list[tuple[str, ...]]()
    session = Session(problem, dmplay.SeededUniforms(seed))
    while not session.over:
        joint = [WAIT_LABEL] * len(problem.agents)
        for seat in list_active_seats(session, range(len(joint))):
            joint[seat] = actions.pop(0)
        session.advance([problem.parse_action(seat, label) for seat, label in enumerate(joint)])
        labels.append(tuple(joint))
    assert not actions
    assert session.total_rewards().tolist() == [*find_node(find_start(session), path).payoffs]
    return Play(name, problem, seed, tuple(labels))


def find_node(node: Node, path: tuple[str, ...]) -> Node:
    """Return the node at the end of a path."""
    for label in path:
        node = node.children[label]
    return node


def find_start(session: Session) -> Node:
    """Return the node after the deal, which OpenSpiel numbers in the state from 1 on."""
    root = read_tree(FOLDER / (POKER if len(session.problem.agents) == 2 else HORSE))
    text = session.problem.format_transcript_state(session.initial_state)
    return root if root.seat is not None else [*root.children.values()][int(text[0]) - 1]


def list_plays(name: str) -> list[tuple[Node, Play]]:
    """Return all plays of a file, with the node in which each begins."""
    problem, start_by_deal = dmplay.load_problem(name), dict[str, tuple[int, Node]]()
    for seed in SEEDS:
        session = Session(problem, dmplay.SeededUniforms(seed))
        deal = problem.format_transcript_state(session.initial_state)
        start_by_deal.setdefault(deal, (seed, find_start(session)))
    return [
        (start, make_play(name, seed, path))
        for seed, start in start_by_deal.values()
        for path in iter_leaf_paths(start)
    ]


def list_random_plays(name: str, seat: int) -> list[tuple[Node, Play]]:
    """Return plays against random agents, in which the seat acts by the bits of the seed."""
    problem, plays = dmplay.load_problem(name), list[tuple[Node, Play]]()
    for seed in SEEDS:
        policies = [
            None if item == seat else dmplay.load_agent(problem, item, "random")
            for item in range(len(problem.agents))
        ]
        session, bits = Session(problem, dmplay.SeededUniforms(seed), policies), seed
        while not session.over:
            joint: list[float | None] = [None] * len(policies)
            if not session.is_inactive(seat):
                legal = session.legal_actions_mask(seat)
                assert legal is not None
                joint[seat], bits = int(legal.argmax()) + (bits & 1), bits >> 1
            session.advance(joint)
        plays.append((find_start(session), Play(name, problem, seed, list_labels(session))))
    return plays


def list_labels(session: Session) -> tuple[tuple[str, ...], ...]:
    """Return the actions of a game by turn and seat."""
    return tuple(
        tuple(session.problem.format_action(seat, action) for seat, action in enumerate(actions))
        for actions in (turn.actions for turn in session.turns)
    )


def iter_file_records(name: str, door: str) -> Iterator[tuple[list[Hashable], int, object]]:
    """Yield what a door shows to each seat: in every play of a file, or in random plays."""
    for seat in range(len(dmplay.load_problem(name).agents)):
        plays = list_random_plays(name, seat) if door in LINE_DOORS else list_plays(name)
        for start, play in plays:
            for turn, outputs in DOORS[door](play, seat).items():
                moments = file_moments(start, play, seat, turn)
                yield [(seat, moment) for moment in moments], turn, outputs


def test_the_plays_of_the_file_are_all_deals_and_bets() -> None:
    assert len(list_plays(POKER)) == 6 * 5
    assert len(list_plays(HORSE)) == 5


@every_door
def test_no_door_distinguishes_nodes_of_an_information_set(door: str) -> None:
    assert_equal_in_equal_moments([*iter_file_records(POKER, door)], 30)


@every_door
def test_no_door_reveals_by_the_number_of_turns_which_node_is_reached(door: str) -> None:
    assert_equal_in_equal_moments([*iter_file_records(HORSE, door)], 4)


def test_a_waiting_player_observes_nothing() -> None:
    play = make_play(POKER, 1, ("pass", "bet", "fold"))
    session = make_session(play)
    observations = [[str(session.observation_after(seat, 0)) for seat in range(2)]]
    for labels in play.labels:
        actions = enumerate(labels)
        session.advance([play.problem.parse_action(seat, label) for seat, label in actions])
        turn = len(session.turns)
        observations.append([str(session.observation_after(seat, turn)) for seat in range(2)])
    assert observations == [
        ["0-0-3-", "nothing"],
        ["nothing", "1-1-3-"],
        ["0-0-4-", "nothing"],
        ["nothing", "nothing"],
    ]


def test_everybody_waits_until_the_third_player_cannot_count_its_node_out() -> None:
    assert make_play(HORSE, 1, ("down", "left")).labels == (
        ("down", "wait", "wait"),
        ("wait", "wait", "wait"),
        ("wait", "wait", "left"),
    )
    assert make_play(HORSE, 1, ("across", "down", "left")).labels == (
        ("across", "wait", "wait"),
        ("wait", "down", "wait"),
        ("wait", "wait", "left"),
    )


@every_turn_door
@pytest.mark.parametrize(("name", "game_count"), [("kuhn_poker", 60), ("leduc_poker", 150)])
def test_no_door_distinguishes_what_poker_hides(name: str, game_count: int, door: str) -> None:
    problem = dmplay.load_problem(f"openspiel:{name}")
    agents = [dmplay.load_agent(problem, seat, "random") for seat in range(2)]
    records = list[tuple[list[Hashable], int, object]]()
    for seed in range(game_count):
        session = Session(problem, dmplay.SeededUniforms(seed), agents)
        while not session.over:
            session.advance()
        play = Play(f"openspiel:{name}", problem, seed, list_labels(session))
        for seat in range(2):
            for turn, outputs in TURN_DOORS[door](play, seat).items():
                moments = library_moments(session, play, seat, turn)
                records.append(([(seat, moment) for moment in moments], turn, outputs))
    assert_equal_in_equal_moments(records, 20)


@pytest.mark.parametrize("door", [*TURN_DOORS, *LEARNING_DOORS])
@pytest.mark.parametrize("name", SECRET_PROBLEM_PARAMS)
def test_no_door_distinguishes_what_a_problem_hides(name: str, door: str) -> None:
    for pair in (find_pair(name, 0), find_pair(name, len(find_pair(name, 0).problem.agents) - 1)):
        outputs = []
        for side in pair.sides:
            actions = [*side.actions[:SHARED_TURNS], pair.first.actions[-1]]
            labels = tuple(
                tuple(pair.problem.format_action(seat, action) for seat, action in enumerate(joint))
                for joint in actions
            )
            watch = (TURN_DOORS | LEARNING_DOORS)[door]
            outputs.append(watch(Play(name, pair.problem, side.seed, labels), pair.seat_index))
        assert outputs[0] == outputs[1]
        assert [*outputs[0]] == [0, 1, 2]


def test_an_observation_of_the_acting_player_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    def observe(self: OpenSpielEnvironment, player: int) -> str:
        return "" if self._state.is_terminal() else self._state.information_state_string(player)

    monkeypatch.setattr(OpenSpielEnvironment, "_observe", observe)
    shutil.copy(FOLDER / POKER, "leaky.efg")  # a game that was not played before
    with pytest.raises(AssertionError, match="can be told apart"):
        assert_equal_in_equal_moments([*iter_file_records("leaky.efg", "view")], 30)


def test_a_turn_that_is_not_delayed_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OpenSpielEnvironment, "_is_delayed", lambda self: False)
    shutil.copy(FOLDER / HORSE, "hasty.efg")  # a game that was not played before
    with pytest.raises(AssertionError, match="can be told apart"):
        assert_equal_in_equal_moments([*iter_file_records("hasty.efg", "view")], 4)


def test_the_length_of_another_seats_text_is_not_shown() -> None:
    problem = dmplay.load_problem("openspiel:kuhn_poker")
    state = problem.sample_initial_states(np.array([[0.5]]))
    outcome = dmplay.Outcome(state, np.zeros((1, 2)), np.array([["2", "a long text"]]))
    assert build_percept(problem, 0, np.array([[0, 2]]), outcome).observation.dtype == "<U1"


def test_a_waiting_player_cannot_tell_whether_the_other_has_an_action_without_a_fixed_name(
    files: Path,
) -> None:
    """OpenSpiel names actions in states; most of forty names are not met before the game."""
    deals = " ".join(f'"{n}" 1/40' for n in range(40))
    nodes = [
        f'p "" 1 1 "" {{ "call" }} 0\np "" 2 {n + 1} "" {{ "take {n}" "leave" }} 0\n'
        't "" 1 "" { 1 1 }\nt "" 2 "" { 0 0 }'
        for n in range(40)
    ]
    header = 'EFG 2 R "forty actions" { "Ann" "Bob" }\n'
    file = files / "forty.efg"
    file.write_text("\n".join([f'{header}c "" 1 "" {{ {deals} }} 0', *nodes]), encoding="utf-8")
    problem, outputs, names = dmplay.load_problem(str(file)), set[str](), set[str]()
    for seed in SEEDS:
        game = Session(problem, dmplay.SeededUniforms(seed))
        game.advance([problem.parse_action(0, "call"), find_wait_action(problem, 1)])
        view = game.view(0)
        outputs.add(repr((view.state_action_labels, [*view.past_action_labels], view.observation)))
        names.add(game.view(1).action_labels.describe_actions(game.legal_actions_mask(1)))
    assert len(names) > 10
    assert len(outputs) == 1


@pytest.mark.parametrize("wrapper", ["cached_tree", "misere"])
def test_a_game_that_is_made_of_a_file_shows_a_waiting_player_nothing(wrapper: str) -> None:
    problem = dmplay.load_problem(f"openspiel:{wrapper}(game=efg_game(filename={POKER}))")
    start = problem.sample_initial_states((np.arange(12)[:, None] + 0.5) / 12)
    assert {*make_initial_observation(problem, start, 1).tolist()} == {"nothing"}
    assert len({*make_initial_observation(problem, start, 0).tolist()}) == 3
