"""Tests of alternating turns: an inactive seat sees the turns of others but does not choose."""

import io
import json
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import ConstantPolicy
from dmplay.core import safe_files
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from dmplay.core.session import Session
from dmplay.errors import BadParameter, IllegalAction
from dmplay.evaluation.many_games import rollout
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.transcript_verification import verify as verified
from dmplay.terminal.capabilities import Terminal
from dmplay.transcript.format import collect_turn_facts
from dmplay.ui.screen.event_log import EventLog
from dmplay.ui.shell.plain_mode import JsonReporter, Reporter, SentenceReporter, play_by_lines
from dmplay.validation.conformance import check
from tests.support.games import read_values
from tests.support.turn_based_games import Nim, Peek

NIM_NAME = f"{Nim.__module__}:{Nim.__name__}"
PIPED_TERMINAL = Terminal(
    full_screen=False, plain_reason="a test", is_interactive=False, color=False, ascii=False
)


def sat(record: Path, agent: str = "human", others: str = "script:one,one,one,one") -> Game:
    return start_new_game(
        GameRequest(NIM_NAME, agent=agent, other_agent=others, seed=1, record_path=record)
    )


def play_lines(game: Game, reporter: Reporter, *lines: str) -> list[str]:
    with redirect_stdout(io.StringIO()) as output:
        play_by_lines(GameController(game), PIPED_TERMINAL, io.StringIO("\n".join(lines)), reporter)
    return output.getvalue().splitlines()


def test_the_problems_of_these_tests_satisfy_every_invariant() -> None:
    assert check(Nim()) == []
    assert check(Peek()) == []


def test_turns_of_others_are_played_and_reported_before_the_next_choice(tmp_path: Path) -> None:
    lines = play_lines(sat(tmp_path / "nim.dmt"), SentenceReporter(PIPED_TERMINAL), "two", "one")
    assert [item for item in lines if item.startswith("turn ")] == [
        "turn 1. left chose two. state 5-right. reward 0. score 0.",
        "turn 2. right chose one. state 4-left. reward 0. score 0.",
        "turn 3. left chose one. state 3-right. reward 0. score 0.",
        "turn 4. right chose one. state 2-left. reward 0. score 0.",
    ]
    events = [
        json.loads(item) for item in play_lines(sat(tmp_path / "two.dmt"), JsonReporter(), "two")
    ]
    assert [item["turn"] for item in events if item["event"] == "turn"] == [1, 2]
    assert verified(tmp_path / "nim.dmt", trusted=True).is_ok


def test_if_another_agent_starts_the_person_chooses_after_it(tmp_path: Path) -> None:
    game = start_new_game(
        GameRequest(
            NIM_NAME,
            agent="script:two,two",
            other_agent="human",
            seed=1,
            record_path=tmp_path / "nim.dmt",
        )
    )
    assert [game.choosing_seat, GameController(game).game.choosing_seat] == [None, 1]
    assert len(game.session.turns) == 1
    with pytest.raises(IllegalAction, match="undo 1: you chose an action in 0 turns"):
        game.undo()
    game.choose(0)
    assert [turn.actions.tolist() for turn in game.session.turns] == [[1, 2], [2, 0], [1, 2]]


def test_undo_and_redo_step_between_the_choices_of_the_person(tmp_path: Path) -> None:
    game = sat(tmp_path / "nim.dmt")
    log = EventLog(game)
    game.on_intermediate_turn = lambda: log.add_new_turns([])
    for _ in range(2):
        game.choose(0)
        log.add_new_turns([])
    assert [row.partition(".")[0] for row in log.rows] == [f"turn {n}" for n in range(1, 5)]
    game.undo()
    assert len(game.session.turns) == 2
    game.redo()
    assert len(game.session.turns) == 4
    game.undo(2)
    assert len(game.session.turns) == 0
    assert read_values(tmp_path / "nim.dmt", "undo") == ["2", "4"]


def test_a_game_interrupted_in_the_turn_of_another_agent_resumes_there(tmp_path: Path) -> None:
    file = tmp_path / "nim.dmt"
    game = sat(file, others="random")
    game.choose(0)
    assert game.recorder
    game.recorder.close()
    full_text = file.read_text()
    file.write_text(full_text[: full_text.index("turn: 2")])
    resumed = start_game(ResumeRequest(file, trusted=True))
    GameController(resumed)
    assert resumed.choosing_seat == 0
    assert file.read_text() == full_text
    resumed.finish()


def test_two_people_choose_alternately(tmp_path: Path) -> None:
    game = sat(tmp_path / "nim.dmt", others="human")
    choosing_seats = []
    while not game.session.over:
        choosing_seats.append(game.choosing_seat)
        assert game.choose(1 if len(choosing_seats) < 4 else 0)
    assert choosing_seats == [0, 1, 0, 1]
    game.undo()
    assert game.choosing_seat == 1


@dataclass(frozen=True)
class AlwaysTakeOne(ConstantPolicy):
    """A policy that always takes one stone, legal or not, and must not be called while inactive."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        assert legal is None or len(legal) > 1 or legal[0, 0]
        return super().choose(memory, legal, u)


def test_a_rollout_plays_the_same_game_as_a_session() -> None:
    problem = Nim()
    policies = [AlwaysTakeOne(problem, 0), AlwaysTakeOne(problem, 1)]
    game = Session(problem, dmplay.SeededUniforms(1), policies)
    while not game.over:
        assert sum(choice is None for choice in game.choose_policy_actions()) == 1
        game.advance()
    result = rollout(problem, policies, episodes=3, seed=1)
    assert result.turn_counts.tolist() == [len(game.turns)] * 3 == [7] * 3
    assert result.total_rewards.tolist() == [game.total_rewards().tolist()] * 3 == [[1.0, -1.0]] * 3


def test_an_initial_observation_is_recorded_and_updates_the_belief() -> None:
    game = Session(Peek(), dmplay.SeededUniforms(1))
    state = int(game.initial_state)
    label = ["clear", "dark"][state // 2]
    assert [view.observation.item() for view in map(game.view, range(2))] == [state // 2, -1]
    assert game.view(0).belief.tolist() == [0.5 * (s // 2 == state // 2) for s in range(4)]
    assert game.view(1).belief.tolist() == [0.25] * 4
    assert collect_turn_facts(game)["observations"] == {"seeing": label}
    search = dmplay.load_agent(Peek(), 0, "search")
    belief = search.initial_memory(np.array([0, 1]))[0]
    assert belief.tolist() == [[0.5, 0.5, 0, 0], [0, 0, 0.5, 0.5]]


def test_an_unreadable_script_is_an_error_of_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moves = tmp_path / "moves.txt"
    request = GameRequest("hexworld", agent=f"script:{moves}", seed=1)
    moves.write_bytes(b"e\xff")
    with pytest.raises(BadParameter, match=r"moves\.txt: not UTF-8, expected lines of"):
        start_new_game(request)
    monkeypatch.setattr(safe_files, "MAX_FILE_BYTES", 1)
    with pytest.raises(BadParameter, match=r"moves\.txt: larger than 0 kB"):
        start_new_game(request)
