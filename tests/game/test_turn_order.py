"""Who only waits is not asked, is told what the others did, and takes back to its own choice."""

import io
import json
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import disk
from dmplay.chance import Array, Bools, Reals
from dmplay.conformance import check
from dmplay.core import Memory
from dmplay.errors import BadParameter, IllegalAction
from dmplay.game.checking import verify_file as verified
from dmplay.game.game import Game
from dmplay.game.log import EventLog
from dmplay.game.request import GameRequest, ResumeRequest
from dmplay.game.start import start_game, start_new_game
from dmplay.game.table import GameController
from dmplay.policies.kinds import ConstantPolicy
from dmplay.rollouts import rollout
from dmplay.session import Session
from dmplay.terminal import Terminal
from dmplay.transcript.format import collect_turn_facts
from dmplay.words.plain import JsonReporter, Reporter, SentenceReporter, play_by_lines
from tests.support.games import values
from tests.support.turns import Nim, Peek

NIM = f"{Nim.__module__}:{Nim.__name__}"
PIPED = Terminal(
    full_screen=False, plain_reason="a test", is_interactive=False, color=False, ascii=False
)


def sat(record: Path, agent: str = "human", others: str = "script:one,one,one,one") -> Game:
    return start_new_game(
        GameRequest(NIM, agent=agent, other_agent=others, seed=1, record_path=record)
    )


def told(game: Game, reporter: Reporter, *lines: str) -> list[str]:
    with redirect_stdout(io.StringIO()) as out:
        play_by_lines(GameController(game), PIPED, io.StringIO("\n".join(lines)), reporter)
    return out.getvalue().splitlines()


def test_the_problems_of_these_tests_keep_every_law() -> None:
    assert check(Nim()) == []
    assert check(Peek()) == []


def test_the_turns_of_others_are_played_and_told_before_the_next_choice(tmp_path: Path) -> None:
    rows = told(sat(tmp_path / "nim.dmt"), SentenceReporter(PIPED), "two", "one")
    assert [row for row in rows if row.startswith("turn ")] == [
        "turn 1. 5-right. left chose two. reward 0. score 0.",
        "turn 2. 4-left. right chose one. reward 0. score 0.",
        "turn 3. 3-right. left chose one. reward 0. score 0.",
        "turn 4. 2-left. right chose one. reward 0. score 0.",
    ]
    data = [json.loads(row) for row in told(sat(tmp_path / "two.dmt"), JsonReporter(), "two")]
    assert [row["turn"] for row in data if row["event"] == "turn"] == [1, 2]
    assert verified(tmp_path / "nim.dmt", trusted=True).is_ok


def test_where_another_begins_the_first_choice_comes_after(tmp_path: Path) -> None:
    game = start_new_game(
        GameRequest(
            NIM,
            agent="script:two,two",
            other_agent="human",
            seed=1,
            record_path=tmp_path / "nim.dmt",
        )
    )
    assert [game.choosing_seat, GameController(game).game.choosing_seat] == [None, 1]
    assert len(game.session.turns) == 1
    with pytest.raises(IllegalAction, match="undo 1: you chose in 0 turns"):
        game.undo()
    game.choose(0)
    assert [turn.actions.tolist() for turn in game.session.turns] == [[1, 2], [2, 0], [1, 2]]


def test_undo_and_redo_go_from_one_own_choice_to_the_next(tmp_path: Path) -> None:
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
    assert values(tmp_path / "nim.dmt", "undo") == ["2", "4"]


def test_a_game_left_at_the_turn_of_another_goes_on_with_it(tmp_path: Path) -> None:
    file = tmp_path / "nim.dmt"
    game = sat(file, others="random")
    game.choose(0)
    assert game.recorder
    game.recorder.close()
    whole = file.read_text()
    file.write_text(whole[: whole.index("turn: 2")])
    resumed = start_game(ResumeRequest(file, trusted=True))
    GameController(resumed)
    assert resumed.choosing_seat == 0
    assert file.read_text() == whole
    resumed.finish()


def test_two_people_are_asked_in_turns(tmp_path: Path) -> None:
    game = sat(tmp_path / "nim.dmt", others="human")
    asked = []
    while not game.session.over:
        asked.append(game.choosing_seat)
        assert game.choose(1 if len(asked) < 4 else 0)
    assert asked == [0, 1, 0, 1]
    game.undo()
    assert game.choosing_seat == 1


@dataclass(frozen=True)
class Stubborn(ConstantPolicy):
    """Takes one, whatever is legal; is never asked while it waits."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        assert legal is None or len(legal) > 1 or legal[0, 0]
        return super().choose(memory, legal, u)


def test_a_rollout_is_the_same_game() -> None:
    problem = Nim()
    policies = [Stubborn(problem, 0), Stubborn(problem, 1)]
    game = Session(problem, dmplay.SeededUniforms(1), policies)
    while not game.over:
        assert sum(choice is None for choice in game.choose_policy_actions()) == 1
        game.advance()
    many = rollout(problem, policies, episodes=3, seed=1)
    assert many.turn_counts.tolist() == [len(game.turns)] * 3 == [7] * 3
    assert many.total_rewards.tolist() == [game.total_rewards().tolist()] * 3 == [[1.0, -1.0]] * 3


def test_what_is_seen_before_the_first_action_is_told_and_believed() -> None:
    game = Session(Peek(), dmplay.SeededUniforms(1))
    state = int(game.initial_state)
    own = ["clear", "dark"][state // 2]
    assert [view.observation.item() for view in map(game.view, range(2))] == [state // 2, -1]
    assert game.view(0).belief.tolist() == [0.5 * (s // 2 == state // 2) for s in range(4)]
    assert game.view(1).belief.tolist() == [0.25] * 4
    assert collect_turn_facts(game)["observations"] == {"seeing": own}
    search = dmplay.load_agent(Peek(), 0, "search")
    belief = search.initial_memory(np.array([0, 1]))[0]
    assert belief.tolist() == [[0.5, 0.5, 0, 0], [0, 0, 0.5, 0.5]]


def test_a_script_that_cannot_be_read_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moves = tmp_path / "moves.txt"
    wanted = GameRequest("hexworld", agent=f"script:{moves}", seed=1)
    moves.write_bytes(b"e\xff")
    with pytest.raises(BadParameter, match=r"moves\.txt: got what is no UTF-8, expected lines of"):
        start_new_game(wanted)
    monkeypatch.setattr(disk, "MAX_FILE_BYTES", 1)
    with pytest.raises(BadParameter, match=r"moves\.txt: larger than 0 MB"):
        start_new_game(wanted)
