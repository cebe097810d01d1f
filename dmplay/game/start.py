"""Setting up games: new ones, resumed ones, and new ones that begin as another did."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from dmplay.advice.ghost import Ghost, beside, noted
from dmplay.core import Policy, Problem
from dmplay.describe import counted, ended
from dmplay.dice import Dice, fresh
from dmplay.disk import apart, write
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems, ways
from dmplay.game import saves
from dmplay.game.account import frame
from dmplay.game.checking import altered, loaded
from dmplay.game.game import AGAIN, Game
from dmplay.game.playback import Playback
from dmplay.game.request import Branching, Recording, Request, Resumption, Wanted, pairs, repeated
from dmplay.game.saves import OUTPUT, readable, standard
from dmplay.game.seats import HUMAN, header, people, seat_policy, sitting, told_in
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import hands
from dmplay.session import Session
from dmplay.transcript.format import MODEL, Frame, turn_limit
from dmplay.transcript.header import Header
from dmplay.transcript.reading import Transcript, left
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import check_seats, replay, unattended
from dmplay.transcript.seal import Luck, going_on, luck, marked, opened, sealed

LARGEST_SEED = 2**63 - 1
GONE = {"script": "a script", "replay": "a replay", MODEL: "a language model"}  # when it ends


def begin(wanted: Wanted, shown: Collection[Luck] = ()) -> Game:
    """The game that is wanted, by people who saw all of games of this luck."""
    match wanted:
        case Request():
            return new(wanted, shown)
        case Branching():
            return branched(wanted, shown)
        case Resumption():
            return resumed(wanted, shown)
        case Recording():
            return Playback(wanted.path, trusted=wanted.trusted, peek=wanted.peek)


def new(request: Request, shown: Collection[Luck] = ()) -> Game:
    """A new game: its problem, who sits where, its dice and its transcript."""
    found = problems.resolve(request.name, request.configured())
    problem = found.problem
    hands(problem, request.keys)  # refuses what cannot be, before anything is written
    seats = seated(request, found)
    _answered(problem, seats, asks=request.asks)
    if HUMAN not in seats:
        _alone(request)
    policies = [seat_policy(problem, seat, who, request.turns) for seat, who in enumerate(seats)]
    request, dice = _thrown(replace(request, peeked=False, branched=None))
    session = Session(problem, dice, policies, limit=turn_limit(problem, seats, request.turns))
    ghost = _ghost(session, seats, request.ghost)
    if luck(found.name, dice) in shown:
        told = going_on(header(found, seats, request, None), problem)
        request = replace(request, peeked=told.peeked)
    path, removed = _place(request, seats, found.name)
    recorder = None
    if path:
        told = header(found, seats, request, path)
        framing = frame if request.frames else None
        recorder = Recorder.create(path, told, session, frame=framing, force=request.force)
        recorder.private = saves.keeps(path)
        if ghost:
            recorder.note(ghost.note)
    keyboard = Keyboard(problem, people(seats), request.keys)
    game = Game(found.name, session, seats, keyboard, recorder, request)
    game.removed = removed
    game.haunt(ghost)
    return game


def _alone(request: Request) -> None:
    """Refuses what is of use to a person alone, or to a transcript, in a game that has neither."""
    if request.player:
        raise BadParameter("--player: no person plays this game")
    if request.timed:
        raise BadParameter("--rate: real time is for people; agents alone play at --speed")
    if request.frames and not (request.record or request.keep):
        raise BadParameter("--frames: no transcript is written; add -o FILE")


def _place(request: Request, seats: Sequence[str], name: str) -> tuple[Path | None, int]:
    """Where a new game is written, if it is; how many older ones that are kept made room for it."""
    if request.record:
        return standard(request.record, OUTPUT), 0
    if not request.keep and HUMAN not in seats:
        return None, 0
    removed = saves.cleared()
    return saves.new(name), removed


def _ghost(session: Session, seats: Sequence[str], name: str) -> Ghost | None:
    """The agent of this name beside the person, if one is wanted."""
    return beside(session, people(seats), name) if name else None


def _thrown(request: Request) -> tuple[Request, Dice]:
    """The request with a seed, a fresh one if it has none, and its dice."""
    if request.seed is None:
        request = replace(request, seed=fresh(), seed_known=False, fresh=True)
    assert request.seed is not None
    if not 0 <= request.seed <= LARGEST_SEED:
        raise BadParameter(f"--seed: got {request.seed}, expected 0 to {LARGEST_SEED}")
    return request, Dice(request.seed, request.episode)


def seated(request: Request, found: problems.Loaded) -> list[str]:
    """Who sits where: the first seat, the others, and any named one, as suits so many turns."""
    problem = found.problem
    if request.others and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {found.name} has one seat only; use --agent")
    rest = range(1, len(problem.agents))
    seats = [request.agent]
    seats += [request.others or agents.roster(problem, seat).partner for seat in rest]
    for name, who in pairs(request.seats, "--seat").items():
        seats[problem.seat(name)] = str(who)
    turns = request.turns
    check_turns(turns)
    if turns is None:
        return seats
    return [agents.for_turns(problem, seat, who, turns) for seat, who in enumerate(seats)]


def check_turns(turns: int | None) -> None:
    """Refuses a game of no turns."""
    if turns is not None and turns < 1:
        raise BadParameter(f"--turns: got {turns}, expected at least 1")


def _answered(problem: Problem, seats: Sequence[str], *, asks: bool) -> None:
    """Refuses a game that waits for a person where nobody may be asked."""
    people = [agent for agent, who in zip(problem.agents, seats, strict=True) if who == HUMAN]
    if people and not asks:
        names = " and ".join(people)
        raise BadParameter(f"--no-input: {names} would be asked; let agents play every seat")


def resumed(wanted: Resumption, shown: Collection[Luck] = ()) -> Game:
    """The game of a transcript, to go on with: cut to its last whole turn, replayed from inputs."""
    path, transcript = wanted.path, readable(wanted.path, left)
    found = loaded(transcript, trusted=wanted.trusted)
    hands(found.problem, wanted.keys)
    check_seats(transcript, found.problem)
    for who in transcript.header.seats.values():
        kind = GONE.get(who.partition(":")[0])
        if kind:
            raise BadParameter(f"{path}: a seat was played by {kind}, which the file does not hold")
    seats, policies = _sitting(transcript, found.problem, trusted=wanted.trusted)
    _answered(found.problem, seats, asks=wanted.asks)
    unattended(transcript, seats, wanted.turns)
    session = replay(transcript, found.problem, policies)
    if session.over and transcript.end:
        raise BadParameter(f"{path}: the game is over ({ended(session.ending)}); nothing to resume")
    seen = luck(found.name, session.source) in shown or not sealed(transcript, found.problem)
    goes_on = seen and not session.over
    if goes_on and going_on(transcript.header, found.problem, str(path)).peeked:
        transcript = marked(transcript)
    before = noted(transcript.notes, found.problem)
    ghost = _ghost(session, seats, wanted.ghost or before)
    recorder = Recorder.resume(path, transcript.content, session, _framing(transcript))
    if not transcript.blocks:
        recorder.turn()
    game = _repeated(found, transcript.header, seats, wanted, recorder)
    game.warning = altered(transcript, found)
    game.repeats = AGAIN in transcript.notes
    if ghost and ghost.name != before:
        recorder.note(ghost.note)
    game.haunt(ghost)
    return game


def branched(wanted: Branching, shown: Collection[Luck] = ()) -> Game:
    """A new game whose first turns are those of a transcript; the rest is played."""
    transcript = readable(wanted.path)
    apart(wanted.record, transcript.path)
    found = loaded(transcript, trusted=wanted.trusted)
    hands(found.problem, wanted.keys)
    past = replay(transcript, found.problem)
    if wanted.turn > len(past.turns):
        turns = counted(len(past.turns), "turn")
        raise BadParameter(f"--at: got {wanted.turn}, {wanted.path} has {turns}")
    seats, policies = _sitting(transcript, found.problem, trusted=wanted.trusted)
    _answered(found.problem, seats, asks=wanted.asks)
    told = [told_in(who, wanted.record) for who in seats]
    names = dict(zip(found.problem.agents, told, strict=True))
    place = told_in(found.name, wanted.record)
    header = replace(
        transcript.header, problem=place, origin=found.origin, seats=names, branched=wanted.turn
    )
    header = going_on(header, found.problem, transcript.path)
    if luck(found.name, header.dice) not in shown:
        opened(transcript, found.problem, peek=wanted.peek)
    unattended(transcript, seats, wanted.turns)
    limit = turn_limit(found.problem, seats, header.turns)
    session = Session(found.problem, header.dice, policies, limit=limit, opening=past.opening)
    recorder = Recorder.create(
        wanted.record, header, session, frame=_framing(transcript), force=wanted.force
    )
    warning = altered(transcript, found)
    del transcript  # what it holds of every turn is held by both sessions
    _retell(past, wanted.turn, session, recorder)
    game = _repeated(found, header, seats, wanted, recorder)
    game.warning = warning
    return game


def _sitting(
    transcript: Transcript, problem: Problem, *, trusted: bool
) -> tuple[list[str], list[Policy | None]]:
    """Who plays on where a transcript leaves off."""
    folder = ways.beside(Path(transcript.path))
    return sitting(problem, transcript.header, trusted=trusted, folder=folder)


def _repeated(
    found: problems.Loaded,
    header: Header,
    seats: Sequence[str],
    wanted: Resumption,
    recorder: Recorder,
) -> Game:
    """A game that goes on from a transcript."""
    recorder.private = saves.keeps(recorder.path)
    asked = repeated(replace(header, problem=found.name), seats, recorder.path, wanted.keys)
    keyboard = Keyboard(found.problem, people(seats), wanted.keys)
    return Game(found.name, recorder.session, seats, keyboard, recorder, asked)


def _retell(told: Session, turns: int, session: Session, recorder: Recorder) -> None:
    """Plays and writes the first turns of a game again; one whose dice were thrown anew, so too.

    All help that was given in it counts.
    """
    if told.help:
        session.help.update(told.help)
        recorder.event("help", dict(told.help))
    for number, played in enumerate(told.turns[:turns], 1):
        if number in told.rerolls:
            session.advance(list(played.actions))
            recorder.turn()
            session.undo()
            session.rerolls[number] = told.rerolls[number]
            recorder.event("reroll", told.rerolls[number])
        session.repeat([played])
        recorder.turn()


def retold(game: Game, path: Path) -> None:
    """Writes a game of which no whole transcript is kept, as far as it came."""
    asked, played = game.request, game.session
    assert asked
    found = problems.resolve(asked.name, asked.configured())
    session = played.anew()
    with TemporaryDirectory() as place:
        draft = Path(place, path.name)
        framing = frame if asked.frames else None
        recorder = Recorder.create(
            draft, header(found, game.seats, asked, path), session, frame=framing
        )
        _retell(played, len(played.turns), session, recorder)
        if played.over:
            session.end(played.ending or "")
            recorder.end()
        recorder.close()
        if recorder.fault:
            raise BadParameter(f"cannot write {draft}: {recorder.fault.strerror}")
        private = game.problem.hidden and not played.over
        write(path, [draft.read_text(encoding="utf-8")], private=private)


def _framing(transcript: Transcript) -> Frame | None:
    return frame if any(block.frame for block in transcript.blocks[:1]) else None
