"""The interface of policies: what a seat perceives, remembers and chooses."""

from collections.abc import Callable, Collection, Sequence
from inspect import getattr_static
from typing import NamedTuple, Protocol, TypeGuard, TypeVar

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.user_code_locations import describe_user_exit
from dmplay.errors import BadPolicy, UnknownName

# in NumPy's errors for writing to an array, and for making it writable
READONLY_ERROR_WORDS = ("read-only", "WRITEABLE")
T = TypeVar("T")
Memory = tuple[Array, ...]
UpdateMethod = TypeVar("UpdateMethod", bound=Callable[..., Memory])


class Percept(NamedTuple):
    """The information that one seat receives in one turn, for B rows.

    The fields are the seat's `action` `[B]`, its `observation` `[B, ...]`, which is the next state
    if agents see it, all `actions` `[B, n]`, and the seat's `reward` `[B]`. The last two are None
    if the seat does not see them.
    """

    action: Array  # [B], the seat's own action
    observation: Array  # [B, ...]; the next state if it is fully observable
    actions: Array | None  # [B, n], the joint action if the state is fully observable
    reward: Reals | None  # [B], the seat's own reward if rewards are observable


FIELD_OMITTED = np.zeros(0)  # placeholder for a percept field that the policy does not read


class GameFollower(Protocol):
    """The interface of memories of games, as one seat perceives them."""

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memory before the first turn: arrays whose first axis is the row.

        The observation is the initial state if it is fully observable, else a null observation: -1
        for labels, NaN for numbers, "" for texts.
        """

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn."""


class Policy(GameFollower, Protocol):
    """The interface of a policy for one seat, which plays a batch of one game or of many.

    A policy may have one more method, `stated_belief(memory)`. It returns the belief `[B, S]` that
    it holds when it chooses, with NaN for none, or None. Transcripts record it.

    It is a type for annotations. `isinstance` does not accept it; `dmplay.check` tries an agent.
    """

    @property
    def uniform_count(self) -> int:
        """The number of uniforms that one row of one choice consumes."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return an action for each row `[B]`; `legal` is `[B, A]`, `u` is `[B, uniform_count]`."""

    def action_values(self, memory: Memory) -> Reals | None:
        """Return the value of each action `[B, A]`, or None if the policy has no values."""


def requires_fields(*field_names: str) -> Callable[[UpdateMethod], UpdateMethod]:
    """Return a decorator for an `update_memory` that reads only these fields of a percept.

    The fields are "action", "observation", "actions" and "reward". In batches of games, the other
    fields are not copied for it. Raise UnknownName for any other name.
    """
    for name in {*field_names} - {*Percept._fields}:
        raise UnknownName("field of a percept", str(name), Percept._fields, "requires_fields")

    def mark_update(update: UpdateMethod) -> UpdateMethod:
        """Store the field names on the method and return it."""
        vars(update)["required_fields"] = field_names
        return update

    return mark_update


def required_fields(follower: GameFollower) -> Collection[str]:
    """Return the percept fields that a follower reads: all, unless it declares fewer."""
    update = follower.update_memory
    field_names: Collection[str] = getattr(update, "required_fields", Percept._fields)
    return field_names


def check_members(policy: object, label: str) -> None:
    """Raise BadPolicy if an object lacks members of a policy, or only inherits their interface.

    No property is computed: that of a program would start it.
    """
    missing = []
    for name in ("uniform_count", "initial_memory", "update_memory", "choose"):
        member = getattr_static(policy, name, None)
        is_interface = member is getattr_static(Policy, name)
        if is_interface or (member is None and not hasattr(policy, name)):
            missing.append(name)
    if missing:
        raise BadPolicy(f"{label}: not a policy, because it lacks {', '.join(missing)}")


def check_policy(policy: object, seat: int) -> None:
    """Raise BadPolicy if this is not a policy, for example an agent's name or a class."""
    if isinstance(policy, type):
        name = policy.__name__
        expected = f"expected an instance of it, such as {name}(problem, {seat})"
        raise BadPolicy(f"seat {seat}: got the class {name}, {expected}")
    if not hasattr(policy, "choose"):
        expected = f"expected a policy, such as dmplay.load_agent(problem, {seat}, NAME)"
        raise BadPolicy(f"seat {seat}: got {policy!r}, {expected}")
    check_members(policy, f"seat {seat}, {type(policy).__name__}")


def check_policies(agents: Sequence[str], policies: object) -> None:
    """Raise BadPolicy unless this is a sequence with a policy for each of these agents."""
    if not is_policy_sequence(policies) or len(policies) != len(agents):
        got, names = describe_policies(policies), ", ".join(agents)
        raise BadPolicy(f"got {got}, expected a policy for each of {names}")
    for seat, policy in enumerate(policies):
        check_policy(policy, seat)


def is_policy_sequence(policies: object) -> TypeGuard[Sequence[object]]:
    """Return whether this can be the policies of all seats: a sequence, but not a name."""
    return isinstance(policies, Sequence) and not isinstance(policies, str)


def describe_policies(policies: object) -> str:
    """Return the number of policies as text, or the repr of anything but a sequence."""
    if not is_policy_sequence(policies):
        return repr(policies)
    return f"{len(policies)} {'policy' if len(policies) == 1 else 'policies'}"


def forbid_writes(error_prefix: object, method: Callable[..., T], *args: object) -> T:
    """Return the result of a policy's method; raise BadPolicy if it writes to an argument."""
    try:
        return method(*args)
    except ValueError as error:
        if not any(word in str(error) for word in READONLY_ERROR_WORDS):
            raise
        name = method.__qualname__
        raise BadPolicy(
            f"{error_prefix}: {name} modifies an array that it received; copy the array first"
        ) from None


def forbid_exit(function: Callable[..., T], *args: object, **options: object) -> T:
    """Return the result of user code; raise BadPolicy if it would end the program."""
    try:
        return function(*args, **options)
    except SystemExit as error:
        message = describe_user_exit(error)
        if not message:  # dmplay ends, for a signal
            raise
        raise BadPolicy(message) from None
