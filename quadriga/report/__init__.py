"""One self-contained HTML page for a recorded run: `quadriga report FILE`."""
