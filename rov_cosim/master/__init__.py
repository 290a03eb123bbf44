"""The co-simulation master: steps the FMUs of a wiring, and records their outputs."""
