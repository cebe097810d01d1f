"""The games of a language model, which plays one seat in each and knows them only by ids."""

from dataclasses import dataclass
from pathlib import Path

from dmplay.core.problem import Problem, find_seat
from dmplay.core.session import DEFAULT_TURN_LIMIT, check_has_belief
from dmplay.core.typed_text import read_belief
from dmplay.errors import BadParameter, UnknownName
from dmplay.external.bots.protocol import JsonObject
from dmplay.game import saves
from dmplay.game.command_line_results import McpServerConfig
from dmplay.game.game import Game
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.seat_status import SeatStatus, describe_seat
from dmplay.output.problem_and_agent_reports import load_problem_info
from dmplay.registry import agents, problems
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problem_name_kinds import names_data_file, names_python_file
from dmplay.transcript.external_players import HUMAN_PLAYER, MODEL_PLAYER
from dmplay.transcript.recorder import Recorder

MAX_GAMES = 16  # including finished games whose result can still be requested


class GameStatus(SeatStatus):
    """The status of a game for the model."""

    game: str


@dataclass
class ModelSeat:
    """A game, the model's seat in it, and the last turn that was reported."""

    game: Game
    seat: int
    last_reported_turn: int = -1  # -1 for none; turn 0 is the initial observation


class ModelGames:
    """The operations that a model can request; DmplayError is raised for invalid requests."""

    def __init__(self, config: McpServerConfig) -> None:
        self.config = config
        self.failed_recorders: list[Recorder] = []  # of games with turns that could not be written
        self.save_removal = saves.SaveRemoval()  # old saves deleted for these games
        self._problem_names: dict[str, str] = {}
        for name in config.problems or _list_builtin_problems_and_variants():
            problems.resolve_problem(name, {})  # raises UnknownName before a client connects
            problem = _problem_id(name)
            owner = self._problem_names.setdefault(problem, name)
            if owner != name:
                raise BadParameter(f"{name}: the id {problem} already belongs to {owner}")
        if config.transcript_folder:
            _make_folder(config.transcript_folder)
        self._seats: dict[str, ModelSeat] = {}
        self._started_count = 0

    def list_problems(self) -> list[dict[str, str]]:
        """Return the id, the kind and a short description of each problem."""
        facts = []
        for name, problem_name in self._problem_names.items():
            problem = problems.load_problem(problem_name)
            about = problems.problem_docstring(problem).partition("\n")[0]
            facts.append({"problem": name, "kind": problem.kind, "about": about})
        return facts

    def problem_info(self, problem: str) -> dict[str, object]:
        """Return the facts of a problem that a player may know before a game."""
        facts = load_problem_info(self._find_problem_name(problem))._asdict()
        del facts["keys"], facts["variants"]  # A model presses no keys, and variants have ids.
        return facts | {"problem": problem}

    def start_game(self, problem: str, seat: str = "", others: str = "") -> GameStatus:
        """Start a game and return its status.

        The model plays the first seat unless it names another. `others` is the agent in all other
        seats; by default, each is played by the usual agent.
        """
        name = self._find_problem_name(problem)
        game_problem = problems.load_problem(name)
        model_seat = find_seat(game_problem, seat) if seat else 0
        players = _list_players(game_problem, model_seat, others)
        discarded_game = self._find_game_to_discard()
        config, episode = self.config, self._started_count
        never_ends = config.turn_limit is None and game_problem.horizon is None
        request = GameRequest(
            name,
            seats=[
                f"{agent}={player}"
                for agent, player in zip(game_problem.agents, players, strict=True)
            ],
            seed=config.seed,
            episode=0 if config.seed is None else episode,
            turns=DEFAULT_TURN_LIMIT if never_ends else config.turn_limit,
            record_path=config.transcript_folder,
            numbered_file_name=problem,
            kept_megabytes=config.kept_megabytes,
            strict=config.strict,
            person_label=MODEL_PLAYER,
            is_seed_visible=False,
        )
        game = start_new_game(request)
        try:
            game.play_until_choice()
        except BaseException:
            if game.recorder:  # As if the game had not been started, its transcript is removed.
                game.recorder.close()
                game.recorder.path.unlink(missing_ok=True)
            raise
        self._seats.pop(discarded_game, None)
        self._started_count += 1
        self._seats[f"g{self._started_count}"] = ModelSeat(game, model_seat)
        self.save_removal = self.save_removal.followed_by(game.save_removal)
        return self._report_status(f"g{self._started_count}")

    def find_required_package(self, problem: str, others: str) -> str:
        """Return the package that an agent named `others` imports; '' if there is none."""
        name = self._problem_names.get(problem)
        if not (name and others):
            return ""
        roster = agents.load_roster(problems.load_problem(name), 0)
        agent_class = roster.agents.get(others.partition(":")[0])
        return getattr(agent_class, "required_package", "")

    def game_status(self, game: str, *, history: bool = False) -> GameStatus:
        """Return the status of a game, with all turns again if `history` is True."""
        seat = self._find_model_seat(game)
        seat.last_reported_turn = -1 if history else seat.last_reported_turn
        return self._report_status(game)

    def play_action(
        self, game: str, action: str, turn: int = 0, belief: object = None
    ) -> GameStatus:
        """Play an action and return the status; raise BadParameter if `turn` is not the next one.

        A `turn` of 0 stands for any. The transcript records the `belief` that the model states, a
        value that `read_belief` reads.
        """
        seat = self._find_model_seat(game)
        current_game, view = seat.game, seat.game.view()
        next_turn = len(current_game.session.turns) + 1
        if turn and turn != next_turn and not current_game.session.over:
            raise BadParameter(f"turn: got {turn}, expected {next_turn}")
        space = current_game.problem.actions[seat.seat]
        labels = view.action_labels if view.state_action_labels else space
        stated = None
        if belief is not None:
            check_has_belief(current_game.session)
            stated = read_belief(current_game.problem, belief)
        current_game.choose(labels.parse_action(action), stated_belief=stated)
        return self._report_status(game)

    def get_hint(self, game: str) -> JsonObject:
        """Return a hint as data, and record in the transcript that the model requested it."""
        current_game = self._find_model_seat(game).game
        current_game.check_hints_allowed("hint")
        message = current_game.hint_provider.create_hint()
        hint = current_game.hint_provider.current_hint
        if hint is None:
            raise BadParameter(message)
        current_game.record_hint()
        return hint.data

    def undo_turns(self, game: str, turns: int = 1) -> GameStatus:
        """Undo the model's last choices and the turns since, and return the status."""
        seat = self._find_model_seat(game)
        if seat.game.session.over:
            raise BadParameter("dmplay_undo: the game is over")
        seat.game.undo(turns)
        seat.last_reported_turn = len(seat.game.session.turns)
        return self._report_status(game)

    def end_game(self, game: str) -> JsonObject:
        """End a game, and return its result and the hidden information of every turn."""
        seat = self._find_model_seat(game)
        self._finish_game(seat, "quit")
        return seat.game.narrator.result_facts()

    def end_all_games(self, reason: str = "interrupted") -> None:
        """End all games, when the client has disconnected."""
        for seat in self._seats.values():
            self._finish_game(seat, reason)

    def _finish_game(self, seat: ModelSeat, reason: str) -> None:
        """Finish a game and its transcript, if it is not finished yet."""
        recorder = seat.game.recorder
        was_open = recorder and recorder.is_open
        seat.game.finish(reason)
        if recorder and was_open and not saves.remove_unplayed_save(recorder):
            self.failed_recorders += [recorder] if recorder.write_error else []

    def _find_problem_name(self, problem: str) -> str:
        """Return the name of the problem with an id; raise UnknownName if there is none."""
        if problem not in self._problem_names:
            raise UnknownName("problem", problem, self._problem_names)
        return self._problem_names[problem]

    def _find_model_seat(self, game: str) -> ModelSeat:
        """Return the model's seat in the game with an id; raise UnknownName if there is none."""
        if game not in self._seats:
            raise UnknownName("game", game, self._seats)
        return self._seats[game]

    def _find_game_to_discard(self) -> str:
        """Return the oldest finished game if there are MAX_GAMES; '' if there are fewer.

        Raises BadParameter if all of them are still being played.
        """
        if len(self._seats) < MAX_GAMES:
            return ""
        finished = [name for name, seat in self._seats.items() if seat.game.session.over]
        if not finished:
            raise BadParameter(f"{MAX_GAMES} games are running; end one of them with dmplay_over")
        return finished[0]

    def _report_status(self, game_id: str) -> GameStatus:
        """Return a game's status with the turns not reported yet; finish the game if it is over."""
        model_seat = self._seats[game_id]
        game, session = model_seat.game, model_seat.game.session
        if session.over:
            self._finish_game(model_seat, "")
        status = describe_seat(
            game.narrator,
            game.snapshot(model_seat.seat),
            first_turn=model_seat.last_reported_turn + 1,
            shows_belief=self.config.show_belief,
        )
        model_seat.last_reported_turn = len(session.turns)
        return {"game": game_id, **status}


def _list_builtin_problems_and_variants() -> list[str]:
    """Return the names of the built-in problems and of their variants."""
    return [
        f"{name}:{variant}" if variant else name
        for name in problem_names()
        for variant in problems.load_variants(name)
    ]


def _make_folder(folder: Path) -> None:
    """Create a folder if it does not exist; raise BadParameter if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadParameter(f"--output: {folder}: {error.strerror}") from None


def _problem_id(name: str) -> str:
    """Return the id of a problem: its name, or for a file, its name without the folder."""
    if names_data_file(name):
        return Path(name).stem
    path, colon, suffix = name.partition(":")
    return f"{Path(path).stem}{colon}{suffix}" if names_python_file(name) else name


def _list_players(problem: Problem, model_seat: int, other_agent: str) -> list[str]:
    """Return the player of each seat: an agent, or "human" for the model's seat.

    Raises UnknownName if a seat has no agent named `others`.
    """
    if other_agent and len(problem.agents) == 1:
        raise BadParameter(f"others: got {other_agent!r}, expected none: there is only one seat")
    players = []
    for seat in range(len(problem.agents)):
        seat_roster = agents.load_roster(problem, seat)
        base_name = other_agent.partition(":")[0]
        if other_agent and base_name not in seat_roster.agents:
            raise UnknownName("agent", base_name, seat_roster.agents)
        players.append(
            HUMAN_PLAYER if seat == model_seat else other_agent or seat_roster.default_partner
        )
    return players
