"""Why a process of a team is not there, and whether a computer is fit for it."""
