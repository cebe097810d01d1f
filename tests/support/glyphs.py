"""What a screen may be drawn with."""

PLAIN = set(map(chr, range(32, 127)))
GLYPHS = set("─│┌┐└┘├┤┬┴┼╱╲┄━┷╋▏▎▍▌▋▊▉█▁▂▃▄▅▆▇▒←→↑↓↖↗↘↙◆●○∘·✓✗×γ…")
