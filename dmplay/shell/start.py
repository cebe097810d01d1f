"""Setting up games: new ones, resumed ones, and played ones to look at again."""

import os
from dataclasses import replace
from pathlib import Path

from dmplay import catalog
from dmplay.dice import Dice
from dmplay.errors import BadParameter
from dmplay.session import Session
from dmplay.shell import saves
from dmplay.shell.checking import loaded
from dmplay.shell.game import Game, frame
from dmplay.shell.keymap import AS_DRAWN, Keys, hands
from dmplay.shell.request import Request, pairs, repeated
from dmplay.shell.saves import INPUT, OUTPUT, standard
from dmplay.shell.seats import HUMAN, header, seat_policy, sitting
from dmplay.transcript.format import CHOSEN, Frame, turn_limit
from dmplay.transcript.reading import Block, Transcript, read
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import play as play_block
from dmplay.transcript.replay import replay
from dmplay.transcript.replay import start as start_session

LARGEST_SEED = 2**63 - 1
NEW_SEEDS = 10**9  # few enough to type


def new(request: Request) -> Game:
    """A new game: its problem, who sits where, its dice and its transcript."""
    found = catalog.resolve(request.name, request.configured())
    problem = found.problem
    keys = hands(problem, request.keys)
    seats = _seats(request, found)
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


def _seats(request: Request, found: catalog.Loaded) -> list[str]:
    """Who sits where: the first seat, the others, and any named one."""
    problem = found.problem
    if request.others and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {found.name} has one seat only; use --agent")
    rest = range(1, len(problem.agents))
    seats = [request.agent]
    seats += [request.others or catalog.partner(problem, seat) for seat in rest]
    for name, who in pairs(request.seats, "--seat").items():
        seats[problem.seat(name)] = str(who)
    return seats


def resumed(path: Path, *, trusted: bool = False, keys: Keys = AS_DRAWN) -> Game:
    """The game of a transcript, to go on with: cut to its last whole turn, replayed from inputs."""
    transcript = _read(path)
    found = loaded(transcript, trusted=trusted)
    held = hands(found.problem, keys)
    for who in transcript.header.seats.values():
        kind = who.partition(":")[0]
        if kind in ("script", "replay"):
            raise BadParameter(
                f"{path}: a seat was played by a {kind}, which the file does not hold"
            )
    seats, policies = sitting(found.problem, transcript.header.seats, trusted=trusted)
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
) -> Game:
    """A new game whose first turns are those of a transcript; the rest is played."""
    transcript = _read(path)
    found = loaded(transcript, trusted=trusted)
    header, held = transcript.header, hands(found.problem, keys)
    told = replay(transcript, found.problem)
    if turn > len(told.turns):
        raise BadParameter(
            f"--at: got {turn}, {path} has {len(told.turns)} turn{'s' * (len(told.turns) != 1)}"
        )
    seats, policies = sitting(found.problem, header.seats, trusted=trusted)
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


def _read(path: Path) -> Transcript:
    try:
        return read(standard(path, INPUT))
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None


class Playback(Game):
    """A recorded game to step through; nothing in it is hidden any more."""

    def __init__(self, path: Path, *, trusted: bool = False) -> None:
        self.transcript = _read(path)
        found = loaded(self.transcript, trusted=trusted)
        self._problem = found.problem
        self._place = 0
        seats = list(self.transcript.header.seats.values())
        super().__init__(found.name, self._session(0), seats)
        self.people = []
        self.reveal = True

    def _session(self, blocks: int) -> Session:
        header = self.transcript.header
        session = start_session(self.transcript, self._problem, Dice(header.seed, header.episode))
        for block in self._blocks()[:blocks]:
            play_block(self.transcript, block, session)
        return session

    def _blocks(self) -> list[Block]:
        return self.transcript.blocks[1:]

    def unattended(self) -> bool:
        """Shows the next turn or event; False at the end of the file."""
        if self._place >= len(self._blocks()):
            reason = self.transcript.reason
            self.session.end(reason if reason in CHOSEN else "unfinished")
            return False
        play_block(self.transcript, self._blocks()[self._place], self.session)
        self._place += 1
        return True

    @property
    def source(self) -> Path | None:
        """The file that is looked at."""
        return Path(self.transcript.path)

    def redo(self) -> None:
        """A recording is only looked at."""
        raise BadParameter("a recording is only looked at; branch plays on")

    def reroll(self) -> None:
        """A recording is only looked at."""
        self.redo()

    def undo(self, turns: int = 1) -> None:
        """Shows the place so many turns or events back."""
        if self._place < turns:
            raise BadParameter("this is the beginning")
        self._place -= turns
        self.session = self._session(self._place)
        self._adviser.clear()
