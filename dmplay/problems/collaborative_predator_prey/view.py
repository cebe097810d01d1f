"""The view of the blind hunt: each hex's probabilities of the prey and the player."""

import math
from collections.abc import Iterator
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import Hex, format_hex, hex_neighbours, move_destinations
from dmplay.core.session import View
from dmplay.core.text import format_reward, join_words
from dmplay.draw import hex_map, theme
from dmplay.draw.action_hints import format_regret_rows
from dmplay.draw.bars import format_sparkline
from dmplay.draw.canvas import format_percent, measure_text
from dmplay.draw.hex_map import HexCell, HexSize
from dmplay.draw.options import DrawOptions
from dmplay.views.generic import format_last_observation
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import CAPTURE_REWARD, MOVE_REWARD, CollaborativePredatorPrey

KEY_FAMILY, KEYS, SECOND_PLAYER_KEYS = hex_map.KEY_FAMILY, hex_map.KEYS, hex_map.SECOND_PLAYER_KEYS
HIDDEN_FACT = "of a catch"
MAX_DESCRIBED_HEXES = 4  # likeliest hexes described in words
REGRET_ROW_COLUMNS = 58  # columns of a row with the regrets of six directions
PREY_SHADE_COUNT = 4  # of the prey's probability, the darkest for the likeliest hex
MAX_PERCENT_HEXES = 3  # number of likeliest hexes that show a percentage
MAX_LISTED_CATCHES = 8  # turns with a catch that the end of a game lists
MIN_CERTAIN_PROBABILITY = 1 - 1e-9


class Marginals(NamedTuple):
    """The probability that each hex holds the prey, and that it holds the viewer's agent."""

    prey: Reals  # [H]
    you: Reals  # [H]


def compute_marginals(view: View[CollaborativePredatorPrey]) -> Marginals | None:
    """Return the marginal probabilities of the belief; None if the belief is too large."""
    return None if view.beliefs is None else _marginalize_belief(view, view.belief)


def _marginalize_belief(view: View[CollaborativePredatorPrey], belief: Reals) -> Marginals:
    """Return the marginal probabilities of a joint belief."""
    problem = view.problem
    joint = belief.reshape((len(problem.hexes),) * problem.walker_count)

    def sum_over_others(walker: int) -> Reals:
        """Sum the joint belief over all walkers but one."""
        other_axes = tuple(axis for axis in range(problem.walker_count) if axis != walker)
        return np.asarray(joint.sum(axis=other_axes))

    return Marginals(sum_over_others(problem.walker_count - 1), sum_over_others(view.seat))


def _find_own_hex(view: View[CollaborativePredatorPrey], marginals: Marginals | None) -> Hex | None:
    """Return the hex of the viewer's agent if it is certain, else None."""
    if marginals is None and view.problem.sighted and view.turns_played:
        return view.problem.hexes[int(view.observation) % len(view.problem.hexes)]
    if marginals is None or marginals.you.max() < MIN_CERTAIN_PROBABILITY:
        return None
    return view.problem.hexes[int(marginals.you.argmax())]


def iter_boards(view: View[CollaborativePredatorPrey], options: DrawOptions) -> Iterator[Text]:
    """Yield the maps, largest first, each with rows that explain it.

    Shaded maps are for screens, hints and forecasts; numbered maps for transcripts.
    """
    if options.allow_large or options.forecast or options.regret is not None:
        yield from _iter_shaded_maps(view, options)
    else:
        yield from _iter_numbered_maps(view, options)


def _iter_shaded_maps(
    view: View[CollaborativePredatorPrey], options: DrawOptions
) -> Iterator[Text]:
    """Yield maps with the prey's belief as shades.

    With a forecast, each hex has the beliefs after the two likeliest observations. Once the state
    is revealed, the maps show all true positions.
    """
    problem, hex_beliefs = view.problem, compute_marginals(view)
    own_hex = _find_own_hex(view, hex_beliefs)
    adjacent = hex_neighbours(own_hex) if options.show_keys and own_hex else []
    prey_beliefs = [hex_beliefs.prey] if hex_beliefs else []
    if options.forecast and options.forecast.beliefs is not None:
        likeliest = options.forecast.beliefs[:2]
        prey_beliefs = [_marginalize_belief(view, belief).prey for belief in likeliest]
    true_glyphs: dict[Hex, list[str]] = {}
    for walker, hex_ in enumerate(_list_true_hexes(view, options)):
        true_glyphs.setdefault(hex_, []).append(_get_agent_glyph(view, walker))

    def draw_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex for a size of map."""
        index, max_glyphs = problem.hexes.index(hex_), size.width - 1
        width = max_glyphs if size.text_rows else 1
        shades = [_format_prey_shade(p, index, width, options.ascii) for p in prey_beliefs]
        first_shade, last_shade = (shades[0], shades[-1]) if shades else ("", "")
        if hex_ in true_glyphs:
            glyphs = "".join(sorted(true_glyphs[hex_]))[:max_glyphs]
            style = "bold reverse" if "@" in glyphs else theme.PIECE
            return HexCell(glyphs, last_shade, glyphs, style)
        own_density = ""
        if not true_glyphs:
            own_density = "@" * (hex_ == own_hex)
            if hex_beliefs:
                own_density = _format_own_density(hex_beliefs.you, index, max_glyphs)
        style = "bold reverse" if hex_ == own_hex else theme.DATA
        if size.text_rows > 1:
            mark = own_density
            if not mark and hex_ in adjacent:
                mark = hex_map.get_direction_key(options, adjacent.index(hex_))
            return HexCell(first_shade if len(shades) > 1 else mark, last_shade, style=style)
        shade = first_shade or own_density
        if own_density and size.text_rows and len(shades) == 1:
            shade = "@" + first_shade[1:]
        dot = f"@{first_shade}" if own_density and max_glyphs > 1 else first_shade or "."
        return HexCell(shade, dot_glyph=dot, style=style)

    caption = _format_caption(view, options, own_hex)
    map_options = options._replace(height=options.height - len(caption))
    sizes = [hex_map.TALL_SIZE]
    for drawing in hex_map.iter_maps(problem.hexes, draw_cell, map_options, extra_sizes=sizes):
        board = drawing if adjacent or not options.show_keys else _add_compass(drawing, options)
        for row in caption:
            board.append(f"\n{row[: options.width]}", "dim")
        yield board


def _get_agent_glyph(view: View[CollaborativePredatorPrey], walker: int) -> str:
    """Return `@` for the viewer, a capital letter for a partner, `o` for the prey."""
    if walker == view.seat:
        return "@"
    return "o" if walker == view.problem.walker_count - 1 else ascii_uppercase[walker]


def _format_prey_shade(belief: Reals, hex_index: int, width: int, ascii_only: bool) -> str:
    """Format the prey's probability in a hex relative to the maximum.

    The MAX_PERCENT_HEXES likeliest hexes have a percentage.
    """
    probability, max_probability = float(belief[hex_index]), float(belief.max())
    if probability < 1e-9:
        return " " * (width - 1) + "." if width == 1 else ""
    level = math.ceil(PREY_SHADE_COUNT * probability / max_probability - 1e-9)
    shade = format_sparkline([level / PREY_SHADE_COUNT - 1e-9], ascii_only)
    rank = int((belief >= probability - 1e-9).sum())
    text = format_percent(probability) if rank <= MAX_PERCENT_HEXES else ""
    return text.center(width, shade) if len(text) < width else shade * width


def _format_own_density(belief: Reals, hex_index: int, width: int) -> str:
    """Format the viewer's probability in a hex: an '@' for each third of the maximum.

    A unique likeliest hex has its percentage, and a certain one a single '@'.
    """
    probability, max_probability = float(belief[hex_index]), float(belief.max())
    sign_count = round(min(width, 3) * probability / max_probability)
    if max_probability >= MIN_CERTAIN_PROBABILITY:
        return "@" * (sign_count > 0)
    text = ""
    if probability >= max_probability - 1e-9 and (belief >= max_probability - 1e-9).sum() == 1:
        text = format_percent(probability)
    return f"@{text}" if text and len(text) < width else "@" * sign_count


def _list_true_hexes(view: View[CollaborativePredatorPrey], options: DrawOptions) -> list[Hex]:
    """Return the hexes of all agents and the prey once they are revealed, else []."""
    if options.revealed_state is None:
        return []
    return [view.problem.hexes[int(position)] for position in options.revealed_state]


def _format_caption(
    view: View[CollaborativePredatorPrey], options: DrawOptions, own_hex: Hex | None
) -> list[str]:
    """Return the rows below the map: the forecast, the regrets, the observation or the legend."""
    if options.revealed_state is not None:
        names = enumerate([*view.problem.agents, "prey"])
        glyphs = [f"{_get_agent_glyph(view, walker)} {name}" for walker, name in names]
        return [f"true positions: {', '.join(glyphs)}"]
    if options.forecast:
        labels, forecast = view.problem.observations[view.seat], options.forecast
        events = zip(("upper", "lower"), forecast.outcomes, forecast.probabilities, strict=False)
        return [
            f"{hex_map.format_move_condition(forecast)}: chance of the prey on each hex",
            "; ".join(
                f"{map_row}: sensed {labels[int(observation)]} ({format_percent(p)})"
                for map_row, observation, p in events
            ),
        ]
    if options.regret is not None and np.nanmax(options.regret) > 0.0:
        columns = options.width
        if options.columns_beside_panel >= REGRET_ROW_COLUMNS:
            columns = options.columns_beside_panel
        return format_regret_rows(
            options._replace(width=columns), view.problem.actions[view.seat].labels
        )
    observation_text = f"sensed {format_last_observation(view)}"
    if view.beliefs is None:
        return [f"{observation_text}. belief: not shown"]
    viewer, full_glyph = view.player_label, "#" if options.ascii else "█"
    position_text = viewer if own_hex else f"where {viewer} may be"
    legend = f"@ {position_text}, {full_glyph} where the prey may be"
    legends = f"{legend} (more: likelier)", legend, f"@ {viewer}, {full_glyph} likely prey"
    width = min(max(options.columns_beside_panel, len(legend)), options.width)
    return [next((text for text in legends if len(text) <= width), observation_text)]


def _add_compass(drawing: Text, options: DrawOptions) -> Text:
    """Return a map with the keys of the directions at its right, if there is room."""
    e, ne, nw, w, sw, se = (hex_map.get_direction_key(options, a) for a in range(6))
    compass, x = [f" {nw} {ne}", f"{w} @ {e}", f" {sw} {se}"], measure_text(drawing)[0] + 3
    if x + max(map(len, compass)) > options.columns_beside_panel:
        return drawing
    rows = drawing.split("\n")
    for row, keys in zip(rows, compass, strict=False):
        row.append(f"{'':{x - len(row)}}{keys}", theme.CHOICE)
    return Text("\n").join(rows)


def _iter_numbered_maps(
    view: View[CollaborativePredatorPrey], options: DrawOptions
) -> Iterator[Text]:
    """Yield maps with both probabilities of each hex as numbers, for transcripts."""
    problem, hex_beliefs = view.problem, compute_marginals(view)
    own_hex = _find_own_hex(view, hex_beliefs)
    adjacent = hex_neighbours(own_hex) if options.show_keys and own_hex else []
    keys = {hex_: hex_map.get_direction_key(options, a) for a, hex_ in enumerate(adjacent)}
    true_hexes = _list_true_hexes(view, options)

    def draw_cell(hex_: Hex, size: HexSize) -> HexCell:
        """Return the content of a hex for a size of map."""
        if hex_beliefs is None:
            return HexCell("")
        index = problem.hexes.index(hex_)
        p_prey, p_you = float(hex_beliefs.prey[index]), float(hex_beliefs.you[index])
        prey_bar, own_bar = (
            format_sparkline([p], options.ascii) if p >= 1e-9 else "" for p in (p_prey, p_you)
        )
        style = "bold" if p_prey >= hex_beliefs.prey.max() - 1e-9 else ""
        style = "reverse" if hex_ in true_hexes else style
        if size.text_rows > 1:
            note = _format_marked_percent("@", p_you, options) or keys.get(hex_, "")
            return HexCell(_format_marked_percent("o", p_prey, options), note, "", style)
        if size == hex_map.SMALL_DOT_SIZE:
            return HexCell("", dot_glyph=prey_bar or ".", style=style)
        digits = format_percent(min(p_prey, 0.99)).rstrip("%")  # at most two columns
        text = f"{digits:>2}{own_bar or ' '}"
        return HexCell(text, dot_glyph=text if text.strip() else ".", style=style)

    combined_legend = f"% prey, bar: {view.player_label}"
    small_legends = (combined_legend, combined_legend, "bar: prey")
    drawings = [*hex_map.iter_maps(problem.hexes, draw_cell, options)]
    large_count = len(drawings) - len(small_legends)
    legends = [*[f"o prey, @ {view.player_label}"] * large_count, *small_legends]
    for drawing, legend in zip(drawings, legends, strict=True):
        belief_text = legend if hex_beliefs else "belief: not shown"
        caption = f"sensed {format_last_observation(view)}. {belief_text}"
        drawing.append(f"\n{caption[: options.width]}")
        if options.revealed_state is not None:
            drawing.append(f"\n{_format_true_positions(view, options)}", theme.TRUTH)
        yield drawing


def _format_marked_percent(mark: str, probability: float, options: DrawOptions) -> str:
    """Format a mark and a probability in five columns, with a bar between them if it fits."""
    text = format_percent(probability)
    has_bar = not options.ascii and len(text) <= 3
    bar = format_sparkline([probability], ascii_only=False) if has_bar else ""
    return f"{mark}{bar}{text:>{4 - len(bar)}}" if text else ""


def _format_true_positions(view: View[CollaborativePredatorPrey], options: DrawOptions) -> str:
    """Format the true positions of all agents and the prey, without names if space is short."""
    positions = [*map(format_hex, _list_true_hexes(view, options))]
    pairs = zip([*view.problem.agents, "prey"], positions, strict=True)
    full_text = f"true positions: {', '.join(map(' '.join, pairs))}"
    if len(full_text) <= options.width:
        return full_text
    return f"true: {' '.join(positions)}"[: options.width]


def _list_likeliest_hexes(
    view: View[CollaborativePredatorPrey], probabilities: Reals, hex_count: int
) -> list[tuple[str, float]]:
    """Return the likeliest hexes and their probabilities, those below 0.0005 left out."""
    order = np.argsort(-np.round(probabilities, 9), kind="stable")[:hex_count]
    pairs = [(format_hex(view.problem.hexes[i]), float(probabilities[i])) for i in order]
    return [(hex_, probability) for hex_, probability in pairs if probability >= 0.0005]


def _describe_partners(view: View[CollaborativePredatorPrey]) -> str:
    """Return a sentence about the partners that the viewer does not see; '' if there are none."""
    others = [agent for seat, agent in enumerate(view.problem.agents) if seat != view.seat]
    if not others:
        return ""
    verb = "is" if len(others) == 1 else "are"
    return f" {' and '.join(others)} {verb} hidden; the belief assumes uniformly random actions."


def _get_possessive(view: View[CollaborativePredatorPrey]) -> str:
    """Return the possessive pronoun of the viewer."""
    return "your" if view.player_label == "you" else "its"


def _describe_sense(view: View[CollaborativePredatorPrey]) -> str:
    """Describe the last observation: whether the prey is on the viewer's hex or beside it."""
    sense, _, own_hex = format_last_observation(view).partition(" ")
    where = own_hex or f"{_get_possessive(view)} hex"
    return f"sensed {'the' if sense == 'prey' else 'no'} prey on {where} or beside it"


def goal_lines(view: View[CollaborativePredatorPrey]) -> list[str]:
    """Return the goal: the rewards of the team, and the information it lacks."""
    slips, player = hex_map.describe_slips(view.problem.slip), view.player_label
    see, sense, be = ("see", "sense", "are") if player == "you" else ("sees", "senses", "is")
    own_hex = f"{_get_possessive(view)} own hex"
    is_blind = not view.problem.sighted
    pays = f"turns begun on its hex pay {CAPTURE_REWARD:g}"
    if len(view.problem.agents) > 1:
        pays = f"turns that a predator begins on its hex pay {CAPTURE_REWARD:g}"
    untold = "a catch or " * is_blind + "the score"
    likely = f"the map shows how likely {player} and the prey are at each hex"
    return [
        "step onto the hidden, moving prey",
        f"{player} {see} {'neither it nor' if is_blind else 'only'} {own_hex}",
        *([f"{player} {be} not told of {untold} until the end"] * (view.rewards is None)),
        f"{pays}, others cost {-MOVE_REWARD:g}",
        *([f"keys step from wherever {player} {be}"] * is_blind),
        f"{player} {sense} it on {own_hex} or beside it",
        *([slips] if slips else []),
        *([likely] * is_blind),
        "a caught prey reappears anywhere",
    ]


def lesson(view: View[CollaborativePredatorPrey]) -> Lesson:
    """Return the lesson: the hunters, the hidden facts, and the cost of a turn."""
    problem, others = view.problem, len(view.problem.agents) - 1
    names = (*problem.agents, "prey")
    team = f", one of {others + 1} predators that cannot talk" if others else ""
    blind = "you see nothing, not even your own hex"
    if problem.sighted:
        blind = "after each turn you see your own hex"
    slips = hex_map.describe_slips(problem.slip) or "no step slips"
    turn = "a turn that begins on its hex pays"
    if others:
        turn = "if a predator begins a turn on its hex, each predator gets"
    return Lesson(
        f"You are {problem.agents[view.seat]}{team}; {blind}, and only sense a prey on your hex or "
        "a neighbouring one",
        f"You want to reach the prey: {turn} {CAPTURE_REWARD:g}",
        f"Any other turn costs {-MOVE_REWARD:g}, and {slips}",
        example_start=f"with {' and '.join(f'{name} at {{}}' for name in names)}",
    )


def panel_rows(view: View[CollaborativePredatorPrey]) -> list[tuple[str, str]]:
    """Return the side panel's rows: last action, observation and reward if visible.

    A visible reward would reveal a capture.
    """
    observation_text = format_last_observation(view) if view.turns_played else "-"
    reward = "hidden" if view.rewards is None else "-"
    reward = format_reward(view.rewards[-1]) if view.rewards else reward
    last = view.last_action_label.upper() or "-"
    rows = [("last", last), ("sensed", observation_text), ("reward", reward)]
    if len(view.problem.agents) > 1 and view.rewards is None:
        rows.append(("partner", "hidden"))
    return [*rows, ("discount", f"{view.problem.discount:.2f} (gamma)")]


def describe_turn(view: View[CollaborativePredatorPrey]) -> str:
    """Describe the last action and observation, a catch if it may be known, and likely hexes."""
    stay = "stayed (caught), " if _has_certainly_caught(view) else ""
    turn = f"chose {view.last_action_label.upper()}, {stay}{_describe_sense(view)}."
    if view.rewards and view.rewards[-1] == CAPTURE_REWARD:
        hunter = "the team" if len(view.problem.agents) > 1 else view.player_label
        turn += f" {hunter} caught the prey."
    return f"{turn} {_describe_belief(view, 1)}".rstrip()


def _has_certainly_caught(view: View[CollaborativePredatorPrey]) -> bool:
    """Return whether the viewer sees that the last move cannot have led to its hex.

    Then its turn began on the hex of the prey, and it stayed there.
    """
    problem, hex_count = view.problem, len(view.problem.hexes)
    if not problem.sighted or not view.turns_played:
        return False
    is_first_turn = view.turns_played == 1  # the start is hidden
    starts = [*range(hex_count)] if is_first_turn else [int(view.observations[-2]) % hex_count]
    slip_count = 3 if problem.slip > 0.0 else 1
    ends = move_destinations(problem.hexes)[starts, int(view.actions[-1]), :slip_count]
    return int(view.observation) % hex_count not in ends


def _describe_belief(view: View[CollaborativePredatorPrey], hex_count: int) -> str:
    """Describe the likeliest hexes of the prey and of the viewer; '' if the belief is too large."""
    hex_beliefs = compute_marginals(view)
    if hex_beliefs is None:
        return ""
    sentences = []
    for name, probabilities in hex_beliefs._asdict().items():
        likeliest = _list_likeliest_hexes(view, probabilities, hex_count)
        hexes_text = ", ".join(f"{hex_} ({format_percent(p)})" for hex_, p in likeliest)
        owner = view.player_label if name == "you" else name
        subject = "your likeliest" if owner == "you" else f"likeliest {owner}"
        sentences.append(f"{subject} hex{'es' * (hex_count > 1)}: {hexes_text}.")
    return " ".join(sentences)


def describe_situation(view: View[CollaborativePredatorPrey]) -> str:
    """Describe the last observation, the belief, the own hex if certain, and the partners."""
    problem, hex_beliefs = view.problem, compute_marginals(view)
    belief_text = _describe_belief(view, MAX_DESCRIBED_HEXES)
    sentences = [f"{_describe_sense(view)}.", belief_text]
    own_hex = _find_own_hex(view, hex_beliefs)
    if own_hex:

        def describe_hex(hex_: Hex) -> str:
            """Return the prey's probability in a hex as text, if there is a belief."""
            if hex_beliefs is None:
                return "floor"
            return f"prey {format_percent(hex_beliefs.prey[problem.hexes.index(hex_)]) or '0%'}"

        sentences += [
            f"at {format_hex(own_hex)}.",
            *hex_map.describe_neighbours(problem.hexes, own_hex, describe_hex),
        ]
    if hex_beliefs is None:
        return f"{' '.join(filter(None, sentences))} the belief is not shown."
    return " ".join(sentences) + _describe_partners(view)


def describe_end(game: FinishedGame[CollaborativePredatorPrey]) -> str:
    """Return the number of turns in which the team caught the prey, and who caught it when."""
    before, names = game.states[:-1], [*game.problem.agents]
    names[game.seat] = game.player
    is_caught = before[:, :-1] == before[:, -1:]  # [T, n]
    turns = (np.flatnonzero(is_caught.any(axis=1)) + 1).tolist()
    catches = list[str]()
    for turn in turns[:MAX_LISTED_CATCHES]:
        catchers = [name for name, caught in zip(names, is_caught[turn - 1], strict=True) if caught]
        catches.append(f"turn {turn} ({join_words(catchers)})")
    catches += ["..."] * (len(turns) > MAX_LISTED_CATCHES)
    where = f": {', '.join(catches)}" if turns else ""
    caught = f"{game.team} caught the prey in {len(turns)} of {game.turns}{where}"
    rewards = game.rewards[:, game.seat] * game.problem.discount ** np.arange(len(before))
    gain, cost = rewards[rewards > 0].sum(), -rewards[rewards < 0].sum()
    late = "; late turns count less" * (game.problem.discount < 1.0)
    return f"{caught}; catches add {gain:.2f} to the score, other turns cost {cost:.2f}{late}"
