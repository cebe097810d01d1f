"""Tests of each claim of a reason against the dynamics of its problem.

A sentence that no pattern describes is an error, so that no claim remains untested.
"""

import re
from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.arrays import Array
from dmplay.core.hexgrid import Hex, format_hex, hex_neighbours, parse_hex, path_lengths
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import Problem, build_percept, make_initial_observation
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.hints.explanation import explain_action
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.problems.mountain_car.agents import compute_action_values
from dmplay.registry import agents

MAX_TURNS, MAX_HIDDEN_TURNS = 40, 8  # few if games with the same history are to be sampled
RANDOM_SHARE = 0.6  # of the turns before a position
Claim = Callable[[Session, int, "re.Match[str]"], Iterator[bool]]


def iter_positions(name: str, count: int) -> Iterator[HintProvider]:
    """Yield positions after games in which the hint's and random actions take turns."""
    random, episode = np.random.default_rng(5), 0
    while count:
        problem, episode = dmplay.load_problem(name), episode + 1
        partner = agents.load_roster(problem).default_partner
        players = ["human", *[partner] * (len(problem.agents) - 1)]
        policies = [None, *(agents.load_agent(problem, 1, player) for player in players[1:])]
        session = Session(problem, SeededUniforms(episode), policies)
        provider = HintProvider(session, AdviceQuestion.of_session(session, 0, players))
        max_turns = MAX_HIDDEN_TURNS if problem.partially_observable else MAX_TURNS
        for _ in range(int(random.integers(max_turns))):
            if not session.over:
                legal = provider.position.legal_actions
                action, _ = provider.position.choose()
                is_random = action is None or random.random() < RANDOM_SHARE
                chosen = int(random.choice(legal)) if is_random else action
                session.advance([chosen, *[None] * (len(problem.agents) - 1)])
        if not session.over:
            count -= 1
            yield provider


def check_sentence(session: Session, action: int, sentence: str, claims: dict[str, Claim]) -> int:
    """Return the number of claims of a sentence, all of which are true."""
    for pattern, check in claims.items():
        match = re.fullmatch(pattern, sentence)
        if match:
            results = [*check(session, action, match)]
            assert all(results), (session.state, action, sentence, results)
            return len(results)
    raise AssertionError(f"no claim of this sentence is tested: {sentence}")


def step(session: Session, action: int) -> Array:
    """Return the state after an action without random events."""
    problem = session.problem
    outcome = problem.step(session.state[None], np.array([[action]]), np.zeros((1, 0)))
    return np.asarray(outcome.state[0])


def play_on(session: Session, action: int, agent: str, max_turns: int = 1000) -> Session:
    """Return the session after an action and the choices of an agent up to the end."""
    future = session.copy_at_start()
    future.append_turns(session.turns)
    policy = agents.load_agent(session.problem, 0, agent)
    seated = SeatedPolicy(future, 0, policy)
    future.advance([action])
    last_turn = len(session.turns) + max_turns
    while not future.over and len(future.turns) < last_turn:
        future.advance([seated.choose()])
    return future


# cart-pole


def check_pole(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the pole leans, swings and reacts to a push as a sentence says."""
    lean, verb, swing, speed, push, effect = match.groups()
    _, v, theta, omega = session.state
    after, other = step(session, action), step(session, 1 - action)
    yield push == ("left", "right")[action]
    yield abs(np.degrees(theta)) < 0.05 if lean is None else (theta > 0) == (lean == "right")
    side = lean or swing
    if swing:
        yield (omega > 0) == (swing == "right")
        yield verb is None or (verb == "falls") == (lean == swing) or lean is None
    if effect == "moves the cart under it":
        yield push == side
        yield abs(after[1] - v) > 0 and (after[1] > v) == (side == "right")
        yield (after[3] < omega) == (side == "right")
    elif effect == "tips it further":
        yield (after[3] > max(omega, other[3])) == (side == "right")
    elif effect == "slows it":
        yield abs(after[3]) < abs(omega) and after[3] * omega > 0
    elif effect == "speeds it up":
        yield abs(after[3]) > abs(omega) and after[3] * omega > 0
    elif effect == "all but stops it":
        yield abs(after[3]) < abs(omega) / 4
    else:
        yield after[3] * omega < 0
    if speed:
        s = session.state
        while s[2] * theta > 0 and s[3] * theta < 0:
            s = step_without_push(s)
        yield (s[2] * theta <= 0) == (speed == "fast enough to pass")


def step_without_push(s: Array) -> Array:
    """Return the state 0.02 s later of a cart that nobody pushes, by the book's equations."""
    x, v, theta, omega = s
    tau = 0.5 * omega**2 * np.sin(theta) / 1.1
    inertia = 0.5 * (4 / 3 - 0.1 * np.cos(theta) ** 2 / 1.1)
    angular = (9.8 * np.sin(theta) - np.cos(theta) * tau) / inertia
    speed_change = tau - 0.1 * 0.5 * angular * np.cos(theta) / 1.1
    return np.array(
        [x + 0.02 * v, v + 0.02 * speed_change, theta + 0.02 * omega, omega + 0.02 * angular]
    )


def check_balance(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the game lasts as long after either push, and the pole hardly leans."""
    futures = [play_on(session, push, "regulate") for push in (0, 1)]
    yield len({len(future.turns) for future in futures}) == 1
    yield abs(np.degrees(session.state[2])) < 3


def check_cart(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the cart is, rolls and moves back as a sentence says."""
    distance, position_side, direction, speed, push, tip, turns = match.groups()
    x, v, _, omega = session.state
    if distance:
        yield f"{abs(x):.2f}" == distance and (x > 0) == (position_side == "right")
    else:
        yield f"{abs(v):.2f}" == speed and (v > 0) == (direction == "right")
    pushed = ("left", "right").index(push)
    yield (step(session, pushed)[3] > omega) == (tip == "right")
    if turns:
        future = play_on(session, pushed, "regulate", int(turns))
        yield future.state[1] * v < 0 and (v > 0) == pushed


def check_ends(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the game lasts as long after each push as a sentence says."""
    first, first_push, second, second_push, both = match.groups()
    clauses = {first_push: first, second_push: second} if first else dict.fromkeys(SIDES, both)
    for push, clause in clauses.items():
        future = play_on(session, SIDES.index(push), "regulate")
        count = len(future.turns) - len(session.turns)
        is_fallen = abs(np.degrees(future.state[2])) > 12
        ends = "the pole falls" if is_fallen else "the cart leaves its track"
        turns = f"{count} turn{'s' * (count > 1)}"
        is_over = future.end_reason == "terminal"
        yield clause == (f"{ends} after {turns}" if is_over else f"the game goes on for {turns}")


def check_lost_game(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the game ends after either push, and sooner after the one of the regulator."""
    futures = [play_on(session, push, "regulate") for push in (0, 1)]
    yield {future.end_reason for future in futures} == {"terminal"}
    policy = agents.load_agent(session.problem, 0, "regulate")
    chosen = int(SeatedPolicy(session, 0, policy).choose())
    yield len(futures[chosen].turns) < len(futures[1 - chosen].turns)


# mountain-car


def check_drive(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether an action changes the speed as a sentence says."""
    motion, effect = match.groups()
    v, after, coast = session.state[1], step(session, action)[1], step(session, 1)[1]
    label = session.action_labels(0)[action]
    yield motion == (f"rolls {SIDES[int(v > 0)]}" if v else "stands still")
    verb, _, effect = effect.removeprefix("driving ").partition(" ")
    yield verb == ("coasting" if label == "coast" else label)
    speed, coast_speed = abs(after), abs(coast)
    is_true = {
        "lets the slope speed it up": speed > abs(v),
        "lets the slope slow it down": speed < abs(v),
        "keeps its speed": abs(speed - abs(v)) < 1e-9,
        "makes it roll left": after < 0 <= v,
        "makes it roll right": after > 0 >= v,
        "does not move it": after == 0,
        "leaves it at top speed": abs(speed) == abs(coast_speed) == 0.07,
        "changes nothing": abs(speed - coast_speed) < 1e-9,
        "adds speed": speed > coast_speed and after * v > 0,
        "brakes it": speed < coast_speed and after * v >= 0,
    }
    yield is_true[effect]


def check_climb(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether driving right all the way reaches the goal in as many turns."""
    future = play_on(session, 2, "always-right", int(match[1]))
    yield future.end_reason == "terminal"
    yield len(future.turns) - len(session.turns) == int(match[1])


def check_return(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the car rolls back from a position if it drives right all the way."""
    top, goal = match.groups()
    future = play_on(session, 2, "always-right", 300)
    path = [future.state]
    while len(future.turns) > len(session.turns):
        future.undo()
        path.insert(0, future.state)
    speeds = [speed for _, speed in path]
    back = next(i for i in range(2, len(path)) if speeds[i - 1] > 0 >= speeds[i])
    yield f"{path[back - 1][0]:.2f}" == top
    yield float(goal) == getattr(session.problem, "goal", None)
    yield float(goal) > float(top)


def check_arrivals(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the car arrives after as many turns as a sentence says."""
    *counts, same, limit = match.groups()
    for index in range(3):
        future = play_on(session, index, "optimal", int(limit or 500))
        count = len(future.turns) - len(session.turns)
        is_there = future.end_reason == "terminal"
        if limit:
            yield not is_there and count == int(limit)
        else:
            yield (same or counts[index]) == (str(count) if is_there else "too many")


def check_grid(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a value differs by a turn or more from the turns to the goal."""
    differences = value_on_grid(session) + count_turns_to_goal(session)
    yield bool(np.abs(differences).max() >= 1.0)


def check_tie(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether two actions take as many turns to the goal, with values that differ by less."""
    turns = count_turns_to_goal(session)
    yield np.unique(turns).size < turns.size
    yield bool(np.abs(value_on_grid(session) + turns).max() < 1.0)


def check_grid_error(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the action of the best value takes longer to the goal than another."""
    quicker, slower = (session.action_labels(0).index(label) for label in match.groups())
    turns = count_turns_to_goal(session)
    yield int(value_on_grid(session).argmax()) == slower
    yield turns[slower] > turns[quicker] == turns.min()


def count_turns_to_goal(session: Session) -> Array:
    """Return the turns to the goal after each action, if the hint agent plays on."""
    futures = [play_on(session, index, "optimal", 500) for index in range(3)]
    return np.array([len(future.turns) - len(session.turns) for future in futures])


def value_on_grid(session: Session) -> Array:
    """Return the value of each action by the grid."""
    return np.asarray(compute_action_values(session.problem, session.state[None])[0])


# collision-avoidance


def sample_runs(session: Session, plan: list[int], games: int = 4000) -> Array:
    """Return the heights at the pass in games with a list of advisories."""
    problem, random = session.problem, np.random.default_rng(7)
    s = np.repeat(session.state[None], games, axis=0)
    for action in plan:
        u = random.random((games, problem.uniform_counts.step))
        s = problem.step(s, np.full((games, 1), action), u).state
    return np.asarray(s[:, 0])


def is_close(text: str, samples: Array) -> bool:
    """Return whether a number is the mean of samples, to five standard errors and its rounding."""
    error = 5 * samples.std() / len(samples) ** 0.5
    return bool(abs(float(text) - samples.mean()) <= error + 10.0 ** -len(text.partition(".")[2]))


def check_pass(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the aircraft pass at the height that a sentence says."""
    height, side, seconds, is_clear = match.groups()
    yield int(seconds) == session.state[3]
    yield height == "50" or bool(is_clear) == (float(height) > 50)
    heights = sample_runs(session, [1] * int(seconds))
    yield abs((1 if side == "above" else -1) * float(height) - heights.mean()) < 6


def check_crossing(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether an advisory that is kept mostly leads to the other side of the intruder."""
    index = session.problem.actions[0].labels.index(match[1])
    heights = sample_runs(session, [index] * int(session.state[3]))
    yield (heights * session.state[0] < 0).mean() > 0.9


def check_collisions(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether advisories that are kept lead to collisions as often as a sentence says."""
    for index, text in enumerate(match.groups()):
        plan = [index] * int(session.state[3])
        yield is_close(text, abs(sample_runs(session, plan)) < 50)


def check_safety(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a collision is as improbable with each advisory as a sentence says."""
    for index in range(3):
        plan = [index] * int(session.state[3])
        yield (abs(sample_runs(session, plan)) < 50).mean() < 0.003


def check_later_advisory(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether an advisory that comes a second later is as safe as a sentence says."""
    first, later, text, wait = match.groups()
    labels = session.action_labels(0)
    plan = [action, *[[*labels].index(later)] * (int(session.state[3]) - 1)]
    yield labels[action] == first
    yield is_close(text, abs(sample_runs(session, plan)) < 50)
    if wait:
        yield session.state[2] == 5 * (action - 1)
        yield is_close(text, abs(sample_runs(session, plan[1:2] + plan[1:])) < 50)


def check_late(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the aircraft pass at a height that no advisory changes."""
    when, height = match.groups()
    seconds = 1 if when == "in 1 second" else 0
    yield session.state[3] == seconds
    for index in range(3):
        yield {f"{abs(h):.0f}" for h in sample_runs(session, [index] * seconds)} == {height}


def check_change_cost(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a change of the present advisory costs 0.01."""
    labels = session.action_labels(0)
    is_collision = session.state[3] == 0 and abs(session.state[0]) < 50
    for a in range(3):
        outcome = session.problem.step(session.state[None], np.array([[a]]), np.full((1, 1), 0.5))
        cost = -float(outcome.rewards[0, 0]) - is_collision
        yield abs(cost - 0.01 * (labels[a] != (match[1] or "no-advisory"))) < 1e-9


# 2048


def slide_by_hand(board: Array, label: str) -> tuple[Array, list[int]]:
    """Return the board of tile values after a slide, without a new tile, and the merged tiles."""
    turns = {"left": 0, "up": 1, "right": 2, "down": 3}[label]
    lines, merges = [], list[int]()
    for line in np.rot90(board, turns).tolist():
        tiles, merged = [tile for tile in line if tile], list[int]()
        while tiles:
            tile = tiles.pop(0)
            if tiles and tiles[0] == tile:
                merges.append(tiles.pop(0))
                tile *= 2
            merged.append(tile)
        lines.append([*merged, *[0] * (4 - len(merged))])
    return np.rot90(np.array(lines), -turns), merges


def list_legal(session: Session) -> list[int]:
    """Return the legal actions of the first seat."""
    mask = session.legal_actions_mask(0)
    return (
        [*range(len(session.action_labels(0)))] if mask is None else np.flatnonzero(mask).tolist()
    )


def get_tiles(session: Session) -> Array:
    """Return the tile values of the board."""
    return np.where(session.state, 2 ** session.state.astype(int), 0)


def read_numbers(session: Session, action: int, text: str) -> dict[str, float]:
    """Return the number of each legal slide; the first is that of the action."""
    first, *others = re.split(r", | and ", text)
    pairs = {label: float(number) for number, label in (x.split(" after ") for x in others)}
    numbers = {session.action_labels(0)[action]: float(first), **pairs}
    legal = list_legal(session)
    assert {*numbers} == {session.action_labels(0)[a] for a in legal}
    return numbers


def iter_next_boards(board: Array) -> Iterator[tuple[float, Array]]:
    """Yield each board with a new tile, and its probability."""
    for row, column in zip(*np.nonzero(board == 0), strict=True):
        for tile, p in ((2, 0.8), (4, 0.2)):
            next_board = board.copy()
            next_board[row, column] = tile
            yield p / (board == 0).sum(), next_board


def check_merges(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a slide merges these tiles and pays these points."""
    name, tiles, points = match.groups()
    yield name.lower() == session.action_labels(0)[action]
    _, merges = slide_by_hand(get_tiles(session), name.lower())
    numbers = [] if tiles == "nothing" else re.findall(r"(\d+)\+\1", tiles)
    yield sorted(map(int, numbers)) == sorted(merges)
    yield int(points or 0) == 2 * sum(merges) == step_and_pay(session, action)


def step_and_pay(session: Session, action: int) -> float:
    """Return the reward of an action in a copy of the game."""
    future = session.copy_at_start()
    future.append_turns(session.turns)
    return float(future.advance([action]).rewards[0])


def check_corner(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the largest tile is in a corner after a slide, and after the others."""
    largest, corner, others, tile, contrast = match.groups()
    labels = session.action_labels(0)
    for a in list_legal(session):
        board, _ = slide_by_hand(get_tiles(session), labels[a])
        corners = {"upper left": (0, 0), "upper right": (0, 3)}
        corners |= {"lower left": (3, 0), "lower right": (3, 3)}
        is_in_one = any(board[cell] == board.max() for cell in corners.values())
        if a == action:
            yield int(largest) == board.max()
            yield is_in_one == (corner is not None)
            yield corner is None or board[corners[corner]] == board.max()
        else:
            is_other = labels[a] in re.split(r", | and ", others or "")
            yield is_in_one == (contrast == "in one" if is_other else corner is not None)
            value = largest if tile == "it" else (tile or "").partition(", ")[2].rstrip(",")
            yield not is_other or not value or int(value) == board.max()


def check_room(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the slides leave as many empty cells."""
    text = re.sub(" empty cells?", "", match[2])
    yield match[1].lower() == session.action_labels(0)[action]
    for label, number in read_numbers(session, action, text).items():
        board, _ = slide_by_hand(get_tiles(session), label)
        yield (board == 0).sum() == number


def compute_tightness(board: Array) -> float:
    """Return the probability that a new tile leaves at most one slide."""
    return float(
        sum(
            p * (sum((slide_by_hand(after, name)[0] != after).any() for name in SLIDES) < 2)
            for p, after in iter_next_boards(board)
        )
    )


def compute_next_points(board: Array) -> float:
    """Return the mean points of the slide that pays most after a new tile."""
    return float(
        sum(
            p * max(2 * sum(slide_by_hand(after, name)[1]) for name in SLIDES)
            for p, after in iter_next_boards(board)
        )
    )


def check_tightness(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a new tile leaves at most one slide as often as a sentence says."""
    for label, number in read_numbers(session, action, match[1]).items():
        board, _ = slide_by_hand(get_tiles(session), label)
        yield abs(compute_tightness(board) - number) < 0.0051


def check_next_merges(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the next slide pays as much as a sentence says."""
    text = match[1].replace(" points on average", "")
    for label, number in read_numbers(session, action, text).items():
        board, _ = slide_by_hand(get_tiles(session), label)
        yield abs(compute_next_points(board) - number) < 0.051


def check_advantages(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the best slide is better than another in the facts of a sentence alone."""
    best, rival, names = match[1].lower(), *match.groups()[1:]
    labels = session.action_labels(0)
    facts = []
    for label in (best, rival):
        board, merges = slide_by_hand(get_tiles(session), label)
        is_in_corner = bool(board[::3, ::3].max() == board.max())
        risk, points = compute_tightness(board), compute_next_points(board)
        room = (board == 0).sum()
        facts.append((sum(merges), is_in_corner, room, -round(risk, 2), round(points, 1)))
    pairs = zip(("points", "corner", "room", "risk", "the next merge"), *facts, strict=True)
    expected = [name for name, fact, other in pairs if fact > other]
    yield (re.split(", | and ", names) if names else []) == expected
    ratings = rate_slides(session)
    yield labels[int(ratings.argmax())] == best
    yield rival == labels[action] or (best == labels[action] and rival != best)
    yield ratings.max() - ratings[[*labels].index(rival)] > 2000


def check_close_ratings(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether two ratings differ as little as a sentence says."""
    first, second, error = match.groups()
    numbers = [rate_slides(session)[SLIDES.index(name)] for name in (first, second)]
    yield SLIDES[action] in {first, second}
    yield -1e-6 <= numbers[0] - numbers[1] <= int(error)


def rate_slides(session: Session) -> Array:
    """Return the rating of each slide by the search that gives the hints."""
    policy = agents.load_agent(session.problem, 0, "expectimax")
    ratings = policy.action_values((session.state[None],))
    assert ratings is not None
    return np.asarray(ratings[0])


# collaborative-predator-prey


@lru_cache(maxsize=1)
def sample_hunts(session: Session, games: int = 50_000) -> tuple[Array, Memory]:
    """Return states and memories of the partner in games in which this seat perceives the same."""
    problem, random = session.problem, np.random.default_rng(3)
    partner = agents.load_agent(problem, 1, agents.load_roster(problem, 1).default_partner)
    s = problem.sample_initial_states(random.random((games, problem.uniform_counts.start)))
    memory = partner.initial_memory(make_initial_observation(problem, s, 1))
    for turn in session.turns:
        s, memory, observations = move_team(problem, partner, s, memory, int(turn.actions[0]))
        rows = observations[:, 0] == turn.observations[0]
        s, memory = s[rows], tuple(part[rows] for part in memory)
    assert len(s) > 100
    return s, memory


def move_team(
    problem: Problem, partner: Policy, s: Array, memory: Memory, action: int
) -> tuple[Array, Memory, Array]:
    """Return the next states, memories of the partner and observations after an action."""
    random = np.random.default_rng(len(s))
    choices = partner.choose(memory, None, random.random((len(s), partner.uniform_count)))
    joint = np.stack([np.full(len(s), action), choices], axis=1)
    outcome = problem.step(s, joint, random.random((len(s), problem.uniform_counts.step)))
    memory = partner.update_memory(memory, build_percept(problem, 1, joint, outcome))
    return outcome.state, memory, outcome.observations


def check_belief(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the prey and the predator are where a sentence says as often."""
    yield from check_place(session, -1, match[1])
    yield from check_place(session, 0, match[2])


def check_partner(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the partner is where a sentence says as often."""
    yield from check_place(session, 1, match[1])


def check_resolution(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a review judges no choice by a difference of this size."""
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ("human", "sweep")))
    yield provider.values_basis.resolution == float(match[1])


def check_place(session: Session, walker: int, text: str) -> Iterator[bool]:
    """Yield whether a walker is where a text says as often."""
    s, _ = sample_hunts(session)
    assert isinstance(session.problem, CollaborativePredatorPrey)
    hexes = [format_hex(hex_) for hex_ in session.problem.hexes]
    chances = np.bincount(s[:, walker], minlength=len(hexes)) / len(s)
    hex_, number = text.rsplit(" (", 1)
    chance = float(number.split()[0].rstrip(")"))
    error = 5 * (chance / len(s)) ** 0.5 + 0.006
    yield abs(chances.max() - chance) <= 2 * error
    if hex_ in hexes:
        yield abs(chances[hexes.index(hex_)] - chance) <= error
    else:
        yield (chances >= chance - error).sum() >= int(hex_.split()[2])


def check_way(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether these are the first moves of the shortest ways between the likeliest hexes."""
    own_hex, prey = find_likeliest_hexes(session)
    assert isinstance(session.problem, CollaborativePredatorPrey)
    hexes = session.problem.hexes
    steps = path_lengths(hexes)[hexes.index(prey)]
    yield steps[hexes.index(own_hex)] == int(match[1])
    neighbours = dict(zip(session.action_labels(0), hex_neighbours(own_hex), strict=True))
    first = {name for name, hex_ in neighbours.items() if hex_ in hexes}
    nearer = {name for name in first if steps[hexes.index(neighbours[name])] < int(match[1])}
    yield nearer == {*match[2].split(" or ")}


def find_likeliest_hexes(session: Session) -> list[Hex]:
    """Return the likeliest hexes of this predator and of the prey, by the sentences before."""
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ("human", "sweep")))
    text = str(explain_action(provider))
    (hexes,) = re.findall(r"the prey most likely at (\S+) .*?, and you at (\S+) ", text)
    return [parse_hex(hex_) for hex_ in hexes[::-1]]


@lru_cache(maxsize=1)
def sample_moves(session: Session) -> dict[str, list[Array]]:
    """Return samples of a capture, the distance and the sense after each move."""
    s, memory = sample_hunts(session)
    problem = session.problem
    assert isinstance(problem, CollaborativePredatorPrey)
    partner = agents.load_agent(problem, 1, agents.load_roster(problem, 1).default_partner)
    steps = path_lengths(problem.hexes)
    samples: dict[str, list[Array]] = {"a predator": [], "you are": [], "you sense": []}
    for action in range(6):
        after, _, observations = move_team(problem, partner, s, memory, action)
        samples["a predator"].append((after[:, :-1] == after[:, -1:]).any(axis=1))
        samples["you are"].append(steps[after[:, 0], after[:, -1]])
        samples["you sense"].append(observations[:, 0] == 0)
    return samples


def check_move(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether a move has the chances or the distance that a sentence says."""
    number, low, high = float(match[3]), float(match[5]), float(match[6])
    by_kind = sample_moves(session)
    samples = next(by_kind[kind] for kind in by_kind if match[2].startswith(kind))
    means = [part.mean() for part in samples]
    errors = [5 * part.std() / len(part) ** 0.5 + 0.006 for part in samples]
    others = [mean for index, mean in enumerate(means) if index != action]
    yield match[1] == session.action_labels(0)[action]
    yield abs(means[action] - number) <= errors[action]
    yield abs(min(others) - low) <= max(errors)
    yield abs(max(others) - high) <= max(errors)
    yield number < low if "nearer" in match[4] else number > high if "more" in match[4] else True


def check_no_lead(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether no chance is clearly greater, and the distance not clearly less, than after
    every other move.
    """
    yield match[1] == session.action_labels(0)[action]
    for kind, samples in sample_moves(session).items():
        sign = -1 if kind == "you are" else 1
        means = [sign * part.mean() for part in samples]
        error = max(5 * part.std() / len(part) ** 0.5 + 0.006 for part in samples)
        yield means[action] <= max(np.delete(means, action)) + error


SLIDES = ("left", "down", "right", "up")
SIDES = ("left", "right")
SIDE = "(left|right)"
END_EVENT = r"(?:the pole falls|the cart leaves its track) after"
END = rf"((?:{END_EVENT}|the game goes on for) \d+ turns?)"
CLAIMS: dict[str, dict[str, Claim]] = {
    "cart-pole": {
        rf"The pole (?:leans {SIDE}|stands upright)(?: and (falls|swings back|swings) {SIDE})?"
        r"(?:, (fast enough to pass|too slowly to reach) the upright)?: "
        rf"a push {SIDE} (moves the cart under it|tips it further|slows it|speeds it up|"
        r"all but stops it|turns it round)\.": check_pole,
        r"Pole and cart are so near balance that the next push can make up for either one\.":
        check_balance,
        rf"The cart (?:is (\d+\.\d\d) m {SIDE} of the middle|rolls {SIDE} at (\d+\.\d\d) m/s): "
        rf"a push {SIDE} tips the pole {SIDE}(?:, and pushes under it turn the cart back in (\d+) "
        r"turns)?\.":
        check_cart,
        rf"If regulate plays on, (?:{END} with {SIDE}, and {END} with {SIDE}|"
        rf"{END}, whichever push comes first)\.": check_ends,
        r"The game is lost, and regulate does not play for its last turns\.": check_lost_game,
    },
    "mountain-car": {
        r"The car (rolls left|rolls right|stands still): ([a-z ]+)\.": check_drive,
        r"Driving right all the way would reach the goal in (\d+) turns?\.": check_climb,
        r"Driving right all the way, it would roll back at position (-?\d\.\d\d), "
        r"and the goal is at (\d\.\d+): it first needs more speed\.": check_return,
        r"If optimal plays on, the car (?:reaches the goal in (?:(\d+|too many) turns with left, "
        r"(\d+|too many) with coast and (\d+|too many) with right|(\d+) turns?, whichever action "
        r"comes first)|does not reach the goal within (\d+) turns?)\.": check_arrivals,
        r"The values below are approximate, so they can differ from this\.":
        check_grid,
        r"Values estimate minus the turns to the goal, so differences below 1 may be none\.":
        check_tie,
        r"The values, interpolated on a grid, err here: ([a-z]+) is quicker than ([a-z]+)\.":
        check_grid_error,
    },
    "collision-avoidance": {
        r"Without gusts and advisories you pass (\d+) m (above|below) aircraft A in (\d+) "
        r"seconds?(, which is clear)?; a collision is under 50 m\.": check_pass,
        r"Kept until the pass, ([a-z-]+) crosses the height of A\.": check_crossing,
        r"Kept until the pass, descend collides with probability ([\d.]+), no-advisory "
        r"([\d.]+) and climb (\d\.\d+)\.": check_collisions,
        r"Each advisory, kept until the pass, collides with a probability under 0\.001\.":
        check_safety,
        r"One second of ([a-z-]+) and then ([a-z-]+) collides with probability (\d\.\d+)"
        r"(, so the change can wait)?\.":
        check_later_advisory,
        r"(?:There is no advisory now|The advisory is now ([a-z-]+)): a change costs 0\.01, and a "
        r"collision 1\.": check_change_cost,
        r"You pass (now|in 1 second) at (\d+) m: no advisory changes that any more; a collision is "
        r"under 50 m\.": check_late,
    },
    "2048": {
        r"([A-Z][a-z]+) merges (nothing|[\d+, and]+?)(?:, for (\d+) points)?\.": check_merges,
        r"The largest tile, (\d+), is then in (?:the ([a-z ]+)|no) corner"
        r"; after ([a-z, ]+?) (it|the largest(?:, \d+,)?) is (in one|in no corner)\.":
        check_corner,
        r"([A-Z][a-z]+) leaves (.*)\.": check_room,
        r"The new tile then leaves at most one slide with probability (.*)\.": check_tightness,
        r"The best merge of the next slide then pays (.*)\.": check_next_merges,
        r"([A-Z][a-z]+) is better than ([a-z]+) in ([a-z, ]+)\.": check_advantages,
        r"None of this favours ([a-z]+) over ([a-z]+)()?: the search looks further ahead\.":
        check_advantages,
        r"The search cannot tell ([a-z]+) and ([a-z]+) apart: their ratings differ by no more "
        r"than their errors of (\d+)\.": check_close_ratings,
    },
    "collaborative-predator-prey": {
        r"The hint's belief has the prey most likely at (.*\)), and you at (.*\))\.": check_belief,
        r"From that hex of yours to that of the prey it is (\d+) steps?, "
        r"first by ([a-z ]+)\.": check_way,
        r"The values are estimates: if two differ by up to (0\.3), they may be equal, "
        r"and the choice is not judged\.": check_resolution,
        r"It has predator2 most likely at (.*\))\.": check_partner,
        r"After ([a-z]+), (a predator is on the prey's hex with probability|you are|"
        r"you sense the prey with probability) (\d\.\d\d)(?: steps from the prey on average)?"
        r"(, more than after any other move|, nearer than after any other move|; after other moves)"
        r" \(?(\d\.\d\d) to (\d\.\d\d)\)?\.": check_move,
        r"Another move looks as good or better next turn; the value of ([a-z]+) also counts later "
        r"turns\.": check_no_lead,
    },
}  # fmt: skip
