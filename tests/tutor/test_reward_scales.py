"""Tests of the tutor on files and on the same files with all rewards multiplied."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.position import find_exact_agent
from dmplay.game.rules_of_thumb import apply_rule, list_rules
from dmplay.tutor.answers import check_answer
from dmplay.tutor.exercise import ExerciseRun
from dmplay.tutor.game_checks import check_game_conditions
from dmplay.tutor.lesson import GameTask, PositionText, Prediction, QuantityCall
from dmplay.tutor.mistakes import list_mistakes
from dmplay.tutor.positions import PositionInGame, open_position
from dmplay.tutor.puzzles import list_puzzles, make_exercise
from dmplay.tutor.quantity import compute_truth
from tests.support.programs import run_dmplay

FILES: dict[str, Callable[[float], str]] = {
    "tiger.pomdp": lambda scale: (
        "discount: 0.95\nvalues: reward\nstates: left right\nactions: listen open-left open-right\n"
        "observations: hear-left hear-right\nstart: uniform\n"
        "T: listen identity\nT: open-left uniform\nT: open-right uniform\n"
        "O: listen\n0.85 0.15\n0.15 0.85\nO: open-left uniform\nO: open-right uniform\n"
        f"R: listen : * : * : * {-1 * scale!r}\n"
        f"R: open-left : left : * : * {-100 * scale!r}\n"
        f"R: open-left : right : * : * {10 * scale!r}\n"
        f"R: open-right : left : * : * {10 * scale!r}\n"
        f"R: open-right : right : * : * {-100 * scale!r}\n"
    ),
    "ladder.mdp": lambda scale: (
        "discount: 0.9\nvalues: reward\nstates: ground top fallen\nactions: stay jump rest\n"
        "start: ground\nT: stay identity\nT: rest identity\n"
        "T: jump : top : top 1\nT: jump : fallen : fallen 1\n"
        "T: jump : ground : top 0.6\nT: jump : ground : fallen 0.4\n"
        f"R: * : ground : * : * {3 * scale!r}\nR: * : top : * : * {4 * scale!r}\n"
        f"R: rest : ground : * : * {2.5 * scale!r}\n"
    ),
    "chicken.nfg": lambda scale: (
        'NFG 1 R "chicken" { "row" "column" } { { "swerve" "dare" } { "swerve" "dare" } } ""\n'
        + " ".join(repr(payoff * scale) for payoff in (3, 3, 5, 1, 1, 5, 0, 0))
        + "\n"
    ),
    "prison.nfg": lambda scale: (
        'NFG 1 R "prison" { "row" "column" } { { "stay" "tell" } { "stay" "tell" } } ""\n'
        + " ".join(repr(payoff * scale) for payoff in (3, 3, 5, 0, 0, 5, 1, 1))
        + "\n"
    ),
}
SCALES = [1e-8, 1e-12, 1e8]


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress and the saved games of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def write_pair(folder: Path, name: str, scale: float) -> tuple[str, str]:
    """Write a file, and the same one with all rewards multiplied; return both paths."""
    paths = folder / name, folder / "scaled" / name
    paths[1].parent.mkdir(exist_ok=True)
    for path, factor in zip(paths, (1.0, scale), strict=True):
        path.write_text(FILES[name](factor))
    return str(paths[0]), str(paths[1])


def open_pair(folder: Path, name: str, scale: float, **facts: object) -> list[PositionInGame]:
    """Return the same position of a file and of its scaled copy."""
    return [
        open_position(PositionText(path, **facts), Path(), trusted=True)  # type: ignore[arg-type]
        for path in write_pair(folder, name, scale)
    ]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", FILES)
def test_the_puzzles_of_a_file_are_those_of_its_scaled_copy(
    tmp_path: Path, name: str, scale: float
) -> None:
    puzzles, scaled_puzzles = (
        [make_exercise(puzzle) for puzzle in list_puzzles(path)]
        for path in write_pair(tmp_path, name, scale)
    )
    facts, scaled_facts = (
        [
            (
                item.question.best_actions,
                item.question.right_actions,
                item.question.obvious_action,
                len(item.question.game.session.turns),
                item.learned[0].partition(" Here")[0],
            )
            for item in exercises
        ]
        for exercises in (puzzles, scaled_puzzles)
    )
    assert facts
    assert sorted(map(str, facts)) == sorted(map(str, scaled_facts))
    for exercise in puzzles + scaled_puzzles:
        for label in exercise.question.legal_labels:
            reply = ExerciseRun(exercise).check_answer(label)
            assert reply.finishes_step == (label in exercise.question.right_actions)
            if not reply.finishes_step:
                assert re.search(r", (?!0 )\S+ less than the best action", reply.lines[0])


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", FILES)
def test_rules_of_thumb_choose_the_same_on_a_scaled_copy(
    tmp_path: Path, name: str, scale: float
) -> None:
    choices: list[list[int | None]] = []
    seats = {"column": "tit-for-tat"} if name.endswith(".nfg") else {}
    for game in open_pair(tmp_path, name, scale, seed=3, turns=6, seats=seats):
        hint_agent = find_exact_agent(game.session, game.question)
        assert hint_agent is not None
        chosen = []
        for number in range(6):
            position = game.ask(hint_agent)
            chosen += [apply_rule(position, rule) for rule in list_rules(game.problem)]
            if not game.session.over:
                actions: list[float | None] = [None] * len(game.problem.agents)
                actions[0] = number % 2
                game.session.advance(actions)
        choices.append(chosen)
    assert choices[0] == choices[1]
    assert any(choice is not None for choice in choices[0])


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    ("name", "quantity", "arguments"),
    [
        ("tiger.pomdp", "best-action-boundary",
         {"below": "open-right", "above": "listen", "state": "right", "turns_left": 2}),
        ("tiger.pomdp", "fewest-turns", {"action": "listen", "belief": "left 0.96 right 0.04"}),
        ("tiger.pomdp", "alpha-vector-count", {"turns_left": 3}),
        ("ladder.mdp", "last-policy-change", {}),
        ("ladder.mdp", "worst-outcome", {"action": "jump"}),
        ("ladder.mdp", "forward-search-action", {"depth": 2}),
        ("ladder.mdp", "search-error-share", {"state": "ground", "simulations": 3}),
        ("ladder.mdp", "best-action", {"state": "ground"}),
        ("ladder.mdp", "order-of-values", {"states": ["ground", "top", "fallen"]}),
        ("chicken.nfg", "best-reply", {"opponent": "swerve 0.5 dare 0.5"}),
        ("chicken.nfg", "level-k-action", {"level": 3}),
    ],
)  # fmt: skip
def test_a_quantity_that_is_no_reward_is_the_same_in_a_scaled_copy(
    tmp_path: Path, name: str, quantity: str, arguments: dict[str, object], scale: float
) -> None:
    first, second = (
        compute_truth(position, QuantityCall(quantity, arguments)).value
        for position in open_pair(tmp_path, name, scale)
    )
    assert second == (pytest.approx(first) if isinstance(first, float) else first)


@pytest.mark.parametrize("quantity", ["equilibrium-payoff", "equilibrium-probability"])
def test_an_equilibrium_that_is_not_the_only_one_is_no_answer(
    tmp_path: Path, quantity: str
) -> None:
    arguments = {"action": "dare"} if quantity == "equilibrium-probability" else {}
    for position in open_pair(tmp_path, "chicken.nfg", 1e-8):
        with pytest.raises(BadParameter, match="the game has several equilibria"):
            compute_truth(position, QuantityCall(quantity, arguments))


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    ("name", "quantity", "arguments"),
    [
        ("tiger.pomdp", "belief-loss",
         {"action": "open-left", "belief": "left 0.5 right 0.5", "turns_left": 2}),
        ("ladder.mdp", "sweep-value", {"state": "ground", "sweep": 3}),
        ("prison.nfg", "equilibrium-payoff", {}),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("factor", "is_right"), [(1.0, True), (1.001, False), (0.0, False)])
def test_an_answer_is_right_by_its_share_of_the_value(  # noqa: PLR0913, PLR0917
    tmp_path: Path,
    name: str,
    quantity: str,
    arguments: dict[str, object],
    scale: float,
    factor: float,
    *,
    is_right: bool,
) -> None:
    for position in open_pair(tmp_path, name, scale):
        prediction = Prediction(QuantityCall(quantity, arguments))
        truth = compute_truth(position, prediction.quantity)
        assert isinstance(truth.value, float)
        answer = check_answer(position, prediction, truth, repr(truth.value * factor))
        assert answer.is_right == is_right


@pytest.mark.parametrize("scale", SCALES)
def test_the_mistakes_of_a_game_are_those_of_the_same_game_of_a_scaled_copy(
    tmp_path: Path, scale: float
) -> None:
    titles = []
    for number, path in enumerate(write_pair(tmp_path, "ladder.mdp", scale)):
        game = tmp_path / f"{number}.dmt"
        lines = "rest\njump\nstay\nrest\n"
        run_dmplay(
            tmp_path, path, "--turns", "4", "--seed", "2", "-o", str(game), "--trust", stdin=lines
        )
        titles.append(
            [item.title.partition(" of")[0] for item in list_mistakes(game, trusted=True)]
        )
    assert titles[0] == titles[1]
    assert titles[0]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    ("limits", "is_right"),
    [
        ({"return_at_least": 8.0}, True),
        ({"return_at_least": 9.0}, False),
        ({"regret_at_most": 1.0}, False),
        ({"regret_at_most": 100.0}, True),
    ],
)
def test_a_task_with_scaled_limits_has_the_same_result(
    tmp_path: Path, limits: dict[str, float], scale: float, *, is_right: bool
) -> None:
    positions = open_pair(tmp_path, "ladder.mdp", scale, turns=4)
    for position, factor in zip(positions, (1.0, scale), strict=True):
        for _ in range(4):
            position.session.advance([2])
        scaled_limits = {name: limit * factor for name, limit in limits.items()}
        check = check_game_conditions(position, replace(GameTask(""), **scaled_limits))  # type: ignore[arg-type]
        assert check.is_right == is_right, check.reason
