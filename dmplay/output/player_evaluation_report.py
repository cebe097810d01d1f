"""The report of `dmplay evaluate`, as a table, JSON or CSV."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

from dmplay.core.problem import find_seat
from dmplay.core.text import align_columns, format_json_report, format_number
from dmplay.errors import BadParameter
from dmplay.evaluation.agent_evaluation import (
    EvaluatedLineup,
    evaluate_lineups,
    evaluate_transcripts,
)
from dmplay.evaluation.executors import open_execution_backend
from dmplay.evaluation.player_evaluation import EvaluatedGame, Evaluation, PlayerEvaluation
from dmplay.evaluation.solutions.solution import Row
from dmplay.game.command_line_results import Printout
from dmplay.game.game_setup import assign_players
from dmplay.game.launch_requests import parse_settings
from dmplay.game.seats import HUMAN
from dmplay.game.transcript_verification import names_transcripts
from dmplay.output.evaluation_request import (
    EvaluationRequest,
    iter_settings,
    make_evaluation_report,
)
from dmplay.output.problem_table import choose_headings, choose_width, describe_omitted_columns
from dmplay.output.tables import MISSING_CELL, format_cell, format_csv, format_mean, format_name
from dmplay.registry.agents import load_roster
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.progress import ProgressBar

MIN_NAME_COLUMNS = 10
NAMES = ("problem", "player", "seat", "game")
SHARED = ("problem", "player", "seat", "games")  # above the table if they are the same in all rows
NOT_STATED = "not stated"  # 0, as the belief is assumed to be the exact one
# from the left, as many as there is room for
QUANTITIES = (
    "regret per turn", "seeing", "choosing", "luck", "start value", "nats", "stated regret",
)  # fmt: skip


class EvaluationCommand(NamedTuple):
    """The arguments of `dmplay evaluate`: an agent and problems, or transcripts."""

    request: EvaluationRequest  # of any problem
    arguments: tuple[str, ...]
    seats: tuple[str, ...]  # at most one, which is evaluated
    episodes: int
    folder: Path | None
    trusted: bool
    typed_options: tuple[str, ...]  # those that only apply to games that are played

    def evaluate(self, progress: ProgressBar) -> Evaluation:
        """Return the evaluation; raise BadParameter for arguments that do not fit together."""
        if len(self.seats) > 1:
            raise BadParameter(f"--seat: got {' and '.join(self.seats)}, expected one seat")
        seat, (agent, *problems) = "".join(self.seats), self.arguments
        if names_transcripts(agent):
            if self.typed_options or self.request.seats:
                option = (*self.typed_options, "seat NAME=AGENT")[0]
                raise BadParameter(f"--{option}: not with transcripts")
            return evaluate_transcripts(
                self.arguments, seat=seat, trusted=self.trusted, progress=progress
            )
        if not problems:
            expected = "expected AGENT PROBLEM..., or transcripts"
            raise BadParameter(f"evaluate: got {agent!r}, {expected}")
        if self.trusted:
            raise BadParameter("--trust: only with transcripts")
        lineups = [
            self._make_lineup(setting, seat)
            for problem in problems
            for setting in iter_settings(self.request._replace(problem=problem))
        ]
        request = self.request
        with open_execution_backend(request.engine, request.workers) as (workers, executor):
            return evaluate_lineups(lineups, workers, executor, progress)

    def _make_lineup(self, request: EvaluationRequest, seat_name: str) -> EvaluatedLineup:
        """Return the lineup of one setting, with the agent in the evaluated seat."""
        loaded = request.load_problem()
        problem = loaded.problem
        seat = find_seat(problem, seat_name or 0)
        name, seats = problem.agents[seat], [*request.seats]
        if name in parse_settings(seats, "--seat"):
            raise BadParameter(f"--seat {name}: AGENT plays this seat; name agents of other seats")
        first_agent, other_agent = request.agent, request.other_agent
        if seat:
            first = other_agent or load_roster(problem).default_partner
            seats = [f"{problem.agents[0]}={first}", *seats, f"{name}={request.agent}"]
            first_agent, other_agent = "", other_agent if len(problem.agents) > 2 else ""
        players = assign_players(loaded, first_agent, other_agent, seats, request.turn_limit)
        if HUMAN in players:
            raise BadParameter(f"{name}: a person cannot play many games; name an agent")
        title = " ".join([loaded.name, *request.settings])
        return EvaluatedLineup(
            problem, players, seat, title, "" if request.settings else request.problem,
            request.turn_limit, request.seed, self.episodes, self.folder,
        )  # fmt: skip


def report_evaluation(
    command: EvaluationCommand, terminal: Terminal, *, lists_games: bool = False
) -> Printout:
    """Evaluate a player and return the report; the exit code is 1 if a file cannot be read."""
    request = command.request
    output_format = request.output_format
    with ProgressBar("evaluating", quiet=bool(output_format), motion=request.motion) as progress:
        evaluation = command.evaluate(progress)
    rows = evaluation.list_rows(games=lists_games)
    if output_format == "json":
        are_recorded = names_transcripts(command.arguments[0])
        facts: dict[str, object] = {} if are_recorded else {"seed": request.seed}
        facts |= {"errors": [*evaluation.errors]} if evaluation.errors else {}
        text = format_json_report(facts | {"games" if lists_games else "players": rows})
    elif output_format == "csv":
        text = format_csv(rows) if rows else ""
    else:
        text = format_evaluation(evaluation, choose_width(terminal.width), games=lists_games)
    return make_evaluation_report(text, "", evaluation.errors)


def format_evaluation(evaluation: Evaluation, width: int, *, games: bool = False) -> str:
    """Return a table with a row for each player, or with `games` for each game.

    What is the same in all rows stands above it, and notes stand below it. Columns for which there
    is no room are named.
    """
    rows = [row for player in evaluation.players for row in _iter_rows(player, games=games)]
    used = {name for row in rows for name, cell in row.items() if cell}
    shared = [name for name in SHARED if name in used and len({row[name] for row in rows}) == 1]
    name_columns = max(width // 4, MIN_NAME_COLUMNS)
    table = [
        {
            name: (format_name(cell, name_columns) if name in NAMES else cell) or MISSING_CELL
            for name, cell in row.items()
            if name in used - {*shared}
        }
        for row in rows
    ]
    heading = ", ".join(rows[0][name] + " games" * (name == "games") for name in shared)
    headings = choose_headings(table, width) if table else ["no games"]
    cells = [headings, *([row[name] for name in headings] for row in table)]
    notes = [
        _format_notes(player, is_only=len(evaluation.players) == 1) for player in evaluation.players
    ]
    omitted = [name for name in table[0] if name not in headings] if table else []
    if omitted:
        notes.append(describe_omitted_columns(omitted))
    lines = [line for note in notes for line in wrap(note, width)]
    return "\n".join([*wrap(heading, width), *align_columns(cells), *lines])


def _format_notes(player: PlayerEvaluation, *, is_only: bool) -> str:
    """Return the remarks on a player as a sentence; '' if there are none."""
    notes = "; ".join(player.remarks)
    return (
        notes
        if is_only or not notes
        else f"{format_name(player.problem)}, {format_name(player.player)}: {notes}"
    )


def _iter_rows(player: PlayerEvaluation, *, games: bool) -> Iterator[dict[str, str]]:
    """Yield the rows of a player's table: one, or one for each game; "" is an empty cell."""
    names = {
        "problem": format_name(player.problem),
        "player": format_name(player.player),
        "seat": format_name(player.seat) * player.has_other_seats,
        "games": "" if games else str(len(player.games)),
    }
    items: Sequence[PlayerEvaluation | EvaluatedGame] = player.games if games else [player]
    for item in items:
        row = item.make_row()
        if isinstance(item, EvaluatedGame):
            names |= {"game": format_name(item.name), "turns": str(item.turn_count)}
            cells = {"return": format_number(item.discounted_return, 4)}
        else:
            cells = {"return": format_mean(row["mean return"], row["standard error"] or None, 4)}
        cells |= {name: _format_quantity(row, name) for name in QUANTITIES}
        if player.has_hidden_states and not item.stated_count and cells["seeing"]:
            cells["seeing"] = NOT_STATED
        yield names | cells


def _format_quantity(row: Row, name: str) -> str:
    """Return a quantity of a row of data as a cell: a mean, or the range between its bounds."""
    exact, low = row[name], row.get(f"{name} lower bound")
    if exact is None and isinstance(low, float):
        return f"{format_number(low, 4)} to {format_cell(row[f'{name} upper bound'], 4)}"
    error = row.get(f"{name} standard error")
    return format_mean(exact, error if error else None, 4) if isinstance(exact, float) else ""
