"""Emulated robots: the simulated team behind the robots' own protocols, for bridges."""
