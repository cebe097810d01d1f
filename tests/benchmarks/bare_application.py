"""A minimal full-screen application: every key redraws a counter."""

from prompt_toolkit.application import Application
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import FormattedTextControl, Layout, Window

press_count = 0
bindings = KeyBindings()


@bindings.add("<any>")
def _count_key(event: KeyPressEvent) -> None:
    global press_count  # noqa: PLW0603 - the only state of the application
    press_count += 1


def main() -> None:
    counter = Window(FormattedTextControl(lambda: f"pressed {press_count} times"))
    Application[None](layout=Layout(counter), key_bindings=bindings, full_screen=True).run()


if __name__ == "__main__":
    main()
