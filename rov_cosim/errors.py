"""The base of all errors that tell a user what is wrong."""


class UserError(Exception):
    """Something is wrong that the user can mend: the message names the thing and the cure."""
