"""Tests of beliefs that players state with their actions, and of their line in transcripts."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Percept
from dmplay.errors import BadParameter, BadPolicy, BadTranscript, DmplayError, Forfeit
from dmplay.external.bots.bot_policy import Bot
from dmplay.game.command_line_results import McpServerConfig
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import resume_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.transcript_verification import verify
from dmplay.servers.mcp.language_model_games import ModelGames
from dmplay.transcript.reader import read_transcript
from dmplay.transcript.replay import replay
from dmplay.ui.shell.commands import run_line, take_prediction_report
from tests.support.games import assert_verified, read_values
from tests.support.programs import run_dmplay
from tests.support.screens import play_keys

HELLO: dict[str, object] = {"type": "hello", "protocol": 1}
ACT: dict[str, object] = {"type": "act", "action": "ignore"}
STATED_LINE = '{"agent": [0.3, 0.7]}'


@pytest.fixture(autouse=True)
def state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


class ScriptedChannel:
    """A connection to a program that answers with these messages."""

    log = b""

    def __init__(self, *answers: dict[str, object]) -> None:
        self._lines = [json.dumps(answer) for answer in (HELLO, *answers)]

    def send(self, text: str, seconds: float) -> None:
        pass

    def read_line(self) -> str:
        return self._lines.pop(0)

    def close(self, farewell: str = "") -> None:
        pass


def start_with_program(*answers: dict[str, object]) -> dmplay.Session:
    """Start a game of a program that ignores the baby, and adds these fields to its actions."""
    acts = [{**ACT, "id": number, **answer} for number, answer in enumerate(answers, 1)]
    problem, channel = dmplay.load_problem("crying-baby"), ScriptedChannel(*acts)
    bot = Bot(problem, 0, "it", "crying-baby", open_channel=lambda _: channel)
    return dmplay.Session(problem, dmplay.SeededUniforms(7), [bot])


class StatingAgent:
    """A policy that ignores the baby and states a fixed belief."""

    uniform_count = 0

    def __init__(self, *belief: float) -> None:
        self._belief = belief

    def initial_memory(self, observation: Array) -> Memory:
        return (observation,)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return (percept.observation,)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.full(len(memory[0]), 2)

    def action_values(self, memory: Memory) -> None:
        return None

    def stated_belief(self, memory: Memory) -> Reals:
        return np.tile(self._belief, (len(memory[0]), 1))


def start_stating(path: Path, problem: str = "crying-baby", **options: object) -> Game:
    """Start a game whose player is asked for a belief with each action."""
    request = GameRequest(problem, seed=7, states_belief=True, record_path=path, **options)  # type: ignore[arg-type]
    return start_new_game(request)


def record_stated_turn(folder: Path) -> Path:
    """Record a game of one turn with a stated belief."""
    game = start_stating(folder / "game.dmt", turns=1)
    game.choose(2, stated_belief=np.array([0.3, 0.7]))
    game.finish()
    return folder / "game.dmt"


def play_with_agent(agent: StatingAgent) -> dmplay.Session:
    session = dmplay.Session(dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(7), [agent])
    session.advance()
    return session


def test_a_person_states_a_belief_by_numbers_by_names_or_not_at_all(tmp_path: Path) -> None:
    game = start_stating(tmp_path / "game.dmt", turns=3)
    controller = GameController(game)
    answers = ["0.3 0.7", "hungry=25% sated=3/4", ""]
    echoes = []
    for answer in answers:
        run_line(controller, "ignore")
        run_line(controller, answer)
        echoes.append(take_prediction_report(game))
    game.finish()
    path = assert_verified(tmp_path / "game.dmt")
    assert read_values(path, "stated") == [STATED_LINE, '{"agent": [0.75, 0.25]}']
    assert echoes[0] == "you stated the belief sated 0.3, hungry 0.7."
    assert not echoes[2]


def test_a_wrong_belief_is_refused_and_the_question_stays_open(tmp_path: Path) -> None:
    game = start_stating(tmp_path / "game.dmt")
    controller = GameController(game)
    run_line(controller, "ignore")
    for answer in ("0.5 0.6", "-0.5 1.5", "0.5", "hungry=0.5 tired=0.5", "a b"):
        with pytest.raises(DmplayError):
            run_line(controller, answer)
        assert game.open_question
    assert not game.session.turns


def test_a_belief_that_is_refused_in_a_pipe_is_asked_for_again(tmp_path: Path) -> None:
    words = ("crying-baby", "--seed", "7", "--turns", "2", "--state-belief", "-o", "game.dmt")
    completed = run_dmplay(tmp_path, *words, stdin="feed\n2 0\n0.5 0.5\nignore\n0.5\n")
    refusals = completed.stderr.splitlines()
    assert [line.partition(":")[0] for line in refusals[:2]] == ["error", "error"]
    assert "you chose feed: state the probability" in completed.stdout
    assert completed.returncode == 0
    game = dmplay.read(tmp_path / "game.dmt")
    assert (len(game.session.turns), game.end_reason) == (1, "quit")


def test_a_review_shows_the_stated_belief_the_exact_one_and_the_loss_by_each(
    tmp_path: Path,
) -> None:
    game = start_stating(tmp_path / "game.dmt", turns=2)
    game.choose(0, stated_belief=np.array([0.5, 0.5]))
    game.choose(0, stated_belief=np.array([0.0, 1.0]))
    game.finish()
    first, second = (move.stated_belief for move in dmplay.review(tmp_path / "game.dmt"))
    assert first is not None
    assert second is not None
    assert first.stated == first.exact == {"sated": 0.5, "hungry": 0.5}
    assert first.seeing == (0.0, 0.0)
    assert second.exact == {"sated": 1.0, "hungry": 0.0}
    (row,) = dmplay.evaluate_transcripts(tmp_path / "game.dmt").list_rows(games=True)
    assert second.seeing is not None
    assert row["seeing"] == pytest.approx(0.9 * second.seeing[0])
    printed = run_dmplay(tmp_path, "review", "game.dmt")
    assert "turn 2: stated hungry 1; exact sated 1; lost by seeing " in printed.stdout
    data = json.loads(run_dmplay(tmp_path, "review", "game.dmt", "--json").stdout)
    assert data["actions"][1]["stated_belief"]["seeing"] == [*second.seeing]


def test_the_board_does_not_show_the_belief_that_is_asked_for(tmp_path: Path) -> None:
    assert start_stating(tmp_path / "game.dmt").view().beliefs is None
    other = start_new_game(GameRequest("crying-baby", record_path=tmp_path / "other.dmt"))
    assert other.view().beliefs is not None


def test_the_full_screen_asks_for_the_belief_after_the_action(tmp_path: Path) -> None:
    game = start_stating(tmp_path / "game.dmt", turns=1)
    play_keys(game, "i", "0", ".", "3", "space", "0", ".", "7", "enter")
    assert game.session.turns[0].stated_beliefs[0].tolist() == [0.3, 0.7]


def test_a_belief_needs_hidden_states_one_person_and_no_prediction(tmp_path: Path) -> None:
    for problem, options in (
        ("hexworld", {}),
        ("crying-baby", {"prediction": "belief"}),
        ("multicaregiver-crying-baby", {"seats": ["caregiver1=human", "caregiver2=human"]}),
    ):
        with pytest.raises(BadParameter):
            start_stating(tmp_path / "game.dmt", problem, **options)
    completed = run_dmplay(tmp_path, "hexworld", "--state-belief", stdin="e\n")
    assert completed.returncode == 2
    assert completed.stderr.count("\n") == 1


def test_a_belief_follows_its_turn_through_undo_redo_reroll_and_resume(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_stating(path)
    game.choose(2, stated_belief=np.array([0.3, 0.7]))
    game.undo()
    game.redo()
    game.reroll()
    assert game.session.turns[0].stated_beliefs[0].tolist() == [0.3, 0.7]
    game.undo()
    game.choose(2)
    assert not game.session.turns[0].stated_beliefs
    game.choose(0, stated_belief=np.array([1.0, 0.0]))
    game.pause()
    resumed = resume_game(ResumeRequest(path))
    assert resumed.session.turns[1].stated_beliefs[0].tolist() == [1.0, 0.0]
    resumed.finish()
    assert_verified(path)


def test_a_model_states_a_belief_with_its_action(tmp_path: Path) -> None:
    config = McpServerConfig(("crying-baby", "hexworld"), transcript_folder=tmp_path / "games")
    games = ModelGames(config)
    games.start_game("crying-baby")
    with pytest.raises(BadParameter):
        games.play_action("g1", "feed", belief={"hungry": 0.5})
    games.play_action("g1", "feed", belief={"hungry": 0.7, "sated": 0.3})
    games.start_game("hexworld")
    with pytest.raises(BadParameter):
        games.play_action("g2", "e", belief={"(1,1)": 1.0})
    games.end_all_games()
    paths = (tmp_path / "games").glob("*.dmt")
    stated = [read_values(assert_verified(path), "stated") for path in paths]
    assert sorted(stated) == [[], [STATED_LINE]]


@pytest.mark.parametrize("belief", [[0.3, 0.7], {"hungry": 0.7, "sated": 0.3}])
def test_a_program_states_a_belief_with_its_action(belief: object) -> None:
    session = start_with_program({"belief": belief}, {})
    session.advance()
    session.advance()
    assert session.turns[0].stated_beliefs[0].tolist() == [0.3, 0.7]
    assert not session.turns[1].stated_beliefs


@pytest.mark.parametrize("belief", [[0.3, 0.8], [0.5], {"tired": 1.0}, "maybe", 1, [True, False]])
def test_a_program_that_states_no_belief_forfeits(belief: object) -> None:
    session = start_with_program({"belief": belief})
    with pytest.raises(Forfeit, match="belief"):
        session.advance()


def test_a_python_agent_states_a_belief_by_a_method() -> None:
    session = play_with_agent(StatingAgent(0.25, 0.75))
    assert session.turns[0].stated_beliefs[0].tolist() == [0.25, 0.75]
    assert not play_with_agent(StatingAgent(np.nan, np.nan)).turns[0].stated_beliefs
    for belief in ((0.5, 0.6), (1.0,), (-0.5, 1.5)):
        with pytest.raises(BadPolicy, match="stated_belief"):
            play_with_agent(StatingAgent(*belief))


@pytest.mark.parametrize(
    "value",
    ["[0.3, 0.7]", "{}", '{"agent": [0.3]}', '{"agent": [0.3, 0.6]}', '{"agent": [-0.3, 1.3]}',
     '{"other": [0.3, 0.7]}', '{"agent": [0.3, "0.7"]}', "null"],
)  # fmt: skip
def test_verify_names_the_line_of_a_wrong_belief(tmp_path: Path, value: str) -> None:
    path = record_stated_turn(tmp_path)
    rows = path.read_text().split("\n")
    line = next(number for number, row in enumerate(rows, 1) if row.startswith("stated: "))
    rows[line - 1] = f"stated: {value}"
    path.write_text("\n".join(rows))
    report = verify(path)
    assert report.findings[0].line == line
    with pytest.raises(BadTranscript):
        replay(read_transcript(path), dmplay.load_problem("crying-baby"))


def test_verify_names_a_belief_over_states_that_are_real_numbers(tmp_path: Path) -> None:
    game = dmplay.play("simple-regulator", seed=7, turns=1)
    game.act(0)
    path = tmp_path / "game.dmt"
    game.save(path)
    text = re.sub("(?m)^(actions: .*)$", r'\1\nstated: {"agent": [1]}', path.read_text())
    path.write_text(text)
    finding = verify(path).findings[0]
    assert "this problem has no belief over hidden states" in str(finding)


def test_a_visible_problem_has_no_stated_belief(tmp_path: Path) -> None:
    session = dmplay.Session(dmplay.load_problem("hexworld"), dmplay.SeededUniforms(7))
    with pytest.raises(BadParameter):
        session.advance([0], stated_beliefs={0: np.ones(1)})


def test_only_its_own_player_is_shown_a_stated_belief_during_the_game(tmp_path: Path) -> None:
    request = GameRequest(
        "multicaregiver-crying-baby",
        seats=["caregiver1=human", "caregiver2=human"],
        seed=7,
        record_path=tmp_path / "game.dmt",
    )
    game = start_new_game(request)
    game.choose(0, stated_belief=np.array([0.3, 0.7]))
    game.choose(0)
    facts = [game.narrator.visible_turn_facts(game.snapshot(seat)) for seat in (0, 1)]
    assert [facts[seat]["stated"] for seat in (0, 1)] == [{"caregiver1": [0.3, 0.7]}, {}]


def test_a_function_of_the_view_states_a_belief_beside_its_action() -> None:
    problem = dmplay.load_problem("crying-baby")
    for belief in ({"hungry": 0.75, "sated": 0.25}, [0.25, 0.75], np.array([0.25, 0.75])):
        agent = dmplay.load_agent(problem, 0, lambda view, belief=belief: ("feed", belief))
        session = dmplay.Session(problem, dmplay.SeededUniforms(7), [agent])
        session.advance()
        session.advance()
        stated = [turn.stated_beliefs[0].tolist() for turn in session.turns]
        assert stated == [[0.25, 0.75]] * 2
    for wrong in ({"hungry": 0.5}, "maybe", 3):
        agent = dmplay.load_agent(problem, 0, lambda view, belief=wrong: ("feed", belief))
        with pytest.raises(BadPolicy, match="belief"):
            dmplay.Session(problem, dmplay.SeededUniforms(7), [agent]).advance()
    visible = dmplay.load_problem("hexworld")
    agent = dmplay.load_agent(visible, 0, lambda view: ("e", [1.0]))
    with pytest.raises(BadPolicy, match="belief"):
        dmplay.Session(visible, dmplay.SeededUniforms(7), [agent]).advance()
