"""Agents by name: those that can play a seat, the one that gives hints, and full names.

An agent is `NAME`, `NAME:PARAMETER=VALUE,...`, `MODULE:ATTRIBUTE`, `./FILE.py:ATTRIBUTE` or a
program, `bot:COMMAND` or `bot:PARAMETER=VALUE,...,COMMAND`. `learned:FILE` is what
`dmplay train` wrote, `policy:FILE` a policy in a text file or of another solver.
"""

import hashlib
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, fields, is_dataclass, replace
from functools import cache, cached_property, partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np

from dmplay.agents import agents_by_method
from dmplay.agents.available_agents import HINT_PROVIDER_ROLE, PARTNER_ROLE, Roster
from dmplay.agents.base import (
    SCRIPTED_PLAYERS,
    AdviceQuestion,
    SeatPolicy,
    bound_action_values,
    bound_best_number,
    find_values_basis,
    models_opponents,
)
from dmplay.agents.random_agent import AGENTS_FOR_ANY_PROBLEM
from dmplay.agents.script import Script
from dmplay.agents.view_policy import ViewPolicy, is_plain_agent
from dmplay.core.action_values import Accuracy, ActionValues, Horizon, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.parameter_parsing import parse_parameter
from dmplay.core.parameters import INTEGER_TYPES
from dmplay.core.policy import Memory, Policy, check_members, forbid_exit, is_policy_sequence
from dmplay.core.problem import Problem, check_problem, find_seat, initial_state_distribution
from dmplay.core.safe_files import read_bytes
from dmplay.core.text import format_count
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadParameter, BadPolicy, DmplayError, UnknownName
from dmplay.registry import problem_module_exports
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problem_name_kinds import names_agent_file, names_bot
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.registry.user_code import load_named_attribute, may_name_code

if TYPE_CHECKING:
    from dmplay.agents.best_response_in_team import PartnerBeliefPolicy

NON_PARAMETER_FIELDS = ("problem", "seat", "policy_maker", "opponents")


class PlainAgent(Protocol):
    """An object that plays one game at a time."""

    @property
    def act(self) -> Callable[..., str | float]:
        """The function of a view that returns an action's name or number."""


# a name, a policy, its class, a function of problem and seat that makes it, or a plain agent
AgentLike = str | Policy | PlainAgent | Callable[..., object]
DIGEST_MARK, DIGEST_DIGITS = ",digest=", 16  # of an agent's file, in its name
MAX_LISTED_PROBLEMS = 4  # maximum number of problems listed for an agent that does not fit


@dataclass(frozen=True)
class HintAgent:
    """The agent that answers a question about one game."""

    name: str  # with all its parameters
    policy: SeatPolicy
    question: AdviceQuestion

    @property
    def base_name(self) -> str:
        """Its name without the turns that it plans and the players that it assumes."""
        return _format_agent_name(self.name.partition(":")[0], self.policy, ["horizon", "to"])

    @cached_property
    def basis(self) -> ValuesBasis:
        """The basis of its values."""
        basis = find_values_basis(self.policy, self.question)
        is_renamed = self.question.scripts and basis.opponents and not basis.assumed_players
        return basis._replace(opponents=(*self._list_opponents(),)) if is_renamed else basis

    @property
    def basis_with_players(self) -> ValuesBasis | None:
        """The basis of its values if they come from a model of the question's players, else None.

        Players whom a person assumes count as those of the game.
        """
        if not models_opponents(self.policy):
            return None
        basis = find_values_basis(self.policy, replace(self.question, assumes_players=False))
        return None if basis.assumed_players else basis

    def _list_opponents(self) -> Iterator[str]:
        """Yield the names of the other players, with the number of actions that one repeats."""
        for seat, name in enumerate(self.question.players):
            script = make_script_policy(self.question, seat)
            count = f" of {format_count(len(script.actions), 'action')}" if script else ""
            if seat != self.question.seat:
                yield f"{name}{count}"

    def attach_basis(self, q: Reals | None, legal: Bools | None) -> ActionValues | None:
        """Return its values `[A]` with their basis; None if it has none.

        Those of illegal actions are nan. Ratings are whole numbers, as they are not more exact.
        """
        problem, seat = self.policy.problem, self.question.seat
        if q is None or not problem.actions[seat].labels:
            return None
        q = q.round() if self.basis.accuracy is Accuracy.RATING else q
        legal_q = q if legal is None else np.where(legal, q, np.nan)
        return ActionValues(legal_q, self.basis, problem.reward_scale)

    @property
    def seat(self) -> int:
        """The seat that the question is about."""
        return self.question.seat

    @property
    def is_about_game(self) -> bool:
        """True if its values are about the turns and the real other players of the game."""
        is_alone = len(self.policy.problem.agents) == 1
        is_modelled = is_alone or bool(self.basis.opponents)
        is_assumed = self.basis.scope or self.question.assumes_players
        return is_modelled and self.basis.has_regrets and not is_assumed

    @property
    def has_exact_regrets(self) -> bool:
        """True if its values are exact and about the game, so that all regrets are known."""
        return self.basis.accuracy is Accuracy.EXACT and self.is_about_game

    def explain_unknown_regrets(self) -> str:
        """Return why no regret of a choice can be bounded, '' if one may be."""
        if not self.is_about_game:
            players = self.basis.scope or "for unknown other players"
            return f"the values of {self.base_name} are not about this game ({players})"
        has_bounds = type(self.policy).value_bounds is not SeatPolicy.value_bounds
        if has_bounds or self.has_exact_regrets:
            return ""
        accuracy = self.basis.accuracy
        kind = "of unknown accuracy" if accuracy is Accuracy.UNKNOWN else f"only {accuracy.words}"
        return f"the values of {self.base_name} are {kind}"

    def bound_regrets(self, memory: Memory, legal: Bools | None, actions: Array) -> Reals | None:
        """Return a lower and an upper bound `[2, B]` of the regret of one action of each row.

        `legal` is `[B, A]`. The bounds are equal if the values are exact. None if the values are
        not about the game, or have no bounds.
        """
        bounds = self._bound_chosen_and_best(memory, legal, actions) if self.is_about_game else None
        if bounds is None:
            return None
        (chosen, best), scale = bounds, self.policy.problem.reward_scale
        regrets = best - chosen[::-1]
        return np.where(regrets <= VALUE_TOLERANCE * scale, 0.0, regrets)

    def _bound_chosen_and_best(
        self, memory: Memory, legal: Bools | None, actions: Array
    ) -> tuple[Reals, Reals] | None:
        """Return the bounds `[2, B]` of the values of the chosen action, and of the best one.

        The best of labelled actions that have bounds is the best of the other ones.
        """
        policy, rows = self.policy, np.arange(len(actions))
        label_count = len(policy.problem.actions[policy.seat].labels)
        actions = actions.astype(np.int64) if label_count else actions
        if label_count and self.has_exact_regrets:
            q = policy.action_values(memory)
            if q is None:
                return None
            best = (q if legal is None else np.where(legal, q, -np.inf)).max(axis=1)
            return np.stack([q[rows, actions]] * 2), np.stack([best] * 2)
        if not label_count:
            chosen = policy.value_bounds(memory, actions)
            best = bound_best_number(policy, memory, legal)
            return None if chosen is None or best is None else (np.stack(chosen), best)
        bounds = bound_action_values(policy, memory)
        if bounds is None:
            return None
        is_other = np.ones((len(actions), label_count), bool) if legal is None else legal.copy()
        is_other[rows, actions] = False
        return bounds[:, rows, actions], np.where(is_other, bounds, -np.inf).max(axis=-1)

    def describe_game(self, turns_done: int) -> str:
        """Return the turns left and the other players that its values are about, as text."""
        basis, turns = self.basis, self.basis.turns_scope
        if basis.horizon is Horizon.PLAN:
            plan = basis.horizon_turns
            turns = f"{format_count(plan - turns_done % plan, 'turn')} left {turns}"
        # An agent of unknown accuracy may not plan at all.
        is_plan = self.policy.plans_whole_game or basis.accuracy is not Accuracy.UNKNOWN
        if not turns and is_plan:
            turns = self.question.describe_turns_left(turns_done)
        return ", ".join(filter(None, (turns, basis.players)))


def load_roster(problem: Problem, seat: int = 0) -> Roster:
    """Return the agents that can play a seat: the problem's own, then those of general methods."""
    specific = problem_module_exports.load_specific_roster(problem, seat)
    general = partial(agents_by_method.build_roster_by_method, problem, seat)
    if specific is None:
        roster = general()
        return replace(roster, agents={**roster.agents, **AGENTS_FOR_ANY_PROBLEM})
    agents = _SpecificAgentsFirst(
        specific.agents, lambda: general().agents if specific.adds_general_agents else {}
    )
    roster = replace(specific, agents=agents)
    problem_module_exports.check_roles(problem, roster)
    if roster.hint_provider:
        return roster
    adviser = general()
    return replace(
        roster,
        hint_provider=adviser.hint_provider,
        finite_horizon_hint_provider=adviser.finite_horizon_hint_provider,
    )


class _SpecificAgentsFirst(Mapping[str, type[SeatPolicy]]):
    """The agents of a problem, then those of general methods, which are found when needed."""

    def __init__(
        self,
        specific: Mapping[str, type[SeatPolicy]],
        find_general: Callable[[], Mapping[str, type[SeatPolicy]]],
    ) -> None:
        self._specific, self._find_general = {**specific}, find_general

    @cached_property
    def _all_agents(self) -> dict[str, type[SeatPolicy]]:
        """All agents; a general one is left out if the problem has it under another name."""
        classes = {*self._specific.values()}
        general = self._find_general().items()
        others = {name: kind for name, kind in general if kind not in classes}
        # Later values replace earlier ones, and the order of the names stays.
        return {**self._specific, **others, **AGENTS_FOR_ANY_PROBLEM, **self._specific}

    @property
    def _quickly_found_agents(self) -> dict[str, type[SeatPolicy]]:
        """The agents of the problem, and those for any problem."""
        return AGENTS_FOR_ANY_PROBLEM | self._specific

    def __getitem__(self, name: str) -> type[SeatPolicy]:
        return self._quickly_found_agents.get(name) or self._all_agents[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all_agents)

    def __len__(self) -> int:
        return len(self._all_agents)


def load_agent(
    problem: ProblemLike, seat: int | str, agent: AgentLike, *, turns: int | None = None
) -> Policy:
    """Return the policy of an agent for a seat, in games of at most `turns` turns.

    `agent` is a name, a policy, its class, a function of problem and seat that makes it, or a plain
    agent: a function of a view, an object with `act(view)`, or its class.

    Raises UnknownName with the nearest names, BadPolicy if the agent does not play this problem,
    and BadParameter if one of its parameters, or the seat, is invalid.
    """
    problem = load_problem(problem)
    check_problem(problem, turns)
    seat = find_seat(problem, seat)
    if not is_single_agent(agent):
        expected = "expected an agent: its name, class, function or object with choose or act"
        raise BadPolicy(f"{problem.agents[seat]}: got {agent!r}, {expected}")
    if not isinstance(agent, str):
        return _make_policy(problem, seat, format_agent_label(agent), agent, {}, turns)
    if names_bot(agent):
        return make_bot(problem, seat, agent, turns)
    if names_agent_file(agent):
        return _load_agent_file(problem, agent)
    if not names_user_code(problem, seat, agent):
        return _make_roster_agent(problem, seat, agent)
    source, _, remainder = agent.partition(":")
    attribute_name, _, parameter_text = remainder.partition(":")
    try:
        factory = load_named_attribute(f"{source}:{attribute_name}")
    except BadParameter:  # no such module
        _raise_if_for_other_problems(problem, seat, source)
        raise
    if parameter_text and not callable(factory):
        raise BadPolicy(f"{agent}: an object takes no parameters; name its class")
    parameters = parse_agent_parameters(factory, parameter_text, agent) if parameter_text else {}
    return _make_policy(problem, seat, agent, factory, parameters, turns)


def _load_agent_file(problem: Problem, name: str) -> Policy:
    """Return the policy of `learned:FILE` or `policy:FILE`, which has the digest in its name."""
    from dmplay.agents.learned_file import read_learned_file
    from dmplay.agents.policy_file import read_policy_file

    kind, path, digest = _split_agent_file_name(name)
    if digest and digest != _compute_file_digest(path):
        raise BadPolicy(f"{path}: the file has another digest than {digest}")
    if kind == "learned":
        return read_learned_file(path).make_policy(problem, name)
    return read_policy_file(path, problem)


def _split_agent_file_name(name: str) -> tuple[str, Path, str]:
    """Return the kind of an agent's file, its path and its digest, '' if the name has none."""
    kind, _, remainder = name.partition(":")
    path, _, digest = remainder.partition(DIGEST_MARK)
    return kind, Path(path), digest


def _compute_file_digest(path: Path) -> str:
    """Return the first digits of the digest of an agent's file; raise BadPolicy without one."""
    try:
        return hashlib.sha256(read_bytes(path)).hexdigest()[:DIGEST_DIGITS]
    except OSError as error:
        raise BadPolicy(f"{path}: {error.strerror}") from None


def add_file_digest(name: str) -> str:
    """Return the name of an agent with the digest of its file, if it is a file."""
    if not names_agent_file(name) or DIGEST_MARK in name:
        return name
    return f"{name}{DIGEST_MARK}{_compute_file_digest(_split_agent_file_name(name)[1])}"


def is_missing_file(name: str) -> bool:
    """Return whether an agent is a file that does not exist."""
    return names_agent_file(name) and not _split_agent_file_name(name)[1].exists()


def load_agents(
    problem: Problem, agents: AgentLike | Sequence[AgentLike], *, turns: int | None = None
) -> list[Policy]:
    """Return a policy for each seat, from an agent for each seat or one for all.

    Raise BadPolicy for another number of agents, and for None.
    """
    policies = load_players(problem, agents, turns=turns)
    if None in policies:
        raise BadPolicy(f"{problem.agents[policies.index(None)]}: got None, expected an agent")
    return [policy for policy in policies if policy is not None]


def load_players(
    problem: Problem, agents: AgentLike | Sequence[AgentLike | None], *, turns: int | None = None
) -> list[Policy | None]:
    """Return the policy of each seat, None for a seat that the caller plays.

    There is an agent or None for each seat, or one agent for all. As on the command line, an agent
    that plans whole games and is named plans for `turns`.
    """
    policies = list[Policy | None]()
    for seat, agent in enumerate(assign_agents(problem, agents)):
        adapted = agent
        if turns and isinstance(agent, str):
            adapted = set_horizon_in_name(problem, seat, agent, turns)
        policy = None if adapted is None else load_agent(problem, seat, adapted, turns=turns)
        policies.append(policy)
    return policies


def assign_agents(
    problem: Problem, agents: AgentLike | Sequence[AgentLike | None]
) -> list[AgentLike | None]:
    """Return the agent of each seat, or None, from a sequence of them or one agent for all.

    Raise BadPolicy for anything else, such as one policy for several seats.
    """
    names = ", ".join(problem.agents)
    is_policy = hasattr(agents, "choose") and not isinstance(agents, type)
    if is_single_agent(agents) and not (is_policy and len(problem.agents) > 1):
        return [cast("AgentLike", agents)] * len(problem.agents)
    if is_policy or not is_policy_sequence(agents):
        expected = f"expected {'' if is_policy else 'an agent, or '}one for each of {names}"
        raise BadPolicy(f"got {agents!r}, {expected}")
    if len(agents) != len(problem.agents):
        raise BadPolicy(
            f"got {format_count(len(agents), 'agent')}, expected one for each of {names}"
        )
    return [*cast("Sequence[AgentLike | None]", agents)]


def assign_entrant(
    problem: Problem, entrant: AgentLike | Sequence[AgentLike], seat: int, others: AgentLike = ""
) -> Sequence[AgentLike]:
    """Return the agent of each seat for one agent in a seat, or for a sequence of all agents.

    `others` play the other seats, by default the usual partners.
    """
    if not is_single_agent(entrant):
        return cast("Sequence[AgentLike]", entrant)
    seats = range(len(problem.agents))
    agents = [others or load_roster(problem, index).default_partner for index in seats]
    agents[seat] = cast("AgentLike", entrant)
    return agents


def is_single_agent(agents: object) -> bool:
    """Return whether this is one agent, not a sequence with one for each seat."""
    has_method = any(hasattr(agents, name) for name in ("choose", "act", "initial_memory"))
    return isinstance(agents, str) or callable(agents) or has_method


def format_agent_label(agent: object) -> str:
    """Return the name of an agent for reports: as given, or that of its class or function.

    That of an object has its parameters that differ from their defaults.
    """
    if isinstance(agent, str):
        return agent
    name = str(getattr(agent, "__name__", type(agent).__name__))
    is_policy = isinstance(agent, SeatPolicy) and not isinstance(agent, type)
    return _format_agent_name(name, cast(SeatPolicy, agent)) if is_policy else name


def label_agents(agents: Sequence[object]) -> list[str]:
    """Return a label for each agent; objects, classes and functions of one name are numbered."""
    labels = [*map(format_agent_label, agents)]
    return [
        label
        if isinstance(agent, str) or labels.count(label) == 1
        else f"{label} {labels[: index + 1].count(label)}"
        for index, (agent, label) in enumerate(zip(agents, labels, strict=True))
    ]


def list_agents(problem: ProblemLike, seat: int | str = 0) -> list[str]:
    """Return the names of the agents that can play a seat of a problem."""
    problem = load_problem(problem)
    seat = find_seat(problem, seat)
    agents = load_roster(problem, seat).agents
    return [name for name in agents if not refuses_to_play(problem, agents[name], seat)]


def _make_policy(  # noqa: PLR0913, PLR0917 - of one agent
    problem: Problem,
    seat: int,
    name: str,
    agent: object,
    parameters: Mapping[str, object],
    turns: int | None,
) -> Policy:
    """Return the policy of an agent of user code, with these parameters; raise BadPolicy."""
    if is_plain_agent(agent):
        turn_limit = problem.horizon if turns is None else turns
        return ViewPolicy(problem, seat, name, agent, turn_limit, parameters)
    if isinstance(agent, type) or (callable(agent) and not hasattr(agent, "choose")):
        make: Any = agent
        try:
            agent = forbid_exit(make, problem, seat, **parameters)
        except TypeError as error:
            if describe_error_location(error):  # raised on a line of user code
                raise
            _raise_if_for_other_problems(problem, seat, name.partition(":")[0])
            reason = f"cannot construct a policy from (problem, seat), {error}"
            raise BadPolicy(f"{name}: {reason}") from None
    check_members(agent, name)
    policy = cast("Policy", agent)
    if not isinstance(policy.uniform_count, INTEGER_TYPES) or policy.uniform_count < 0:
        got = f"{name}: uniform_count: got {policy.uniform_count!r}"
        raise BadPolicy(f"{got}, expected a whole number, 0 or more")
    return policy


def names_user_code(problem: Problem, seat: int, name: str) -> bool:
    """Return whether an agent's name refers to a file or module, not to an agent of the seat.

    The code that it names is run only if it is trusted.
    """
    agent_names = (*problem_module_exports.RESERVED_AGENT_NAMES, *load_roster(problem, seat).agents)
    return may_name_code(name) and name.partition(":")[0] not in agent_names


def find_hint_provider(problem: Problem, question: AdviceQuestion) -> HintAgent | None:
    """Return the agent that answers a question about a game; None if there is none.

    All advice comes from it: hints, values, overlays, reviews, grades and the best ghost. It is
    None too if the agent refuses the problem.
    """
    name = load_roster(problem, question.seat).hint_provider_for(question.turn_limit)
    if name is None:
        return None
    try:
        agent = load_hint_agent(problem, question, name)
    except BadPolicy:
        return None
    return _find_best_response(agent) or agent


def find_partner_policy(problem: Problem, question: AdviceQuestion) -> "PartnerBeliefPolicy | None":
    """Return the policy whose beliefs about the state use the rule of the other player.

    None if the agent that answers the question has no such beliefs, or does not know the rule, or
    if a person only assumes it.
    """
    if len(problem.agents) == 1 or question.assumes_players:
        return None
    from dmplay.agents.best_response_in_team import PartnerBeliefPolicy  # few problems need it

    roster = load_roster(problem, question.seat)
    name = roster.hint_provider_for(question.turn_limit)
    if name is None or not issubclass(roster.agents.get(name, SeatPolicy), PartnerBeliefPolicy):
        return None
    try:
        policy = load_hint_agent(problem, question, name).policy
    except DmplayError:
        return None
    if not isinstance(policy, PartnerBeliefPolicy) or policy.to == "random":
        return None
    return policy if (policy.to,) == question.opponents else None


def _find_best_response(agent: HintAgent) -> HintAgent | None:
    """Return the best response to the players of an agent's question; None if it is not computed.

    It is not needed if the agent plans with these players; if all see the state, its values must
    be exact in this game too. It is not tried in games of unknown size that only a search can play.
    """
    problem, question = agent.policy.problem, agent.question
    others = [(seat, name) for seat, name in enumerate(question.players) if seat != question.seat]
    is_known = [
        make_script_policy(question, seat)
        or name.partition(":")[0] in load_roster(problem, seat).agents
        for seat, name in others
    ]
    is_large = agent.name == "search" and not isinstance(problem.state_count, int)
    if is_large or not others or not all(is_known):
        return None
    basis = agent.basis_with_players
    is_exact = basis and basis.accuracy is Accuracy.EXACT and not basis.turns_scope
    if basis and (is_exact or problem.partially_observable):
        return None
    try:
        policy, observation = _make_best_response(problem, question)
        policy.action_values(policy.initial_memory(observation))
    except DmplayError:
        return None
    return HintAgent("best-response", policy, question)


def _make_best_response(problem: Problem, question: AdviceQuestion) -> tuple[SeatPolicy, Array]:
    """Return the best response to the players of a question, with its first observations.

    Raises an error if it cannot be planned.
    """
    seat, turns, names = question.seat, question.turn_limit, question.opponents
    if problem.partially_observable:
        from dmplay.agents.best_response_in_team import BestResponseInTeam

        def make_partner(other: int, name: str) -> SeatPolicy | None:
            """Return the policy of the partner; None for random play."""
            return make_script_policy(question, other) or _make_opponent(problem, other, name)

        script = make_script_policy(question, 1 - seat)
        horizon = turns or (len(script.actions) if script else 0)
        team_policy = BestResponseInTeam(problem, seat, to=names[0], horizon=horizon)
        return team_policy.with_policy_maker(make_partner), np.full(1, -1)
    from dmplay.agents.best_response_plan import BestResponsePlan

    others = [other for other in range(len(problem.agents)) if other != seat]
    policies = [
        make_script_policy(question, other) or _make_roster_agent(problem, other, name)
        for other, name in zip(others, names, strict=True)
    ]
    plan = BestResponsePlan(problem, seat, names, turns, tuple(policies))
    return plan, initial_state_distribution(problem)[1]


def make_script_policy(question: AdviceQuestion, seat: int) -> Script | None:
    """Return the policy of a seat that repeats listed actions; None if it does not."""
    is_scripted = question.players[seat] in SCRIPTED_PLAYERS  # not if another player is assumed
    scripts = (script for script in question.scripts if isinstance(script, Script))
    return next((script for script in scripts if is_scripted and script.seat == seat), None)


def load_hint_agent(problem: Problem, question: AdviceQuestion, name: str) -> HintAgent:
    """Return the named agent of a roster, adapted to a question.

    Raises BadPolicy if it refuses the problem.
    """
    seat, turns = question.seat, question.turn_limit
    try:
        policy = _make_roster_agent(problem, seat, name)
    except BadPolicy:  # Without a discount some agents can only plan a number of turns.
        agent_class = load_roster(problem, seat).agents.get(name)
        has_horizon = agent_class is not None and "horizon" in default_parameters(agent_class)
        if turns is None or not has_horizon:
            raise
        policy = _make_roster_agent(problem, seat, f"{name}:horizon={turns}")
    policy = policy.adapt_to_game(question)
    agent_classes = load_roster(problem, seat).agents
    if type(policy) is not agent_classes.get(name):  # another agent may fit the game better
        name = next((item for item in agent_classes if type(policy) is agent_classes[item]), name)
    return HintAgent(_format_agent_name(name, policy), policy, question)


def default_agent_name(problem: Problem, seat: int, turn_limit: int | None = None) -> str:
    """Return the name of the agent that plays a seat of many games if none is named.

    It is the roster's batch agent, else the hint provider, else the default partner.
    """
    seat_roster = load_roster(problem, seat)
    has_provider = find_hint_provider(problem, AdviceQuestion(seat, turn_limit))
    hint_provider = seat_roster.hint_provider_for(turn_limit) if has_provider else None
    return seat_roster.batch_agent or hint_provider or seat_roster.default_partner


def refuses_to_play(problem: Problem, agent_class: type[SeatPolicy], seat: int = 0) -> bool:
    """Return whether an agent of a roster refuses to play a seat, by default the first.

    An agent that needs an optional package is assumed to play, as the package is not loaded.
    """
    if agent_class.required_package:
        return False
    try:
        agent_class(problem, seat)
    except BadPolicy:
        return True
    return False


def set_horizon_in_name(problem: Problem, seat: int, name: str, turn_limit: int) -> str:
    """Return an agent's name with its horizon set to `turn_limit`, if it plans whole games.

    A name that sets a horizon already, and that of any other agent, is returned unchanged.
    """
    base, _, parameter_text = name.partition(":")
    agent_class = load_roster(problem, seat).agents.get(base)
    if agent_class is None or not agent_class.plans_whole_game:
        return name
    if "horizon" in parse_agent_parameters(agent_class, parameter_text, base):
        return name
    agent = _make_roster_agent(problem, seat, name)
    return _format_agent_name(base, agent.adapt_to_game(AdviceQuestion(seat, turn_limit)))


def find_agent_name(problem: Problem, seat: int, policy: Policy) -> str:
    """Return the name by which a policy can be loaded for a seat, with its parameters.

    The name of a policy that is not in the roster is that of its class.
    """
    if isinstance(policy, Script):
        return SCRIPTED_PLAYERS[0]
    for name, agent_class in load_roster(problem, seat).agents.items():
        if type(policy) is agent_class:
            return _format_agent_name(name, policy)
    return type(policy).__name__


def default_parameters(agent_class: Callable[..., object]) -> dict[str, object]:
    """Return the parameters of an agent's class or function with their defaults.

    They are the fields of a dataclass, or the arguments with a default.
    """
    if is_dataclass(agent_class):
        return {item.name: item.default for item in _parameter_fields(agent_class)}
    items = inspect.signature(agent_class).parameters.values()
    return {item.name: item.default for item in items if item.default is not item.empty}


def describe_agents(problem: Problem, names: Sequence[str]) -> dict[str, dict[str, object]]:
    """Return the parameters of some agents, with their values, in the first seat of each."""
    described = dict[str, dict[str, object]]()
    for name, seat in product(names, range(len(problem.agents))):
        is_in_roster = name.partition(":")[0] in load_roster(problem, seat).agents
        if is_in_roster and name not in described and not names_bot(name):
            policy = _make_roster_agent(problem, seat, name)
            parameters = default_parameters(type(policy))
            described[name] = {key: getattr(policy, key) for key in parameters}
    return described


def parameter_meanings(agent_class: type[SeatPolicy]) -> dict[str, str]:
    """Return the parameters of an agent with their descriptions, '' if there is none."""
    parameters = _parameter_fields(agent_class)
    return {parameter.name: parameter.metadata.get("meaning", "") for parameter in parameters}


def _make_roster_agent(problem: Problem, seat: int, name: str) -> SeatPolicy:
    """Return the agent of a roster by name, with its parameters.

    Raises UnknownName, or BadPolicy if it is an agent of other problems.
    """
    base, _, parameter_text = name.partition(":")
    agents = load_roster(problem, seat).agents
    if base in problem_module_exports.RESERVED_AGENT_NAMES:  # it is not a policy
        raise UnknownName("agent", name, [*agents, "bot:COMMAND"])
    if base not in agents:
        _raise_if_for_other_problems(problem, seat, base)
        raise UnknownName("agent", base, _valid_agent_names(problem, seat))
    parameters = parse_agent_parameters(agents[base], parameter_text, base)
    agent = agents[base](problem, seat, **parameters)
    return agent.with_policy_maker(partial(_make_opponent, problem))


def _valid_agent_names(problem: Problem, seat: int) -> list[str]:
    """Return the names that an agent of a seat can have."""
    return [
        "human",
        *load_roster(problem, seat).agents,
        "script",
        "replay",
        "bot",
        "learned:FILE",
        "policy:FILE",
    ]


def _raise_if_for_other_problems(problem: Problem, seat: int, name: str) -> None:
    """Raise BadPolicy if a name that this seat does not know is a built-in agent of other problems.

    The message names some of those problems and the agents of this seat.
    """
    kind_by_problem = {
        problem_name: kind for problem_name, kind, agents in _builtin_agents() if name in agents
    }
    if not kind_by_problem:
        return
    kinds = {*kind_by_problem.values()}
    problem_list = ", ".join([*kind_by_problem][:MAX_LISTED_PROBLEMS])
    if len(kind_by_problem) > MAX_LISTED_PROBLEMS:
        problem_list += " and others"
    valid_names = ", ".join(_valid_agent_names(problem, seat))
    reason = "" if problem.kind in kinds else f" ({' or '.join(sorted(kinds))}, not {problem.kind})"
    raise BadPolicy(f"agent {name} is for {problem_list}{reason}; expected one of {valid_names}")


@cache
def _builtin_agents() -> list[tuple[str, str, set[str]]]:
    """Return each built-in problem with its kind and the agents of its first and last seat."""
    builtin_agents = []
    for name in problem_names():
        problem = load_problem(name)
        first, last = (load_roster(problem, seat).agents for seat in (0, len(problem.agents) - 1))
        builtin_agents.append((name, problem.kind, {*first, *last}))
    return builtin_agents


def _make_opponent(problem: Problem, seat: int, name: str) -> SeatPolicy | None:
    """Return the agent of a name or role as a search simulates it; None for random play."""
    seat_roster = load_roster(problem, seat)
    if name in {HINT_PROVIDER_ROLE, PARTNER_ROLE} and seat_roster.simulation_agent:
        name = seat_roster.simulation_agent
    elif name == HINT_PROVIDER_ROLE:
        has_batch_agent, question = seat_roster.batch_agent, AdviceQuestion(seat)
        provider = None if has_batch_agent else find_hint_provider(problem, question)
        name = provider.name if provider else "random"
    elif name == PARTNER_ROLE:
        name = seat_roster.default_partner
    if name.partition(":")[0] in {"random", "search"}:
        return None
    policy = _make_roster_agent(problem, seat, name)
    if policy.depends_on_clock:
        reason = "its choices depend on the clock, so a search cannot simulate it"
        raise BadPolicy(f"{name}: {reason}; use random instead")
    return policy


def make_bot(problem: Problem, seat: int, name: str, turn_limit: int | None = None) -> Policy:
    """Return the agent that runs the program of `bot:COMMAND` in a game of `turn_limit` turns.

    Pairs `KEY=VALUE,` before the command are its parameters.
    """
    from dmplay.external.bots.bot_policy import Bot  # imported only if a program plays

    command, options = name.partition(":")[2], {}
    while command.startswith(("clock=", "belief=")):
        pair, _, command = command.partition(",")
        key, _, value = pair.partition("=")
        options[key] = parse_parameter(key, value, getattr(Bot, key))
    label = problem_module_exports.get_problem_name(problem)
    return Bot(problem, seat, command, label, turn_limit, **options)  # type: ignore[arg-type]


def parse_agent_parameters(agent_class: Any, text: str, name: str) -> dict[str, object]:
    """Return the parameters in `a=1,b=2`, each parsed to the type of its default.

    The name of the positional parameter may be left out.
    """
    defaults, parsed = default_parameters(agent_class), {}
    positional_parameter = getattr(agent_class, "positional_parameter", "")
    for pair in filter(None, text.split(",")):
        key, equals, value = pair.partition("=")
        if not equals and positional_parameter:
            key, equals, value = positional_parameter, "=", pair
        parameter_name = key.strip().replace("-", "_")
        if parameter_name not in defaults:
            raise UnknownName("parameter", key, defaults, error_prefix=f"agent {name}")
        if not equals:
            raise BadParameter(f"agent {name}: got {pair!r}, expected {parameter_name}=VALUE")
        default = defaults[parameter_name]
        parsed[parameter_name] = parse_parameter(parameter_name, value.strip(), default)
    return parsed


def _format_agent_name(name: str, policy: SeatPolicy, omitted: Sequence[str] = ()) -> str:
    """Return an agent's name, followed by its parameters that differ from their defaults.

    The parameters named in `omitted` are left out.
    """
    parts = []
    for key, default in default_parameters(type(policy)).items():
        value = getattr(policy, key)
        is_number_or_text = isinstance(value, str | int | float | np.generic)
        if is_number_or_text and value != default and key not in omitted:
            parts.append(f"{key}={str(value).lower() if isinstance(value, bool) else value}")
    return f"{name}:{','.join(parts)}" if parts else name


def _parameter_fields(agent_class: Any) -> list[Field[Any]]:
    """Return the fields of an agent class that are parameters."""
    return [field for field in fields(agent_class) if field.name not in NON_PARAMETER_FIELDS]
