"""What keeps a campaign from its end."""

from importlib import import_module
from typing import Any

from ...errors import UserError


class CampaignError(UserError):
    """The campaign did not get to its end; what was recorded until then is kept."""


def with_extra(module: str) -> Any:
    """Return a module of this package that takes the extra `campaign`, loaded when it is called for.

    Raises
    ------
    CampaignError : what it takes is not installed.
    """
    try:
        return import_module(f".{module}", __package__)
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("rov_cosim"):
            raise
        brings = "pip install distributed pyarrow"  # the extra `campaign`; a copy may be none from an index
        raise CampaignError(f"Campaigns need {error.name}, which is not installed: {brings}") from error
