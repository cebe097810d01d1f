"""Thompson sampling: sample a model from the belief, and take the best action for it."""

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.chance import Categorical


def sample_best_actions(belief: Reals, best_actions: Ints, u: Reals) -> Ints:
    """Return the best actions `[B]` for models sampled from beliefs `[B, S]` (section 15.4).

    `best_actions` `[S]` has the best action of each model; the uniforms `u` are `[B, 1]`.
    """
    return np.asarray(best_actions[Categorical.from_probabilities(belief).sample_events(u)])
