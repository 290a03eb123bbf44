"""The subcommands of `rov-cosim`: module NAME holds the command NAME as `command`."""
