"""Words that every shell takes as plain text, so that completion may offer them."""

# Besides letters and digits. None of these starts an expansion, a quotation or another command.
SAFE_SIGNS = frozenset("_-./:,=+@ ")
SAFE_FIRST_SIGNS = frozenset("_-./")  # zsh expands a first `=`, and PowerShell a first `@`
MAX_WORD_CHARS = 1000  # maximum length of a word that is offered


def is_safe_word(word: str, partial_word: str) -> bool:
    """Return whether a shell can be offered a word, which may come from a stranger's file.

    zsh evaluates what it is offered, and bash puts it into the line unquoted. A word that begins
    like an option is safe only if the partial word does.
    """
    return (
        0 < len(word) <= MAX_WORD_CHARS
        and all(c.isalnum() or c in SAFE_SIGNS for c in word)
        and (word[0].isalnum() or word[0] in SAFE_FIRST_SIGNS)
        and word[-1] != " "
        and (word[0] != "-" or partial_word.startswith("-"))
    )
