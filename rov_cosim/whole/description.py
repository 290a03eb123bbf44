"""The model descriptions of a system as one FMU, of FMI 2.0 and 3.0."""

from collections.abc import Iterable, Sequence
from typing import Any

from fmpy.model_description import Category, CoSimulation, DefaultExperiment, ModelDescription, ModelVariable, Unknown

from ..exporters import fmi3_description
from ..exporters.model_description import GENERATED, GENERATION_TOOL, LOG_CATEGORIES, identified, to_xml
from ..ssp.units import defined_units
from .layout import Layout


def describe(layout: Layout, identifier: str, can_save: bool) -> ModelDescription:
    """Return FMPy's description object of a system's FMU.

    Parameters
    ----------
    layout : its variables.
    identifier : the name of its binary.
    can_save : whether its state can be saved.

    Raises
    ------
    UserError : two elements define a unit of one name differently.
    """
    variables = [shown.variable for shown in layout.variables]
    description = ModelDescription(
        fmiVersion="2.0",
        modelVariables=variables,
        **_about(layout, variables, identifier, can_save, canNotUseMemoryManagementFunctions=True),
    )
    return identified(description, to_xml)


def describe_3(layout: Layout, variables: Sequence[ModelVariable], identifier: str) -> ModelDescription:
    """Return the same for FMI 3.0, with the variables of `arrays`; the elements are linked, so that it can be saved."""
    step = str(layout.wiring.step_size)
    description = ModelDescription(
        fmiVersion=fmi3_description.VERSION,
        modelVariables=[*variables, fmi3_description.time(len(layout.variables))],
        **_about(layout, variables, identifier, True, fixedInternalStepSize=step),
    )
    return identified(description, fmi3_description.to_xml)


def _about(
    layout: Layout, variables: Iterable[ModelVariable], identifier: str, can_save: bool, **capabilities: object
) -> dict[str, Any]:
    """Return what both versions tell, as arguments of ModelDescription."""
    wiring = layout.wiring
    outputs = [variable for variable in variables if variable.causality == "output"]
    return {
        "modelName": wiring.name,
        "description": wiring.description or None,
        "generationTool": GENERATION_TOOL if can_save else f"{GENERATION_TOOL} with FMUs that it loads",
        "generationDateAndTime": GENERATED,
        "variableNamingConvention": "structured",
        "logCategories": [Category(name, text) for name, text in LOG_CATEGORIES.items()],
        "defaultExperiment": DefaultExperiment(
            wiring.start_time, wiring.stop_time if wiring.has_stop_time else None, stepSize=wiring.step_size
        ),
        "coSimulation": CoSimulation(
            modelIdentifier=identifier,
            # Its steps are multiples of the inner one; tools take this flag for leave to take any.
            canHandleVariableCommunicationStepSize=False,
            canGetAndSetFMUstate=can_save,
            canSerializeFMUstate=can_save,
            **capabilities,
        ),
        "unitDefinitions": list(defined_units({e.name: e.description for e in wiring.elements}).values()),
        "outputs": [Unknown(variable=variable, dependencies=[], dependenciesKind=[]) for variable in outputs],
        "initialUnknowns": [Unknown(variable=variable) for variable in outputs],
    }
