"""A release: all that is handed over, the same to the last bit wherever it is made."""
