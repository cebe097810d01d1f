"""Training of agents: the loop over seeds, evaluation at checkpoints, and learned files."""
