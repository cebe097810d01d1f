"""The topics of the guide: numbered files in reading order, each with its title first."""

from pathlib import Path

from dmplay.errors import UnknownName

GUIDE_FOLDER = Path(__file__).parent


def list_topics() -> dict[str, Path]:
    """Return every topic with its file, in reading order."""
    return {file.stem.partition("-")[2]: file for file in sorted(GUIDE_FOLDER.glob("*.md"))}


def read_topic(name: str) -> str:
    """Return the Markdown of a topic; raise UnknownName with the nearest names."""
    files = list_topics()
    if name.lower() not in files:
        raise UnknownName("topic", name, files)
    return files[name.lower()].read_text(encoding="utf-8")


def topic_title(name: str) -> str:
    """Return the title of a topic."""
    return read_topic(name).partition("\n")[0].removeprefix("# ")


def format_topic_list() -> str:
    """Return the name and title of every topic, one per line."""
    return "\n".join(f"{name:<13}{topic_title(name)}" for name in list_topics())
