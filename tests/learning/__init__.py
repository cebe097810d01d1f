"""Training of the 2048 network that dmplay ships: run `learn_2048.c`, then `pack_2048.py`."""
