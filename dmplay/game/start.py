"""Setting up games: new ones, resumed ones, and new ones that begin as another did."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dmplay.core import Problem
from dmplay.dice import Dice
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems
from dmplay.game import saves
from dmplay.game.checking import loaded, readable
from dmplay.game.game import Game, frame
from dmplay.game.keymap import AS_DRAWN, Keys, hands
from dmplay.game.request import Request, pairs, repeated
from dmplay.game.saves import OUTPUT, standard
from dmplay.game.seats import HUMAN, header, seat_policy, sitting
from dmplay.session import Session
from dmplay.transcript.format import Frame, turn_limit
from dmplay.transcript.reading import Transcript
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import replay

LARGEST_SEED = 2**63 - 1
NEW_SEEDS = 10**9  # few enough to type


def new(request: Request) -> Game:
    """A new game: its problem, who sits where, its dice and its transcript."""
    found = problems.resolve(request.name, request.configured())
    problem = found.problem
    keys = hands(problem, request.keys)
    seats = _seats(request, found)
    if request.turns is not None and request.turns > 0:
        turns = request.turns
        seats = [agents.for_turns(problem, n, who, turns) for n, who in enumerate(seats)]
    _answered(problem, seats, asks=request.asks)
    policies = [seat_policy(problem, seat, who) for seat, who in enumerate(seats)]
    seed = (
        int.from_bytes(os.urandom(8), "big") % NEW_SEEDS if request.seed is None else request.seed
    )
    if not 0 <= seed <= LARGEST_SEED:
        raise BadParameter(f"--seed: got {seed}, expected 0 to {LARGEST_SEED}")
    if request.turns is not None and request.turns < 1:
        raise BadParameter(f"--turns: got {request.turns}, expected at least 1")
    dice = Dice(seed, request.episode)
    limit = turn_limit(problem, seats, request.turns)
    session = Session(problem, dice, policies, limit=limit)
    path = request.record and standard(request.record, OUTPUT)
    if path is None and (request.keep or HUMAN in seats):
        path = saves.new(found.name)
    recorder = None
    if path:
        recorder = Recorder.create(
            path,
            header(found, seats, dice, request),
            session,
            frame=frame if request.frames else None,
            force=request.force,
        )
    game = Game(found.name, session, seats, recorder, request)
    game.hands = keys
    if request.seed is None:
        game.tells_seed = False
        game.again = request.command(found.name, seed)
    return game


def _seats(request: Request, found: problems.Loaded) -> list[str]:
    """Who sits where: the first seat, the others, and any named one."""
    problem = found.problem
    if request.others and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {found.name} has one seat only; use --agent")
    rest = range(1, len(problem.agents))
    seats = [request.agent]
    seats += [request.others or agents.roster(problem, seat).partner for seat in rest]
    for name, who in pairs(request.seats, "--seat").items():
        seats[problem.seat(name)] = str(who)
    return seats


def _answered(problem: Problem, seats: Sequence[str], *, asks: bool) -> None:
    """Refuses a game that waits for a person where nobody may be asked."""
    people = [agent for agent, who in zip(problem.agents, seats, strict=True) if who == HUMAN]
    if people and not asks:
        names = " and ".join(people)
        raise BadParameter(f"--no-input: {names} would be asked; let agents play every seat")


def resumed(path: Path, *, trusted: bool = False, keys: Keys = AS_DRAWN, asks: bool = True) -> Game:
    """The game of a transcript, to go on with: cut to its last whole turn, replayed from inputs."""
    transcript = readable(path)
    found = loaded(transcript, trusted=trusted)
    held = hands(found.problem, keys)
    for who in transcript.header.seats.values():
        kind = who.partition(":")[0]
        if kind in ("script", "replay"):
            raise BadParameter(
                f"{path}: a seat was played by a {kind}, which the file does not hold"
            )
    seats, policies = sitting(found.problem, transcript.header.seats, trusted=trusted)
    _answered(found.problem, seats, asks=asks)
    session = replay(transcript, found.problem, policies)
    if session.over and transcript.end:
        raise BadParameter(f"{path}: the game is over ({session.ending}); nothing to resume")
    recorder = Recorder.resume(path, transcript.content, session, _framing(transcript))
    asked = repeated(transcript.header, seats, path, keys)
    game = Game(found.name, session, seats, recorder, asked)
    game.hands = held
    game.tells_seed = False
    return game


def branched(  # noqa: PLR0913 - a place in a file, another file, and what is wanted of both
    path: Path,
    turn: int,
    record: Path,
    *,
    force: bool = False,
    trusted: bool = False,
    keys: Keys = AS_DRAWN,
    asks: bool = True,
) -> Game:
    """A new game whose first turns are those of a transcript; the rest is played."""
    transcript = readable(path)
    found = loaded(transcript, trusted=trusted)
    header, held = transcript.header, hands(found.problem, keys)
    told = replay(transcript, found.problem)
    if turn > len(told.turns):
        raise BadParameter(
            f"--at: got {turn}, {path} has {len(told.turns)} turn{'s' * (len(told.turns) != 1)}"
        )
    seats, policies = sitting(found.problem, header.seats, trusted=trusted)
    _answered(found.problem, seats, asks=asks)
    dice = Dice(header.seed, header.episode)
    limit = turn_limit(found.problem, seats, header.turns)
    session = Session(found.problem, dice, policies, limit=limit, opening=told.opening)
    framed = _framing(transcript)
    names = dict(zip(found.problem.agents, seats, strict=True))
    recorder = Recorder.create(
        record, replace(header, seats=names), session, frame=framed, force=force
    )
    _retell(told, turn, session, recorder)
    asked = repeated(header, seats, record, keys)
    game = Game(found.name, session, seats, recorder, asked)
    game.hands = held
    game.tells_seed = False
    return game


def _retell(told: Session, turns: int, session: Session, recorder: Recorder) -> None:
    """Plays and writes the first turns of a game again; one whose dice were thrown anew, so too."""
    for number, played in enumerate(told.turns[:turns], 1):
        actions = list(played.actions)
        if number in told.rerolls:
            session.advance(actions)
            recorder.turn()
            session.undo()
            session.rerolls[number] = told.rerolls[number]
            recorder.event("reroll", told.rerolls[number])
        session.advance(actions, played.draws)
        recorder.turn()


def _framing(transcript: Transcript) -> Frame | None:
    return frame if transcript.blocks[0].frame else None
