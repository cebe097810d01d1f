"""Functions that set up games: new, resumed, and branched from a transcript."""

import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from dmplay.agents.base import AdviceQuestion
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, find_seat
from dmplay.core.safe_files import is_game_running, write_file
from dmplay.core.session import DEFAULT_TURN_LIMIT, Session
from dmplay.core.text import describe_end_reason, format_count
from dmplay.core.uniforms import SeededUniforms, new_seed
from dmplay.errors import BadParameter
from dmplay.game import saves
from dmplay.game.action_input import Keyboard
from dmplay.game.game import Game
from dmplay.game.hints.ghost_agent import Ghost, create_ghost, find_ghost_name
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.key_bindings import resolve_key_maps
from dmplay.game.launch_requests import (
    AnyGameRequest,
    BranchRequest,
    GameRequest,
    ReplayRequest,
    ResumeRequest,
    parse_settings,
    request_from_header,
)
from dmplay.game.narration import render_transcript_frame
from dmplay.game.playback import Playback
from dmplay.game.predictions import VALUE, BeliefPrompt, Predictor
from dmplay.game.saves import STDOUT_PATH, load_transcript, resolve_dash_to_stream
from dmplay.game.seats import (
    HUMAN,
    list_human_seats,
    list_scripts,
    load_resumed_players,
    make_header,
    make_seat_policy,
    name_in_transcript,
    shorten_player_name,
)
from dmplay.game.start_seeds import draw_seed
from dmplay.game.transcript_verification import describe_problem_change, load_transcript_problem
from dmplay.registry import agents, problem_name_kinds, problems
from dmplay.transcript.concealment import (
    GameKey,
    has_hidden_information,
    is_concealed,
    make_game_key,
    mark_header_peeked,
    mark_peeked,
    mark_peeked_if_concealed,
)
from dmplay.transcript.external_players import MODEL_PLAYER
from dmplay.transcript.format import (
    NATURAL_END_REASONS,
    REPEATED_UNIFORMS_PREFIX,
    FrameRenderer,
    resolve_turn_limit,
)
from dmplay.transcript.header import Header
from dmplay.transcript.reader import Transcript, read_incomplete_transcript
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import check_seats, check_unattended_turns, replay

MAX_SEED = 2**63 - 1
# players that cannot be resumed, and their descriptions
UNRESUMABLE_PLAYERS = {"script": "a script", "replay": "a replay", MODEL_PLAYER: "a language model"}


def start_game(request: AnyGameRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """Return the game that a request describes: new, resumed, branched or replayed.

    `disclosed_games` are the keys of games whose hidden information the players have already seen.
    """
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
    """Return a new game: its problem, players, uniforms and transcript.

    If the players have already seen this game's hidden information, it is marked as peeked.
    """
    loaded_problem = request.load_problem()
    problem = loaded_problem.problem
    # Raises for invalid keys before a file is written.
    resolve_key_maps(problem, request.key_preferences)
    seats = assign_players(
        loaded_problem, request.agent, request.other_agent, request.seats, request.turns
    )
    _check_people_can_play(problem, seats, can_ask=request.can_ask)
    if HUMAN not in seats:
        _check_agents_only_options(request)
        request = replace(request, player="")
    policies = [
        make_seat_policy(problem, seat, player, request.turns) for seat, player in enumerate(seats)
    ]
    request = replace(request, peeked=False, branched=None, earlier=())
    request, uniforms = _seed_request(request, problem, seats)
    session = Session(
        problem, uniforms, policies, turn_limit=resolve_turn_limit(problem, seats, request.turns)
    )
    ghost = _make_ghost(session, seats, request.ghost_agent)
    predictor = _make_predictor(session, seats, request)
    if make_game_key(loaded_problem.name, uniforms) in disclosed_games:
        game_header = mark_header_peeked(make_header(loaded_problem, seats, request, None), problem)
        request = replace(request, peeked=game_header.peeked)
    path, save_removal = _choose_transcript_path(request, seats, loaded_problem.name)
    recorder = None
    if path:
        game_header = make_header(loaded_problem, seats, request, path)
        renderer = render_transcript_frame if request.record_frames else None
        recorder = Recorder.create(path, game_header, session, frame=renderer, force=request.force)
        recorder.is_private = saves.is_save(path)
        if ghost:
            recorder.write_note(ghost.transcript_note)
    keyboard = Keyboard(problem, list_human_seats(seats), request.key_preferences)
    game = Game(loaded_problem.name, session, seats, keyboard, recorder, request)
    game.save_removal = save_removal
    game.set_ghost(ghost)
    game.predictor = predictor
    return game


def _make_predictor(
    session: Session, player_names: Sequence[str], request: GameRequest
) -> Predictor | None:
    """Return the predictor of the person's seat; None if nothing is asked between turns.

    Raise BadParameter unless one person plays, and the game allows these predictions.
    """
    if not (request.prediction or request.states_belief):
        return None
    option = "--state-belief" if request.states_belief else "--predict"
    seats = list_human_seats(player_names)
    if request.prediction and request.states_belief:
        raise BadParameter("--predict and --state-belief: expected only one of them")
    if len(seats) != 1:
        raise BadParameter(f"{option}: got {len(seats)} human players, expected one")
    if "rate" in request.typed_options:
        raise BadParameter(f"{option}: real time leaves no time to answer; leave out --rate")
    if request.states_belief:
        return BeliefPrompt(session, seats[0])
    if request.prediction == VALUE and request.strict == "hints":
        raise BadParameter("--predict value: this game forbids hints (--strict=hints)")
    players = [*map(shorten_player_name, player_names)]
    scripts = list_scripts(session, player_names)
    question = AdviceQuestion.of_session(session, seats[0], players, scripts)
    provider = HintProvider(session, question)
    return Predictor(request.prediction, session, seats[0], provider)


def _check_agents_only_options(request: GameRequest) -> None:
    """Raise BadParameter for options that a game of agents alone does not support.

    Those of a settings file do not count where they have no use.
    """
    if request.player and "player" in request.typed_options:
        raise BadParameter("--player: no person plays this game")
    if "rate" in request.typed_options:
        raise BadParameter(
            "--rate: real time needs a human player; if only agents play, use --speed"
        )
    is_recorded = bool(request.record_path) or request.keep_save
    if request.record_frames and not is_recorded and "frames" in request.typed_options:
        raise BadParameter("--frames: no transcript is written; add -o FILE")


def _choose_transcript_path(
    request: GameRequest, player_names: Sequence[str], problem_name: str
) -> tuple[Path | None, saves.SaveRemoval]:
    """Return the path of a new game's transcript, or None, and the saves deleted for it."""
    if request.record_path and request.numbered_file_name:
        path = saves.create_game_file(request.record_path, request.numbered_file_name)
        return path, saves.SaveRemoval()
    if request.record_path:
        return resolve_dash_to_stream(request.record_path, STDOUT_PATH), saves.SaveRemoval()
    if not request.keep_save and HUMAN not in player_names:
        return None, saves.SaveRemoval()
    save_removal = saves.remove_old_saves(request.kept_megabytes)
    return saves.create_save(problem_name), save_removal


def _make_ghost(session: Session, player_names: Sequence[str], agent_name: str) -> Ghost | None:
    """Return the ghost with this agent; None if the name is empty."""
    return create_ghost(session, list_human_seats(player_names), agent_name) if agent_name else None


def _seed_request(
    request: GameRequest, problem: Problem, player_names: Sequence[str]
) -> tuple[GameRequest, SeededUniforms]:
    """Return the request with a seed, newly drawn if it has none, and the seed's uniforms.

    A person's new game does not end at once if it need not. Raise BadParameter if the seed is out
    of range.
    """
    if request.seed is None:
        is_of_person = HUMAN in player_names and request.person_label == HUMAN
        is_checked = is_of_person and not request.is_handed_in
        seed = draw_seed(problem, request.episode, request.turns) if is_checked else new_seed()
        request = replace(request, seed=seed, is_seed_visible=False, has_fresh_seed=True)
    assert request.seed is not None
    if not 0 <= request.seed <= MAX_SEED:
        raise BadParameter(f"--seed: got {request.seed}, expected 0 to {MAX_SEED}")
    return request, SeededUniforms(request.seed, request.episode)


def assign_players(
    loaded_problem: problems.LoadedProblem,
    first_agent: str,
    other_agent: str,
    seat_settings: Sequence[str],
    turns: int | None,
) -> list[str]:
    """Return the player of each seat, from `--agent`, `--vs`, `--seat` and `--turns`.

    Seats without a player get the default partner; the first seat gets the default agent. With a
    turn limit, agents that plan for a horizon plan for that number of turns. Raise BadParameter if
    `--agent` or `--vs` is for no seat, because `--seat` names the players of all its seats.
    """
    problem = loaded_problem.problem
    if other_agent and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {loaded_problem.name} has only one seat; use --agent")
    other_seats = range(1, len(problem.agents))
    players = [first_agent or agents.default_agent_name(problem, 0, turns)]
    players += [
        other_agent or agents.load_roster(problem, seat).default_partner for seat in other_seats
    ]
    named_seats = set[int]()
    for name, player in parse_settings(seat_settings, "--seat").items():
        named_seats.add(seat := find_seat(problem, name))
        players[seat] = str(player)
    for option, agent, seats in (
        ("--agent", "" if first_agent == HUMAN else first_agent, range(1)),
        ("--vs", other_agent, other_seats),
    ):
        if agent and named_seats.issuperset(seats):
            names = " and ".join(problem.agents[seat] for seat in seats)
            raise BadParameter(f"{option}: --seat also sets {names}; leave out one of the options")
    check_turn_limit(turns)
    if turns is None:
        return players
    return [
        agents.set_horizon_in_name(problem, seat, player, turns)
        for seat, player in enumerate(players)
    ]


def check_turn_limit(turn_limit: int | None) -> None:
    """Raise BadParameter if the turn limit is less than 1."""
    if turn_limit is not None and turn_limit < 1:
        raise BadParameter(f"--turns: got {turn_limit}, expected at least 1")


def _check_people_can_play(problem: Problem, player_names: Sequence[str], *, can_ask: bool) -> None:
    """Raise BadParameter if a person plays but cannot be asked for actions."""
    human_agents = [
        agent for agent, player in zip(problem.agents, player_names, strict=True) if player == HUMAN
    ]
    if human_agents and not can_ask:
        names = " and ".join(human_agents)
        raise BadParameter(f"--no-input: a person plays {names}; give an agent to every seat")


def resume_game(request: ResumeRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """Return the game of a transcript, replayed up to its last complete turn, to be resumed.

    Raise BadParameter if the game is over, or if a script, a replay or a language model played in
    it. If the players have seen its hidden information, the transcript is marked as peeked.
    """
    path, transcript = request.path, load_transcript(request.path, read_incomplete_transcript)
    if path.is_file() and is_game_running(path):  # Its file must not be changed here.
        raise BadParameter(f"{path}: this game is running, here or in another dmplay process")
    loaded_problem = load_transcript_problem(transcript, trusted=request.trusted)
    resolve_key_maps(loaded_problem.problem, request.key_preferences)
    check_seats(transcript, loaded_problem.problem)
    for player in transcript.header.seats.values():
        kind = UNRESUMABLE_PLAYERS.get(player.partition(":")[0])
        if kind:
            raise BadParameter(
                f"{path}: a seat was played by {kind}, which the file does not contain"
            )
    players, policies = _load_players(transcript, loaded_problem.problem, trusted=request.trusted)
    _check_people_can_play(loaded_problem.problem, players, can_ask=request.can_ask)
    if request.turn_limit is not None and HUMAN in players:
        raise BadParameter(
            f"--turns: got {request.turn_limit}, but a person plays this game and its turn "
            "limit cannot change; leave --turns out"
        )
    check_unattended_turns(transcript, players, request.turn_limit)
    session = replay(transcript, loaded_problem.problem, policies)
    if session.over and transcript.end_block:
        raise BadParameter(
            f"{path}: the game is over "
            f"({describe_end_reason(session.end_reason)}); nothing to resume"
        )
    is_disclosed = make_game_key(
        loaded_problem.name, session.uniform_source
    ) in disclosed_games or not is_concealed(transcript, loaded_problem.problem)
    is_continued = is_disclosed and not session.over
    if (
        is_continued
        and mark_header_peeked(transcript.header, loaded_problem.problem, str(path)).peeked
    ):
        transcript = mark_peeked(transcript)
    recorded_ghost = find_ghost_name(transcript.notes, loaded_problem.problem)
    ghost = _make_ghost(session, players, request.ghost_agent or recorded_ghost)
    if transcript.has_changed_line_ends:  # The recorder continues at an offset in the file.
        write_file(path.resolve(), [transcript.content], continues=True)
    recorder = Recorder.resume(path, transcript.content, session, _find_frame_renderer(transcript))
    if not transcript.blocks:
        recorder.write_turn()
    game = _make_continued_game(loaded_problem, transcript.header, players, request, recorder)
    game.warning = describe_problem_change(transcript, loaded_problem)
    game.is_resumed = True
    game.repeats_uniforms = any(
        note.startswith(REPEATED_UNIFORMS_PREFIX) for note in transcript.notes
    )
    if ghost and ghost.name != recorded_ghost:
        recorder.write_note(ghost.transcript_note)
    game.set_ghost(ghost)
    return game


def format_resume_command(game: Game) -> str:
    """Return the `dmplay` command that resumes a game that was left; '' if it cannot be resumed.

    A shell comment after it says that the resumed game is marked as peeked.
    """
    assert game.recorder
    assert game.request
    is_disclosed = not game.is_concealed and has_hidden_information(
        game.problem, game.player_names, reveal=game.reveal
    )
    agent_names = {player.partition(":")[0] for player in game.player_names} - {HUMAN}
    if (
        game.session.end_reason in NATURAL_END_REASONS
        or game.recorder.is_full
        or not agent_names.isdisjoint(UNRESUMABLE_PLAYERS)
        or (is_disclosed and game.strict)
    ):
        return ""
    words = ["dmplay", "resume", str(game.recorder.path)]
    builtin_names = {*agents.load_roster(game.problem).agents} if agent_names else set()
    if not agent_names <= builtin_names or problems.requires_trust(game.problem_name):
        words.append("--trust")
    if not game.human_seats and (game.request.turns or 0) > DEFAULT_TURN_LIMIT:
        words += ["--turns", str(game.request.turns)]
    is_marked = is_disclosed and not game.request.peeked
    return shlex.join(words) + "  # no medal: its hidden states can now be seen" * is_marked


def branch_game(request: BranchRequest, disclosed_games: Collection[GameKey] = ()) -> Game:
    """Return a new game that repeats a transcript's first turns and continues from there.

    Raise BadParameter if the transcript has fewer turns. Its hidden information must be disclosed:
    the game is over, was seen by the players, or `peek` is set.
    """
    transcript = load_transcript(request.path)
    loaded_problem = load_transcript_problem(transcript, trusted=request.trusted)
    resolve_key_maps(loaded_problem.problem, request.key_preferences)
    past_session = replay(transcript, loaded_problem.problem)
    if request.turn > len(past_session.turns):
        turns = format_count(len(past_session.turns), "turn")
        raise BadParameter(f"--at: got {request.turn}, {request.path} has {turns}")
    players, policies = _load_players(transcript, loaded_problem.problem, trusted=request.trusted)
    for name, player in parse_settings(request.seats, "--seat").items():
        seat = find_seat(loaded_problem.problem, name)
        players[seat] = str(player)
        policies[seat] = make_seat_policy(
            loaded_problem.problem, seat, players[seat], transcript.header.turns
        )
    _check_people_can_play(loaded_problem.problem, players, can_ask=request.can_ask)
    recorded_players = [name_in_transcript(player, request.record_path) for player in players]
    players_by_agent = dict(zip(loaded_problem.problem.agents, recorded_players, strict=True))
    problem_name = name_in_transcript(loaded_problem.name, request.record_path)
    new_header = replace(
        transcript.header,
        problem=problem_name,
        origin=loaded_problem.origin,
        seats=players_by_agent,
        branched=request.turn,
        earlier=_list_earlier_players(transcript.header, players_by_agent, request),
    )
    new_header = mark_header_peeked(new_header, loaded_problem.problem, transcript.path)
    if make_game_key(loaded_problem.name, new_header.uniform_source) not in disclosed_games:
        mark_peeked_if_concealed(transcript, loaded_problem.problem, peek=request.peek)
    check_unattended_turns(transcript, players, request.turn_limit)
    limit = resolve_turn_limit(loaded_problem.problem, players, new_header.turns)
    session = Session(
        loaded_problem.problem,
        new_header.uniform_source,
        policies,
        turn_limit=limit,
        initial_uniforms=past_session.initial_uniforms,
    )
    recorder = Recorder.create(
        request.record_path,
        new_header,
        session,
        frame=_find_frame_renderer(transcript),
        force=request.force,
    )
    warning = describe_problem_change(transcript, loaded_problem)
    del transcript  # Free its memory: both sessions hold the turns.
    _copy_turns(past_session, request.turn, session, recorder)
    game = _make_continued_game(loaded_problem, new_header, players, request, recorder)
    game.warning = warning
    return game


def _list_earlier_players(
    header: Header, players_by_agent: Mapping[str, str], request: BranchRequest
) -> Sequence[Mapping[str, object]]:
    """Return the players of the first turns of a branch, one entry for each change."""
    entries = [{**e, "turns": min(e["turns"], request.turn)} for e in header.earlier]
    new_names = [setting.partition("=")[0].strip() for setting in request.seats]
    changed = {
        name: header.seats[name]
        for name in new_names
        if header.seats[name] != players_by_agent[name]
    }
    new_entries = [{"turns": request.turn, "seats": changed}] if changed and request.turn else []
    return tuple(entry for entry in [*entries, *new_entries] if entry["turns"])


def _load_players(
    transcript: Transcript, problem: Problem, *, trusted: bool
) -> tuple[list[str], list[Policy | None]]:
    """Return the players and policies that continue a transcript; None for a person."""
    folder = problem_name_kinds.transcript_folder(Path(transcript.path))
    return load_resumed_players(problem, transcript.header, trusted=trusted, folder=folder)


def _make_continued_game(
    loaded_problem: problems.LoadedProblem,
    header: Header,
    player_names: Sequence[str],
    request: ResumeRequest,
    recorder: Recorder,
) -> Game:
    """Return a game around the recorder's session, which has already replayed the transcript.

    The recorder is marked as private if its file is a save.
    """
    recorder.is_private = saves.is_save(recorder.path)
    new_request = request_from_header(
        replace(header, problem=loaded_problem.name),
        player_names,
        recorder.path,
        request.key_preferences,
    )
    if not isinstance(request, BranchRequest):
        new_request = replace(new_request, is_handed_in=bool(header.player))
    keyboard = Keyboard(
        loaded_problem.problem, list_human_seats(player_names), request.key_preferences
    )
    game = Game(
        loaded_problem.name, recorder.session, player_names, keyboard, recorder, new_request
    )
    game.earlier_turns = header.turns_before_these_players
    return game


def _copy_turns(
    past_session: Session, turn_count: int, session: Session, recorder: Recorder
) -> None:
    """Replay the first turns of a session in another one and write them, including rerolls.

    All hints of the past session are counted, also those after these turns.
    """
    if past_session.hint_counts:
        session.hint_counts.update(past_session.hint_counts)
        recorder.write_event("help", dict(past_session.hint_counts))
    for number, turn in enumerate(past_session.turns[:turn_count], 1):
        if number in past_session.reroll_counts:
            session.advance(list(turn.actions), stated_beliefs=turn.stated_beliefs)
            recorder.write_turn()
            session.undo()
            session.reroll_counts[number] = past_session.reroll_counts[number]
            recorder.write_event("reroll", past_session.reroll_counts[number])
        session.append_turns([turn])
        recorder.write_turn()


def write_game_copy(game: Game, path: Path) -> None:
    """Write the transcript of a game that has no complete file, up to the current turn."""
    request, original = game.request, game.session
    assert request
    loaded_problem = request.load_problem()
    session = original.copy_at_start()
    with TemporaryDirectory() as folder:
        draft = Path(folder, path.name)
        renderer = render_transcript_frame if request.record_frames else None
        recorder = Recorder.create(
            draft,
            make_header(loaded_problem, game.player_names, request, path),
            session,
            frame=renderer,
        )
        _copy_turns(original, len(original.turns), session, recorder)
        if original.over:
            session.end(original.end_reason or "")
            recorder.write_end()
        recorder.close()
        if recorder.write_error:
            raise BadParameter(f"cannot write {draft}: {recorder.write_error.strerror}")
        is_private = game.problem.partially_observable and not original.over
        write_file(path, [draft.read_text(encoding="utf-8")], private=is_private)


def _find_frame_renderer(transcript: Transcript) -> FrameRenderer | None:
    """Return the frame renderer if the first block of a transcript has a frame; else None."""
    return render_transcript_frame if any(block.frame for block in transcript.blocks[:1]) else None
