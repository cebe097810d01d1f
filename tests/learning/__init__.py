"""How what dmplay ships ready learned was learned: `learn_2048.c`, then `pack_2048.py`."""
