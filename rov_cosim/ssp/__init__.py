"""Systems of FMUs as SSP has them: wiring, units, archives read and written, FMUs swapped."""
