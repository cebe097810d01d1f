"""Monte Carlo tree search in steps: selection, expansion, playout and backup.

Source: section 9.6, Monte Carlo Tree Search; with hidden states, chapter 22, Online Belief State
Planning. The search itself is in `monte_carlo_tree.py`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from dmplay.algorithms.formula_text import format_number, format_weighted_sum, shorten_numbers
from dmplay.algorithms.monte_carlo_tree import Decision, MonteCarloTree, SearchHistory
from dmplay.algorithms.step import Algorithm, Step, TreeNode, WatchRequest
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.text import describe_end_reason, format_count, format_score
from dmplay.core.uniforms import SeededUniforms, make_numpy_generator
from dmplay.errors import EpisodeOver

DEFAULT_SIMULATIONS = 50
MAX_DEPTH = 50  # turns of one simulation
ROW_SENTENCE = "The rows show, by turns, an action and the outcomes to which it led."
MAX_PATH_CHARACTERS = 24  # characters of a path after which its other turns are not named


def explain_misfit(problem: Problem) -> str:
    """Return why tree search does not fit a problem; '' if it fits."""
    if not problem.partially_observable or Session(problem, SeededUniforms(0)).has_visible_beliefs:
        return ""
    return (
        "tree search draws hidden states from a belief, but this problem has too many states "
        "to list, or observations without names"
    )


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the start, and up to four steps a simulation; raise EpisodeOver after the game."""
    problem, seat = request.problem, request.seat
    session = request.session or Session(problem, SeededUniforms(request.seed))
    if session.over:
        reason = describe_end_reason(session.end_reason)
        raise EpisodeOver(f"tree search needs a turn to play, but the game is over ({reason})")
    search = build_search(session, seat, request.seed)
    painter = TreePainter(search, _format_root(session))
    yield Step("start", _describe_start(request, search), "", (painter.draw_tree(),))
    last_simulation = request.iterations or DEFAULT_SIMULATIONS
    for simulation in range(1, last_simulation + 1):
        is_first, is_last = simulation == 1, simulation == last_simulation
        prefix = f"simulation {simulation}"
        first_state = search.sample_root_state()
        decisions, state = search.select_path(first_state)
        root_text = problem.format_state(first_state) if problem.partially_observable else ""
        yield Step(
            f"{prefix}: selection",
            _describe_selection(search, decisions, root_text),
            _format_score_formula(search, decisions),
            (painter.draw_tree(decisions),),
        )
        is_new = bool(decisions) and _is_new(decisions[-1])
        search.add_new_node(decisions)
        rewards: list[float] = []
        if is_new:
            tree = painter.draw_tree(decisions)
            outcome = _format_outcome(problem, decisions[-1].outcome_label)
            notes = [ROW_SENTENCE] if is_first else []
            sentences = (f"The tree gets a node for {outcome}.", *notes)
            yield Step(f"{prefix}: expansion", sentences, "", (tree,))
            max_turns = search.depth - len(decisions)
            rewards = search.play_out(state, max_turns)
            yield Step(
                f"{prefix}: playout",
                _describe_playout(problem.discount, rewards, max_turns, is_first=is_first),
                _format_playout_formula(problem, rewards),
                (tree,),
            )
        value = float(np.sum(problem.discount ** np.arange(len(rewards)) * np.array(rewards)))
        formula = _format_backup_formula(search, decisions, value)
        return_text = _format_return(problem, decisions, value)
        total = search.back_up(decisions, value)
        yield Step(
            f"{prefix}: backup",
            _describe_backup(search, return_text, total, is_first=is_first, is_last=is_last),
            formula,
            (painter.draw_tree(decisions),),
        )


def build_search(session: Session, seat: int, seed: int) -> MonteCarloTree:
    """Return a search from the position of a game, with only the information of a seat."""
    problem = session.problem
    turns_left = MAX_DEPTH
    if session.turn_limit is not None:
        turns_left = min(MAX_DEPTH, session.turn_limit - len(session.turns))
    states, probabilities = session.state[None], np.ones(1)
    if problem.partially_observable:
        beliefs = session.view(seat).beliefs
        assert beliefs is not None
        states, probabilities = problem.enumerate_states(), beliefs[-1]
    return MonteCarloTree(
        problem, seat, states, probabilities, turns_left, make_numpy_generator(seed)
    )


Path = dict[tuple[SearchHistory, int], str]  # the outcome of each action of a simulation


@dataclass(eq=False)
class TreePainter:
    """The pictures of a growing tree; parts that a simulation does not visit are drawn once."""

    search: MonteCarloTree
    root_label: str
    # of each node: the visits and the constant c at which it was drawn, and its picture
    drawn_nodes: dict[SearchHistory, tuple[int, float, TreeNode]] = field(default_factory=dict)

    def draw_tree(self, decisions: Sequence[Decision] = ()) -> TreeNode:
        """Return the whole tree, with the path of a simulation marked."""
        path = {(decision.node, decision.action): decision.outcome_label for decision in decisions}
        return self._draw_node(self.search.root, self.root_label, path)

    def _draw_node(self, node: SearchHistory, label: str, path: Path | None) -> TreeNode:
        """Return a node with all nodes below it; `path` is None if it is not on the path."""
        exploration = self.search.exploration_constant
        if path is None and node in self.drawn_nodes:
            visits, constant, picture = self.drawn_nodes[node]
            if (visits, constant) == (node.decision_count, exploration):
                return picture
        actions = tuple(self._draw_action(node, action, path) for action in node.actions)
        picture = TreeNode(label, node.decision_count, None, None, path is not None, actions)
        if path is None:
            self.drawn_nodes[node] = node.decision_count, exploration, picture
        return picture

    def _draw_action(self, node: SearchHistory, action: int, path: Path | None) -> TreeNode:
        """Return an action of a node, with its outcomes, and its score once it has been tried."""
        statistics = node.actions[action]
        chosen = path.get((node, action)) if path else None
        children: list[TreeNode] = []
        for outcome, child in statistics.outcomes.items():
            label = _format_outcome(self.search.problem, outcome)
            children.append(self._draw_node(child, label, path if outcome == chosen else None))
        value, score = None, None
        if statistics.visits:
            value, score = statistics.mean, self.search.compute_score(node, action)
        is_on_path, outcomes = chosen is not None, tuple(children)
        return TreeNode(statistics.label, statistics.visits, value, score, is_on_path, outcomes)


def _format_outcome(problem: Problem, label: str) -> str:
    """Return an outcome for readers: in a game of one state it is the next round."""
    return "next round" if problem.state_count == 1 else shorten_numbers(label)


def _format_root(session: Session) -> str:
    """Return the label of the root: the state, or the belief if it is hidden."""
    problem = session.problem
    if problem.partially_observable:
        return "belief"
    state_text = problem.format_state(session.state)
    return "this round" if problem.state_count == 1 else shorten_numbers(state_text)


def _is_new(decision: Decision) -> bool:
    """Return whether the outcome of a decision is not in the tree yet."""
    statistics = decision.node.actions.get(decision.action)
    return statistics is None or decision.outcome_label not in statistics.outcomes


def _describe_start(request: WatchRequest, search: MonteCarloTree) -> tuple[str, ...]:
    """Return the first step's sentences: root, simulations, belief, and the other agents' play."""
    problem, agent = request.problem, request.problem.agents[request.seat]
    others = [name for name in problem.agents if name != agent]
    position = "the position of your game" if request.session else "the start of a game"
    turns = format_count(search.depth, "turn")
    sentences = [
        f"The root of the tree is {position}{f', for {agent}' if others else ''}.",
        f"Each simulation adds at most one node, and plays at most {turns}.",
    ]
    if problem.partially_observable:
        sentences += [
            f"Its state is drawn from the belief of {agent}, not from the game.",
            "A node is a history of actions and observations.",
        ]
    if others:
        names = " and ".join(others)
        sentences.append(f"All values are against {names} acting uniformly at random.")
    return tuple(sentences)


def _describe_selection(
    search: MonteCarloTree, decisions: Sequence[Decision], root_text: str
) -> tuple[str, ...]:
    """Return the sentences about the path of a simulation through the tree."""
    sentences = [f"The belief gave the state {root_text}."] if root_text else []
    steps: list[str] = []
    for decision in decisions:
        outcome = _format_outcome(search.problem, decision.outcome_label)
        if sum(map(len, steps)) > MAX_PATH_CHARACTERS:
            steps.append(f"{len(decisions) - len(steps)} more")
            break
        steps.append(f"{decision.action_label} to {outcome}")
    sentences.append(f"Path: {', then '.join(steps) or 'none, because this state is an end'}.")
    if not decisions:
        return tuple(sentences)
    first, last = decisions[0], decisions[-1]
    if first.action in search.root.actions:
        meaning = "the range of the returns so far"
        if not search.have_returns_differed:
            meaning = "used while all returns are equal"
        sentences += [
            f"In the root, {first.action_label} has the highest UCB score: Q plus a bonus for few "
            "tries, c sqrt(ln N / n).",
            f"N counts all tries in the root, n those of {first.action_label}; "
            f"c = {format_score(search.exploration_constant)} is {meaning}.",
        ]
    if last.action not in last.node.actions:
        untried = f"was untried {'in the root' if len(decisions) == 1 else 'there'}"
        sentences.append(f"{last.action_label} {untried}, and untried actions come first.")
    elif _is_new(last):
        outcome = _format_outcome(search.problem, last.outcome_label)
        sentences.append(f"{last.action_label} led to {outcome} for the first time: the path ends.")
    else:
        sentences.append("The simulation ends inside the tree.")
    return tuple(sentences)


def _format_score_formula(search: MonteCarloTree, decisions: Sequence[Decision]) -> str:
    """Return the UCB1 score of the action chosen at the root; '' if it was not tried before."""
    if not decisions or decisions[0].action not in search.root.actions:
        return ""
    statistics = search.root.actions[decisions[0].action]
    terms = (
        f"{format_number(statistics.mean)} + {format_number(search.exploration_constant)} "
        f"x sqrt(ln {search.root.decision_count} / {statistics.visits})"
    )
    score = search.compute_score(search.root, decisions[0].action)
    return f"UCB({statistics.label}) = {terms} = {format_score(score)}"


def _describe_playout(
    discount: float, rewards: Sequence[float], max_turns: int, *, is_first: bool
) -> tuple[str, ...]:
    """Return the sentences about the random actions after the tree."""
    if not rewards:
        return ("The simulation ends there, so nothing is played.",)
    end = "up to the limit of the simulation" if len(rewards) == max_turns else "to the game's end"
    sentences = [
        f"Uniformly random actions play {format_count(len(rewards), 'turn')}, {end}.",
        "Their return estimates the value of the new node.",
    ]
    if is_first:
        weight = "1" if discount == 1.0 else f"{discount:g} to the power of the turn"
        sentences.append(
            f"value = sum of ({weight} x reward), with turns from 0; rewards of 0 are left out."
        )
    return tuple(sentences)


def _format_playout_formula(problem: Problem, rewards: Sequence[float]) -> str:
    """Return the discounted sum of rewards; '' if all of them are 0."""
    turns = [turn for turn, reward in enumerate(rewards) if reward]
    if not turns:
        return ""
    weights = [problem.discount**turn for turn in turns]
    values = [rewards[turn] for turn in turns]
    total = sum(weight * value for weight, value in zip(weights, values, strict=True))
    return f"value = {format_weighted_sum(weights, values)} = {format_score(total)}"


def _format_return(problem: Problem, decisions: Sequence[Decision], value: float) -> str:
    """Return the return from the root as a sum: the rewards on the path, and the playout's."""
    weights = problem.discount ** np.arange(len(decisions) + 1)
    return format_weighted_sum(weights, [*(decision.reward for decision in decisions), value])


def _describe_backup(
    search: MonteCarloTree, return_text: str, total: float, *, is_first: bool, is_last: bool
) -> tuple[str, ...]:
    """Return the sentences about the update of the means; after the last one, of the choice."""
    best = max(search.root.actions.values(), key=lambda statistics: statistics.mean, default=None)
    return_sentence = (
        f"The return from the root is {return_text} = {format_score(total)}: the rewards on the "
        "path, then the playout."
    )
    if best and is_last:
        return (
            f"The search ends, and chooses {best.label}, the root's action with the highest Q.",
            "Q is usually below the value of optimal play, because playouts act at random.",
            return_sentence,
        )
    sentences = [return_sentence]
    if is_first:
        sentences += [
            "N counts how often an action was tried. In a new state, no action was: N = 0.",
            "New Q = old Q + (return - old Q) / N, so Q is the mean return.",
        ]
    if best:
        sentences.append(f"{best.label} has the highest Q in the root so far.")
    return tuple(sentences)


def _format_backup_formula(
    search: MonteCarloTree, decisions: Sequence[Decision], value: float
) -> str:
    """Return the next update of the mean of the root's action; '' if none was chosen."""
    if not decisions:
        return ""
    for decision in reversed(decisions):
        value = decision.reward + search.problem.discount * value
    statistics = search.root.actions[decisions[0].action]
    mean, visits = statistics.mean, statistics.visits + 1
    update = f"({format_number(value)} - {format_number(mean)}) / {visits}"
    new_mean = mean + (value - mean) / visits
    return f"Q({statistics.label}) = {format_number(mean)} + {update} = {format_score(new_mean)}"


ALGORITHM = Algorithm(
    "tree-search",
    "simulate games, and try promising actions more often (Monte Carlo tree search)",
    "section 9.6, Monte Carlo Tree Search",
    explain_misfit,
    iterate_steps,
)
