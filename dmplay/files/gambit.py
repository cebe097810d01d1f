"""Reading games in normal form as Gambit writes them (`.nfg`)."""

from dmplay.core import Problem


def read(path: str, raw: bytes) -> Problem:
    raise NotImplementedError
