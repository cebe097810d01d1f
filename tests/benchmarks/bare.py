"""The least full-screen application: every key redraws a counter."""

from prompt_toolkit.application import Application
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import FormattedTextControl, Layout, Window

pressed = 0
bindings = KeyBindings()


@bindings.add("<any>")
def _press(event: KeyPressEvent) -> None:
    global pressed  # noqa: PLW0603 - the whole state
    pressed += 1


def main() -> None:
    counter = Window(FormattedTextControl(lambda: f"pressed {pressed} times"))
    Application[None](layout=Layout(counter), key_bindings=bindings, full_screen=True).run()


if __name__ == "__main__":
    main()
