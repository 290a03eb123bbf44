"""The FMI 2.0 model description of a system as one FMU."""

from fmpy.model_description import Category, CoSimulation, DefaultExperiment, ModelDescription, Unknown

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
    wiring = layout.wiring
    variables = [shown.variable for shown in layout.variables]
    outputs = [shown.variable for shown in layout.outputs]
    return identified(
        ModelDescription(
            fmiVersion="2.0",
            modelName=wiring.name,
            description=wiring.description or None,
            generationTool=GENERATION_TOOL if can_save else f"{GENERATION_TOOL} with FMUs that it loads",
            generationDateAndTime=GENERATED,
            variableNamingConvention="structured",
            logCategories=[Category(name, text) for name, text in LOG_CATEGORIES.items()],
            defaultExperiment=DefaultExperiment(
                wiring.start_time, wiring.stop_time if wiring.has_stop_time else None, stepSize=wiring.step_size
            ),
            coSimulation=CoSimulation(
                modelIdentifier=identifier,
                # Its steps are multiples of the inner one; tools take this flag for leave to take any.
                canHandleVariableCommunicationStepSize=False,
                canGetAndSetFMUstate=can_save,
                canSerializeFMUstate=can_save,
                canNotUseMemoryManagementFunctions=True,
            ),
            unitDefinitions=list(defined_units({e.name: e.description for e in wiring.elements}).values()),
            modelVariables=variables,
            outputs=[Unknown(variable=variable, dependencies=[], dependenciesKind=[]) for variable in outputs],
            initialUnknowns=[Unknown(variable=variable) for variable in outputs],
        ),
        to_xml,
    )
