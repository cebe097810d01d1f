"""The topics of the guide: a file each, numbered in reading order, its title on the first line."""

from pathlib import Path

from dmplay.errors import UnknownName

FOLDER = Path(__file__).parent.parent / "guide"


def topics() -> dict[str, Path]:
    """Every topic with its file, in reading order, by listing the folder."""
    return {file.stem.partition("-")[2]: file for file in sorted(FOLDER.glob("*.md"))}


def topic(name: str) -> str:
    """The Markdown of a topic; raises UnknownName with the nearest names."""
    known = topics()
    if name.lower() not in known:
        raise UnknownName("topic", name, known)
    return known[name.lower()].read_text(encoding="utf-8")


def title(name: str) -> str:
    """What a topic is about, in a few words."""
    return topic(name).partition("\n")[0].removeprefix("# ")
