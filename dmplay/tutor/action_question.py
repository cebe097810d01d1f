"""Questions for the best action in a position: the text, the check, and the reasons in numbers."""

from collections.abc import Collection, Iterator, Sequence
from functools import cached_property

import numpy as np

from dmplay.agents.base import address_opponent
from dmplay.agents.random_agent import Random
from dmplay.agents.repeated_game_rules import COOPERATE_LABEL, CooperateDefectRule
from dmplay.core.arrays import Reals
from dmplay.core.belief import initial_belief
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.hexgrid import list_hexes
from dmplay.core.problem import Problem
from dmplay.core.session import Turn
from dmplay.core.spaces import normalize_label
from dmplay.core.text import format_count
from dmplay.draw.hex_map import describe_map
from dmplay.errors import UnknownName
from dmplay.game.action_breakdown import PossibleOutcome, merge_outcomes_by_text
from dmplay.game.action_input import Keyboard
from dmplay.game.hints.review import RIGHT_LOSS_PERCENT
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.game.rules_of_thumb import build_seat_payoffs, is_repeated_game
from dmplay.game.seats import HUMAN
from dmplay.registry.agents import HintAgent, default_parameters, load_roster, make_script_policy
from dmplay.registry.problem_module_exports import find_export
from dmplay.registry.problem_name_kinds import names_data_file, names_python_file
from dmplay.tutor.answers import AnswerCheck
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import format_number
from dmplay.views.protocol import Lesson, load_view_module

MAX_LISTED_OUTCOMES = 5
MAX_LISTED_ACTIONS = 10
MAX_LISTED_PAYOFFS = 16
MIN_LISTED_PROBABILITY = 0.0005  # of a state in a belief
MAX_NAMED_ACTIONS = 4  # that are nearly as good as the best one
RIGHT_LOSS_LIMIT = (
    f"{RIGHT_LOSS_PERCENT}% of the difference between the values of the best and the worst action"
)


class ActionQuestion:
    """A question for the best action in a position.

    `obvious_action` is the action that the solution compares with the best one.
    """

    def __init__(
        self, game: PositionInGame, hint_agent: HintAgent, *, obvious_action: int | None = None
    ) -> None:
        self.game, self.position = game, game.ask(hint_agent)
        self.problem, self.seat = game.problem, game.seat
        values = self.position.values()
        assert values is not None
        self.values: Reals = np.where(np.isnan(values.q), -np.inf, values.q)  # [A]
        self.labels = tuple(self.position.labels)
        self.obvious_action = obvious_action

    @cached_property
    def tolerance(self) -> float:
        """The loss up to which an action is right, which is `RIGHT_LOSS_LIMIT`."""
        legal_values = self.values[np.isfinite(self.values)]
        return max(float(np.ptp(legal_values)) * RIGHT_LOSS_PERCENT / 100, self._tie_tolerance)

    @property
    def _tie_tolerance(self) -> float:
        """The difference up to which values are equal."""
        return VALUE_TOLERANCE * self.problem.reward_scale

    @property
    def best_action(self) -> int:
        """The index of the first of the best actions."""
        return int(np.flatnonzero(self.values >= self.values.max() - self._tie_tolerance)[0])

    @property
    def best_actions(self) -> list[str]:
        """The labels of the best actions, which are equally good."""
        return [label for label in self.right_actions if self._compute_loss(label) == 0.0]

    @property
    def right_actions(self) -> list[str]:
        """The labels of the right actions, best first."""
        order = np.argsort(-self.values, kind="stable")
        return [self.labels[action] for action in order if self._is_right(int(action))]

    @property
    def shows_board(self) -> bool:
        """True if there is a board, and it shows only what the player sees, not a belief."""
        return not (self.problem.partially_observable or self._lists_payoffs)

    @property
    def legal_labels(self) -> list[str]:
        """The labels of the legal actions."""
        return [self.labels[action] for action in np.flatnonzero(np.isfinite(self.values))]

    @property
    def expected_answer(self) -> str:
        """The legal actions as text; only the first and the last of many."""
        legal = self.legal_labels
        if len(legal) > MAX_LISTED_ACTIONS:
            return f"{legal[0]} to {legal[-1]}"
        return _join_labels(legal, "or")

    def describe_game(self) -> list[str]:
        """Return sentences on the rules of the game, its probabilities, and the other players."""
        lesson, problem = self._lesson, self.problem
        has_goal = lesson.objective.startswith("You want ")
        goal = [] if has_goal else ["You want the largest sum of rewards"]
        sentences = [lesson.role, lesson.objective, *goal, lesson.costs, *lesson.chances]
        rules = [f"{text[:1].upper()}{text[1:]}." for text in sentences if text]
        if problem.partially_observable:
            start = self.format_belief(initial_belief(problem))
            rules.append(f"The probabilities of the hidden states at the start are {start}.")
        name = self.game.problem_name
        if names_data_file(name) or names_python_file(name):
            rules.append(f"All probabilities and rewards are in {name}.")
        if self._lists_payoffs:
            rules += self._describe_payoffs()
        return [*rules, *self._describe_players()]

    @property
    def _lists_payoffs(self) -> bool:
        """True for a repeated game whose view does not explain the rewards."""
        has_lesson = hasattr(find_export(self.problem, "VIEW"), "lesson")
        return is_repeated_game(self.problem) and not has_lesson

    @cached_property
    def _lesson(self) -> Lesson:
        """The sentences that introduce the problem."""
        return load_view_module(self.problem).lesson(self.position.view)

    @property
    def has_map(self) -> bool:
        """True if the board is a map that marks the player."""
        return bool(self._lesson.map_mark)

    def _describe_players(self) -> Iterator[str]:
        """Yield sentences on each other player."""
        for seat, name in enumerate(self.position.question.players):
            if seat != self.seat and name != HUMAN:
                yield describe_agent(self.game, seat, name)

    def prompt(self) -> str:
        """Return the question, with the number of turns that are left."""
        turns_left, word = self.position.turns_left, find_turn_word(self.problem)
        limit = (
            "The game has no turn limit."
            if turns_left is None
            else f"You have {format_count(turns_left, word)} left."
        )
        discount, weight = self.problem.discount, ""
        if turns_left != 1 and discount < 1.0:
            times = format_number(discount)
            weight = f" Each later {word} counts {times} times the {word} before it."
        elif turns_left != 1:
            weight = f" All {word}s count the same."
        return f"{limit}{weight} What do you do?"

    def describe_situation(self) -> list[str]:
        """Return the situation in sentences, for a reader who does not see the board.

        It is [] in a repeated game, whose situation is its history.
        """
        problem, view = self.problem, self.position.view
        if problem.state_count == 1:
            return []
        if not hasattr(find_export(problem, "VIEW"), "describe_situation"):
            return [f"The state is {problem.format_state(self.game.session.state)}."]
        text = load_view_module(problem).describe_situation(view)
        situation = f"{text[:1].upper()}{text[1:]}"
        hexes = list_hexes(problem)
        return [*describe_map(hexes), situation] if hexes else [situation]

    def _describe_payoffs(self) -> list[str]:
        """Return the rewards of each pair of actions in sentences; [] if there are many."""
        payoffs, other_payoffs = build_seat_payoffs(self.problem, self.seat)
        replies = self.problem.actions[1 - self.seat].labels
        if payoffs.size > MAX_LISTED_PAYOFFS:
            return []
        agent = self.problem.agents[1 - self.seat]
        return [
            f"{label} against {reply} pays {payoffs[i, j]:g} to you and "
            f"{other_payoffs[i, j]:g} to {agent}."
            for i, label in enumerate(self.labels)
            for j, reply in enumerate(replies)
        ]

    def parse_answer(self, text: str) -> int:
        """Return the legal action that a text names; raise UnknownName with the nearest names."""
        legal = self.legal_labels
        by_normal_form = {normalize_label(label): label for label in legal}
        keyboard = Keyboard(self.problem, [self.seat], DEFAULT_KEY_PREFERENCES)
        keys = {key: name for key, name, _ in keyboard.list_actions_with_keys(self.position.view)}
        aliases = {
            normalize_label(alias): normalize_label(label)
            for alias, label in {**keys, **self.problem.action_aliases}.items()
        }
        word = normalize_label(text)
        label = by_normal_form.get(word) or by_normal_form.get(aliases.get(word, ""))
        if label is None:
            raise UnknownName("action", text, legal)
        return self.labels.index(label)

    def check_answer(self, action: int) -> AnswerCheck:
        """Return whether an action is right, with the loss of a wrong one.

        The best action is not named; the solution that follows a right answer says the rest.
        """
        if self._is_right(action):
            return AnswerCheck(True, "")
        loss = self._format_value(float(self.values.max() - self.values[action]))
        return AnswerCheck(
            False, f"{self._describe_value(action)}, {loss} less than the best action"
        )

    def _compute_loss(self, label: str) -> float:
        """Return the best value minus that of an action; 0 if they are equal but for rounding."""
        loss = float(self.values.max() - self.values[self.labels.index(label)])
        return loss if loss > self._tie_tolerance else 0.0

    def _is_right(self, action: int) -> bool:
        """Return whether an action is as good as the best one, within the tolerance."""
        return bool(self.values[action] >= self.values.max() - self.tolerance)

    def _format_value(self, value: float) -> str:
        """Return a value as text."""
        return format_number(value, self.problem.reward_scale)

    def _describe_value(self, action: int) -> str:
        """Return the value of an action as text."""
        return f"{self.labels[action]} is worth {self._format_value(float(self.values[action]))}"

    def explain_action(self, action: int, *, with_beliefs: bool = False) -> list[str]:
        """Return the outcomes of an action: probability, reward and later value, one a line."""
        outcomes = [
            outcome._replace(text=self._describe_perceived_event(outcome))
            for outcome in merge_outcomes_by_text(self.position.outcomes(action))
        ]
        if len(outcomes) > MAX_LISTED_OUTCOMES:
            outcomes = [*outcomes[: MAX_LISTED_OUTCOMES - 1], _merge_unlikely_outcomes(outcomes)]
        return [
            f"  with probability {_format_probability(item.probability)} "
            + self._describe_outcome(item, with_beliefs=with_beliefs)
            for item in outcomes
        ]

    def _describe_outcome(self, outcome: PossibleOutcome, *, with_beliefs: bool) -> str:
        """Return an outcome as text: what the player perceives, the reward and the later value."""
        belief, ends_game = "", outcome.ends_problem or self.position.turns_left == 1
        if with_beliefs and outcome.belief is not None and not ends_game:
            belief = f", belief {self.format_belief(outcome.belief)}"
        end = "the game ends"
        if not ends_game:
            end = f"then worth {self._format_value(outcome.value_after)}"
        name = "mean reward" if self.problem.partially_observable else "reward"
        return f"{outcome.text}: {name} {self._format_value(outcome.reward)}{belief}, {end}"

    def _describe_perceived_event(self, outcome: PossibleOutcome) -> str:
        """Return the perceived part of an outcome as text: a move, an observation, or a reply."""
        if self.problem.partially_observable:
            return outcome.text
        if self.problem.state_count != 1:
            return f"to {outcome.text}"
        agents = self.problem.agents
        return f"{agents[1 - self.seat] if len(agents) == 2 else 'the others'} plays {outcome.text}"

    def describe_solution(self, explained_actions: Collection[int] = ()) -> list[str]:
        """Return the belief, and the outcomes of the obvious action and of the best one.

        If there are no beliefs to add, actions that were explained before are left out.
        """
        actions = [self.best_action]
        if self.obvious_action is not None and self.obvious_action not in actions:
            actions.insert(0, self.obvious_action)
        lines = []
        if self.problem.partially_observable:
            belief = self.position.view.belief
            lines.append(f"Your belief over the hidden states is now {self.format_belief(belief)}.")
        for action in actions:
            if action not in explained_actions or self.problem.partially_observable:
                lines.append(f"{self._describe_value(action)}:")
                lines += self.explain_action(action, with_beliefs=True)
        if self.position.turns_left != 1:
            discount = self.problem.discount
            factor = f"{format_number(discount)} x " * (discount < 1.0)
            lines.append(f"Each value is the mean of reward + {factor}later worth.")
        return lines

    def describe_right_actions(self) -> str:
        """Return sentences that name the best actions, and those that also count as right."""
        best = self.best_actions
        text = f"solution: {' or '.join(best)}{' (equally good)' * (len(best) > 1)}"
        near = self.right_actions[len(best) :]
        if not near:
            return f"{text}."
        first_loss, last_loss = (self._format_value(self._compute_loss(near[i])) for i in (0, -1))
        loss = f"only {last_loss}" if first_loss == last_loss else f"at most {last_loss}"
        others = [f"{len(near) - MAX_NAMED_ACTIONS} more"] * (len(near) > MAX_NAMED_ACTIONS)
        names = _join_labels([*near[:MAX_NAMED_ACTIONS], *others], "and")
        lose, count = ("lose", "count") if len(near) > 1 else ("loses", "counts")
        return (
            f"{text}; {names} {lose} {loss} and {count} as right, "
            f"because the limit is {self._format_value(self.tolerance)}."
        )

    def format_belief(self, belief: Reals) -> str:
        """Return the probability of each possible state as text."""
        pairs = [
            f"{self._lesson.state_name.format(self.problem.format_state(state))}: "
            f"{_format_probability(float(p))}"
            for state, p in zip(self.problem.enumerate_states(), belief, strict=True)
            if p >= MIN_LISTED_PROBABILITY
        ]
        return ", ".join(pairs)


def find_turn_word(problem: Problem) -> str:
    """Return the word for a turn of a problem: a round in a repeated game."""
    return "round" if problem.state_count == 1 else "turn"


def describe_history(position: PositionInGame) -> str:
    """Return the turns so far as the player saw them; '' if the board shows all that counts."""
    session, problem = position.session, position.problem
    word = find_turn_word(problem)
    if not session.turns:
        return f"This is the first {word}."
    if not problem.partially_observable and problem.state_count != 1:
        return ""
    turns = [
        f"{word} {number}: {_describe_perceived_turn(position, turn)}"
        for number, turn in enumerate(session.turns, 1)
    ]
    return f"So far: {'; '.join(turns)}."


def _describe_perceived_turn(position: PositionInGame, turn: Turn) -> str:
    """Return the player's action in a turn, and what the player perceived."""
    problem, seat = position.problem, position.seat
    own_action = problem.format_action(seat, turn.actions[seat])
    if problem.partially_observable:
        observation = problem.observations[seat].format_observation(turn.observations[seat])
        return f"{own_action}, then {observation}"
    others = [
        f"{agent} {problem.format_action(other, turn.actions[other])}"
        for other, agent in enumerate(problem.agents)
        if other != seat
    ]
    return ", ".join([f"you {own_action}", *others])


def describe_agent(position: PositionInGame, seat: int, name: str) -> str:
    """Return sentences with an agent's name, parameters and description."""
    problem, (short_name, _, settings) = position.problem, name.partition(":")
    agent_class = load_roster(problem, seat).agents.get(short_name)
    script = make_script_policy(position.question, seat)
    if script:
        listed = [problem.format_action(seat, a) for a in script.actions[:MAX_LISTED_ACTIONS]]
        listed += ["..."] * (len(script.actions) > MAX_LISTED_ACTIONS)
        return f"{problem.agents[seat]} plays this list of actions: {', '.join(listed)}."
    if agent_class is None:
        return f"{problem.agents[seat]} is the agent {name}."
    set_values = dict(setting.split("=") for setting in settings.split(",") if setting)
    parameters = {**default_parameters(agent_class), **set_values}
    settings = ", ".join(f"{key} {value}" for key, value in parameters.items())
    description = " ".join((agent_class.__doc__ or "").partition("\n\n")[0].split())
    for key, value in parameters.items():
        description = description.replace(f"`{key}`", str(value))
    if len(problem.agents) == 2:
        description = address_opponent(description)
    labels = problem.actions[seat].labels
    all_legal = position.session.legal_actions_mask(seat) is None
    if issubclass(agent_class, Random) and len(labels) <= MAX_LISTED_ACTIONS and all_legal:
        description += f" Each of {_join_labels(labels, 'and')} has probability 1/{len(labels)}."
    text = (
        f"{problem.agents[seat]} is the agent {short_name}{settings and f' ({settings})'}, "
        f"which {description[:1].lower()}{description[1:]}"
    )
    seated = position.session.seated_policies[seat]
    has_label = COOPERATE_LABEL in problem.actions[seat].labels
    if seated is None or not isinstance(seated.policy, CooperateDefectRule) or has_label:
        return text
    your_action, other_action = (
        problem.format_action(index, seated.policy.cooperative_actions[index])
        for index in (position.seat, seat)
    )
    return (
        f"{text} You cooperate with {your_action}, and {problem.agents[seat]} with {other_action}."
    )


def _join_labels(labels: Sequence[str], conjunction: str) -> str:
    """Return labels as text, with a conjunction before the last one."""
    return f" {conjunction} ".join(filter(None, [", ".join(labels[:-1]), labels[-1]]))


def _merge_unlikely_outcomes(outcomes: Sequence[PossibleOutcome]) -> PossibleOutcome:
    """Return all outcomes but the likeliest ones as one, with their mean reward and value."""
    remaining = outcomes[MAX_LISTED_OUTCOMES - 1 :]
    total = sum(item.probability for item in remaining)
    return PossibleOutcome(
        f"one of {len(remaining)} other outcomes, on average",
        total,
        sum(item.probability * item.reward for item in remaining) / total,
        sum(item.probability * item.value_after for item in remaining) / total,
        ends_problem=all(item.ends_problem for item in remaining),
    )


def _format_probability(probability: float) -> str:
    """Return a probability with at most three decimals."""
    return format_number(round(probability, 3))
