"""Published Dec-POMDPs as text files, written from their definitions."""

from collections.abc import Callable, Iterator, Sequence
from itertools import product

from dmplay.formats import cassandra
from dmplay.formats.file_problems import FileProblem

Row = Sequence[float]
BINARY_PAIRS = [*product(range(2), repeat=2)]


def parse_team_file(text: str) -> FileProblem:
    return cassandra.read_markov_file("team.dpomdp", text.encode(), team=True)


def _format_row(row: Row) -> str:
    return " ".join(f"{number:.10g}" for number in row)


def _format_team_file(  # noqa: PLR0913, PLR0917 - one parameter for each part of a problem
    start: Row,
    actions: str,
    observations: str,
    transition_row: Callable[[int, tuple[int, ...]], Row],
    observation_row: Callable[[int, tuple[int, ...]], Row],
    reward_lines: Iterator[str],
) -> str:
    """Format a file of two identical agents, with functions for the rows of T and O."""
    states = range(len(start))
    lines = ["agents: 2", "discount: 1", "values: reward", f"states: {len(states)}", "start:"]
    lines += [
        _format_row(start),
        "actions:",
        actions,
        actions,
        "observations:",
        observations,
        observations,
    ]
    for a in product(range(len(actions.split())), repeat=2):
        lines += [f"T: {a[0]} {a[1]} :", *(_format_row(transition_row(s, a)) for s in states)]
        lines += [f"O: {a[0]} {a[1]} :", *(_format_row(observation_row(s, a)) for s in states)]
    return "\n".join([*lines, *reward_lines, ""])


def multiply_probabilities(first: float, second: float) -> Row:
    """Return the probabilities of the four pairs of two independent binary events."""
    return [(first if a else 1 - first) * (second if b else 1 - second) for a, b in BINARY_PAIRS]


def format_dectiger() -> str:
    """Format Dec-Tiger: two agents listen for one tiger (Nair et al., IJCAI 2003)."""

    def goes(s: int, a: tuple[int, ...]) -> Row:
        return (0.5, 0.5) if any(a) else (1.0 - s, s)

    def sees(s: int, a: tuple[int, ...]) -> Row:
        p_right = 0.85 if s else 0.15
        return [0.25] * 4 if any(a) else multiply_probabilities(p_right, p_right)

    def pays() -> Iterator[str]:
        for s, a in product(range(2), product(range(3), repeat=2)):
            is_tiger_door = [door == s + 1 for door in a if door]
            one_door_reward = -101 if any(is_tiger_door) else 9
            two_door_reward = -100 if a[0] != a[1] else -50 if any(is_tiger_door) else 20
            reward = (-2, one_door_reward, two_door_reward)[len(is_tiger_door)]
            yield f"R: {a[0]} {a[1]} : {s} : * : * : {reward}"

    return _format_team_file(
        (0.5, 0.5), "listen left right", "hear-left hear-right", goes, sees, pays()
    )


def format_broadcast() -> str:
    """Format the broadcast channel: only one of two nodes may send (Hansen et al., AAAI 2004)."""

    def goes(s: int, a: tuple[int, ...]) -> Row:
        still_full = [bool(full and waits) for full, waits in zip(BINARY_PAIRS[s], a, strict=True)]
        return multiply_probabilities(
            *(
                1.0 if is_full else p_arrival
                for is_full, p_arrival in zip(still_full, (0.9, 0.1), strict=True)
            )
        )

    def sees(s: int, a: tuple[int, ...]) -> Row:
        p_quiet = 0.1 if a == (0, 0) else 0.9
        return multiply_probabilities(p_quiet, p_quiet)

    def pays() -> Iterator[str]:
        for s, (first, second) in enumerate(BINARY_PAIRS):
            yield f"R: send wait : {s} : * : * : {first}"
            yield f"R: wait send : {s} : * : * : {second}"

    return _format_team_file((0, 0, 0, 1), "send wait", "collision quiet", goes, sees, pays())


def format_recycling() -> str:
    """Format recycling robots: two robots with batteries collect cans (Amato et al., UAI 2007)."""
    p_low_battery = {(0, 0): 0.0, (0, 1): 0.0, (1, 0): 0.3, (1, 1): 0.8, (2, 0): 0.5, (2, 1): 0.7}
    p_stuck = {(1, 1): 0.2, (2, 1): 0.3}

    def goes(s: int, a: tuple[int, ...]) -> Row:
        return multiply_probabilities(
            *(p_low_battery[pair] for pair in zip(a, BINARY_PAIRS[s], strict=True))
        )

    def sees(s: int, a: tuple[int, ...]) -> Row:
        return multiply_probabilities(*map(float, BINARY_PAIRS[s]))

    def pays() -> Iterator[str]:
        for s, a in product(range(4), product(range(3), repeat=2)):
            first, second = (
                p_stuck.get(pair, 0.0) for pair in zip(a, BINARY_PAIRS[s], strict=True)
            )
            cans = 5 if a == (2, 2) else 2 * a.count(1)
            reward = cans * (1 - first) * (1 - second) - 10 * (first + second)
            yield f"R: {a[0]} {a[1]} : {s} : * : * : {reward:.10g}"

    return _format_team_file((1, 0, 0, 0), "wait small big", "high low", goes, sees, pays())


def format_meeting(size: int = 2) -> str:
    """Format the meeting problem on a grid of 2 x 2 (Bernstein et al., IJCAI 2005; Amato et al.,
    2006) or of 3 x 3 with two meeting corners (Amato et al., ICAPS 2009).
    """
    cells, is_small = size * size, size == 2
    steps = ((-1, 0), (1, 0), (0, -1), (0, 1), (0, 0))
    observation_count = size if is_small else cells

    def moved(cell: int, step: int) -> int:
        row, column = cell // size + steps[step][0], cell % size + steps[step][1]
        return row * size + column if 0 <= row < size and 0 <= column < size else cell

    def make_cell_row(cell: int, step: int) -> Row:
        probabilities = [0.0] * cells
        for other in range(5):
            probabilities[moved(cell, other)] += 0.6 if other == step else 0.1
        return [float(cell == target) for target in range(cells)] if step == 4 else probabilities

    def goes(s: int, a: tuple[int, ...]) -> Row:
        return [
            p * q for p in make_cell_row(s // cells, a[0]) for q in make_cell_row(s % cells, a[1])
        ]

    def sees(s: int, a: tuple[int, ...]) -> Row:
        observed = [cell % size if is_small else cell for cell in divmod(s, cells)]
        return [float([*pair] == observed) for pair in product(range(observation_count), repeat=2)]

    def pays() -> Iterator[str]:
        for cell in range(cells) if is_small else (0, cells - 1):
            meeting_state = cell * (cells + 1)
            yield (
                f"R: * : * : {meeting_state} : * : 1"
                if is_small
                else f"R: * : {meeting_state} : * : * : 1"
            )

    start_state = cells + 2 if is_small else (size - 1) * cells + size * (size - 1)
    start = [float(s == start_state) for s in range(cells * cells)]
    return _format_team_file(
        start, "up down left right stay", str(observation_count), goes, sees, pays()
    )
