"""Tests of agent names: which agents can play a seat, which suit a game, and how they are named."""

from itertools import product
from pathlib import Path

import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.agents.best_response_in_team import BestResponseInTeam
from dmplay.agents.best_response_plan import BestResponsePlan
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, BadPolicy, DmplayError, UnknownName
from dmplay.game.seats import load_verifiable_policies
from dmplay.registry.agents import (
    MAX_LISTED_PROBLEMS,
    describe_agents,
    find_hint_provider,
    load_roster,
    set_horizon_in_name,
)
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_variants

PLAIN_AGENT_SOURCE = """
import numpy as np

class Plain:
    uniform_count = 0

    def __init__(self, problem, seat):
        pass

    def initial_memory(self, observation):
        return (np.zeros(len(observation)),)

    def update_memory(self, memory, percept):
        return memory

    def choose(self, memory, legal, u):
        return np.zeros(len(u), int)

    def action_values(self, memory):
        return None
"""


def list_seats(name: str) -> list[tuple[Problem, int]]:
    """Return every seat of a problem and its variants."""
    problems = load_variants(name).values()
    return [(problem, seat) for problem in problems for seat in range(len(problem.agents))]


@pytest.mark.parametrize("name", problem_names())
def test_every_agent_with_a_role_is_in_the_roster(name: str) -> None:
    for problem, seat in list_seats(name):
        seat_roster = load_roster(problem, seat)
        parts = {
            seat_roster.hint_provider,
            seat_roster.default_partner,
            seat_roster.batch_agent,
        } - {None}
        assert parts <= {*seat_roster.agents}
        assert [*seat_roster.agents][-2:] == ["random", "search"]


@pytest.mark.parametrize("name", problem_names())
def test_a_hint_provider_is_the_agent_of_its_name(name: str) -> None:
    for problem, seat in list_seats(name):
        for turns, rival in product((None, 1, 7, 1000), ("random", "human", "chase", "sing")):
            provider = find_hint_provider(
                problem, AdviceQuestion(seat, turns, (rival,) * len(problem.agents))
            )
            best_responses = BestResponsePlan, BestResponseInTeam
            if provider and type(provider.policy) not in best_responses:
                assert dmplay.load_agent(problem, seat, provider.name) == provider.policy


@pytest.mark.parametrize(
    ("name", "turns", "seats", "expected"),
    [
        ("catch", None, (), "optimal"),
        ("catch", 3, (), "optimal:horizon=3"),
        ("catch", 11, (), "optimal:horizon=11"),
        ("catch", 21, (), "optimal"),
        ("machine-replacement", 100, (), "optimal:horizon=100"),
        ("machine-replacement", 101, (), "optimal"),
        ("predator-prey", 5, ("human", "flee"), "best-response:horizon=5"),
        ("predator-prey", 5, ("human", "random"), "best-response:horizon=5,to=random"),
        ("predator-prey", 5, ("human", "chase"), "best-response:horizon=5,to=chase"),
        ("predator-prey", None, ("human", "human"), "best-response"),
        ("predator-prey", None, ("human", "random:x=1"), "best-response"),
        ("multicaregiver-crying-baby", 5, ("human", "feed-when-crying"), "best-response:horizon=5"),
        ("multicaregiver-crying-baby", 5, ("human", "random"), "best-response:to=random,horizon=5"),
        ("multicaregiver-crying-baby", 5, ("human", "search"), "best-response:to=random,horizon=5"),
        ("multicaregiver-crying-baby", 5, ("human", "joint-plan"),
         "best-response:to=joint-plan,horizon=5"),
        ("hexworld", 3, ("human",), "optimal:horizon=3"),
        ("hexworld", 10_001, ("human",), "optimal"),
        ("crying-baby", 20, ("human",), "optimal:horizon=20"),
    ],
)  # fmt: skip
def test_the_name_of_a_hint_provider_contains_its_parameters_for_this_game(
    name: str, turns: int | None, seats: tuple[str, ...], expected: str
) -> None:
    provider = find_hint_provider(dmplay.load_problem(name), AdviceQuestion(0, turns, tuple(seats)))
    assert provider is not None
    assert provider.name == expected


def test_a_plan_is_limited_to_the_end_of_the_game_only_for_hints() -> None:
    endless = dmplay.load_problem("crying-baby", discount=1.0)
    names = [
        provider.name
        for turns in (3, 10, 30)
        if (provider := find_hint_provider(endless, AdviceQuestion(0, turns)))
    ]
    assert names == [f"optimal:horizon={turns}" for turns in (3, 10, 30)]
    assert set_horizon_in_name(endless, 0, "plan", 3) == "plan"


@pytest.mark.parametrize(
    ("agent", "turns", "expected"),
    [
        ("optimal", 3, "optimal:horizon=3"),
        ("optimal", 10, "optimal"),
        ("optimal", 11, "optimal:horizon=11"),
        ("optimal", 21, "optimal"),
        ("optimal:horizon=7", 3, "optimal:horizon=7"),
        ("search", 3, "search:horizon=3"),
        ("search:simulations=60", 3, "search:simulations=60,horizon=3"),
        ("search:depth=5", 3, "search:depth=5,horizon=3"),
        ("greedy", 3, "greedy"),
        ("human", 3, "human"),
        ("./bots.py:Plain", 3, "./bots.py:Plain"),
    ],
)
def test_a_planning_agent_gets_the_turn_limit_unless_its_name_sets_a_horizon(
    agent: str, turns: int, expected: str
) -> None:
    assert set_horizon_in_name(dmplay.load_problem("catch"), 0, agent, turns) == expected


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("optimla", "unknown agent 'optimla'; did you mean optimal?"),
        ("random:speed=3", "agent random: unknown parameter 'speed'"),
        ("optimal:x", "agent optimal: unknown parameter 'x'"),
    ],
)
def test_a_wrong_agent_is_one_clear_line(name: str, message: str) -> None:
    with pytest.raises(UnknownName) as caught:
        dmplay.load_agent(dmplay.load_problem("hexworld"), 0, name)
    assert str(caught.value).startswith(message)


def test_an_agent_for_other_problems_is_refused() -> None:
    hexworld = dmplay.load_problem("hexworld")
    others = "nearest-exit, random, search, script, replay, bot, learned:FILE, policy:FILE"
    planned_names = [
        name for name in problem_names() if "plan" in load_roster(dmplay.load_problem(name)).agents
    ]
    planned = ", ".join(planned_names[:MAX_LISTED_PROBLEMS])
    planned += " and others" * (len(planned_names) > MAX_LISTED_PROBLEMS)
    for name in ("plan", "plan:horizon=3"):
        with pytest.raises(BadPolicy) as caught:
            dmplay.load_agent(hexworld, 0, name)
        message = f"agent plan is for {planned} (POMDP, not MDP); expected one of human, optimal"
        assert str(caught.value) == f"{message}, {others}"
    with pytest.raises(BadPolicy, match=r"optimal is for .* and others; expected one of human"):
        dmplay.load_agent(dmplay.load_problem("2048"), 0, "optimal")


def test_an_agent_for_other_problems_is_refused_even_if_a_module_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "qmdp.py").write_text("from fractions import Fraction as Strategy\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(BadPolicy, match=r"^agent qmdp is for .*, not MDP.; expected one of human"):
        dmplay.load_agent(dmplay.load_problem("hexworld"), 0, "qmdp:Strategy")


@pytest.mark.parametrize("name", ["os:path", "os:getcwd", "os:sep", "fractions:Fraction"])
def test_an_object_that_constructs_no_policy_is_refused(name: str) -> None:
    reason = "cannot construct a policy from|not a policy, because it lacks"
    with pytest.raises(BadPolicy, match=f"^{name}: {reason}"):
        dmplay.load_agent(dmplay.load_problem("hexworld"), 0, name)


@pytest.mark.parametrize("seat", [1, -1])
def test_an_agent_needs_an_existing_seat(seat: int) -> None:
    with pytest.raises(BadParameter, match=f"^seat: got {seat!r}, expected 0 to 0$"):
        dmplay.load_agent(dmplay.load_problem("hexworld"), seat, "optimal")


def test_an_agent_in_a_file_plays(tmp_path: Path) -> None:
    (tmp_path / "bots.py").write_text(
        "from dmplay.agents.random_agent import Random as Bot\nclass Nothing:\n"
        "    def __init__(self, problem, seat): pass\n"
    )
    problem = dmplay.load_problem("hexworld")
    bot = dmplay.load_agent(problem, 0, f"{tmp_path}/bots.py:Bot")
    assert dmplay.rollout(problem, [bot], episodes=3).terminated.all()
    with pytest.raises(
        DmplayError,
        match="not a policy, because it lacks uniform_count, initial_memory, update_memory, choose",
    ):
        dmplay.load_agent(problem, 0, f"{tmp_path}/bots.py:Nothing")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", r": expected the name of an object in it, such as \S+/plain.py:Plain$"),
        (":Plan", ": unknown attribute 'Plan'; did you mean Plain[?]$"),
        (":A", ": unknown attribute 'A'; expected one of Plain$"),  # without imports
    ],
)
def test_the_error_names_the_agents_that_a_file_defines(
    name: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "plain.py").write_text(PLAIN_AGENT_SOURCE)
    with pytest.raises(DmplayError, match=message):
        dmplay.load_agent(dmplay.load_problem("hexworld"), 0, f"{tmp_path}/plain.py{name}")


@pytest.mark.parametrize("draws", [-1, "x", None, 0.5])
def test_the_uniform_count_of_an_agent_must_be_a_whole_number(
    draws: object, tmp_path: Path
) -> None:
    (tmp_path / "bots.py").write_text(
        "from dmplay.agents.random_agent import Random\nclass "
        f"Bot(Random):\n    uniform_count = {draws!r}\n"
    )
    with pytest.raises(
        BadPolicy, match=f"Bot: uniform_count: got {draws!r}, expected a whole number, 0 or"
    ):
        dmplay.load_agent(dmplay.load_problem("hexworld"), 0, f"{tmp_path}/bots.py:Bot")


def test_a_minimal_agent_class_plays_and_can_be_verified(tmp_path: Path) -> None:
    (tmp_path / "bots.py").write_text(PLAIN_AGENT_SOURCE)
    problem, name = dmplay.load_problem("hexworld"), f"{tmp_path}/bots.py:Plain"
    assert set_horizon_in_name(problem, 0, name, 3) == name
    result = dmplay.rollout(
        problem, [dmplay.load_agent(problem, 0, name)], episodes=2, turn_limit=3
    )
    assert result.turn_counts.tolist() == [3, 3]
    assert load_verifiable_policies(problem, {"agent": name}, trusted=True) != [None]


def test_an_agent_with_a_time_limit_cannot_be_verified() -> None:
    problem = dmplay.load_problem("2048")
    for limit, verifiable in (("", True), (":milliseconds=5", False)):
        seats = {"agent": f"expectimax{limit}"}
        assert (load_verifiable_policies(problem, seats, trusted=False) != [None]) is verifiable


def test_the_parameters_of_an_agent_are_those_of_a_seat_that_has_it(tmp_path: Path) -> None:
    (tmp_path / "duel.py").write_text(
        "import dmplay\nfrom dmplay.problems.prisoners_dilemma.rules import *\n"
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\nclass Steady(dmplay.ConstantPolicy):\n    steps: int = 3\n"
        "class Duel(PrisonersDilemma):\n    pass\n"
        "def AGENTS(problem, seat):\n    return {'steady': Steady} if seat else {}\n"
    )
    problem = dmplay.load_problem(f"{tmp_path}/duel.py:Duel")
    names = ["steady:steps=5", "search", "nobody"]
    described = describe_agents(problem, names)
    assert described["steady:steps=5"] == {"steps": 5}
    assert [*described] == names[:2]
