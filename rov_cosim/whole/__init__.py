"""A whole system as one FMU: its elements and the master's loop in C, behind the shell of the components."""
