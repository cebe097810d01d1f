"""Problems that packages offer by entry points."""

GROUP = "dmplay.problems"


def installed() -> dict[str, str]:
    """Their names, and what each points to, `MODULE` or `MODULE:PROBLEM`, which is not imported."""
    from importlib.metadata import entry_points

    return {point.name: point.value for point in entry_points(group=GROUP)}
