"""The keys and words that play actions."""
