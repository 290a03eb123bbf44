"""The command `rov-cosim`, a subcommand a file."""
