"""The linear quadratic regulator of the pole."""

from dmplay.core.text import format_count
from dmplay.evaluation.solutions.solution import Row, Solution

from .agents import LinearQuadraticPolicy
from .rules import CartPole


def solve_cart_pole(problem: CartPole) -> Solution:
    """Return the gain of the linear quadratic regulator of the pole."""
    lqr = LinearQuadraticPolicy(problem, 0).regulator
    pairs = zip(("x", "v", "theta", "omega"), lqr.gain.tolist(), strict=True)
    rows: list[Row] = [{"of": name, "weight": weight} for name, weight in pairs]
    summary = (
        f"residual {lqr.riccati_residual:.1g} after {format_count(lqr.sweep_count, 'sweep')}; "
        f"spectral radius {lqr.spectral_radius:.4g}; pushes right if the weighted sum is below 0"
    )
    return Solution("Riccati equation of the cart and pole linearized at rest", summary, rows)


SOLUTION = solve_cart_pole
