"""Setting up games: new ones, resumed ones, and played ones to look at again."""

import os
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dmplay import catalog
from dmplay.dice import Dice
from dmplay.errors import BadParameter
from dmplay.session import Session
from dmplay.shell import saves
from dmplay.shell.checking import loaded
from dmplay.shell.game import Game, frame
from dmplay.shell.plain import Objects, Reporter, Sentences, Silence, play
from dmplay.shell.screen import Screen
from dmplay.shell.screen import run as run_screen
from dmplay.shell.seats import HUMAN, header, seat_policy, sitting
from dmplay.shell.signals import leaving
from dmplay.shell.terminal import Terminal
from dmplay.transcript.format import Frame, turn_limit
from dmplay.transcript.reading import Block, Transcript, read
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.verify import CHOSEN, replay
from dmplay.transcript.verify import play as play_block
from dmplay.transcript.verify import start as start_session

LARGEST_SEED = 2**63 - 1
NEW_SEEDS = 10**9  # few enough to type


@dataclass(frozen=True)
class Request:
    """What the command line asked for."""

    problem: str
    variant: str = ""
    settings: Sequence[str] = ()
    seed: int | None = None
    episode: int = 0
    agent: str = HUMAN
    others: str = ""
    seats: Sequence[str] = ()
    turns: int | None = None
    record: Path | None = None
    frames: bool = False
    force: bool = False
    strict: bool = False
    reveal: bool = False
    parameters: Mapping[str, object] = field(default_factory=dict)


def new(request: Request) -> Game:
    """A new game: its problem, who sits where, its dice and its transcript."""
    name = f"{request.problem}:{request.variant}" if request.variant else request.problem
    found = catalog.resolve(name, pairs(request.settings, "--set"))
    problem = found.problem
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
    path = request.record
    if path is None and HUMAN in seats:
        path = saves.new(found.name)
    recorder = None
    if path:
        recorder = Recorder.create(
            path,
            header(found, seats, dice, request.turns),
            session,
            frame=frame if request.frames else None,
            force=request.force,
        )
    game = Game(found.name, session, seats, recorder)
    if request.seed is None:
        game.tells_seed = False
        game.again = _again(request, found.name, seed)
    game.strict, game.reveal = request.strict, request.reveal
    return game


def _again(request: Request, name: str, seed: int) -> str:
    """The command that plays the same game with the same dice."""
    words = ["dmplay", name]
    for option, values in (("--set", request.settings), ("--seat", request.seats)):
        words += [word for value in values for word in (option, value)]
    if request.agent != HUMAN:
        words += ["--agent", request.agent]
    if request.others:
        words += ["--vs", request.others]
    if request.turns is not None:
        words += ["--turns", str(request.turns)]
    if request.episode:
        words += ["--episode", str(request.episode)]
    wishes = {"--strict": request.strict, "--reveal": request.reveal, "--frames": request.frames}
    words += [option for option, wish in wishes.items() if wish]
    return shlex.join([*words, "--seed", str(seed)])


def pairs(settings: Sequence[str], option: str) -> dict[str, object]:
    """The settings `NAME=VALUE` of an option."""
    found: dict[str, object] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            raise BadParameter(f"{option}: got {setting!r}, expected NAME=VALUE")
        found[key.strip()] = value.strip()
    return found


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


def resumed(path: Path, *, trusted: bool = False) -> Game:
    """The game of a transcript, to go on with: cut to its last whole turn, replayed from inputs."""
    transcript = _read(path)
    found = loaded(transcript, trusted=trusted)
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
    game = Game(found.name, session, seats, recorder)
    game.tells_seed = False
    return game


def branched(
    path: Path, turn: int, record: Path, *, force: bool = False, trusted: bool = False
) -> Game:
    """A new game whose first turns are those of a transcript; the rest is played."""
    transcript = _read(path)
    found = loaded(transcript, trusted=trusted)
    header = transcript.header
    told = replay(transcript, found.problem)
    if turn > len(told.turns):
        raise BadParameter(f"--at: got {turn}, {path} has {len(told.turns)} turns")
    seats, policies = sitting(found.problem, header.seats, trusted=trusted)
    dice = Dice(header.seed, header.episode)
    limit = turn_limit(found.problem, seats, header.turns)
    session = Session(found.problem, dice, policies, limit=limit, opening=told.opening)
    framed = _framing(transcript)
    names = dict(zip(found.problem.agents, seats, strict=True))
    recorder = Recorder.create(
        record, replace(header, seats=names), session, frame=framed, force=force
    )
    for played in told.turns[:turn]:
        session.advance(list(played.actions), played.draws)
        recorder.turn()
    game = Game(found.name, session, seats, recorder)
    game.tells_seed = False
    return game


def _framing(transcript: Transcript) -> Frame | None:
    return frame if transcript.blocks[0].frame else None


def _read(path: Path) -> Transcript:
    try:
        return read(path)
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
            end = self.transcript.end
            told = end["end"] if end else {}
            reason = str(told.get("reason")) if isinstance(told, dict) else ""
            self.session.end(reason if reason in CHOSEN else "unfinished")
            return False
        play_block(self.transcript, self._blocks()[self._place], self.session)
        self._place += 1
        return True

    def redo(self) -> None:
        """A recording is only looked at."""
        raise BadParameter("a recording is only looked at; dmplay branch plays on")

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


def run(  # noqa: PLR0913 - a game, how to talk, and what is wanted beside it
    game: Game,
    terminal: Terminal,
    *,
    json: bool = False,
    quiet: bool = False,
    speed: float = 2.0,
    rate: float | None = None,
) -> int:
    """Plays a game with the front end that the terminal allows; returns the exit code."""
    code = 0
    try:
        with leaving():
            if terminal.screen and not quiet:
                screen = Screen(game, terminal, speed, rate)
                code = run_screen(screen)
                game.finish("interrupted" if code else "quit")
                print(game.result())
            else:
                reporter: Reporter = Silence() if quiet else Objects() if json else Sentences()
                play(game, terminal, sys.stdin, reporter)
    except (KeyboardInterrupt, BrokenPipeError, SystemExit):
        game.finish("interrupted")
        raise
    finally:
        _epilogue(game, quiet)
    return code or _kept(game)


def _epilogue(game: Game, quiet: bool) -> None:
    """Where the transcript is, how to see it again, how to play it again."""
    recorder = game.recorder
    if quiet:
        return
    rows = []
    if recorder and not recorder.fault:
        rows += [f"transcript: {recorder.path}", f"replay: dmplay replay {recorder.path}"]
    if game.again:
        rows.append(f"again: {game.again}")
    for row in rows:
        print(row, file=sys.stderr)


def _kept(game: Game) -> int:
    """Exit code 1, and a line, where turns could not be written."""
    recorder = game.recorder
    if recorder is None or recorder.fault is None:
        return 0
    print(f"error: cannot write {recorder.path}: {recorder.fault.strerror}", file=sys.stderr)
    return 1
