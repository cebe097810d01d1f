"""A game of `dmplay.play` is saved as a transcript that verifies."""

import importlib
import json
import re
import stat
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.command_line_results import McpServerConfig
from dmplay.game.manual_game import ManualGame
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import identify_problem, load_variants
from dmplay.servers.mcp.language_model_games import ModelGames
from dmplay.transcript.reader import read_transcript
from tests.support.games import read_values


class Defector(dmplay.ReactivePolicy):
    """An agent that is not in a roster."""

    def choose(self, memory: Any, legal: Any, u: Any) -> Any:
        return np.ones(len(memory[0]), int)


def play_turns(game: ManualGame, turns: int) -> ManualGame:
    """Play the first legal action of each seat for so many turns, or to the end."""
    for _ in range(turns):
        if not game.over:
            seats = [game.session.problem.agents[seat] for seat in game._manual_seats]
            choices = map(game.legal_actions, seats)
            game.act(*[c[0] if isinstance(c, list) else 0.0 for c in choices])
    return game


@pytest.mark.parametrize("name", [n for n in problem_names() if n != "collaborative-predator-prey"])
@pytest.mark.parametrize("turns", [0, 2, 5])
def test_a_saved_game_verifies(name: str, turns: int, tmp_path: Path) -> None:
    game = play_turns(dmplay.play(name, seed=7, turns=4), turns)
    game.save(tmp_path / "game.dmt")
    report = dmplay.verify(tmp_path / "game.dmt")
    assert report.findings == []
    assert report.turns == len(game.session.turns)
    header = read_transcript(tmp_path / "game.dmt").header
    assert (header.problem, header.seed, {*header.seats.values()}) == (name, 7, {"human"})


def test_agents_are_recorded_by_their_names_and_choose_again(tmp_path: Path) -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    grim, defector = dmplay.load_agent(problem, 0, "grim"), Defector(problem, 0)
    for first, name in {grim: "grim", defector: "human", None: "human"}.items():
        game = dmplay.play(problem, [first, "tit-for-tat"], seed=7)
        play_turns(game, 3).save(tmp_path / "game.dmt", overwrite=True)
        seats = read_transcript(tmp_path / "game.dmt").header.seats
        assert seats == {"agent1": name, "agent2": "tit-for-tat"}
        report = dmplay.verify(tmp_path / "game.dmt")
        assert (report.findings, report.unchecked_players) == ([], ["human"] * (name == "human"))


def test_a_running_game_with_hidden_states_is_private_and_can_be_resumed(tmp_path: Path) -> None:
    game = play_turns(dmplay.play("crying-baby", seed=7, turns=3), 1)
    path = tmp_path / "game.dmt"
    game.save(path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    with pytest.raises(BadParameter, match="this game can still be continued"):
        dmplay.Playback(path)
    play_turns(game, 2).save(path, overwrite=True)
    assert dmplay.Playback(path).count_turns() == 3
    assert stat.S_IMODE(path.stat().st_mode) & 0o044
    play_turns(dmplay.play("crying-baby", seed=8), 1).save(path, overwrite=True)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_help_is_counted_in_a_saved_game(tmp_path: Path) -> None:
    game = play_turns(dmplay.play("hexworld", seed=7), 1)
    game.session.hint_counts["agent"] = 2
    game.save(tmp_path / "game.dmt")
    assert read_values(tmp_path / "game.dmt", "help") == ['{"agent": 2}']
    assert dmplay.verify(tmp_path / "game.dmt").findings == []


def test_turns_played_again_with_new_draws_verify(tmp_path: Path) -> None:
    game = play_turns(dmplay.play("hexworld:straight-line", seed=7), 1)
    game.session.reroll()
    game.session.reroll()
    play_turns(game, 1).undo()
    game.save(tmp_path / "game.dmt")
    assert dmplay.verify(tmp_path / "game.dmt").findings == []
    replayed = dmplay.Playback(tmp_path / "game.dmt")
    assert [*replayed.iter_agent_turns()] == [0, 1]  # the turn, and its reroll
    np.testing.assert_array_equal(replayed.session.turns[0].state, game.session.turns[0].state)


def test_an_object_is_recorded_by_the_name_that_loads_it_again(tmp_path: Path) -> None:
    game = play_turns(dmplay.play(dmplay.load_problem("hexworld", slip=0.1), seed=7), 2)
    game.save(tmp_path / "game.dmt")
    assert read_transcript(tmp_path / "game.dmt").header.parameters == {"slip": 0.1}
    assert dmplay.verify(tmp_path / "game.dmt").findings == []
    for name in problem_names():
        for problem in load_variants(name).values():
            loaded = identify_problem(problem)
            assert loaded.name == name
            assert dmplay.load_problem(name, **loaded.parameters) == problem


def test_a_problem_of_a_file_is_saved_with_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pond.py").write_text(
        "from dmplay.problems.hexworld.rules import HexWorld\n\n\nclass Pond(HexWorld):\n    pass\n"
    )
    Path("games").mkdir()
    for problem in (Path("pond.py"), dmplay.load_problem("./pond.py", slip=0.2)):
        game = play_turns(dmplay.play(problem, seed=7), 2)
        game.save("games/game.dmt", overwrite=True)
        header = read_transcript("games/game.dmt").header
        assert header.problem.partition(":")[0] == "../pond.py"
        assert dmplay.verify("games/game.dmt", trusted=True).findings == []
    local = type(game.session.problem)(discount=0.5)
    assert identify_problem(local).parameters == {"discount": 0.5}


def test_a_problem_and_an_agent_without_a_name_are_given_as_objects(tmp_path: Path) -> None:
    class Pond(type(dmplay.load_problem("hexworld"))):  # type: ignore[misc]
        pass

    def go_east(view: dmplay.View[dmplay.Problem]) -> str:
        return "e"

    path = tmp_path / "game.dmt"
    game = dmplay.play(Pond(slip=0.2), go_east, seed=7, turns=3)
    while not game.over:
        game.act()
    game.save(path)
    assert read_transcript(path).header.parameters["slip"] == 0.2
    with pytest.raises(BadTranscript, match="is code outside dmplay"):
        dmplay.read(path)
    regrets = [choice.regret for choice in game.review()]
    for problem in Pond, Pond(slip=0.2), Pond:
        assert dmplay.read(path, problem=problem).returns == game.returns
        assert [choice.regret for choice in dmplay.review(path, problem=problem)] == regrets
        assert len(dmplay.evaluate_transcripts(path, problem=problem).players[0].games) == 1
        for agents, unchecked in ((None, ["human"]), (go_east, []), ([go_east], [])):
            report = dmplay.verify(path, problem=problem, agents=agents)
            assert (report.findings, report.unchecked_players) == ([], unchecked)
    finding, *_ = dmplay.verify(path, problem=Pond, agents=lambda view: "w").findings
    assert "action" in str(finding)
    assert dmplay.verify(path, problem="hexworld").is_ok
    assert not dmplay.verify(path, problem="crying-baby").is_ok


@pytest.mark.extra("gymnasium")
def test_a_session_and_the_game_of_an_environment_are_saved(tmp_path: Path) -> None:
    env = importlib.import_module("dmplay.gym").Env("prisoners-dilemma", others="grim", turns=3)
    env.reset(seed=7)
    for _ in range(3):
        env.step(1)
    problem = dmplay.load_problem("hexworld", slip=0.1)
    policies = [dmplay.load_agent(problem, 0, "optimal")]
    walk = dmplay.Session(problem, dmplay.SeededUniforms(7, 2), policies)
    walk.advance()
    for session, names in ((env.unwrapped.session, ["human", "grim"]), (walk, ["optimal"])):
        dmplay.save(session, tmp_path / "game.dmt", overwrite=True)
        assert [*read_transcript(tmp_path / "game.dmt").header.seats.values()] == names
        report = dmplay.verify(tmp_path / "game.dmt")
        assert (report.findings, report.turns) == ([], len(session.turns))


def test_a_path_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    game = dmplay.play("hexworld", seed=7)
    game.save(tmp_path / "game.dmt")
    before = (tmp_path / "game.dmt").read_text()
    play_turns(game, 1)
    for path, message in {
        tmp_path / "game.dmt": "exists; give another name, or overwrite=True",
        tmp_path: "exists; give another name, or overwrite=True",
        tmp_path / "none" / "game.dmt": "No such file or directory",
    }.items():
        with pytest.raises(BadParameter, match=f"{re.escape(str(path))}.*{message}"):
            game.save(path)
    assert (tmp_path / "game.dmt").read_text() == before


@pytest.mark.parametrize("name", [n for n in problem_names() if n != "collaborative-predator-prey"])
def test_rows_and_review_are_those_of_the_saved_game(name: str, tmp_path: Path) -> None:
    game = play_turns(dmplay.play(name, seed=7, turns=3), 3)
    game.session.end("quit")
    game.save(tmp_path / "game.dmt")
    recorded = dmplay.read(tmp_path / "game.dmt")
    assert game.turns == recorded.turns
    assert game.returns == recorded.returns
    assert game.end_reason == recorded.end_reason
    assert game.prompt() == recorded.prompt()
    assert [str(choice) for choice in game.review()] == [str(c) for c in recorded.review()]


def test_a_running_game_tells_only_what_its_seat_knows() -> None:
    game = dmplay.play("crying-baby", seed=7, turns=2)
    game.act("ignore")
    assert [*game.turns[1]] == ["turn", "actions agent", "observations agent", "belief agent"]
    status = json.loads(game.prompt())
    assert (status["turn"], status["words"], status["legal"]) == (1, "", ["feed", "sing", "ignore"])
    assert not {"state", "reward", "belief"} & {*status["turns"][1]}
    assert "belief" in json.loads(game.prompt(belief=True))["words"]
    game.act("ignore")
    assert {"state", "rewards agent"} <= {*game.turns[1]}


@pytest.mark.parametrize("name", problem_names())
def test_the_prompt_begins_with_the_rules_of_the_server_if_they_are_wanted(name: str) -> None:
    game = dmplay.play(name, seed=7, turns=3)
    rules, info = json.loads(game.prompt(rules=True))["rules"], ModelGames(McpServerConfig([name]))
    facts = info.problem_info(name)
    assert (rules["kind"], rules["about"]) == (facts["kind"], facts["about"])
    assert [*rules["parameters"]] == [*facts["parameters"]]  # type: ignore[misc]
    assert json.loads(game.prompt(rules=True)) == {"rules": rules} | json.loads(game.prompt())


def test_the_prompt_is_what_a_language_model_gets() -> None:
    for name, belief in (("crying-baby", False), ("crying-baby", True), ("catch", False)):
        config = McpServerConfig([name], show_belief=belief, seed=7, turn_limit=3)
        model_games, game = ModelGames(config), dmplay.play(name, seed=7, turns=3)
        model_games.start_game(name)
        for turn in range(4):
            status: dict[str, Any] = {**model_games.game_status("g1", history=True)}
            assert status.pop("game") == "g1"
            assert json.loads(game.prompt(belief=belief)) == status
            if turn < 3:
                choices = game.legal_actions()
                action = choices[0] if isinstance(choices, list) else 1.0
                game.act(action)
                model_games.play_action("g1", str(action))
