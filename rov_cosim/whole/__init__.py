"""A whole system as one FMU: its elements and the master's loop in C, linked or loaded, behind the components' shell."""
