"""Archives of others: systems in systems, mapped parameters, transformations, signal dictionaries."""

from contextlib import contextmanager
from math import pi
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from lxml import etree
from pythonfmu.builder import FmuBuilder

from fmu import with_units
from rov_cosim.errors import UserError
from rov_cosim.exporters import archive
from rov_cosim.master.simulation import simulate
from rov_cosim.ssp import reader as ssp_reader
from rov_cosim.ssp import swap_map
from rov_cosim.ssp.swapping import with_swaps
from rov_cosim.ssp.wiring import Element, End, Link, Wiring, WiringError
from rov_cosim.whole import writer as ssp_writer
from structure import (
    EXPERIMENT,
    binding,
    bindings,
    component,
    connections,
    connectors,
    elements,
    mapping,
    parameter_set,
    ssd,
    system,
    written,
)

MODES = {"off": 1, "slow": 2, "fast": 5}
FACTOR = ("", '<ssc:LinearTransformation factor="-0.5"/>')


@pytest.fixture(scope="session")
def mixed(tmp_path_factory) -> Path:
    """Return a pythonfmu FMU with a variable of each type; `mode` and `seen_mode` are made Enumerations."""
    folder = tmp_path_factory.mktemp("mixed")
    fmu = FmuBuilder.build_FMU(Path(__file__).parent / "fmus" / "mixed.py", folder)
    content = archive.read(fmu)
    root = etree.fromstring(content["modelDescription.xml"])
    types = etree.Element("TypeDefinitions")
    enumeration = etree.SubElement(etree.SubElement(types, "SimpleType", name="Mode"), "Enumeration")
    for name, value in MODES.items():
        etree.SubElement(enumeration, "Item", name=name, value=str(value))
    root.find("CoSimulation").addnext(types)
    for variable in root.iter("ScalarVariable"):
        if variable.get("name") in ("mode", "seen_mode"):
            variable[0].tag = "Enumeration"
            variable[0].set("declaredType", "Mode")
    archive.write(fmu, {**content, "modelDescription.xml": etree.tostring(root)})
    return fmu


@contextmanager
def opened(path, expected=()):
    """Yield the wiring of an archive of which just the expected is told."""
    told = []
    with ssp_reader.opened(path, told.append) as wiring:
        steps = [line for line in told if "names no step" in line]
        assert len(steps) == 1
        rest = [line for line in told if line not in steps]
        assert len(rest) == len(expected), rest
        assert all(sentence in line for sentence, line in zip(expected, rest, strict=True)), rest
        yield wiring


def problems(path):
    with pytest.raises(WiringError) as caught, ssp_reader.opened(path):
        pass
    return caught.value.problems


INNER = system(
    "inner",
    connectors(into="input", out="output")
    + elements(component("c", "gain"))
    + connections((".into", "c.u"), ("c.y", ".out", FACTOR)),
)
OUTER = system(
    "outer",
    connectors(into="input", out="output")
    + elements(component("b", "gain"), INNER)
    + connections((".into", "b.u"), ("inner.into", "b.y"), ("inner.out", ".out")),
)
LOOP = elements(component("a", "gain"), OUTER) + connections(("a.y", "outer.into"), ("a.u", "outer.out", FACTOR))


def test_systems_in_systems_run_as_if_they_were_flat(plain_gain, tmp_path):
    values = {"a.rate": 1.0, "outer.b.gain": 0.25, "outer.inner.c.rate": -3.0, "outer.inner.c.gain": 0.5}
    with opened(written(tmp_path / "nested.ssp", ssd(LOOP), {"gain": plain_gain})) as nested:
        results = simulate(nested.with_values(values), stop_time=3.0)
    description = read_model_description(str(plain_gain))
    flat = tuple(Element(name, plain_gain, description) for name in ("first", "second", "third"))
    ends = [("first", "second", 1.0), ("second", "third", 1.0), ("third", "first", 0.25)]
    links = tuple(Link(End(source, "y"), End(target, "u"), factor) for source, target, factor in ends)
    by_hand = Wiring("flat", flat, links, 3.0, nested.step_size).with_values(
        {"first.rate": 1.0, "second.gain": 0.25, "third.rate": -3.0, "third.gain": 0.5}
    )
    expected = simulate(by_hand)
    assert np.ptp(expected["third.y"]) > 1.0
    for name, other in (("a", "first"), ("outer.b", "second"), ("outer.inner.c", "third")):
        assert np.array_equal(results[f"{name}.y"], expected[f"{other}.y"])


def test_an_element_of_an_inner_system_is_swapped_by_its_whole_name(plain_gain, mixed, tmp_path):
    text = '["outer.b".variables]\nlevel = { ours = "gain", factor = 2.0 }\n'
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    with opened(written(tmp_path / "nested.ssp", ssd(LOOP), {"gain": plain_gain})) as nested:
        changed = nested.with_values({"outer.b.gain": 0.05, "a.rate": 1.0})
        swapped = with_swaps(changed, {"outer.b": mixed}, swap_map.read(tmp_path / "map.toml"))
        assert swapped.value("outer.b.level") == 0.1
        results = simulate(swapped)
    assert np.array_equal(results["outer.b.y"][1:], 0.1 * results["a.y"][:-1])


def test_what_was_read_of_systems_in_systems_is_written_flat_and_read_alike(plain_gain, tmp_path):
    with opened(written(tmp_path / "nested.ssp", ssd(LOOP), {"gain": plain_gain})) as nested:
        changed = nested.with_values({"outer.inner.c.gain": 0.5})
        ssp_writer.write(changed, tmp_path / "flat.ssp", plain=True)
        with ssp_reader.opened(tmp_path / "flat.ssp") as flat:
            assert flat.runs_as(changed)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (
            elements(component("a", "gain"), system("s", connectors(out="output"))) + connections(("a.y", "s.out")),
            "Connection a.y -> s.out: both ends give a value.",
        ),
        (
            connectors(into="input")
            + elements(component("a", "gain"), component("b", "gain"), system("s", connectors(into="input")))
            + connections(("a.y", "s.into"), ("b.y", "s.into")),
            None,
        ),
        (
            elements(
                component("a", "gain"),
                component("b", "gain"),
                system(
                    "s", connectors(into="input") + elements(component("c", "gain")) + connections((".into", "c.u"))
                ),
            )
            + connections(("a.y", "s.into"), ("b.y", "s.into")),
            "s.into has 2 sources, a.y and b.y.",
        ),
        (
            elements(
                component("a", "gain"),
                system("s", connectors(into="input", out="output") + connections((".into", ".out"))),
            )
            + connections(("s.out", "s.into"), ("s.out", "a.u")),
            "go round in a loop.",
        ),
        (
            elements(system("s", elements(component("c", "gain")) + connections(("c.y", "ghost.u")))),
            "Connection s.c.y -> s.ghost.u: there is no element s.ghost.",
        ),
        (
            elements(component("a.b", "mixed"), system("a", elements(component("b", "mixed")))),
            "There are 2 elements of the name a.b: give each a name of its own.",
        ),
    ],
)
def test_connections_that_cannot_be_are_refused(plain_gain, mixed, tmp_path, content, sentence):
    path = written(tmp_path / "wrong.ssp", ssd(content), {"gain": plain_gain, "mixed": mixed})
    if sentence is None:
        with opened(path) as wiring:  # what feeds nothing harms nothing
            assert wiring.links == ()
    else:
        assert any(sentence in problem for problem in problems(path)), problems(path)


def test_an_input_of_the_archive_that_nothing_feeds_keeps_its_start_value(plain_gain, tmp_path):
    content = connectors(push="input", y="output") + elements(component("a", "gain"))
    content += connections((".push", "a.u"), ("a.y", ".y"))
    path = written(tmp_path / "open.ssp", ssd(content), {"gain": plain_gain})
    with opened(path, ["Nothing feeds push of the archive: the start values hold of a.u."]) as wiring:
        assert simulate(wiring)["a.y"][-1] == 1.0
        assert simulate(wiring.with_values({"a.u": 4.0}))["a.y"][-1] == 9.0


def test_a_signal_dictionary_joins_systems(plain_gain, tmp_path):
    dictionary = (
        '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary version="1.0">'
        '<ssb:DictionaryEntry name="speed"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary>'
        "</ssd:SignalDictionary></ssd:SignalDictionaries>"
    )
    reference = f'<ssd:SignalDictionaryReference name="ref" dictionary="bus">{connectors(speed="inout")}'
    reference += "</ssd:SignalDictionaryReference>"
    ends = {"one": (("c.y", "ref.speed", FACTOR),), "two": (("ref.speed", "c.u"),)}
    parts = [system(n, elements(component("c", "gain"), reference) + connections(*ends[n])) for n in ends]
    path = written(tmp_path / "bus.ssp", ssd(elements(*parts) + dictionary), {"gain": plain_gain})
    with opened(path) as wiring:
        assert wiring.links == (Link(End("one.c", "y"), End("two.c", "u"), -0.5),)
    lost = written(tmp_path / "lost.ssp", ssd(elements(*parts)), {"gain": plain_gain})
    assert "one.ref: there is no signal dictionary bus." in problems(lost)


UNITS = {"m": {"m": "1"}, "mm": {"m": "1", "factor": "0.001"}}
DEFINED = (
    '<ssd:Units><ssc:Unit name="cm"><ssc:BaseUnit m="1" factor="0.01"/></ssc:Unit>'
    '<ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit></ssd:Units>'
)
SUPPRESSED = ('suppressUnitConversion="true"', "")


@pytest.mark.parametrize(
    ("unit", "first", "last", "factor"),
    [
        ("", ("", ""), ("", ""), 1000.0),  # from m to mm, whatever is between
        (" cm", ("", ""), ("", ""), 1000.0),
        (" cm", SUPPRESSED, ("", ""), 10.0),  # the number of metres is taken for one of centimetres
        (" cm", ("", ""), SUPPRESSED, 100.0),
        (" cm", SUPPRESSED, SUPPRESSED, 1.0),
        ("", SUPPRESSED, ("", ""), 1.0),
        (" cm", FACTOR, FACTOR, 250.0),
    ],
)
def test_units_are_converted_from_connector_to_connector(plain_gain, tmp_path, unit, first, last, factor):
    fmus = {
        "metres": with_units(plain_gain, tmp_path / "m.fmu", {"y": "m"}, UNITS),
        "millimetres": with_units(plain_gain, tmp_path / "mm.fmu", {"u": "mm"}, UNITS),
    }
    inner = connectors(into=f"input{unit}") + elements(component("b", "millimetres"))
    content = elements(component("a", "metres"), system("s", inner + connections((".into", "b.u", last))))
    content += connections(("a.y", "s.into", first))
    with opened(written(tmp_path / "units.ssp", ssd(content, DEFINED + EXPERIMENT), fmus)) as wiring:
        assert [link.factor for link in wiring.links] == pytest.approx([factor], rel=1e-12)


def test_a_connector_of_another_dimension_is_refused_and_an_undefined_unit_told(plain_gain, tmp_path):
    fmus = {"gain": with_units(plain_gain, tmp_path / "m.fmu", {"y": "m", "u": "m"}, UNITS)}
    for unit, is_refused in (("K", True), ("furlong", False)):
        inner = connectors(into=f"input {unit}") + elements(component("b", "gain"))
        content = elements(component("a", "gain"), system("s", inner + connections((".into", "b.u"))))
        content += connections(("a.y", "s.into"))
        path = written(tmp_path / f"{unit}.ssp", ssd(content, DEFINED + EXPERIMENT), fmus)
        if is_refused:
            assert "Connection a.y -> s.b.u: unit m does not match K" in problems(path)[0]
        else:
            told = ["the unit furlong is not defined; the number is taken as furlong."] * 2
            with opened(path, [told[0], "the unit furlong is not defined; the number is taken as m."]) as wiring:
                assert wiring.links[0].factor == 1.0


def test_a_suppressed_conversion_joins_what_no_factor_converts(plain_gain, tmp_path):
    units = {"m": {"m": "1"}, "K": {"K": "1"}}
    fmus = {"gain": with_units(plain_gain, tmp_path / "odd.fmu", {"y": "m", "u": "K"}, units)}
    for further, factor in ((SUPPRESSED, 1.0), ((SUPPRESSED[0], FACTOR[1]), -0.5)):
        content = elements(component("a", "gain"), component("b", "gain")) + connections(("a.y", "b.u", further))
        with opened(written(tmp_path / "odd.ssp", ssd(content), fmus)) as wiring:
            assert [link.factor for link in wiring.links] == [factor]
            assert len(simulate(wiring)) == 11
    content = elements(component("a", "gain"), component("b", "gain")) + connections(("a.y", "b.u"))
    assert "unit m does not match K" in problems(written(tmp_path / "odd.ssp", ssd(content), fmus))[0]


def test_parameters_reach_their_place_by_name_prefix_and_connector_the_outer_and_later_first(plain_gain, tmp_path):
    own = bindings(
        binding(parameter_set(gain=("Real", 3), rate=("Real", 3), fail_at=("Real", 50))),
        binding(parameter_set(fail_at=("Real", 60))),
    )
    inner = (
        connectors(k="parameter", into="input")
        + bindings(binding(parameter_set(**{"c.rate": ("Real", 4), "k": ("Real", 5)})))
        + elements(component("c", "gain", own), component("d", "gain"))
        + connections((".k", "c.gain"), (".k", "d.gain", FACTOR), (".into", "d.u"))
    )
    outer = bindings(
        binding(parameter_set(gain=("Real", 7)), attributes='prefix="s.d."'),
        binding(parameter_set(into=("Real", 9)), attributes='prefix="s."'),
        binding(parameter_set(**{"s.c.rate": ("Real", 6), "s.e.rate": ("Real", 1), "s.c.rote": ("Real", 1)})),
    )
    path = written(tmp_path / "bound.ssp", ssd(outer + elements(system("s", inner))), {"gain": plain_gain})
    left_out = (
        "2 parameters are, as s.e.rate, bound to the archive for nothing that is in it, and left out. Did you mean"
    )
    with opened(path, [left_out]) as wiring:
        assert wiring.value("s.c.fail_at") == 60.0
        assert wiring.value("s.c.rate") == 6.0
        assert wiring.value("s.c.gain") == 5.0
        assert wiring.value("s.d.gain") == 7.0
        assert wiring.value("s.d.u") == 9.0
        assert wiring.value("s.d.rate") == 0.0


def test_a_parameter_goes_through_the_units_of_connectors(plain_gain, tmp_path):
    fmus = {"gain": with_units(plain_gain, tmp_path / "mm.fmu", {"gain": "mm"}, UNITS)}
    inner = connectors(k="parameter cm") + elements(component("c", "gain"))
    inner += connections((".k", "c.gain", FACTOR))
    metre = '<ssv:Units><ssc:Unit name="metre"><ssc:BaseUnit m="1"/></ssc:Unit></ssv:Units>'
    for values, expected in (
        (parameter_set(metre, **{"s.k": ("Real", 3, "metre")}), -1500.0),
        (parameter_set(**{"s.k": ("Real", 3)}), -15.0),  # without a unit it is in the connector's
    ):
        content = bindings(binding(values)) + elements(system("s", inner))
        with opened(written(tmp_path / "led.ssp", ssd(content, DEFINED + EXPERIMENT), fmus)) as wiring:
            assert wiring.value("s.c.gain") == pytest.approx(expected, rel=1e-12)


CELSIUS = '<ssv:Units><ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit></ssv:Units>'
SUPPRESS = 'suppressUnitConversion="true"'
LINEAR = '<ssc:LinearTransformation factor="2" offset="5"/>'


def table(type_, **entries):
    written_ = "".join(f'<ssc:MapEntry source="{s.strip("_")}" target="{t}"/>' for s, t in entries.items())
    return f"<ssc:{type_}MappingTransformation>{written_}</ssc:{type_}MappingTransformation>"


MAPPINGS = {
    "conversion": (("T", "a.level"), ("Real", 30, "degC"), "level", 303.15),
    "conversion, then line": (("T", "a.level", "", LINEAR), ("Real", 30, "degC"), "level", 2 * 303.15 + 5),
    "line alone": (("T", "a.level", SUPPRESS, LINEAR), ("Real", 30, "degC"), "level", 65.0),
    "line of an Integer": (("T", "a.count", "", LINEAR), ("Integer", 30), "count", 65),
    "Boolean": (("T", "a.on", "", table("Boolean", true="false", false="true")), ("Boolean", "0"), "on", True),
    "Integer": (("T", "a.count", "", table("Integer", _3="8", _4="9")), ("Integer", 4), "count", 9),
    "Enumeration": (("T", "a.mode", "", table("Enumeration", cruise="fast")), ("Enumeration", "cruise"), "mode", 5),
    "item by number": (("T", "a.mode", "", table("Integer", _2="5")), ("Enumeration", "slow"), "mode", 5),
    "Integer to item": (("T", "a.mode"), ("Integer", 2), "mode", 2),
    "String": (("T", "a.file"), ("String", " my_file.csv "), "file", " my_file.csv "),
}


@pytest.mark.parametrize("case", MAPPINGS)
@pytest.mark.parametrize("is_inline", [True, False])
def test_mapped_parameters_are_converted_transformed_and_set(mixed, tmp_path, case, is_inline):
    entry, value, variable, expected = MAPPINGS[case]
    fmus = {"mixed": with_units(mixed, tmp_path / "kelvin.fmu", {"level": "K"}, {"K": {"K": "1"}})}
    values = parameter_set(CELSIUS, **{"T": value, "a.count": ("Integer", 77), "level": ("Real", 77)})
    files = {}
    if is_inline:
        bound = binding(values, mapping(entry))
    else:
        bound = '<ssd:ParameterBinding source="my%20values.ssv"><ssd:ParameterMapping source="x/map.ssm"/>'
        bound += "</ssd:ParameterBinding>"
        files = {"my values.ssv": values.encode(), "x/map.ssm": f"<!-- first -->{mapping(entry)}".encode()}
    path = written(tmp_path / "mapped.ssp", ssd(bindings(bound) + elements(component("a", "mixed"))), fmus, **files)
    with opened(path) as wiring:
        assert wiring.value(f"a.{variable}") == expected
        assert type(wiring.value(f"a.{variable}")) is type(expected)
        assert [*wiring.elements[0].start_values] == [variable]  # what the mapping does not name is not bound
        seen = simulate(wiring)[f"a.seen_{variable}"][-1]
        assert (seen.decode() if isinstance(seen, bytes) else seen) == expected


@pytest.mark.parametrize(
    ("entry", "value", "reason"),
    [
        (("T", "a.count", "", table("Integer", _3="8")), ("Integer", 4), "has no entry for '4'"),
        (("T", "a.on", "", table("Integer", _3="8")), ("Boolean", "true"), "is not for type Boolean"),
        (("T", "a.on", "", LINEAR), ("Boolean", "true"), "a LinearTransformation is not for True"),
        (("T", "a.count", "", LINEAR.replace('"2"', '"0.3"')), ("Integer", 1), "expected a whole number"),
        (("T", "a.mode"), ("Enumeration", "idle"), "expected one of off (1), slow (2), fast (5), got 'idle'"),
        (("T", "a.mode"), ("Integer", 3), "expected one of off (1)"),
        (("T", "a.mode"), ("String", "fast"), "type String does not match Enumeration"),
        (("T", "a.y"), ("Real", 1), "a.y cannot be set"),
        (("T", "a.level", "", LINEAR.replace('"2"', '"INF"')), ("Real", 1), "a.level: 1 becomes inf by"),
        (("T", "a.level", "", LINEAR.replace('"2"', '"NaN"')), ("Real", 1), "a.level: 1 becomes nan by"),
    ],
)
def test_mapped_parameters_that_cannot_be_set_are_refused(mixed, tmp_path, entry, value, reason):
    content = bindings(binding(parameter_set(T=value), mapping(entry))) + elements(component("a", "mixed"))
    told = problems(written(tmp_path / "wrong.ssp", ssd(content), {"mixed": mixed}))
    assert len(told) == 1
    assert reason in told[0]


def test_a_mapping_of_two_to_one_is_refused(mixed, tmp_path):
    values, entries = parameter_set(T=("Real", 1), S=("Real", 2)), (("T", "a.level"), ("S", "a.level"))
    content = bindings(binding(values, mapping(*entries))) + elements(component("a", "mixed"))
    (told,) = problems(written(tmp_path / "two.ssp", ssd(content), {"mixed": mixed}))
    assert "Parameter a.level stands twice as a target of one parameter mapping: remove an entry." in told


def test_ways_that_part_and_meet_are_not_followed_each(mixed, tmp_path):
    through = connectors(i="input", o="output") + connections((".i", ".o"))
    content, pairs, last = [component("a", "mixed")], [], ".p"
    for n in range(40):  # 2 ** 40 ways
        content += [system(f"{name}{n}", through) for name in "xyz"]
        pairs += [(last, f"x{n}.i"), (last, f"y{n}.i"), (f"x{n}.o", f"z{n}.i"), (f"y{n}.o", f"z{n}.i")]
        last = f"z{n}.o"
    bound = bindings(binding(parameter_set(p=("Real", 1))))
    whole = connectors(p="input") + bound + elements(*content) + connections(*pairs, (last, "a.level"))
    (told,) = problems(written(tmp_path / "ways.ssp", ssd(whole), {"mixed": mixed}))
    assert "z39.i has 2 sources, x39.o and y39.o" in told


def test_a_mapping_of_what_its_set_has_not_is_told(mixed, tmp_path):
    values, entries = parameter_set(T=("Real", 1)), (("T", "a.level"), ("S", "a.level"), ("", "a.level"))
    content = bindings(binding(values, mapping(*entries))) + elements(component("a", "mixed"))
    path = written(tmp_path / "lacking.ssp", ssd(content), {"mixed": mixed})
    with opened(path, ["The parameter mapping is for 1 parameters that its set has not: S"]):
        pass


@pytest.mark.parametrize(
    ("end", "literal", "expected"),
    [
        ("h", "2.5", 2.5),
        ("seen_file", None, None),
        ("file", "a b_c.csv", "a b_c.csv"),
        ("mode", "fast", 5),
        ("mode", "2", 2),
    ],
)
def test_outputs_with_an_exact_start_strings_and_items_can_be_set(mixed, tmp_path, end, literal, expected):
    with opened(written(tmp_path / "one.ssp", ssd(elements(component("a", "mixed"))), {"mixed": mixed})) as wiring:
        if literal is None:
            with pytest.raises(WiringError, match="of causality output: only inputs and parameters can be set"):
                wiring.with_values({f"a.{end}": "x"})
            return
        changed = wiring.with_values({f"a.{end}": literal})
        assert changed.value(f"a.{end}") == expected
        seen = simulate(changed)[f"a.{end}" if end == "h" else f"a.seen_{end}"][0]
        assert (seen.decode() if isinstance(seen, bytes) else seen) == expected
        ssp_writer.write(changed, tmp_path / "again.ssp", plain=True)
        with ssp_reader.opened(tmp_path / "again.ssp") as again:
            assert again.runs_as(changed)


def test_values_in_another_unit_are_converted(plain_gain, tmp_path):
    fmus = {"gain": with_units(plain_gain, tmp_path / "rad.fmu", {"gain": "rad"}, {"rad": {"rad": "1"}})}
    degree = f'<ssv:Units><ssc:Unit name="deg"><ssc:BaseUnit rad="1" factor="{pi / 180!r}"/></ssc:Unit></ssv:Units>'
    content = elements(component("a", "gain", bindings(binding(parameter_set(degree, gain=("Real", 90, "deg"))))))
    with opened(written(tmp_path / "deg.ssp", ssd(content), fmus)) as wiring:
        assert wiring.value("a.gain") == pytest.approx(pi / 2, rel=1e-15)


def test_a_variable_has_the_unit_of_its_type(plain_gain, tmp_path):
    fmu = with_units(plain_gain, tmp_path / "typed.fmu", {}, {"K": {"K": "1"}})
    content = archive.read(fmu)
    root = etree.fromstring(content["modelDescription.xml"])
    types = etree.Element("TypeDefinitions")
    etree.SubElement(etree.SubElement(types, "SimpleType", name="Temperature"), "Real", unit="K")
    root.find("UnitDefinitions").addnext(types)
    for variable in root.iter("ScalarVariable"):
        if variable.get("name") in ("gain", "y", "u"):
            variable[0].set("declaredType", "Temperature")
    archive.write(fmu, {**content, "modelDescription.xml": etree.tostring(root)})
    fmus = {"typed": fmu, "metre": with_units(plain_gain, tmp_path / "m.fmu", {"u": "m"}, {"m": {"m": "1"}})}
    values = bindings(binding(parameter_set(CELSIUS, gain=("Real", 30, "degC"))))
    with opened(written(tmp_path / "typed.ssp", ssd(elements(component("a", "typed", values))), fmus)) as wiring:
        assert wiring.value("a.gain") == 303.15
    content = elements(component("a", "typed"), component("b", "metre")) + connections(("a.y", "b.u"))
    assert "unit K does not match m" in problems(written(tmp_path / "wrong.ssp", ssd(content), fmus))[0]


def test_without_a_stop_time_a_run_needs_one(plain_gain, tmp_path):
    path = written(tmp_path / "endless.ssp", ssd(elements(component("a", "gain")), ""), {"gain": plain_gain})
    with opened(path) as wiring:
        assert not wiring.has_stop_time
        assert len(simulate(wiring, stop_time=0.3)) == 11
        with pytest.raises(UserError, match="give one by --stop-time"):
            simulate(wiring)


@pytest.mark.parametrize(
    ("stop", "of_fmu", "step"), [(84.0, None, 0.03), (0.002, None, 1e-5), (84.0, "0.004", 0.004), (0.3, None, 0.03)]
)
def test_an_archive_that_names_no_step_has_one_of_its_fmus_or_a_short_one(plain_gain, tmp_path, stop, of_fmu, step):
    fmu = tmp_path / "gain.fmu"
    content = archive.read(plain_gain)
    root = etree.fromstring(content["modelDescription.xml"])
    for experiment in root.findall("DefaultExperiment"):
        root.remove(experiment)
    if of_fmu:
        root.find("ModelVariables").addprevious(etree.Element("DefaultExperiment", stepSize=of_fmu))
    archive.write(fmu, {**content, "modelDescription.xml": etree.tostring(root)})
    experiment = EXPERIMENT.replace('"0.3"', f'"{stop}"')
    path = written(tmp_path / "step.ssp", ssd(elements(component("a", "gain")), experiment), {"gain": fmu})
    with opened(path) as wiring:
        assert wiring.step_size == step
