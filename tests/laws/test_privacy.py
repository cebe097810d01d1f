"""What a person is shown, told and advised betrays nothing that the seat may not know."""

import json
from dataclasses import replace

import pytest

from dmplay.errors import DmplayError
from dmplay.finding import problems
from dmplay.game.game import Game
from dmplay.game.seats import HUMAN
from dmplay.game.table import Table
from dmplay.screen.frame import Room, Shown, compose
from dmplay.session import Session
from dmplay.words.commands import COMMANDS, typed
from tests.support import screens
from tests.support.cases import CASES, draws, load, small
from tests.support.games import Scripted
from tests.support.screens import secret
from tests.support.twins import Told, twins

ROOMS = (Room(80, 24), Room(80, 24, ascii=True), Room(50, 14), Room(40, 12), Room(200, 60))
TURNS = 5  # of a game, that its adviser need not plan far
ASKED = ("look", "legal", "belief", "state", "keys", "hint")
GUARDED = [name for name in CASES if load(name).observations or len(load(name).agents) > 1]
TOGETHER = [name for name in CASES if len(load(name).agents) > 1]
every_guarded = pytest.mark.parametrize("name", GUARDED)


def test_the_audit_is_of_the_hidden_and_the_simultaneous_problems() -> None:
    names = {problems.stem(load(name)) for name in GUARDED}
    assert names == {
        "crying_baby", "machine_replacement", "catch", "multicaregiver_crying_baby",
        "collaborative_predator_prey", "prisoners_dilemma", "rock_paper_scissors",
        "travelers_dilemma", "predator_prey",
    }  # fmt: skip


def everything(game: Game, log: list[str]) -> list[str]:
    """All that one person can see or ask for: screens, words, data and advice."""
    shown = [str(compose(game, room, Shown(), log).markup) for room in ROOMS]
    shown += [typed(Table(game), command) for command in ASKED]
    shown += [
        game.account.situation(game.view()),
        game.adviser.hint(),
        json.dumps(game.account.public(game.view())),
    ]
    for overlay in ("values", "policy", "states"):
        shown.append(compose(game, ROOMS[0], Shown(overlay=overlay), log).plain)
    return shown + (log[-1:] if game.session.turns else [])


def seated(name: str, seat: int, session: Session, *, reveal: bool = False) -> Game:
    """The game of one person whose seed is fresh and so not shown."""
    who = ["random"] * len(session.problem.agents)
    who[seat] = HUMAN
    return screens.seated(name, session, who, replace(secret(name), reveal=reveal))


@every_guarded
def test_games_that_a_seat_cannot_tell_apart_are_shown_alike(name: str) -> None:
    problem = small(name)
    for seat in range(len(problem.agents)):
        for pair in twins(name, seat)[:1]:
            games = [
                seated(name, seat, Session(problem, Told(game, seat, 10, others), limit=TURNS))
                for game, others in zip(pair, (11, 12), strict=True)
            ]
            logs: list[list[str]] = [[], []]
            for turn in range(len(pair.one.actions) + 1):
                one, other = (everything(*each) for each in zip(games, logs, strict=True))
                assert one == other
                if turn < len(pair.one.actions):
                    for game, log, told in zip(games, logs, pair, strict=True):
                        game.session.advance(list(told.actions[turn]))
                        log.append(game.account.said(game.view()))


@every_guarded
def test_what_is_hidden_is_seen_once_it_is_revealed(name: str) -> None:
    problem = small(name)
    if not problem.hidden:
        return
    for seat in range(len(problem.agents)):
        pair = twins(name, seat)[0]
        shown = []
        for told in pair:
            session = Session(problem, Told(told, seat, 10, 11), limit=TURNS)
            game = seated(name, seat, session, reveal=True)
            for actions in told.actions:
                game.session.advance(list(actions))
            shown.append([compose(game, room, Shown(), []).plain for room in ROOMS])
        assert all(one != other for one, other in zip(*shown, strict=True))


@pytest.mark.parametrize("name", TOGETHER)
def test_a_choice_stays_hidden_until_all_are_in(name: str) -> None:
    problem = small(name)
    agents = len(problem.agents)
    shown = []
    for chosen in (0, 1):
        nature = [draws(count, 0, 1)[0].tolist() for count in problem.draws]
        session = Session(problem, Scripted(*nature))
        game = screens.seated(name, session, [HUMAN] * agents, secret(name))
        assert not game.choose(chosen)
        assert game.watcher == 1
        shown.append(everything(game, []))
    assert shown[0] == shown[1]


@every_guarded
def test_no_command_tells_the_state_before_the_end(name: str) -> None:
    problem = small(name)
    if not problem.hidden:
        return
    told = twins(name, 0)[0].one
    game = seated(name, 0, Session(problem, Told(told, 0, 10, 11), limit=TURNS))
    assert "hidden" in typed(Table(game), "state")
    for command in COMMANDS:
        if command.name in ("quit", "reroll", "new", "restart"):
            continue
        try:
            words = typed(Table(game), command.name)
        except DmplayError as error:
            words = str(error)
        assert "truly" not in words
