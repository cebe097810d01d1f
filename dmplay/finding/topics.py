"""The topics of the guide: a file each, numbered in reading order, its title on the first line."""

from pathlib import Path

from dmplay.errors import UnknownName

GUIDE_FOLDER = Path(__file__).parent.parent / "guide"


def list_topics() -> dict[str, Path]:
    """Every topic with its file, in reading order, by listing the folder."""
    return {file.stem.partition("-")[2]: file for file in sorted(GUIDE_FOLDER.glob("*.md"))}


def read_topic(name: str) -> str:
    """The Markdown of a topic; raises UnknownName with the nearest names."""
    known = list_topics()
    if name.lower() not in known:
        raise UnknownName("topic", name, known)
    return known[name.lower()].read_text(encoding="utf-8")


def topic_title(name: str) -> str:
    """What a topic is about, in a few words."""
    return read_topic(name).partition("\n")[0].removeprefix("# ")
