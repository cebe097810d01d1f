"""Characters that a screen may contain."""

ASCII_CHARACTERS = set(map(chr, range(32, 127)))
GLYPHS = set("─│┌┐└┘├┤┬┴┼╱╲┄━┷╋▏▎▍▌▋▊▉█▁▂▃▄▅▆▇░▒←→↑↓↖↗↘↙◆●○∘·✓✗×γ…")
