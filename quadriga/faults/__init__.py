"""Teams in which one thing goes wrong: what, when, and what came of it."""
