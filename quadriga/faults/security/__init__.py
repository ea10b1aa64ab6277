"""Forgers, strangers and certificates that end: faults of who may say what."""
