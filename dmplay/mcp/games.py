"""The games of a language model: it sits in one seat of each, and knows them by ids alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

from dmplay.bots.protocol import JsonObject, describe_choices, encode_observation, encode_percept
from dmplay.core import Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import agents, problems
from dmplay.finding.names import problem_names
from dmplay.finding.ways import names_data_file, names_python_file
from dmplay.game import saves
from dmplay.game.errand import McpServerConfig
from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.reports.problems import load_problem_info
from dmplay.session import DEFAULT_TURN_LIMIT
from dmplay.transcript.format import HUMAN_PLAYER, MODEL_PLAYER
from dmplay.transcript.recorder import Recorder

MAX_GAMES = 16  # games at once, with those of which only the end is still known


class GameStatus(TypedDict):
    """Where a game stands for the model, and what happened since it was told last."""

    game: str
    seat: str
    turn: int  # how many were played
    turns: list[JsonObject]  # those that were not told yet, by the keys of `bots.protocol.learnt`
    seen: object  # a name, numbers or the notation of a state; null for nothing yet
    legal: object  # names of actions, or the bounds of a number
    words: str  # the same, as a person would read it; '' where that would tell a belief
    ending: str  # how it ended; '' while it goes on


@dataclass
class ModelSeat:
    """A game, the model's seat in it, and how many of its turns were told."""

    game: Game
    seat: int
    last_reported_turn: int = -1  # the last; turn 0 is what was seen first


class ModelGames:
    """What a model can ask for; DmplayError where it asks for what cannot be."""

    def __init__(self, config: McpServerConfig) -> None:
        self.config = config
        self.failed_recorders: list[Recorder] = []  # of games of which turns could not be written
        self._problem_names: dict[str, str] = {}
        for name in config.problems or _builtin_problem_names():
            problems.resolve_problem(name, {})  # refuses what there is not, before anybody asks
            if self._problem_names.setdefault(_problem_id(name), name) != name:
                raise BadParameter(
                    f"{name}: {_problem_id(name)} is {self._problem_names[_problem_id(name)]} already"
                )
        if config.transcript_folder:
            _make_folder(config.transcript_folder)
        self._seats: dict[str, ModelSeat] = {}
        self._started_count = 0

    def list_problems(self) -> list[dict[str, str]]:
        """The ids of problems, and what each is about."""
        each = ((name, problems.load_problem(known)) for name, known in self._problem_names.items())
        return [
            {
                "problem": name,
                "kind": one.kind,
                "about": problems.full_description(one).partition("\n")[0],
            }
            for name, one in each
        ]

    def problem_info(self, problem: str) -> dict[str, object]:
        """All about a problem that a player may know before a game."""
        told = load_problem_info(self._problem_name(problem))._asdict()
        del told["keys"], told["variants"]  # nobody presses keys here; variants have ids
        return told | {"problem": problem}

    def start_game(self, problem: str, seat: str = "", others: str = "") -> GameStatus:
        """Begins a game, in the first seat if none is named, with the usual agents in the others
        if none is.
        """
        name = self._problem_name(problem)
        rules = problems.load_problem(name)
        place = rules.seat_index(seat) if seat else 0
        who = _assign_players(rules, place, others)
        self._discard_finished_game()
        terms, episode = self.config, self._started_count
        endless = terms.turn_limit is None and rules.horizon is None
        request = GameRequest(
            name,
            seats=[f"{agent}={one}" for agent, one in zip(rules.agents, who, strict=True)],
            seed=terms.seed,
            episode=0 if terms.seed is None else episode,
            turns=DEFAULT_TURN_LIMIT if endless else terms.turn_limit,
            record_path=terms.transcript_folder
            and saves.create_game_file(terms.transcript_folder, problem),
            strict=terms.strict,
            person_label=MODEL_PLAYER,
            is_seed_visible=False,
        )
        self._started_count += 1
        found = self._seats[f"g{self._started_count}"] = ModelSeat(start_new_game(request), place)
        found.game.play_until_choice()
        return self._report_status(f"g{self._started_count}")

    def game_status(self, game: str, *, history: bool = False) -> GameStatus:
        """Where a game stands; with all turns again if the history is asked for."""
        found = self._seat_of_game(game)
        found.last_reported_turn = -1 if history else found.last_reported_turn
        return self._report_status(game)

    def play_action(self, game: str, action: str, turn: int = 0) -> GameStatus:
        """Plays an action; where a turn is named, only in that one."""
        found = self._seat_of_game(game)
        played, view = found.game, found.game.view()
        number = len(played.session.turns) + 1
        if turn and turn != number and not played.session.over:
            raise BadParameter(f"turn: got {turn}, expected {number}")
        known = (
            view.action_labels if view.state_action_labels else played.problem.actions[found.seat]
        )
        played.choose(known.parse_action(action))
        return self._report_status(game)

    def get_hint(self, game: str) -> JsonObject:
        """What a good player would do, which the transcript says was asked."""
        played = self._seat_of_game(game).game
        played.check_hints_allowed("hint")
        said = played.hint_provider.create_hint()
        advice = played.hint_provider.current_hint
        if advice is None:
            raise BadParameter(said)
        played.record_hint()
        return advice.data

    def undo_turns(self, game: str, turns: int = 1) -> GameStatus:
        """Takes back the model's last choices, and what came of them."""
        found = self._seat_of_game(game)
        if found.game.session.over:
            raise BadParameter("undo: the game is over")
        found.game.undo(turns)
        found.last_reported_turn = len(found.game.session.turns)
        return self._report_status(game)

    def end_game(self, game: str) -> JsonObject:
        """Ends a game that goes on; how it ended, and what was hidden."""
        found = self._seat_of_game(game)
        self._finish_game(found, "quit")
        return found.game.narrator.result_facts()

    def end_all_games(self, reason: str = "interrupted") -> None:
        """Ends all games: nobody is there any more."""
        for found in self._seats.values():
            self._finish_game(found, reason)

    def _finish_game(self, seat: ModelSeat, reason: str) -> None:
        """Ends a game, once, and its transcript."""
        recorder = seat.game.recorder
        goes_on = recorder and recorder.is_open
        seat.game.finish(reason)
        if (
            recorder
            and goes_on
            and not saves.remove_unplayed_save(recorder)
            and recorder.write_error
        ):
            self.failed_recorders.append(recorder)

    def _problem_name(self, problem: str) -> str:
        """The problem of an id."""
        if problem not in self._problem_names:
            raise UnknownName("problem", problem, self._problem_names)
        return self._problem_names[problem]

    def _seat_of_game(self, game: str) -> ModelSeat:
        """The game of an id."""
        if game not in self._seats:
            raise UnknownName("game", game, self._seats)
        return self._seats[game]

    def _discard_finished_game(self) -> None:
        """Forgets the first of too many games that is over; refuses one more if none is."""
        if len(self._seats) < MAX_GAMES:
            return
        over = [name for name, one in self._seats.items() if one.game.session.over]
        if not over:
            raise BadParameter(f"new: {MAX_GAMES} games are played; end one of them by over")
        del self._seats[over[0]]

    def _report_status(self, game_id: str) -> GameStatus:
        """What the model may know of a game, and was not told yet; one that is over is ended."""
        found = self._seats[game_id]
        game, place, session = found.game, found.seat, found.game.session
        if session.over:
            self._finish_game(found, "")
        news = range(found.last_reported_turn + 1, len(session.turns) + 1)
        found.last_reported_turn = len(session.turns)
        legal = session.legal_actions_mask(place)
        tells = self.config.show_belief or not game.problem.partially_observable
        return {
            "game": game_id,
            "seat": game.problem.agents[place],
            "turn": found.last_reported_turn,
            "turns": [_turn_facts(found, number) for number in news],
            "seen": encode_observation(
                game.problem, place, session.observation_after(place, found.last_reported_turn)
            ),
            "legal": describe_choices(game.problem, place, legal, session.action_labels(place)),
            "words": game.narrator.describe_situation(game.snapshot(place)) if tells else "",
            "ending": game.narrator.describe_result() if session.over else "",
        }


def _turn_facts(seat: ModelSeat, turn: int) -> JsonObject:
    """What a turn taught the seat; the first, what it saw before it did anything."""
    session, place = seat.game.session, seat.seat
    if not turn:
        facts = {
            "observation": encode_observation(
                session.problem, place, session.observation_after(place, 0)
            )
        }
    else:
        facts = encode_percept(session.problem, place, session.build_percept(place, turn), 0)
    return {"turn": turn} | facts


def _builtin_problem_names() -> list[str]:
    """The built-in problems and their variants."""
    return [
        f"{name}:{variant}" if variant else name
        for name in problem_names()
        for variant in problems.load_variants(name)
    ]


def _make_folder(folder: Path) -> None:
    """Makes a folder where there is none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadParameter(f"--output: {folder}: {error.strerror}") from None


def _problem_id(name: str) -> str:
    """By what a model knows a problem: its name, of a file without the place."""
    if names_data_file(name):
        return Path(name).stem
    place, colon, rest = name.partition(":")
    return f"{Path(place).stem}{colon}{rest}" if names_python_file(name) else name


def _assign_players(problem: Problem, model_seat: int, other_agent: str) -> list[str]:
    """Who sits where: agents that dmplay knows, and whoever asks in this place."""
    if other_agent and len(problem.agents) == 1:
        raise BadParameter(f"others: got {other_agent!r}, expected none: there is one seat only")
    who = []
    for seat in range(len(problem.agents)):
        known = agents.load_roster(problem, seat)
        base = other_agent.partition(":")[0]
        if other_agent and base not in known.agents:
            raise UnknownName("agent", base, known.agents)
        who.append(HUMAN_PLAYER if seat == model_seat else other_agent or known.default_partner)
    return who
