"""Moments of a recorded walk as a scene that a page shows from all sides."""
