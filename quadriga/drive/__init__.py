"""Driving a team by hand: who is in charge, what is asked for, and the page in the browser."""
