"""Which keys and words play which actions."""
