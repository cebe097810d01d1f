"""What a screen may be drawn with."""

GLYPHS = set("─│┌┐└┘├┤┬┴┼╱╲┄━┷╋▏▎▍▌▋▊▉█▁▂▃▄▅▆▇▒←→↑↓↖↗↘↙◆●○∘·✓✗×γ…")
