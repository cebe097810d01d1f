"""Setting up games: new ones, resumed ones, and new ones that begin as another did."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from dmplay.advice.ghost import Ghost, create_ghost, find_ghost_name
from dmplay.core import Policy, Problem
from dmplay.describe import describe_end_reason, format_count
from dmplay.dice import SeededUniforms, new_seed
from dmplay.disk import check_not_source, write_file
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems, ways
from dmplay.game import saves
from dmplay.game.account import render_transcript_frame
from dmplay.game.checking import describe_problem_change, load_transcript_problem
from dmplay.game.game import REPEATED_UNIFORMS_NOTE, Game
from dmplay.game.playback import Playback
from dmplay.game.request import (
    AnyGameRequest,
    BranchRequest,
    GameRequest,
    ReplayRequest,
    ResumeRequest,
    parse_settings,
    request_from_header,
)
from dmplay.game.saves import STDOUT_PATH, load_transcript, resolve_dash
from dmplay.game.seats import (
    HUMAN,
    list_human_seats,
    load_resumed_players,
    make_header,
    make_seat_policy,
    name_in_transcript,
)
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import resolve_key_maps
from dmplay.session import Session
from dmplay.transcript.format import MODEL_PLAYER, FrameRenderer, resolve_turn_limit
from dmplay.transcript.header import Header
from dmplay.transcript.reading import Transcript, read_incomplete_transcript
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import check_seats, check_unattended_turns, replay
from dmplay.transcript.seal import (
    GameKey,
    disclose_transcript,
    is_concealed,
    make_game_key,
    mark_header_peeked,
    mark_peeked,
)

MAX_SEED = 2**63 - 1
UNRESUMABLE_PLAYERS = {
    "script": "a script",
    "replay": "a replay",
    MODEL_PLAYER: "a language model",
}  # when it ends


def start_game(request: AnyGameRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """The game that is wanted, by people who saw all of games of this luck."""
    match request:
        case GameRequest():
            return start_new_game(request, disclosed_games)
        case BranchRequest():
            return branch_game(request, disclosed_games)
        case ResumeRequest():
            return resume_game(request, disclosed_games)
        case ReplayRequest():
            return Playback(request.path, trusted=request.trusted, peek=request.peek)


def start_new_game(request: GameRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """A new game: its problem, who sits where, its dice and its transcript."""
    found = problems.resolve_problem(request.problem_name, request.changed_parameters())
    problem = found.problem
    resolve_key_maps(
        problem, request.key_preferences
    )  # refuses what cannot be, before anything is written
    seats = assign_players(request, found)
    _check_people_can_play(problem, seats, can_ask=request.can_ask)
    if HUMAN not in seats:
        _check_agents_only_options(request)
    policies = [
        make_seat_policy(problem, seat, who, request.turns) for seat, who in enumerate(seats)
    ]
    request, dice = _with_seed(replace(request, peeked=False, branched=None))
    session = Session(
        problem, dice, policies, turn_limit=resolve_turn_limit(problem, seats, request.turns)
    )
    ghost = _make_ghost(session, seats, request.ghost_agent)
    if make_game_key(found.name, dice) in disclosed_games:
        told = mark_header_peeked(make_header(found, seats, request, None), problem)
        request = replace(request, peeked=told.peeked)
    path, removed = _choose_transcript_path(request, seats, found.name)
    recorder = None
    if path:
        told = make_header(found, seats, request, path)
        framing = render_transcript_frame if request.record_frames else None
        recorder = Recorder.create(path, told, session, frame=framing, force=request.force)
        recorder.is_private = saves.is_save(path)
        if ghost:
            recorder.write_note(ghost.transcript_note)
    keyboard = Keyboard(problem, list_human_seats(seats), request.key_preferences)
    game = Game(found.name, session, seats, keyboard, recorder, request)
    game.removed_save_count = removed
    game.set_ghost(ghost)
    return game


def _check_agents_only_options(request: GameRequest) -> None:
    """Refuses what is of use to a person alone, or to a transcript, in a game that has neither."""
    if request.player:
        raise BadParameter("--player: no person plays this game")
    if request.has_rate_option:
        raise BadParameter("--rate: real time is for people; agents alone play at --speed")
    if request.record_frames and not (request.record_path or request.keep_save):
        raise BadParameter("--frames: no transcript is written; add -o FILE")


def _choose_transcript_path(
    request: GameRequest, player_names: Sequence[str], problem_name: str
) -> tuple[Path | None, int]:
    """Where a new game is written, if it is; how many older ones that are kept made room for it."""
    if request.record_path:
        return resolve_dash(request.record_path, STDOUT_PATH), 0
    if not request.keep_save and HUMAN not in player_names:
        return None, 0
    removed = saves.remove_old_saves()
    return saves.create_save(problem_name), removed


def _make_ghost(session: Session, player_names: Sequence[str], agent_name: str) -> Ghost | None:
    """The agent of this name beside the person, if one is wanted."""
    return create_ghost(session, list_human_seats(player_names), agent_name) if agent_name else None


def _with_seed(request: GameRequest) -> tuple[GameRequest, SeededUniforms]:
    """The request with a seed, a fresh one if it has none, and its dice."""
    if request.seed is None:
        request = replace(request, seed=new_seed(), is_seed_visible=False, has_fresh_seed=True)
    assert request.seed is not None
    if not 0 <= request.seed <= MAX_SEED:
        raise BadParameter(f"--seed: got {request.seed}, expected 0 to {MAX_SEED}")
    return request, SeededUniforms(request.seed, request.episode)


def assign_players(request: GameRequest, loaded_problem: problems.LoadedProblem) -> list[str]:
    """Who sits where: the first seat, the others, and any named one, as suits so many turns."""
    problem = loaded_problem.problem
    if request.other_agent and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {loaded_problem.name} has one seat only; use --agent")
    rest = range(1, len(problem.agents))
    seats = [request.agent]
    seats += [
        request.other_agent or agents.load_roster(problem, seat).default_partner for seat in rest
    ]
    for name, who in parse_settings(request.seats, "--seat").items():
        seats[problem.seat_index(name)] = str(who)
    turns = request.turns
    check_turn_limit(turns)
    if turns is None:
        return seats
    return [agents.plan_for_turn_limit(problem, seat, who, turns) for seat, who in enumerate(seats)]


def check_turn_limit(turn_limit: int | None) -> None:
    """Refuses a game of no turns."""
    if turn_limit is not None and turn_limit < 1:
        raise BadParameter(f"--turns: got {turn_limit}, expected at least 1")


def _check_people_can_play(problem: Problem, player_names: Sequence[str], *, can_ask: bool) -> None:
    """Refuses a game that waits for a person where nobody may be asked."""
    people = [
        agent for agent, who in zip(problem.agents, player_names, strict=True) if who == HUMAN
    ]
    if people and not can_ask:
        names = " and ".join(people)
        raise BadParameter(f"--no-input: {names} would be asked; let agents play every seat")


def resume_game(request: ResumeRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """The game of a transcript, to go on with: cut to its last whole turn, replayed from inputs."""
    path, transcript = request.path, load_transcript(request.path, read_incomplete_transcript)
    found = load_transcript_problem(transcript, trusted=request.trusted)
    resolve_key_maps(found.problem, request.key_preferences)
    check_seats(transcript, found.problem)
    for who in transcript.header.seats.values():
        kind = UNRESUMABLE_PLAYERS.get(who.partition(":")[0])
        if kind:
            raise BadParameter(f"{path}: a seat was played by {kind}, which the file does not hold")
    seats, policies = _load_players(transcript, found.problem, trusted=request.trusted)
    _check_people_can_play(found.problem, seats, can_ask=request.can_ask)
    check_unattended_turns(transcript, seats, request.turn_limit)
    session = replay(transcript, found.problem, policies)
    if session.over and transcript.end_block:
        raise BadParameter(
            f"{path}: the game is over ({describe_end_reason(session.end_reason)}); nothing to resume"
        )
    seen = make_game_key(found.name, session.uniform_source) in disclosed_games or not is_concealed(
        transcript, found.problem
    )
    goes_on = seen and not session.over
    if goes_on and mark_header_peeked(transcript.header, found.problem, str(path)).peeked:
        transcript = mark_peeked(transcript)
    before = find_ghost_name(transcript.notes, found.problem)
    ghost = _make_ghost(session, seats, request.ghost_agent or before)
    recorder = Recorder.resume(path, transcript.content, session, _frame_renderer(transcript))
    if not transcript.blocks:
        recorder.write_turn()
    game = _make_continued_game(found, transcript.header, seats, request, recorder)
    game.warning = describe_problem_change(transcript, found)
    game.repeats_uniforms = REPEATED_UNIFORMS_NOTE in transcript.notes
    if ghost and ghost.name != before:
        recorder.write_note(ghost.transcript_note)
    game.set_ghost(ghost)
    return game


def branch_game(request: BranchRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """A new game whose first turns are those of a transcript; the rest is played."""
    transcript = load_transcript(request.path)
    check_not_source(request.record_path, transcript.path)
    found = load_transcript_problem(transcript, trusted=request.trusted)
    resolve_key_maps(found.problem, request.key_preferences)
    past = replay(transcript, found.problem)
    if request.turn > len(past.turns):
        turns = format_count(len(past.turns), "turn")
        raise BadParameter(f"--at: got {request.turn}, {request.path} has {turns}")
    seats, policies = _load_players(transcript, found.problem, trusted=request.trusted)
    _check_people_can_play(found.problem, seats, can_ask=request.can_ask)
    told = [name_in_transcript(who, request.record_path) for who in seats]
    names = dict(zip(found.problem.agents, told, strict=True))
    place = name_in_transcript(found.name, request.record_path)
    header = replace(
        transcript.header, problem=place, origin=found.origin, seats=names, branched=request.turn
    )
    header = mark_header_peeked(header, found.problem, transcript.path)
    if make_game_key(found.name, header.uniform_source) not in disclosed_games:
        disclose_transcript(transcript, found.problem, peek=request.peek)
    check_unattended_turns(transcript, seats, request.turn_limit)
    limit = resolve_turn_limit(found.problem, seats, header.turns)
    session = Session(
        found.problem,
        header.uniform_source,
        policies,
        turn_limit=limit,
        initial_uniforms=past.initial_uniforms,
    )
    recorder = Recorder.create(
        request.record_path, header, session, frame=_frame_renderer(transcript), force=request.force
    )
    warning = describe_problem_change(transcript, found)
    del transcript  # what it holds of every turn is held by both sessions
    _copy_turns(past, request.turn, session, recorder)
    game = _make_continued_game(found, header, seats, request, recorder)
    game.warning = warning
    return game


def _load_players(
    transcript: Transcript, problem: Problem, *, trusted: bool
) -> tuple[list[str], list[Policy | None]]:
    """Who plays on where a transcript leaves off."""
    folder = ways.transcript_folder(Path(transcript.path))
    return load_resumed_players(problem, transcript.header, trusted=trusted, folder=folder)


def _make_continued_game(
    loaded_problem: problems.LoadedProblem,
    header: Header,
    player_names: Sequence[str],
    request: ResumeRequest,
    recorder: Recorder,
) -> Game:
    """A game that goes on from a transcript."""
    recorder.is_private = saves.is_save(recorder.path)
    asked = request_from_header(
        replace(header, problem=loaded_problem.name),
        player_names,
        recorder.path,
        request.key_preferences,
    )
    keyboard = Keyboard(
        loaded_problem.problem, list_human_seats(player_names), request.key_preferences
    )
    return Game(loaded_problem.name, recorder.session, player_names, keyboard, recorder, asked)


def _copy_turns(
    past_session: Session, turn_count: int, session: Session, recorder: Recorder
) -> None:
    """Plays and writes the first turns of a game again; one whose dice were thrown anew, so too.

    All help that was given in it counts.
    """
    if past_session.hint_counts:
        session.hint_counts.update(past_session.hint_counts)
        recorder.write_event("help", dict(past_session.hint_counts))
    for number, played in enumerate(past_session.turns[:turn_count], 1):
        if number in past_session.reroll_counts:
            session.advance(list(played.actions))
            recorder.write_turn()
            session.undo()
            session.reroll_counts[number] = past_session.reroll_counts[number]
            recorder.write_event("reroll", past_session.reroll_counts[number])
        session.append_turns([played])
        recorder.write_turn()


def write_game_copy(game: Game, path: Path) -> None:
    """Writes a game of which no whole transcript is kept, as far as it came."""
    asked, played = game.request, game.session
    assert asked
    found = problems.resolve_problem(asked.problem_name, asked.changed_parameters())
    session = played.copy_at_start()
    with TemporaryDirectory() as place:
        draft = Path(place, path.name)
        framing = render_transcript_frame if asked.record_frames else None
        recorder = Recorder.create(
            draft, make_header(found, game.player_names, asked, path), session, frame=framing
        )
        _copy_turns(played, len(played.turns), session, recorder)
        if played.over:
            session.end(played.end_reason or "")
            recorder.write_end()
        recorder.close()
        if recorder.write_error:
            raise BadParameter(f"cannot write {draft}: {recorder.write_error.strerror}")
        private = game.problem.partially_observable and not played.over
        write_file(path, [draft.read_text(encoding="utf-8")], private=private)


def _frame_renderer(transcript: Transcript) -> FrameRenderer | None:
    return render_transcript_frame if any(block.frame for block in transcript.blocks[:1]) else None
