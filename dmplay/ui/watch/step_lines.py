"""The steps of an algorithm as lines of text and as JSON Lines."""

import json
from collections.abc import Iterable, Iterator

import numpy as np

from dmplay.algorithms.finite_mdp import format_state_name
from dmplay.algorithms.step import (
    AlphaVectorSet,
    BeliefTable,
    Curve,
    Picture,
    StateValues,
    Step,
    StrategyMixes,
    TreeNode,
)
from dmplay.core.problem import Problem
from dmplay.core.text import escape_unprintable, format_count, format_score
from dmplay.game.watching import WatchedSteps

LAST_STEPS = 3  # steps that a command in a shell without a full screen shows
MAX_NODES = 12  # children of the root of a search tree in words
MAX_ACTIONS = 12  # actions of a mixed strategy in words
MAX_STATES = 40  # states in words


def format_step_lines(number: int, step: Step, problem: Problem, *, pictures: bool) -> list[str]:
    """Return a step as lines of text, with the pictures in words if wished."""
    lines = [f"step {number}. {step.title}.", *step.sentences]
    lines += [step.formula] if step.formula else []
    if pictures:
        lines += [line for picture in step.pictures for line in describe_picture(picture, problem)]
    return list(map(escape_unprintable, lines))


def iter_lines(watched: WatchedSteps, index: int | None = None) -> Iterator[str]:
    """Yield all steps as lines of text, the last one with its pictures in words, or only one."""
    if index is not None:
        step = watched.steps[index]
        yield _join_lines(format_step_lines(index + 1, step, watched.problem, pictures=True))
        return
    yield f"{watched.title}: {watched.algorithm.description} ({watched.algorithm.source}).\n"
    for number, step in enumerate(watched.iter_steps(), 1):
        is_last = watched.compute_until(number) < number
        yield _join_lines(format_step_lines(number, step, watched.problem, pictures=is_last))


def format_last_steps(watched: WatchedSteps) -> list[str]:
    """Return the last steps as lines of text, the last one with its pictures in words."""
    steps = list(watched.iter_steps())
    lines = [f"{watched.title}: {watched.algorithm.description}."]
    omitted = max(len(steps) - LAST_STEPS, 0)
    if omitted:
        lines.append(f"These are the last {LAST_STEPS} of {len(steps)} steps.")
    for number, step in enumerate(steps[omitted:], omitted + 1):
        is_last = number == len(steps)
        lines += format_step_lines(number, step, watched.problem, pictures=is_last)
    return lines


def _join_lines(lines: Iterable[str]) -> str:
    """Return lines as one text that ends with a line feed."""
    return "".join(f"{line}\n" for line in lines)


def describe_picture(picture: Picture, problem: Problem) -> list[str]:
    """Return the content of a picture in words."""
    match picture:
        case StateValues():
            return [_describe_values(picture, problem)]
        case Curve():
            return [f"{picture.label}: {', '.join(map(format_score, picture.numbers[-5:]))}."]
        case TreeNode():
            return _describe_tree(picture)
        case BeliefTable():
            return [_describe_column(picture, index) for index in range(len(picture.columns))]
        case AlphaVectorSet():
            return _describe_vectors(picture)
        case StrategyMixes():
            return _describe_mixes(picture)


def _describe_values(picture: StateValues, problem: Problem) -> str:
    """Return the values and actions of the first states, or of those with a value that changed."""
    count = len(picture.values)
    listed = np.unique(np.linspace(0, count - 1, min(count, MAX_STATES)).round().astype(int))
    parts = []
    for state in listed.tolist():
        action = -1 if picture.actions is None else int(picture.actions[state])
        name = "" if action < 0 else f" {problem.format_action(0, action)}"
        value = format_score(float(picture.values[state]))
        parts.append(f"{format_state_name(problem, picture.states[state])} {value}{name}")
    heading = "values" if len(listed) == count else f"values of {len(listed)} of {count} states"
    return f"{heading}: {'; '.join(parts)}."


def _describe_tree(root: TreeNode) -> list[str]:
    """Return the statistics of the actions at the root, most visited first."""
    children = sorted(root.children, key=lambda child: -child.visits)
    parts = [
        f"{child.label} N {child.visits}"
        + ("" if child.value is None else f", Q {format_score(child.value)}")
        + ("" if child.score is None else f", UCB {format_score(child.score)}")
        for child in children[:MAX_NODES]
    ]
    return [f"tree after {format_count(root.visits, 'simulation')}: {'; '.join(parts) or 'empty'}."]


def _describe_column(picture: BeliefTable, index: int) -> str:
    """Return one column of a belief table; of many states, those with the largest numbers."""
    name, numbers = picture.columns[index]
    order = [*range(len(numbers))]
    if len(order) > MAX_ACTIONS:
        order = np.argsort(-np.nan_to_num(numbers, nan=-1.0), kind="stable")[:MAX_ACTIONS].tolist()
    finite = [state for state in order if not np.isnan(numbers[state])]
    parts = [f"{picture.state_labels[state]} {numbers[state]:.4f}" for state in finite]
    more = len(numbers) - len(order)
    return f"{name}: {', '.join(parts)}{f', {more} more' if more else ''}."


def _describe_vectors(picture: AlphaVectorSet) -> list[str]:
    """Return a line for each vector that is best at some belief, and one for the belief."""
    states = ", ".join(picture.state_labels)
    lines = [f"vectors over {states}:"]
    for index in np.flatnonzero(~picture.dominated).tolist():
        numbers = ", ".join(map(format_score, picture.vectors[index].tolist()))
        lines.append(f"{picture.action_labels[index]}: {numbers}.")
    dominated = int(np.count_nonzero(picture.dominated))
    lines += [f"removed: {format_count(dominated, 'vector')}."] if dominated else []
    if picture.belief is not None:
        numbers = ", ".join(f"{p:.4f}" for p in picture.belief)
        lines.append(f"belief: {numbers}.")
    return lines


def _describe_mixes(picture: StrategyMixes) -> list[str]:
    """Return a line for each agent with its most probable actions."""
    lines = []
    for seat, (agent, mix) in enumerate(zip(picture.agents, picture.mixes, strict=True)):
        order = [a for a in np.argsort(-mix, kind="stable")[:MAX_ACTIONS].tolist() if mix[a] > 0]
        parts = [f"{picture.action_labels[seat][a]} {mix[a]:.3f}" for a in order]
        best = picture.best_responses[seat] if picture.best_responses else -1
        reply = "" if best < 0 else f"; best response {picture.action_labels[seat][best]}"
        lines.append(f"{agent}: {', '.join(parts)}{reply}.")
    return lines


def iter_json_lines(watched: WatchedSteps, index: int | None = None) -> Iterator[str]:
    """Yield each step as a line of JSON, or only one."""
    for number, step in enumerate(watched.iter_steps(), 1):
        if index in {None, number - 1}:
            yield f"{format_json_step(number, step, watched.problem)}\n"


def format_json_step(number: int, step: Step, problem: Problem) -> str:
    """Return a step as one line of JSON, with the data of its pictures."""
    facts = {
        "step": number,
        "title": step.title,
        "sentences": list(step.sentences),
        "formula": step.formula,
        "pictures": [_picture_facts(picture, problem) for picture in step.pictures],
    }
    return json.dumps(facts, default=_to_list)


def _picture_facts(picture: Picture, problem: Problem) -> dict[str, object]:
    """Return the data of a picture, with its kind."""
    match picture:
        case StateValues():
            labels = problem.actions[0].labels
            names = [format_state_name(problem, state) for state in picture.states]
            actions = None if picture.actions is None else picture.actions.tolist()
            facts = {
                "states": names,
                "values": picture.values,
                "actions": actions and [None if a < 0 else labels[a] for a in actions],
                "changed": picture.changed,
                "focus": None if picture.focus is None else names[picture.focus],
            }
            return {"kind": "state values", **facts}
        case Curve():
            return {"kind": "curve", **picture._asdict()}
        case TreeNode():
            return {"kind": "search tree", **_node_facts(picture)}
        case BeliefTable():
            columns = {name: numbers for name, numbers in picture.columns}
            return {"kind": "belief", "states": list(picture.state_labels), "columns": columns}
        case AlphaVectorSet():
            return {"kind": "alpha vectors", **picture._asdict()}
        case StrategyMixes():
            return {"kind": "mixes", **picture._asdict()}


def _node_facts(node: TreeNode) -> dict[str, object]:
    """Return the data of a node and of all nodes below it."""
    return {**node._asdict(), "children": [_node_facts(child) for child in node.children]}


def _to_list(value: object) -> object:
    """Return an array or a NumPy number as lists and numbers of Python; None if not finite."""
    assert isinstance(value, np.ndarray | np.generic)
    numbers = np.asarray(value, object)
    if np.asarray(value).dtype.kind == "f":
        numbers[~np.isfinite(value)] = None
    return numbers.tolist()
