"""The report of `dmplay evaluate`, as a table, JSON or CSV."""

from pathlib import Path
from typing import NamedTuple

from dmplay.core.text import format_json_report
from dmplay.errors import BadParameter
from dmplay.evaluation.agent_evaluation import Evaluation, evaluate, evaluate_transcripts
from dmplay.game.command_line_results import Printout
from dmplay.game.transcript_verification import TRANSCRIPT_SUFFIX
from dmplay.output.evaluation_request import make_evaluation_report
from dmplay.output.tables import format_csv
from dmplay.terminal.progress import ProgressBar


class EvaluationCommand(NamedTuple):
    """The arguments of `dmplay evaluate`: an agent and problems, or transcripts."""

    arguments: tuple[str, ...]
    episodes: int
    other_agent: str
    turns: int | None
    seed: int
    folder: Path | None
    trusted: bool
    typed_options: tuple[str, ...]  # those that only apply to games that are played

    @property
    def names_transcripts(self) -> bool:
        """True if the first argument is a transcript or a folder, or the standard input."""
        first = self.arguments[0]
        return first == "-" or first.endswith(TRANSCRIPT_SUFFIX) or Path(first).is_dir()

    def evaluate(self, progress: ProgressBar) -> Evaluation:
        """Return the evaluation; raise BadParameter for arguments that do not fit together."""
        agent, *problems = self.arguments
        if self.names_transcripts:
            if self.typed_options:
                raise BadParameter(f"--{self.typed_options[0]}: not with transcripts")
            return evaluate_transcripts(self.arguments, trusted=self.trusted, progress=progress)
        if not problems:
            expected = "expected AGENT PROBLEM..., or transcripts"
            raise BadParameter(f"evaluate: got {agent!r}, {expected}")
        if self.trusted:
            raise BadParameter("--trust: only with transcripts")
        return evaluate(
            agent, problems, self.episodes, others=self.other_agent or None, turns=self.turns,
            seed=self.seed, folder=self.folder, progress=progress,
        )  # fmt: skip


def report_evaluation(
    command: EvaluationCommand,
    *,
    lists_games: bool = False,
    output_format: str = "",
    motion: bool = True,
) -> Printout:
    """Evaluate a player and return the report; the exit code is 1 if a file cannot be read."""
    with ProgressBar("evaluating", quiet=bool(output_format), motion=motion) as progress:
        evaluation = command.evaluate(progress)
    rows = evaluation.list_rows(games=lists_games)
    if output_format == "json":
        facts: dict[str, object] = {} if command.names_transcripts else {"seed": command.seed}
        facts |= {"errors": [*evaluation.errors]} if evaluation.errors else {}
        text = format_json_report(facts | {"games" if lists_games else "players": rows})
    elif output_format == "csv":
        text = format_csv(rows) if rows else ""
    else:
        text = evaluation.format_table(games=lists_games)
    return make_evaluation_report(text, "", evaluation.errors)
