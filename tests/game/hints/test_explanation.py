"""Tests of `why`: sentences on a hint whose numbers sum to the value that the hint shows."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import Labels, Outcome, Tables, Tabular
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array
from dmplay.core.chance import Categorical, Chance
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.session import Session, Turn
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, IllegalAction
from dmplay.game.action_breakdown import ActionBreakdown
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.hints.explanation import MAX_SENTENCE_WORDS, explain_action
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.launch_requests import GameRequest
from dmplay.registry import agents
from dmplay.ui.shell.commands import run_line
from tests.support.literature_pomdps import make_four_by_three, make_tiger
from tests.support.problem_cases import CASE_NAMES, load_small_problem
from tests.support.programs import run_dmplay
from tests.support.random_problems import RandomGame, RandomProblem, RandomRivalGame
from tests.support.screens import make_game, make_session_game, play_keys
from tests.support.soccer import Soccer
from tests.support.turn_based_games import Nim
from tests.support.user_problems import Heap, Key, Vault

TURN_LIMIT = 4
SAMPLE_COUNT = 5  # uniforms with which each position is played on
MAX_REPLAYED_ACTIONS = 3  # of each position
USER_PROBLEMS: dict[str, Callable[[], Problem]] = {
    "key": Key,
    "heap": Heap,
    "vault": Vault,
    "tiger": make_tiger,
    "four by three": make_four_by_three,
    "random problem": RandomProblem,
    "random problem without end": lambda: RandomProblem(ends=False, seed=1),
    "random problem of 3 turns": lambda: RandomProblem(turns=3, seed=2),
    "random game": RandomGame,
    "random rival game": RandomRivalGame,
    "soccer": Soccer,
    "nim": Nim,
}
FEED = 0  # of the crying baby
pytestmark = pytest.mark.usefixtures("coarse")


def create_game(name: str, problem: Problem, turn_limit: int | None = TURN_LIMIT) -> Game:
    """Create a game of one person in the first seat against the default partners."""
    names = ["human"] + [
        agents.load_roster(problem, seat).default_partner for seat in range(1, len(problem.agents))
    ]
    policies = [None] + [
        dmplay.load_agent(problem, seat, names[seat]) for seat in range(1, len(names))
    ]
    session = Session(problem, SeededUniforms(11), policies, turn_limit=turn_limit)
    return make_session_game(name, session, names)


def load_any_problem(name: str) -> Problem:
    return USER_PROBLEMS[name]() if name in USER_PROBLEMS else load_small_problem(name)


def list_legal_actions(session: Session) -> list[int]:
    legal = session.legal_actions_mask(0)
    return list(range(len(session.action_labels(0)))) if legal is None else [*np.flatnonzero(legal)]


def format_outcome(game: Game, turn: Turn) -> str:
    """Return the outcome of a turn as `why` names it."""
    problem = game.problem
    if problem.partially_observable:
        return problem.observations[0].format_observation(turn.observations[0])
    if problem.state_count == 1:
        return problem.format_action(1, turn.actions[1])
    text = problem.describe_state(turn.state)
    return f"the end ({text})" if problem.terminal(turn.state[None])[0] else text


def compute_value_of_playing_on(game: Game, session: Session) -> float:
    """Return the best value after a turn, from a hint provider that follows the turns anew."""
    if session.over:
        return 0.0
    provider = HintProvider(session, game.advice_question(0))
    provider.create_hint()
    assert provider.current_hint is not None
    values = provider.current_hint.values
    assert values is not None
    return float(np.nanmax(values.q))


def assert_outcomes_match_the_session(game: Game, parts: ActionBreakdown) -> None:
    """Play the action with many uniforms; each turn must lead to an outcome with its value."""
    by_text = {outcome.label: outcome for outcome in parts.outcomes}
    assert sum(outcome.probability for outcome in parts.outcomes) == pytest.approx(1.0)
    for seed in range(SAMPLE_COUNT):
        policies = [seated.policy if seated else None for seated in game.session.seated_policies]
        session = game.session.copy_at_start(policies)
        session.append_turns(game.session.turns)
        generator = np.random.default_rng(seed)
        uniforms = generator.random(game.problem.uniform_counts.step)
        others = [None] * (len(game.problem.agents) - 1)
        turn = session.advance([parts.action, *others], uniforms)
        outcome = by_text[format_outcome(game, turn)]
        if not session.is_inactive(0):
            value = compute_value_of_playing_on(game, session)
            assert outcome.value_after == pytest.approx(value, abs=1e-6)
        if game.problem.rewards_observable and len(game.problem.agents) == 1:
            assert outcome.reward == pytest.approx(turn.rewards[0])


@pytest.mark.parametrize("name", [*CASE_NAMES, *USER_PROBLEMS])
def test_the_reward_now_and_the_values_after_each_outcome_sum_to_an_exact_value(name: str) -> None:
    game = create_game(name, load_any_problem(name))
    for _ in range(TURN_LIMIT):
        provider = game.hint_provider
        provider.create_hint()
        hint = provider.current_hint
        assert hint is not None
        assert hint.action is not None
        for action in list_legal_actions(game.session)[:6]:
            parts = provider.position.break_down(action)
            if hint.values_basis.accuracy is not Accuracy.EXACT or parts is None:
                break
            assert hint.values is not None
            after = sum(item.probability * item.value_after for item in parts.outcomes)
            reward = sum(item.probability * item.reward for item in parts.outcomes)
            value = reward + game.problem.discount * after
            assert value == pytest.approx(hint.values.q[action], abs=1e-6)
            if not hint.values_basis.scope and action < MAX_REPLAYED_ACTIONS:
                assert_outcomes_match_the_session(game, parts)
        game.choose(hint.action)
        if game.session.over:
            break


@pytest.mark.parametrize("name", [*CASE_NAMES, *USER_PROBLEMS])
def test_an_explanation_has_at_most_four_short_sentences_with_sums_to_the_digits(name: str) -> None:
    game = create_game(name, load_any_problem(name))
    while not game.session.over:
        provider = game.hint_provider
        if provider.explain_unavailable():
            assert run_line(GameController(game), "why").startswith("no why: ")
            return
        actions: list[float | None] = [None]
        actions += list_legal_actions(game.session)[:3] or [0.1]
        for action in actions:
            explanation = explain_action(provider, action)
            reasons = explanation.data.get("reasons", [])
            assert isinstance(reasons, list)
            assert 1 <= len(explanation.sentences[len(reasons) :]) <= 4, explanation
            for sentence in explanation.sentences:
                for part in sentence.split(". "):
                    assert len(part.split()) <= MAX_SENTENCE_WORDS, sentence
                assert sentence.endswith(".")
                assert ".." not in sentence
            assert_printed_numbers_sum(explanation.sentences)
            json.dumps(explanation.data)
        assert provider.current_hint is not None
        assert provider.current_hint.action is not None
        game.choose(provider.current_hint.action)


def assert_printed_numbers_sum(sentences: tuple[str, ...]) -> None:
    """Check `worth 7.04: reward 0.00 now and 7.04 later` to the last printed digit."""
    number = r"(-?\d+\.\d+)"
    match = re.search(
        rf"worth (?:\w+ )*{number}: reward {number} now and {number} later", sentences[0]
    )
    if match:
        value, reward, later = map(Decimal, match.groups())
        assert value == reward + later, sentences[0]
    match = re.search(
        rf"{number} (more|less) now (?:but|and) {number} (more|less) later", sentences[-1]
    )
    total = re.search(rf"{number} (more|less)\.$", sentences[-2]) if len(sentences) > 1 else None
    if match and total:
        signs = {"more": 1, "less": -1}
        sign = -1 if "It costs" in sentences[-1] else 1
        difference = Decimal(match[1]) * signs[match[2]] + Decimal(match[3]) * signs[match[4]]
        assert sign * difference == Decimal(total[1]) * signs[total[2]], sentences[-1]


def test_a_slip_onto_a_bad_hex_explains_why_the_straight_way_is_worse() -> None:
    problem = dmplay.load_problem("hexworld")
    game = make_game("hexworld")
    game.session.initial_state = problem.parse_state("(2,1)")
    label, sentences, data, is_worse = explain_action(game.hint_provider)
    assert not is_worse
    assert label == "nw in the state (2,1) (optimal)"
    value, outcomes, comparison, reason = sentences
    assert value == (
        "The best action nw is worth 3.36: reward 0.00 now and 3.36 later "
        "(discount 0.9 x mean value 3.73)."
    )
    assert outcomes.startswith("Next is (1,2) with probability 0.70 (then worth ")
    rule = "the best if every action surely had its likeliest outcome"
    assert comparison == f"The action w, {rule}, is worth 1.87, 1.49 less than nw."
    assert reason == (
        "It brings the same now and 1.49 less later, mainly because of (2,0) (110 % of the "
        "difference) and (1,2) (56 %)."
    )  # 0.15 x (1.87 + 0.9 x 10) / 1.49 and 0.70 x (0.9 x 3.39 - 1.87) / 1.49
    assert data["compared_with"]["rule"] == rule  # type: ignore[index]


def compute_values(problem: Problem, sweeps: int) -> dict[str, float]:
    """Return the optimal value of every state by its text, by value iteration."""
    states = problem.enumerate_states()
    values = dict.fromkeys(map(problem.describe_state, states), 0.0)
    for _ in range(sweeps):
        q_by_state = {
            problem.describe_state(state): [
                sum(p * total for _, (p, _, total) in list_outcomes(problem, state, action, values))
                for action in list_legal_labels(problem, state)
            ]
            for state in states
            if not problem.terminal(state[None])[0]
        }
        values |= {text: max(q) for text, q in q_by_state.items()}
    return values


def list_legal_labels(problem: Problem, state: Array) -> list[int]:
    legal = problem.legal_actions_mask(state[None])
    count = problem.action_counts[0]
    return [*range(count)] if legal is None else np.flatnonzero(legal[0, 0]).tolist()


def list_outcomes(
    problem: Problem, state: Array, action: int, values: dict[str, float]
) -> list[tuple[tuple[str, float], tuple[float, float, float]]]:
    """Return text and reward of each outcome, with its probability, reward and total."""
    p, outcome = enumerate_outcomes(problem, state[None], np.array([[action]]))
    table: dict[tuple[str, float], tuple[float, float, float]] = {}
    for chance, next_state, reward in zip(
        p[0].tolist(), outcome.state[0], outcome.rewards[0, :, 0].tolist(), strict=True
    ):
        text = problem.describe_state(next_state)
        name = f"the end ({text})" if problem.terminal(next_state[None])[0] else text
        key = name, round(reward, 9)
        before = table.get(key, (0.0, 0.0, 0.0))[0]
        table[key] = before + chance, reward, reward + problem.discount * values[text]
    return [item for item in table.items() if item[1][0] > 0.0]


def compute_shares(
    problem: Problem, state: Array, actions: tuple[int, int], values: dict[str, float]
) -> dict[tuple[str, float], float]:
    """Return the share of each outcome in the difference between the first and second action."""
    better, worse = (dict(list_outcomes(problem, state, a, values)) for a in actions)
    v = sum(p * total for p, _, total in worse.values())
    difference = sum(p * total for p, _, total in better.values()) - v
    nothing = (0.0, 0.0, 0.0)
    return {
        key: (better.get(key, nothing)[0] - worse.get(key, nothing)[0])
        * ((better | worse)[key][2] - v)
        / difference
        for key in better | worse
    }


@dataclass(frozen=True)
class PayingArrivals(RandomProblem):
    """A random problem that pays by the next state, also in different ways for the same one."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        toss = Categorical.from_probabilities(np.tile([0.3, 0.7], (len(s), 1)))
        return (*super().chance(s, a), toss)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(events[0], (3.0 * events[1] - events[0])[:, None], events[0])


@pytest.mark.parametrize(
    "problem",
    [
        dmplay.load_problem("hexworld"),
        dmplay.load_problem("hexworld:straight-line"),
        *(RandomProblem(seed=seed, ends=bool(seed % 2)) for seed in range(4)),
        *(PayingArrivals(seed=seed, ends=bool(seed % 2)) for seed in range(4)),
    ],
    ids=lambda problem: f"{type(problem).__name__}-{getattr(problem, 'seed', '')}",
)
def test_a_cause_has_half_of_the_difference_or_is_named_with_its_share(problem: Problem) -> None:
    values = compute_values(problem, 300)
    named = 0
    for state in problem.enumerate_states():
        actions = list_legal_labels(problem, state)
        if problem.terminal(state[None])[0] or len(actions) < 2:
            continue
        game = create_game("shares", problem, None)
        game.session.initial_state = state
        for action in actions:
            data = (explanation := explain_action(game.hint_provider, action)).data
            labels = game.session.action_labels(0)
            if "shares" not in data:
                continue
            pair = labels.index(str(data["best"])), labels.index(str(data["action"]))
            if pair[0] == pair[1]:
                compared = data["compared_with"]["action"]  # type: ignore[index]
                pair = pair[0], labels.index(compared)
            expected = compute_shares(problem, state, pair, values)
            shares = {
                (item["outcome"], round(item["reward"], 9)): item["share"]
                for item in data["shares"]  # type: ignore[attr-defined]
            }
            assert shares == pytest.approx(expected, abs=1e-6)
            assert sum(shares.values()) == pytest.approx(1.0)
            named += check_causes(explanation.sentences[-1], sorted(expected.items(), key=by_share))
    assert named


def by_share(item: tuple[tuple[str, float], float]) -> float:
    return -item[1]


def check_causes(sentence: str, ranked: list[tuple[tuple[str, float], float]]) -> int:
    """Check the named outcomes of a sentence against all shares; return their number."""
    single = re.search(
        r"mainly because it leads to (.+?)(?: \((?:reward|then).*\))? with", sentence
    )
    if single:
        assert single[1] == ranked[0][0][0]
        assert ranked[0][1] >= 0.5 > ranked[1][1]
        return 1
    several = re.search(r"(mainly )?because of (.*)\.$", sentence)
    if not several:
        return 0
    pattern = r"(\S+|the end \(\S+\)) \((?:reward (\S+), )?(\d+) %(?: of the difference)?\)"
    entries = re.findall(pattern, several[2])
    texts = [text for (text, _), _ in ranked]
    assert len(entries) >= 2, sentence
    for (name, paid, percent), ((text, reward), share) in zip(entries, ranked, strict=False):
        assert bool(paid) == (texts.count(text) > 1), sentence
        assert not paid or float(paid) == pytest.approx(reward, abs=0.01), sentence
        assert (name, int(percent)) == (text, round(100 * share)), sentence
        assert (share >= 0.5) == bool(several[1]), sentence
    return len(entries)


def test_an_outcome_without_a_name_is_summarised_in_one_sentence(tmp_path: Path) -> None:
    file = tmp_path / "course.py"  # which has no reasons of its own
    file.write_text(
        "from dmplay.problems.collision_avoidance.agents import AGENTS\n"
        "from dmplay.problems.collision_avoidance.rules import CollisionAvoidance\n"
        "class Course(CollisionAvoidance): pass\n"
    )
    game = make_game(str(file), seed=3)
    outcomes = explain_action(game.hint_provider).sentences[1]
    assert re.fullmatch(
        r"\d+ outcomes are possible; what follows is worth about \S+ to \S+; "
        r"the likeliest has probability 0\.\d\d and is worth about \S+\.",
        outcomes,
    )


def test_defection_pays_now_and_is_punished_by_tit_for_tat() -> None:
    game = make_game("prisoners-dilemma", "human", "tit-for-tat", turns=10)
    assert explain_action(game.hint_provider).sentences == (
        "The best action cooperate is worth -9.00: reward -1.00 now and -8.00 later.",
        "Agent2 is expected to choose cooperate now and again next turn.",
        "The action defect, which pays the most now, is worth -11.00, 2.00 less than cooperate.",
        "It costs 1.00 less now but 3.00 more later, as agent2 then chooses defect.",
    )


def test_an_explanation_prints_the_difference_that_the_board_shows() -> None:
    game = make_game("hexworld")  # 7.0444 - 6.2791 = 0.7653, but 7.04 - 6.28 = 0.76
    sentences = explain_action(game.hint_provider).sentences
    assert (
        sentences[2]
        == "The action sw, the next best, is worth 6.28, 0.77 less than se before rounding."
    )
    assert "b=sw ▄-0.77" in play_keys(make_game("hexworld"), "tab", size=(120, 24)).last


def test_a_state_that_the_belief_excludes_is_not_assumed_to_be_certain() -> None:
    game = start_new_game(GameRequest("catch", seed=3))
    for throw in (4, 2, 3, 5, 6):  # 50 m, 30 m, 40 m and 60 m are caught, then 70 m is dropped
        game.choose(throw)
    assert game.view().belief[0] < 0.01  # a drop alone would suggest a skill of 20 m
    comparison = explain_action(game.hint_provider).sentences[2]
    assert comparison.startswith(
        'The action 100, which follows the simple rule "throw the farthest, '
    )


def test_later_turns_are_worth_less_if_the_observation_tells_less_of_the_same_state() -> None:
    game = make_game("crying-baby", "human", turns=10)
    game.choose(FEED)
    provider = game.hint_provider
    sing = provider.position.labels.index("sing")
    assert explain_action(provider, sing).sentences[-1] == (
        "It costs 0.50 less now but 0.35 more later, as what you then observe tells less."
    )


def test_a_difference_of_simulated_games_may_be_no_more_than_chance() -> None:
    provider = make_game("simple-regulator", "human", turns=10).hint_provider
    best, _ = provider.position.choose()
    assert best is not None
    near, far = (explain_action(provider, best + change).sentences[-1] for change in (0.005, 0.5))
    assert near.endswith(", no more than chance explains.")
    assert far.endswith(" more.")


def test_another_action_is_explained_against_the_best_one() -> None:
    game = make_game("prisoners-dilemma", "human", "tit-for-tat", turns=10)
    assert explain_action(game.hint_provider, 1).sentences[-2:] == (
        "The best action cooperate is worth 2.00 more.",
        "It costs 1.00 more now but 3.00 less later, as agent2 then chooses cooperate.",
    )


def test_in_the_last_turn_no_later_turn_counts() -> None:
    game = make_game("crying-baby", turns=1)
    assert explain_action(game.hint_provider).sentences == (
        "The best action ignore is worth -5.00, the expected reward of this turn; no later turn "
        "counts.",
        "You observe quiet with probability 0.52 (P(sated) = 0.79) or crying with probability "
        "0.48 (P(sated) = 0.09).",
        "The action sing, the next best, is worth -5.50, 0.50 less than ignore.",
    )


def test_in_the_last_round_of_a_repeated_game_the_other_agent_cannot_answer() -> None:
    game = make_game("prisoners-dilemma", "human", "tit-for-tat", turns=1)
    assert explain_action(game.hint_provider).sentences[0] == (
        "The best action defect is worth 0.00, the expected reward of this turn; it is the last "
        "turn, so agent2 cannot answer it."
    )


@dataclass(frozen=True)
class HiddenCoin(Tabular):
    """A coin lies hidden: look at it, or call a side and win or lose 1."""

    discount: float = 0.5
    actions = (Labels(("look", "heads", "tails")),)
    observations = (Labels(("saw heads", "saw tails")),)
    state_names, initial_belief = ("heads", "tails"), np.array([0.5, 0.5])
    tables = Tables(
        np.repeat(np.eye(2)[:, None], 3, axis=1),
        np.array([[[0.0], [1.0], [-1.0]], [[0.0], [-1.0], [1.0]]]),
        np.stack([np.eye(2), *2 * [np.full((2, 2), 0.5)]]),
    )


def test_looking_is_worth_the_difference_between_a_sure_call_and_a_blind_one() -> None:
    game = create_game("coin", HiddenCoin(), turn_limit=2)
    look = game.hint_provider.position.break_down(0)
    assert look is not None
    assert look.value == pytest.approx(0.5)  # 0 now, 0.5 x 1 after looking; a blind call: 0
    assert look.information_value == pytest.approx(0.5)
    value, outcomes, comparison, reason = explain_action(game.hint_provider).sentences
    assert value == (
        "The best action look is worth 0.50: reward 0.00 now and 0.50 later "
        "(discount 0.5 x mean value 1.00)."
    )
    assert outcomes == (
        "You observe saw heads with probability 0.50 (P(heads) = 1.00, then worth 1.00) or saw "
        "tails with probability 0.50 (P(heads) = 0.00, then worth 1.00)."
    )
    assert comparison == "The action heads, the next best, is worth 0.00, 0.50 less than look."
    assert reason == (
        "What you then observe helps you to choose later: "
        "that is worth 0.00 after it, and 0.50 after look."
    )


def test_the_explanations_of_a_turn_count_as_a_hint_and_is_forbidden_with_hints() -> None:
    game = make_game("hexworld")
    controller = GameController(game)
    assert run_line(controller, "why").startswith(
        "why se in the state (7,2) (optimal): The best action se "
    )
    assert run_line(controller, "why w").startswith(
        "why not w in the state (7,2) (optimal): The action w is worth 5.54"
    )
    assert game.session.hint_counts == {"agent": 1}
    run_line(controller, "se")
    run_line(controller, "why")
    assert game.session.hint_counts == {"agent": 2}
    strict_game = make_session_game(
        "hexworld", game.session, ["human"], GameRequest("hexworld", strict="hints")
    )
    with pytest.raises(BadParameter, match="why: this game forbids hints"):
        run_line(GameController(strict_game), "why")


def test_an_illegal_action_is_not_explained() -> None:
    game = make_session_game("heap", Session(Heap(), SeededUniforms(1)), ["human"])
    game.session.initial_state = np.array(1)
    with pytest.raises(IllegalAction, match="two"):
        explain_action(game.hint_provider, 1)


def test_json_lines_contain_the_numbers_of_the_explanation(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--json", stdin="why\nquit\n")
    events = [json.loads(line) for line in result.stdout.splitlines()]
    (event,) = [event for event in events if event["event"] == "why"]
    outcomes = event["outcomes"]
    after = sum(item["probability"] * item["value_after"] for item in outcomes)
    assert event["value"] == pytest.approx(event["reward"] + event["discount"] * after)
    assert event["action"] == "se"
    assert event["text"].startswith("why se in the state (7,2) (optimal): ")


def test_the_key_row_offers_an_explanation_once_there_is_a_hint() -> None:
    before, after = play_keys(make_game("prisoners-dilemma"), "tab").frames[-2:]
    assert "Tab hint" in before.split("\n")[-1]
    assert "Tab why" in after.split("\n")[-1]


def test_the_key_y_shows_the_explanation_below_the_board_or_else_as_a_page() -> None:
    large, small = (
        play_keys(make_game("hexworld"), "tab", "Y", size=size).last
        for size in ((200, 60), (80, 24))
    )
    assert "why se in the state (7,2) (optimal): The" in large
    assert "moves into a wall: ne -1.57" in large
    assert small.split("\n")[1:3] == [
        " why se in the state (7,2) (optimal)",
        " The best action se is worth 7.04: reward 0.00 now and 7.04 later (discount 0.9",
    ]
    assert "moves into a wall: ne -1.57" not in small
    assert "│ 6,2 │ 7,2 │ 8,2 │" in small  # the map with the coordinates of the explanation
