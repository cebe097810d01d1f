"""The list of algorithms that can be watched, with the problems that each one fits."""

from textwrap import TextWrapper

from dmplay.algorithms.registry import load_algorithms
from dmplay.core.text import format_json_report
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_problem

WIDTH = 79  # columns


def report_algorithms(*, json: bool) -> str:
    """Return each algorithm, its purpose, its section of the book and the problems it fits."""
    problems = {name: load_problem(name) for name in problem_names()}
    fitting = {
        name: [n for n, problem in problems.items() if not algorithm.explain_misfit(problem)]
        for name, algorithm in load_algorithms().items()
    }
    if json:
        rows = [
            {"name": name, "description": entry.description, "source": entry.source,
             "problems": fitting[name]}
            for name, entry in load_algorithms().items()
        ]  # fmt: skip
        return format_json_report({"algorithms": rows})
    lines = ["Watch an algorithm work, one step per key press: dmplay watch ALGORITHM PROBLEM", ""]
    wrapper = TextWrapper(
        WIDTH, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False
    )
    for name, entry in load_algorithms().items():
        lines += [f"{name}: {entry.description}", *wrapper.wrap(f"book: {entry.source}")]
        lines += [*wrapper.wrap(f"problems: {', '.join(fitting[name]) or 'none'}"), ""]
    lines.append("Your own problems work too: dmplay watch ALGORITHM ./FILE")
    return "\n".join(lines)
