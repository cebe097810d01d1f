"""The players in a transcript that are not agents: a person, or a language model."""

HUMAN_PLAYER, MODEL_PLAYER = "human", "mcp"
EXTERNAL_PLAYERS = (HUMAN_PLAYER, MODEL_PLAYER)
