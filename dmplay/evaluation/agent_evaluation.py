"""Evaluations of players: where they lost value, by seeing, choosing and luck, for each problem."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, cast

from dmplay.agents.base import AdviceQuestion
from dmplay.core.policy import Policy, is_policy_sequence
from dmplay.core.problem import Problem, check_problem, find_seat
from dmplay.core.return_bounds import count_weighty_turns
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.core.work_budget import ProgressCallback, report_progress_to, scale_progress_to_part
from dmplay.errors import BadParameter, DmplayError, Forfeit
from dmplay.evaluation.interruptible_rollouts import check_episode_count
from dmplay.evaluation.player_evaluation import EvaluatedGame, Evaluation, PlayerEvaluation
from dmplay.evaluation.sweep import expand_entrants
from dmplay.external.bots.shutdown import close_bots
from dmplay.game.hints.lost_value import ValueMeter, explain_missing_parts
from dmplay.game.launch_requests import format_settings
from dmplay.game.manual_game import ManualGame
from dmplay.game.recorded_games import PathLike, read
from dmplay.game.seats import HUMAN, list_judged_seats
from dmplay.game.session_files import find_recorded_name
from dmplay.registry.agents import (
    AgentLike,
    assign_entrant,
    find_agent_name,
    format_agent_label,
    label_agents,
    load_agents,
)
from dmplay.registry.problem_module_exports import get_problem_name
from dmplay.registry.problem_name_kinds import (
    CURRENT_FOLDER,
    names_python_file,
    rebase_name,
    transcript_folder,
)
from dmplay.registry.problems import (
    ProblemLike,
    identify_problem,
    list_problems,
    load_problem,
    resolve_problem,
)
from dmplay.simulation.worker_pool import WorkerCount, run_blocks
from dmplay.transcript.format import resolve_turn_limit

DEFAULT_EPISODES = 100
BLOCK_EPISODES = 16  # games between two reports of progress

Meters = dict[AdviceQuestion, ValueMeter | str]  # or the reason why there is none


@dataclass(frozen=True)
class EvaluatedLineup:
    """A problem, the agent of each seat, the seat that is evaluated, and the games to play."""

    problem: Problem
    agents: Sequence[AgentLike]
    seat: int
    title: str  # of the problem
    problem_name: str = ""  # by which transcripts name it; "" if it follows from the problem
    turns: int | None = None
    seed: int = 0
    episodes: int = DEFAULT_EPISODES
    folder: Path | None = None  # for transcripts
    player_number: int | None = None  # in the names of transcripts, if there are several players
    label: str = ""  # of the evaluated agent among several; "" for its name
    _meters: Meters = field(default_factory=dict)

    @cached_property
    def _weighty_turns(self) -> int | None:
        """The turn limit; of a game without end, the turns that have a weight in the return."""
        is_endless = self.problem.horizon is None and self.problem.can_run_forever
        return (
            count_weighty_turns(self.problem) if self.turns is None and is_endless else self.turns
        )

    @cached_property
    def policies(self) -> list[Policy]:
        """The policy of each seat; a named agent that plans whole games plans for these turns."""
        return load_agents(self.problem, self.agents, turns=self._weighty_turns)

    @property
    def player(self) -> str:
        """The name of the evaluated agent: that of its roster, else as it was given."""
        policy, agent = self.policies[self.seat], self.agents[self.seat]
        name = find_agent_name(self.problem, self.seat, policy)
        label = self.label or format_agent_label(agent)
        return label if name == type(policy).__name__ else name

    @property
    def _unrecorded_player(self) -> str:
        """The name of the evaluated agent if it is the only one that no name loads again."""
        seated = enumerate(zip(self.policies, self.agents, strict=True))
        names = [find_recorded_name(self.problem, seat, *agent) for seat, agent in seated]
        is_only = names[self.seat] == HUMAN and names.count(HUMAN) == 1
        return self.player if is_only else ""

    def path(self, episode: int) -> Path:
        """Return the path of an episode's transcript."""
        title = self.title if self.player_number is None else f"{self.title} {self.player_number}"
        stem = "".join(c if c.isalnum() else "-" for c in title).strip("-")
        number = f"{episode:0{len(str(self.episodes - 1))}}"
        return (self.folder or Path()) / f"{stem}-{number}.dmt"

    def prepare_folder(self) -> None:
        """Make the folder, if there is one; raise BadParameter if it is not empty."""
        if self.folder is None:
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadParameter(f"{self.folder}: {error.strerror}") from None
        if any(self.folder.iterdir()):
            raise BadParameter(f"{self.folder} is not empty; name another folder")

    def play_block(self, episodes: range) -> list[EvaluatedGame]:
        """Play and evaluate a block of episodes, and write their transcripts."""
        games, session = list[EvaluatedGame](), None
        limit = resolve_turn_limit(self.problem, (), self._weighty_turns)
        try:
            for index, episode in enumerate(episodes):
                uniforms = SeededUniforms(self.seed, episode)
                session = Session(self.problem, uniforms, self.policies, turn_limit=limit)
                with scale_progress_to_part(index, len(episodes)):
                    games.append(self._play(session, episode))
        finally:
            if session:  # A program plays all games of a block without a new start.
                close_bots(session, self.title)
        return games

    def _play(self, session: Session, episode: int) -> EvaluatedGame:
        """Play a session to its end and evaluate it."""
        game = ManualGame(session, self.agents, self.problem_name)
        try:
            while not session.over:
                session.advance()
        except Forfeit:
            session.end("forfeit")
        if self.folder is not None:
            game.save(self.path(episode), player=self._unrecorded_player)
        question = game.advice_question(self.seat)
        return measure_game(f"episode {episode}", session, question, self._meters)


def evaluate(  # noqa: PLR0913 - each is the caller's to choose
    agent: AgentLike | Sequence[AgentLike | Sequence[AgentLike]],
    problems: ProblemLike | Sequence[ProblemLike],
    episodes: int = DEFAULT_EPISODES,
    *,
    seat: int | str = 0,
    others: AgentLike = "",
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    folder: PathLike | None = None,
    progress: ProgressCallback | None = None,
) -> Evaluation:
    """Play games of one or several agents in each problem, and return where each lost value.

    The agents are those of `compare`: each plays `seat`, or is itself a sequence with an agent for
    each seat. If it is one agent, `others` play the other seats, by default the usual agents. A
    range in a name makes several agents. Each plays the games of `run`, whatever the workers and
    the executor.

    If a `folder` is given, transcripts are written there, and `evaluate_transcripts` computes the
    same numbers from them. Raise BadParameter if the folder is not empty, and if a problem stands
    where an agent is expected.
    """
    is_list = isinstance(problems, list | tuple)
    items = agent if is_policy_sequence(agent) else [agent]
    entrants = expand_entrants(cast("Sequence[AgentLike | Sequence[AgentLike]]", items))
    _check_order(entrants)
    lineups = []
    for item in cast("list[ProblemLike]", problems if is_list else [problems]):
        name = resolve_problem(item, {}).name if isinstance(item, str) else ""
        problem, meters = load_problem(item), Meters()
        check_problem(problem, turns)
        index = find_seat(problem, seat)
        title = name or get_problem_name(problem)
        loaded = None if name else identify_problem(problem)
        if loaded and loaded.name == title:
            title = " ".join([title, *format_settings(loaded.parameters)])
        seated = [assign_entrant(problem, entrant, index, others) for entrant in entrants]
        labels = label_agents([agents[index] for agents in seated])
        for number, (agents, label) in enumerate(zip(seated, labels, strict=True), 1):
            lineups.append(
                EvaluatedLineup(
                    problem, agents, index, title, name, turns, seed, episodes,
                    None if folder is None else Path(folder),
                    number if len(entrants) > 1 else None, label, meters,
                )
            )  # fmt: skip
    return evaluate_lineups(lineups, workers, executor, progress)


def _check_order(entrants: Sequence[object]) -> None:
    """Raise BadParameter if the problems stand where the agents are expected."""
    for entrant in entrants:
        is_class = isinstance(entrant, type) and issubclass(entrant, Problem)
        if is_class or isinstance(entrant, Problem) or entrant in list_problems():
            expected = "expected evaluate(agent, problems)"
            raise BadParameter(f"agent: got the problem {format_agent_label(entrant)}, {expected}")


def evaluate_lineups(
    lineups: Sequence[EvaluatedLineup],
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
) -> Evaluation:
    """Play the games of each lineup, and return where its agent lost value."""
    for lineup in lineups:
        check_episode_count(lineup.episodes)
        lineup.prepare_folder()
    players = []
    with report_progress_to(progress or (lambda share: None)):
        for index, lineup in enumerate(lineups):
            with scale_progress_to_part(index, len(lineups)):
                blocks = run_blocks(
                    lineup.play_block, range(lineup.episodes), size=BLOCK_EPISODES,
                    workers=workers, executor=executor,
                )  # fmt: skip
                in_order = sorted(blocks, key=lambda block: block[0].start)
            games = [game for _, block_games in in_order for game in block_games]
            problem, names = lineup.problem, (lineup.title, lineup.player)
            players.append(PlayerEvaluation.of_games(problem, *names, lineup.seat, games))
    return Evaluation(tuple(players))


def evaluate_transcripts(  # noqa: PLR0913 - each is the caller's to choose
    paths: PathLike | Sequence[PathLike],
    *,
    problem: ProblemLike | None = None,
    seat: str = "",
    trusted: bool = False,
    peek: bool = False,
    progress: ProgressCallback | None = None,
) -> Evaluation:
    """Return the parts of the value that the players of recorded games lost.

    In each game, it is the player of `seat`. Without a seat, these are its people and language
    models, else its programs, else the agent of the first seat. `paths` are those of `read`. A
    `problem` takes the place of the recorded name. Code that a file names is imported only if it is
    `trusted`. `peek` reads unfinished games with hidden states too. A file that cannot be read is
    in `errors`, unless it is the only one.
    """
    items = cast("list[PathLike]", paths if isinstance(paths, list | tuple) else [paths])
    recorded = read([*items], problem=problem, trusted=trusted, peek=peek, skip_bad=True)
    if not recorded and len(recorded.errors) == 1:
        raise BadParameter(recorded.errors[0])
    groups: dict[object, _Group] = {}
    for number, game in enumerate(recorded):
        if progress:
            progress(number / len(recorded))
        player, path = game.transcript.header.player, Path(game.transcript.path)
        names = [_locate_agent(name, transcript_folder(path)) for name in game.player_names]
        title = " ".join([game.problem_name, *game.settings])
        for index in [find_seat(game.problem, seat)] if seat else list_judged_seats(names):
            key = title, (*names,), index, player
            group = groups.setdefault(
                key, _Group(game.problem, title, player or names[index], index, [], {})
            )
            question, file = game.advice_question(index), game.transcript.path
            group.games.append(measure_game(file, game.session, question, group.meters))
    players = [PlayerEvaluation.of_games(*group[:5]) for group in groups.values()]
    return Evaluation(tuple(players), tuple(recorded.errors))


def _locate_agent(name: str, folder: Path) -> str:
    """Return the name of an agent in a transcript of a folder, as it is given in the current one.

    It differs if the agent is in a file.
    """
    name = rebase_name(name, folder, CURRENT_FOLDER)
    return f"./{name}" if names_python_file(name) and name[0] not in "./" else name


class _Group(NamedTuple):
    """The recorded games of one player in one seat of a problem."""

    problem: Problem
    title: str
    player: str
    seat: int
    games: list[EvaluatedGame]
    meters: Meters


def measure_game(
    name: str, session: Session, question: AdviceQuestion, meters: Meters
) -> EvaluatedGame:
    """Return the parts of a game's return for the seat of the question.

    `meters` has those of earlier games of the same problem, and gets a new one if necessary.
    """
    hints = session.hint_counts[session.problem.agents[question.seat]]
    returned, limit = session.seat_return(question.seat), session.turn_limit
    game = EvaluatedGame(name, len(session.turns), returned, hints, limit)
    fault = explain_missing_parts(session)
    if question.earlier_turns:
        fault = "another player played the first turns"
    if fault:
        return game._replace(fault=fault)
    if question not in meters:
        try:
            meters[question] = ValueMeter(session.problem, question)
        except DmplayError as error:
            meters[question] = str(error)
    meter = meters[question]
    if isinstance(meter, str):
        return game._replace(missing_parts=meter)
    try:
        return game._replace(parts=meter.divide_game(session))
    except DmplayError as error:
        return game._replace(missing_parts=str(error))
