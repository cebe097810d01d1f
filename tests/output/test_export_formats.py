"""Tests that the lists of export formats agree with each other."""

from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.export_formats import EXPORT_FORMATS, KNOWN_EXTENSIONS, check_extension_fits_format
from dmplay.output.transcript_export import RENDERERS


def test_every_format_has_a_renderer() -> None:
    assert {*RENDERERS} == {*EXPORT_FORMATS}, (
        "edit EXPORT_FORMATS in dmplay/game/export_formats.py "
        "or RENDERERS in dmplay/output/transcript_export.py"
    )


def test_every_extension_of_a_format_is_known() -> None:
    extensions = {export_format.extension for export_format in EXPORT_FORMATS.values()}
    assert extensions <= KNOWN_EXTENSIONS, (
        "add the extension to KNOWN_EXTENSIONS in dmplay/game/export_formats.py; "
        "otherwise other formats can be written to a file with this extension"
    )


@pytest.mark.parametrize("name", EXPORT_FORMATS)
def test_a_file_of_another_picture_format_is_refused(name: str) -> None:
    with pytest.raises(BadParameter, match=r"name the file g\."):
        check_extension_fits_format(Path("g.png"), name)


def test_the_formats_begin_and_end_as_the_help_says() -> None:
    # `dmplay export --help`: "Choose one format, from --svg to --json."
    assert [*EXPORT_FORMATS][:: len(EXPORT_FORMATS) - 1] == ["svg", "json"], (
        "put the row of a new format above the row of json"
    )
