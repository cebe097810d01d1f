"""Evaluation of agents over many games: summaries, standard errors and comparisons."""
