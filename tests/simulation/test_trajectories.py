"""The turns that a rollout keeps are those of sessions, to the last bit."""

from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, BudgetExceeded, UnknownName
from dmplay.game.turn_facts import flatten_turn_facts
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_variants
from dmplay.simulation import rollouts
from dmplay.transcript.format import collect_turn_facts

EPISODES, TURNS = 9, 5
HEXWORLD = dmplay.load_problem("hexworld")


@pytest.mark.parametrize("name", problem_names())
def test_trajectories_are_those_of_sessions(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rollouts, "MAX_BLOCK_EPISODES", 4)  # three blocks of different lengths
    monkeypatch.setattr(rollouts, "MIN_BLOCK_EPISODES", 4)
    for problem in load_variants(name).values():
        played = dmplay.rollout(
            problem, "random", episodes=EPISODES, turns=TURNS, seed=3, keep=["trajectories"]
        )
        rows = []
        for episode in range(EPISODES):
            policies = [dmplay.load_agent(problem, i, "random") for i in range(len(problem.agents))]
            session = Session(problem, SeededUniforms(3, episode), policies, turns=TURNS)
            states, facts = [session.state], [collect_turn_facts(session)]
            while not session.over:
                states.append(session.advance().state)
                facts.append(collect_turn_facts(session))
            rows += [{"episode": episode} | flatten_turn_facts(fact) for fact in facts]
            count = len(session.turns)
            assert played.turn_counts[episode] == count
            assert_same_bits(played.states[episode], np.stack(states))
            for field in ("actions", "observations", "rewards"):
                if count:
                    turns = np.stack([getattr(turn, field) for turn in session.turns])
                    assert_same_bits(getattr(played, field)[episode], turns)
        without_draws = [{k: v for k, v in row.items() if k != "draws"} for row in rows]
        assert played.list_rows() == without_draws


def assert_same_bits(padded: np.ndarray, turns: np.ndarray) -> None:
    """Check that an array begins with these turns, and has no other ones."""
    recorded, padding = padded[: len(turns)], padded[len(turns) :]
    assert recorded.dtype.kind == turns.dtype.kind
    if turns.dtype.kind == "O":
        assert recorded.tolist() == turns.tolist()
        assert not any(item is not None for item in padding.flat)
    else:
        assert recorded.tobytes() == turns.astype(recorded.dtype).tobytes()
        assert (
            np.isnan(padding).all()
            if padding.dtype.kind == "f" and padding.any()
            else not {*padding.flat} - {-1, 0, ""}
        )


def test_workers_change_nothing() -> None:
    options: dict[str, Any] = {
        "episodes": 40,
        "turns": 8,
        "seed": 5,
        "keep": ["trajectories", "returns"],
    }
    first, second = (dmplay.rollout(HEXWORLD, "random", workers=n, **options) for n in (1, 2))
    assert all(map(np.array_equal, first, second))
    weights = HEXWORLD.discount ** np.arange(first.rewards.shape[1])
    np.testing.assert_allclose((first.rewards * weights[:, None]).sum(axis=1), first.returns)


def test_only_the_arrays_that_are_named_are_kept() -> None:
    played = dmplay.rollout(HEXWORLD, "random", episodes=3, turns=4, seed=5, keep=["actions"])
    assert {name for name in played._fields if len(getattr(played, name))} == {"actions"}
    assert played.actions.shape == (3, 4, 1)
    with pytest.raises(BadParameter, match=r'expected a rollout with keep=\["trajectories"\]'):
        played.list_rows()
    with pytest.raises(UnknownName, match="unknown array 'action'; did you mean actions"):
        dmplay.rollout(HEXWORLD, "random", episodes=3, keep=["action"])
    assert dmplay.rollout(HEXWORLD, "random", episodes=0, keep=["trajectories"]).list_rows() == []


def test_too_much_memory_is_refused_with_a_remedy() -> None:
    problem = dmplay.load_problem("collision-avoidance")
    message = (
        r"trajectories: .* MB, more than the limit of 512 MB; keep fewer arrays, or play fewer"
    )
    with pytest.raises(BudgetExceeded, match=message):
        dmplay.rollout(problem, "random", episodes=1_000_000, keep=["states"])


@pytest.mark.extra("pandas")
def test_a_frame_has_a_row_per_turn_or_per_game() -> None:
    problem = dmplay.load_problem("crying-baby")
    options: dict[str, Any] = {"episodes": 3, "turns": 4, "seed": 7, "first_episode": 5}
    games = dmplay.rollout(problem, "optimal", **options).to_frame()
    assert [*games] == ["episode", "return agent", "total reward agent", "turns", "terminated"]
    turns = dmplay.rollout(problem, "optimal", keep=["trajectories"], **options).to_frame()
    assert [*turns["episode"].unique()] == [*games["episode"]] == [5, 6, 7]
    totals = turns.groupby("episode")["rewards agent"].sum()
    assert totals.tolist() == games["total reward agent"].tolist()
