"""The view of the crying baby problem: the last observation and the belief about hunger."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.core.session import View
from dmplay.core.tabular import Tabular
from dmplay.core.text import format_count, format_reward
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_forecast_rows,
    format_observation,
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
    list_action_keys,
    rank_actions,
)
from dmplay.draw.bars import (
    draw_belief_bars,
    draw_belief_chart,
    draw_probability_history,
    draw_true_state,
    format_belief,
)
from dmplay.draw.canvas import Canvas
from dmplay.draw.number_line import format_signed_fixed
from dmplay.draw.options import DrawOptions
from dmplay.problems._shared.baby_care import ACTIONS, FEED, IGNORE
from dmplay.problems.multicaregiver_crying_baby.rules import MulticaregiverCryingBaby
from dmplay.views.generic import format_last_observation
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import CryingBaby

CaregiverProblem = CryingBaby | MulticaregiverCryingBaby
MAX_HISTORY_TURNS = 20  # beliefs in the history
# columns of a bar on the large board, and of a regret bar
WIDE_BAR_COLUMNS, REGRET_BAR_COLUMNS = 40, 10
# rows of a board from which it has a chart of the belief; maximum rows and columns of the chart
MIN_CHART_HEIGHT, MAX_CHART_ROWS, MAX_CHART_COLUMNS = 34, 24, 64
KEYS = {"f": "feed", "s": "sing", "i": "ignore"}
MIN_CERTAIN_PROBABILITY = 1 - 1e-9
HIDDEN_FACT = "the baby's hunger"


def iter_boards(view: View[CaregiverProblem], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards, the largest first.

    The large board comes first if `options.allow_large` is set. The small boards follow, with rows
    of hints and of the forecast below them, then without these rows. If there are no hints, a row
    of facts on the actions replaces them on a large screen until the game is over. Without a
    belief, there are only the observation and the probabilities of crying.
    """
    if view.beliefs is None:
        sound = (format_last_observation(view), _choose_sound_style(view))
        rows = ["", *_describe_cry_probabilities(view)]
        yield from iter_with_and_without_rows([Text.assemble("heard  ", sound)], rows, options)
        return
    if options.allow_large:
        if options.height >= MIN_CHART_HEIGHT:
            yield _draw_large_board(view, options, with_chart=True)
        yield _draw_large_board(view, options)
    rows = format_regret_rows(options, list_action_keys(KEYS, options))
    if not rows and options.allow_large and not view.end_reason:
        rows = [_format_action_facts(view, options)]
    rows += format_forecast_rows(view, options, view.problem.state_names)
    yield from iter_with_and_without_rows(_iter_small_boards(view, options), rows, options)


def _iter_small_boards(view: View[CaregiverProblem], options: DrawOptions) -> Iterator[Text]:
    """Yield the small board with the belief history, then without it."""
    for with_history in (True, False):
        canvas = Canvas()
        y = _draw_observation_and_belief(view, canvas, options)
        if with_history:
            y = _draw_belief_history(view, canvas, y, options)
        draw_true_state(canvas, y, view.problem.state_names, options)
        yield canvas.to_text()


def _draw_observation_and_belief(
    view: View[CaregiverProblem], canvas: Canvas, options: DrawOptions, max_bar_columns: int = 20
) -> int:
    """Draw the last observation and the belief bars; return the next free row."""
    canvas.write_text(0, 0, "heard  ")
    canvas.write_text(7, 0, format_last_observation(view), _choose_sound_style(view))
    return draw_belief_bars(
        canvas, 2, view.problem.state_names, view.belief, options, max_bar_columns=max_bar_columns
    )


def _choose_sound_style(view: View[CaregiverProblem]) -> str:
    """Return the style of the last observation."""
    return theme.ALERT if format_last_observation(view) == "crying" else "bold"


def _draw_belief_history(
    view: View[CaregiverProblem], canvas: Canvas, y: int, options: DrawOptions
) -> int:
    """Draw a sparkline of the past probabilities of hunger; return the next free row.

    At most MAX_HISTORY_TURNS turns are drawn.
    """
    recent_beliefs = (view.beliefs or ())[-MAX_HISTORY_TURNS - 1 :]  # one more than are drawn
    probabilities = [float(b[-1]) for b in recent_beliefs]
    draw_probability_history(
        canvas, y, "chance of hunger", probabilities, options, max_turns=MAX_HISTORY_TURNS
    )
    return y + 1


def _draw_large_board(
    view: View[CaregiverProblem], options: DrawOptions, *, with_chart: bool = False
) -> Text:
    """Return the large board, with expected rewards and regrets of all actions.

    Below them are the forecast, or the probabilities of crying if no forecast is asked for. The
    chart of the belief by turn comes last.
    """
    canvas = Canvas()
    y = _draw_observation_and_belief(view, canvas, options, WIDE_BAR_COLUMNS)
    y = _draw_belief_history(view, canvas, y, options) + 1
    _draw_expected_rewards(view, canvas, y, options)
    rows = format_forecast_rows(view, options, view.problem.state_names)
    style = "" if options.forecast else "dim"
    y = canvas.write_rows(y + len(KEYS) + 2, rows or _describe_cry_probabilities(view), style)
    draw_true_state(canvas, y, view.problem.state_names, options)
    if with_chart:
        _draw_belief_chart(view, canvas, y + 1, options)
    return canvas.to_text()


def _draw_belief_chart(
    view: View[CaregiverProblem], canvas: Canvas, y: int, options: DrawOptions
) -> None:
    """Draw the probability of hunger by turn, with the actions and observations below."""
    canvas.write_text(0, y + 1, f"P({view.problem.state_names[-1]}) by turn", "dim")
    labels = view.problem.actions[view.seat].labels
    sounds = [format_observation(view.problem, view.seat, sound) for sound in view.observations[1:]]
    draw_belief_chart(
        canvas,
        y + 2,
        [float(belief[-1]) for belief in view.beliefs or ()],
        [
            ("turn", [str(turn) for turn in range(len(view.observations))]),
            ("chose", ["", *(labels[int(action)] for action in view.actions)]),
            ("heard", ["", *sounds]),
        ],
        rows=min(options.height - y - 7, MAX_CHART_ROWS),
        columns=min(options.columns_beside_panel, MAX_CHART_COLUMNS),
        ascii_only=options.ascii,
    )


def _draw_expected_rewards(
    view: View[CaregiverProblem], canvas: Canvas, y: int, options: DrawOptions
) -> None:
    """Draw a table of the reward of each action and the hunger in the next turn.

    The columns are the cost of effort, the expected reward under the belief, which includes the
    cost of hunger, and the probability of hunger after the action, if it can be told. With hints,
    a bar shows the regret and the best action comes first.
    """
    next_hunger = _predict_hunger(view)
    heading = f"this turn: effort  reward{'  then hungry' * bool(next_hunger)}"
    canvas.write_text(0, y, heading, "dim")
    regret_heading = "value below best" if options.regret is not None else ""
    canvas.write_text(len(heading) + 2, y, regret_heading, "dim")
    hunger = float(view.belief[-1]) * view.problem.hungry_reward
    keys, labels = list_action_keys(KEYS, options), view.problem.actions[view.seat].labels
    for row, action in enumerate(rank_actions(options, len(keys)), y + 1):
        effort = view.problem.action_rewards[view.seat][action]
        canvas.write_text(0, row, f"{keys[action]} {labels[action]}")
        cells = f"{format_signed_fixed(effort, 2):>8}{format_signed_fixed(hunger + effort, 2):>8}"
        cells += f"{next_hunger[action]:>13.0%}" if next_hunger else ""
        canvas.write_text(9, row, cells)
        regret = format_regret_with_bar(options, action, REGRET_BAR_COLUMNS)
        canvas.write_text(len(heading) + 2, row, regret, theme.REGRET)


def _predict_hunger(view: View[CaregiverProblem]) -> list[float]:
    """Return the probability of hunger after each action; [] if it is unknown what a partner does.

    A partner of whose rule the belief knows nothing acts at random, as in the belief.
    """
    problem, joint_action = view.problem, list[int | None]([None] * len(view.problem.agents))
    if view.known_partner == "feed-when-crying":
        is_crying = format_last_observation(view) == "crying"
        joint_action[1 - view.seat] = FEED if is_crying else IGNORE
    elif view.known_partner in ACTIONS:
        joint_action[1 - view.seat] = ACTIONS.index(view.known_partner)
    elif view.known_partner not in {"", "random"}:
        return []
    unheard = [None] * len(joint_action)
    probabilities = list[float]()
    for action in range(len(ACTIONS)):
        joint_action[view.seat] = action
        probabilities.append(
            float(problem.joint_belief_update(view.belief, joint_action, unheard)[-1])
        )
    return probabilities


def _format_action_facts(view: View[CaregiverProblem], options: DrawOptions) -> str:
    """Return the hunger after each action in one row, or the rewards if it is unknown."""
    hunger = float(view.belief[-1]) * view.problem.hungry_reward
    efforts = view.problem.action_rewards[view.seat]
    facts = [f"{chance:.0%}" for chance in _predict_hunger(view)]
    heading = "hungry in the next turn:" if facts else "this turn only:"
    facts = facts or [format_signed_fixed(hunger + effort, 2) for effort in efforts]
    pairs = zip(list_action_keys(KEYS, options), facts, strict=True)
    return "  ".join([heading, *map("{0[0]} {0[1]}".format, pairs)])


def _describe_cry_probabilities(view: View[CaregiverProblem]) -> list[str]:
    """Return the probabilities that a baby cries, hungry or sated, and that it becomes hungry."""
    problem = view.problem
    hungry = _format_cry_probability(problem.cries_hungry, problem.cries_hungry_sung)
    sated = _format_cry_probability(problem.cries_sated, problem.cries_sated_sung)
    rows = [f"a hungry baby cries: {hungry}", f"a sated baby cries: {sated}"]
    if _is_song_useless(problem):
        rows = [
            f"a hungry baby cries: {problem.cries_hungry:.0%}, a sated one: "
            f"{problem.cries_sated:.0%}",
            "singing changes neither",
        ]
    is_quiet_good_news = (
        problem.cries_hungry > problem.cries_sated
        and problem.cries_hungry_sung > problem.cries_sated_sung
    )
    clue = "; if quiet, less" * is_quiet_good_news
    return [*rows, f"an unfed sated baby gets hungry: {problem.becomes_hungry:.0%}{clue}"]


def _is_song_useless(problem: CaregiverProblem) -> bool:
    """Return whether a baby cries as often without a song as with one."""
    without_song = problem.cries_hungry, problem.cries_sated
    return without_song == (problem.cries_hungry_sung, problem.cries_sated_sung)


def _format_cry_probability(without_song: float, with_song: float) -> str:
    """Return the probabilities of crying without and with a song as text, once if equal."""
    if without_song != with_song:
        return f"{without_song:.0%}, with a song {with_song:.0%}"
    return f"{without_song:.0%}, with or without a song"


def goal_lines(view: View[CaregiverProblem]) -> list[str]:
    """Return the goal and the costs of hunger, feeding and singing, as clauses."""
    problem = view.problem
    feeding, singing, _ = problem.action_rewards[view.seat]
    goal, team = "keep the baby sated (not hungry)", []
    if len(problem.agents) > 1:
        goal = f"with {problem.agents[1 - view.seat]}, keep the baby sated"
        team = [
            "hunger costs both caregivers, feeding only the one that feeds",
            "both can feed, choose at the same time and hear the same",
        ]
    return [
        goal,
        f"hunger costs {-problem.hungry_reward:g}, feeding {-feeding:g}, singing {-singing:g}",
        *team,
        f"crying is the only clue{', clearer after singing' * _is_song_informative(problem)}",
    ]


def lesson(view: View[CaregiverProblem]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    problem = view.problem
    feeding, singing, ignoring = (f"{0.0 - pay:g}" for pay in problem.action_rewards[view.seat])
    is_single_agent = len(problem.agents) == 1
    role = "You "
    if not is_single_agent:
        role = f"You are {problem.agents[view.seat]}, one of two caregivers who cannot talk; you "
    song = ", and singing makes its crying a better clue" if _is_song_informative(problem) else ""
    return Lesson(
        f"{role}care for a baby that is hungry or sated; you only hear whether it cries",
        f"You want it sated: feeding always sates it{song}",
        f"A turn that starts with a hungry baby costs {-problem.hungry_reward:g}; feeding costs "
        f"{'' if is_single_agent else 'you '}{feeding}, singing {singing}, ignoring {ignoring}",
        "feed",
        "with a baby that is {}",
        chances=tuple(_describe_hunger_chances(view)),
    )


def _describe_hunger_chances(view: View[CaregiverProblem]) -> Iterator[str]:
    """Yield sentences with the probabilities of hunger and of crying."""
    problem = view.problem
    is_single_agent = len(problem.agents) == 1
    if not is_single_agent:
        partner = problem.agents[1 - view.seat]
        yield f"You do not see what {partner} does; both choose at the same time"
        yield "You pay for your own actions only, and each caregiver can feed the baby"
    yield (
        f"An unfed sated baby gets hungry in a turn with probability {problem.becomes_hungry:g}, "
        "and a hungry one stays hungry until it is fed"
    )
    chances = {
        "hungry": (problem.cries_hungry, problem.cries_hungry_sung),
        "sated": (problem.cries_sated, problem.cries_sated_sung),
    }
    if _is_song_useless(problem):
        yield "Singing costs, and changes nothing"
    singer = "you sing" if is_single_agent else "a caregiver sings"
    for state, (without_song, with_song) in chances.items():
        song = f", or {with_song:g} if {singer}" if with_song != without_song else ""
        yield f"A baby that is {state} after the turn cries with probability {without_song:g}{song}"


def _is_song_informative(problem: CaregiverProblem) -> bool:
    """Return whether a sung-to baby's crying tells more about both states than without a song."""
    sated, hungry = problem.cries_sated, problem.cries_hungry
    sated_sung, hungry_sung = problem.cries_sated_sung, problem.cries_hungry_sung
    is_never_less = sated_sung <= sated <= hungry <= hungry_sung
    return is_never_less and (sated, hungry) != (sated_sung, hungry_sung)


def panel_rows(view: View[Tabular]) -> list[tuple[str, str]]:
    """Return the panel rows: the last reward and the discount.

    The reward is hidden until the game is over, because it reveals the state.
    """
    reward = "hidden" if view.rewards is None else "-"
    reward = format_reward(view.rewards[-1]) if view.rewards else reward
    return [("reward", reward), ("discount", f"{view.problem.discount:.2f}")]


def describe_turn(view: View[CaregiverProblem]) -> str:
    """Return a description of the last turn: the action, the observation and the belief."""
    return f"chose {view.last_action_label}, {describe_situation(view)}"


def describe_situation(view: View[CaregiverProblem]) -> str:
    """Return a description of the last observation and the belief."""
    return f"heard {format_last_observation(view)}. {describe_belief(view)}".rstrip()


def describe_belief(view: View[CaregiverProblem]) -> str:
    """Return the belief as a sentence, the likeliest state first; '' if there is none."""
    if view.beliefs is None:
        return ""
    partners = view.problem.agents[: view.seat] + view.problem.agents[view.seat + 1 :]
    # A belief that is certain beside a random partner is certain beside any.
    is_certain = float(view.belief.max()) >= MIN_CERTAIN_PROBABILITY
    partners = () if view.known_partner or is_certain else partners
    assumption = "".join(f" as if {partner} acted at random" for partner in partners)
    return f"belief{assumption}: {format_belief(view.problem.state_names, view.belief)}."


def describe_end(game: FinishedGame[CaregiverProblem]) -> str:
    """Return the number of turns with a hungry baby, and how often each agent fed it."""
    hungry = int((game.states[:-1] == 1).sum())
    counts = (game.actions == FEED).sum(axis=0).tolist()
    feedings = format_count(counts.pop(game.seat), "time")
    others = [name for seat, name in enumerate(game.problem.agents) if seat != game.seat]
    parts = [f"{game.player} fed it {feedings}", *map("{} {}".format, others, counts)]
    return f"the baby went hungry for {hungry} of {game.turns}; {', '.join(parts)}"
