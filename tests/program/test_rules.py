"""Rules of class societies and standards as files: their formulas against numbers of this file, ranges, words and margins."""

import json
import math
import random
import re

import pytest
from conftest import SOURCE

RPM = math.pi / 30
FOLDER = SOURCE / "src/analyse/rules"
EXACT = 1e-12  # formulas of a few operations
# two discs on a shaft of 100 mm; the peak of order 2 is at 974.6 rpm
DISCS = """\
&body name = 'one' inertia = 2 /
&body name = 'two' inertia = 3 /
&coupling name = 'shaft' bodies = 'one', 'two' stiffness = 5e4 magnifier = 50.0 diameter = 0.1 bore = 0.04 /
&excitation name = 'x' body = 'one' kind = 'orders' orders = 2 amplitudes = {amplitude} /
&run t_end = 1 /
&response body = 'one' speed_rpm = 300, 1500 count = 41 {response} /
&limit coupling = 'shaft' {limit} /
"""


def text(limit, response="", amplitude=7.0):
    return DISCS.format(limit=limit, response=response, amplitude=amplitude)


def answer(nocdyn, limit, response="", amplitude=7.0, command="response"):
    nocdyn.write("machine.nml", text(limit, response, amplitude))
    outcome = nocdyn(command, "machine.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / f"out/{command}.json").read_text())


def refusal(nocdyn, limit, response=""):
    nocdyn.write("machine.nml", text(limit, response))
    outcomes = [nocdyn(command, "machine.nml") for command in ("check", "response")]
    assert {outcome.returncode for outcome in outcomes} == {2}
    assert outcomes[0].stderr == outcomes[1].stderr
    return outcomes[0].stderr


def curves(nocdyn, has_transient=True):
    """Speed ratio to `rated` rpm, limit and transient limit [Pa] of the stress."""
    table = nocdyn.values("out", "response.csv")
    return list(
        zip(
            (speed / RPM for speed in table["omega_one"]),
            table["limit_stress_shaft"],
            table["transient_limit_stress_shaft"] if has_transient else table["omega_one"],
            strict=True,
        )
    )


def lines(report, **wanted):
    return [line for line in report["verdict"]["lines"] if all(line.get(key) == value for key, value in wanted.items())]


def test_every_rule_file_tells_its_source_and_can_be_asked_for(nocdyn):
    words = {}
    for key in ("limit.rule", "response.margin_rule"):
        group, name = key.split(".")
        page = nocdyn("help", "input", group).stdout
        row = re.search(rf"^ *{name} .*\n(?: .*\n)?", page, re.MULTILINE)[0]
        words[key] = set(re.findall(r"\b(?:iacs|kr|api)_\w+", row))
    files = {path.stem: path.read_text() for path in FOLDER.glob("*.rule")}
    assert words["limit.rule"] == {name for name, rule in files.items() if re.search("^continuous", rule, re.MULTILINE)}
    assert words["response.margin_rule"] == {name for name, rule in files.items() if re.search("^margin", rule, re.MULTILINE)}
    for name, rule in files.items():
        assert re.search(rf"^name +=? *= {name}$|^name\s*=\s*{name}$", rule, re.MULTILINE)
        for key in ("label", "title", "edition", "source", "url"):
            assert re.search(rf"^{key}\s*= \S", rule, re.MULTILINE), (name, key)


WORDS = {  # of the kind of shaft and of its features: largest strength [N/mm2], c_K
    "": (800, 1.0),
    "intermediate": (800, 1.0),
    "thrust": (800, 0.85),
    "propeller": (600, 0.55),
    "stern_tube": (600, 0.8),
    "intermediate', 'carbon": (600, 1.0),
    "intermediate', 'alloy', 'keyway_tapered": (800, 0.6),
    "keyway_cylindrical": (800, 0.45),
    "radial_hole": (800, 0.5),
    "slot": (800, 0.3),
    "flange": (800, 1.0),
    "shrink_fit": (800, 1.0),
}


@pytest.mark.parametrize("word", WORDS)
def test_iacs_m68_caps_the_strength_and_knows_the_shapes_of_shafts(nocdyn, word):
    most, c_k = WORDS[word]
    rated, strength = 1200, 900
    choices = f"choices = '{word}'" if word else ""
    report = answer(nocdyn, f"rule = 'iacs_m68' tensile_strength = {strength}e6 rated_speed_rpm = {rated} {choices}")
    for rpm, found, passed in curves(nocdyn):
        share = rpm / rated
        tau = (most + 160) / 18 * c_k * (0.35 + 0.93 * 100**-0.2) * (3 - 2 * share**2 if share < 0.9 else 1.38)
        assert found == pytest.approx(1e6 * tau, rel=EXACT)
        assert passed == pytest.approx(1e6 * tau * (1.7 / c_k**0.5 if share < 0.8 else 1), rel=EXACT)
    note = f"machine.nml:7: &limit: IACS UR M68: sigma_B = 900 is taken as {most}, the most that the rule takes"
    assert note in report["notes"]


def test_a_strength_below_the_cap_is_taken_as_it_is(nocdyn):
    report = answer(nocdyn, "rule = 'iacs_m68' tensile_strength = 600e6 rated_speed_rpm = 1200 choices = 'propeller'")
    assert not any("is taken as" in note for note in report["notes"])


def test_iacs_m68_bars_the_tolerance_of_the_tachometer_too(nocdyn):
    """16 n_c / (18 - lambda) to (18 - lambda) n_c / 16, or the range that exceeds the limit, if that is wider."""
    rated = 1300
    report = answer(nocdyn, f"rule = 'iacs_m68' tensile_strength = 4e8 c_k = 0.1 rated_speed_rpm = {rated}", amplitude=70)
    (barred,) = report["barred_speed_ranges"]
    (line,) = lines(report, criterion="stress, continuous")
    table = nocdyn.values("out", "response.csv")
    limit, found = table["limit_stress_shaft"], table["half_range_stress_shaft"]
    worst = max(range(len(limit)), key=lambda i: found[i] / limit[i])
    critical = table["omega_one"][worst] / RPM
    share = critical / rated
    low = min(16 * critical / (18 - share), barred["from_rad_s"] / RPM)
    high = max((18 - share) * critical / 16, barred["to_rad_s"] / RPM)
    assert [one / RPM for one in barred["with_tolerance_rad_s"]] == pytest.approx([low, high], rel=1e-9)
    assert 16 * critical / (18 - share) < barred["from_rad_s"] / RPM
    assert f"with the tolerance of the tachometer {low:.4g} to {high:.4g} rpm" in line["assessment"]


def test_speeds_beyond_the_rule_are_told(nocdyn):
    report = answer(nocdyn, "rule = 'iacs_m68' tensile_strength = 6e8 rated_speed_rpm = 900", amplitude=1)
    (line,) = lines(report, criterion="stress, continuous")
    assert "lambda 1.1, outside of the range of the rule" in line["assessment"]
    report = answer(nocdyn, "rule = 'iacs_m68' tensile_strength = 6e8 rated_speed_rpm = 960", amplitude=1)
    (line,) = lines(report, criterion="stress, continuous")
    assert "outside" not in line["assessment"]


@pytest.mark.parametrize(("word", "slope", "low"), [("four_stroke", 24, 21), ("other", 29, 16)])
@pytest.mark.parametrize(("strength", "yield_stress"), [(440, 225), (600, 300)])
def test_the_rule_of_crankshafts_of_the_korean_register(nocdyn, word, slope, low, strength, yield_stress):
    rated = 1320
    answer(
        nocdyn,
        f"rule = 'kr_crankshaft' choices = '{word}' tensile_strength = {strength}e6 rated_speed_rpm = {rated} "
        f"rule_symbols = 'yield_stress' rule_values = {yield_stress}",
    )
    factor = 1 + 2 / 3 * (strength / 440 - 1)
    for rpm, found, passed in curves(nocdyn):
        share = rpm / rated
        tau = 45 - slope * share**2 if share <= 1 else low + 237 * (share - 0.8) * math.sqrt(share - 1)
        assert found == pytest.approx(1e6 * factor * tau, rel=EXACT)
        assert passed == pytest.approx(2e6 * tau * yield_stress / 225 if share < 0.8 else found, rel=EXACT)


def test_the_rule_of_generator_shafts_of_the_korean_register(nocdyn):
    answer(nocdyn, "rule = 'kr_generator' tensile_strength = 600e6 rated_speed_rpm = 1200")
    factor = 1 + 2 / 3 * (600 / 440 - 1)
    for rpm, found, passed in curves(nocdyn):
        assert found == pytest.approx(31e6 * factor, rel=EXACT)
        assert passed == pytest.approx(118e6 if rpm < 0.9 * 1200 else found, rel=EXACT)


def crank_limit(strength, pin, journal, throw, fillet, web, width, bending, kind):
    """Torsion beside bending in the crankpin fillet: the equivalent stress is sigma_DW / 1.15 [N/mm2]."""
    r, w, b = fillet / pin, web / pin, width / pin
    s = max(((pin + journal) / 2 - throw) / pin, -0.5)
    alpha = 0.8 * r ** (-0.322 + 0.1015 * (1 - s)) * (7.8955 - 10.654 * b + 5.3482 * b**2 - 0.85 * b**3) * w**-0.145
    fatigue = kind * (0.42 * strength + 39.3)
    fatigue *= 0.264 + 1.073 * pin**-0.2 + (785 - strength) / 4900 + 196 / strength * math.sqrt(1 / max(fillet, 2))
    return math.sqrt((fatigue / 1.15) ** 2 - bending**2) / math.sqrt(3) / alpha


@pytest.mark.parametrize("seed", range(4))
def test_iacs_m53_leaves_the_torsion_that_bending_does_not_need(nocdyn, seed):
    chance = random.Random(seed)
    pin = chance.uniform(80, 400)
    keys = {
        "D_G": pin * chance.uniform(0.9, 1.2),
        "E": pin * chance.uniform(0.55, 2.0),
        "R_H": pin * chance.uniform(0.03, 0.13),
        "W": pin * chance.uniform(0.2, 0.8),
        "B": pin * chance.uniform(1.1, 2.2),
        "bending_stress": chance.uniform(0, 100),
    }
    strength = chance.uniform(450, 900)
    word, kind = chance.choice([("continuous_grain_flow", 1.05), ("free_form", 1), ("cast_cold_rolled", 0.93)])
    answer(
        nocdyn,
        f"rule = 'iacs_m53' choices = '{word}' tensile_strength = {strength}e6 diameter = {pin / 1000} rated_speed_rpm = 1500\n"
        f"rule_symbols = {', '.join(map(repr, keys))}\nrule_values = {', '.join(map(str, keys.values()))}",
    )
    expected = crank_limit(strength, pin, *list(keys.values())[:-1], keys["bending_stress"], kind)
    for _, found, _ in curves(nocdyn, has_transient=False):
        assert found == pytest.approx(1e6 * expected, rel=1e-10)


OWN = """\
# a rule of my own
label = house rule
unit = MPa
symbol = d from diameter in mm
symbol = k default 2
choice = grade default 1: fine 1.5, rough 0.5
value = big: max(d, 3, -k^2) + abs(-1) - min(4, 2)
continuous = {formula}
"""
FORMULAS = [
    ("1 + 2 * 3", lambda d, k, g, x: 7),
    ("(1 + 2) * 3 / 4", lambda d, k, g, x: 9 / 4),
    ("2^3^2 / 100", lambda d, k, g, x: 512 / 100),
    ("10 - 2^-2", lambda d, k, g, x: 9.75),
    ("1e2 - -3.5E0 - .5", lambda d, k, g, x: 103),
    ("20 - k^2 * grade", lambda d, k, g, x: 20 - k * k * g),
    ("big", lambda d, k, g, x: max(d, 3, -k * k) + 1 - 2),
    ("if(lambda <= 0.5, 40 - lambda, if(lambda > 1, 2 + sqrt(lambda - 1), 9 * lambda))",
     lambda d, k, g, x: 40 - x if x <= 0.5 else 2 + math.sqrt(x - 1) if x > 1 else 9 * x),
    ("if(lambda >= 0.75, 1, 2) * 3", lambda d, k, g, x: 3 if x >= 0.75 else 6),
    ("if(k<3,d,1)^0.5", lambda d, k, g, x: math.sqrt(d) if k < 3 else 1),
    ("100 / lambda ^ 1.5", lambda d, k, g, x: 100 / x**1.5),
]  # fmt: skip


@pytest.mark.parametrize(("formula", "expected"), FORMULAS, ids=[formula for formula, _ in FORMULAS])
def test_formulas_of_a_rule_of_ones_own(nocdyn, formula, expected):
    nocdyn.write("own.rule", OWN.format(formula=formula))
    for keys, k, grade in (("", 2, 1), ("choices = 'rough' rule_symbols = 'k' rule_values = 3", 3, 0.5)):
        report = answer(nocdyn, f"rule_file = 'own.rule' rated_speed_rpm = 1000 {keys}")
        assert lines(report, criterion="stress, continuous")[0]["rule"] == "house rule"
        for rpm, found, _ in curves(nocdyn, has_transient=False):
            assert found == pytest.approx(1e6 * expected(100, k, grade, rpm / 1000), rel=1e-13)


def test_an_input_that_was_written_has_the_lines_of_the_rule(nocdyn):
    nocdyn.write("own.rule", OWN.format(formula="3"))
    report = answer(nocdyn, "rule_file = 'own.rule' rated_speed_rpm = 1000")
    assert nocdyn("run", "machine.nml", "--set", "coupling.shaft.damping_frequency=100", "--out", "out").returncode == 0
    (nocdyn.folder / "own.rule").unlink()
    assert nocdyn("response", "out/input.nml", "--out", "again").returncode == 0
    again = json.loads((nocdyn.folder / "again/response.json").read_text())
    assert again["verdict"]["largest_ratio"] == report["verdict"]["largest_ratio"]


MISTAKES = [
    ("continuous = ", "continuous = 1 +", "8: continuous: the formula ends too early; required: a number, a symbol"),
    ("continuous = ", "continuous = 1 2", "8: continuous: the formula has '2'; required there: an operator"),
    ("continuous = ", "continuous = (1", "8: continuous: the formula ends too early; required: )"),
    ("continuous = ", "continuous = min(1)", "8: continuous: the formula has ')'; required there: ,"),
    ("continuous = ", "continuous = if(1, 2, 3)", "8: continuous: the formula has ', 2, 3)'; required there: a comparison"),
    ("continuous = ", "continuous = 1.2.3", "8: continuous: the formula has '1.2.3'; required there: a number"),
    ("continuous = ", "continuous = ton", "8: continuous: there is no symbol 'ton' here; allowed: lambda, d, k, grade, big,"),
    ("continuous = ", "continuous = n_c", "8: continuous: there is no symbol 'n_c' here; allowed: lambda, d"),
    ("continuous = ", f"continuous = {'(' * 1001}", "8: continuous: the formula is too long; allowed: 1000 characters"),
    ("continuous = ", "continuous = 1e999", "8: continuous: the formula has '1e999'; required there: a number"),
    ("continuous = 3", "continuous =", "8: continuous: there is no value"),
    ("label = ", "lable = ", "2: 'lable' is no key of a rule; allowed: name, label"),
    ("label = house rule", "label", '2: there is no "="; required: KEY = VALUE'),
    ("unit = MPa", "unit = psi", "3: unit: 'psi' is no unit of a rule; allowed: 1, Pa, MPa"),
    ("from diameter", "from length", "4: symbol: 'length' is no key of &limit that a rule can use; allowed: tensile_strength"),
    ("symbol = d from", "symbol = d of", "4: symbol: 'of' is not expected; allowed: NAME from KEY"),
    ("symbol = k default", "symbol = 2k default", "5: symbol: '2k' is no name of a symbol; allowed: up to 24 letters"),
    ("symbol = k default", "symbol = d default", "5: symbol: the symbol 'd' is there already"),
    ("fine 1.5,", "fine,", "6: choice: a word and its number are required between commas"),
    (": fine 1.5, rough 0.5", "", "6: choice: there are no words; required: NAME: WORD NUMBER"),
    ("grade default", "grade else", "6: choice: 'else' is not expected; allowed: NAME default FORMULA"),
    ("value = big: max", "value = big max", "7: value: there is no formula; required: NAME: FORMULA"),
    ("value = big", "range = x <= 3: hold\nvalue = big", "7: range: there is no symbol 'x' above; required: SYMBOL <= FORMULA"),
    ("value = big", "range = d < 3: hold\nvalue = big", "7: range: after d <= or >= is required"),
    ("value = big", "range = d <= 3: stop\nvalue = big", "7: range: 'stop' is no action outside of a range; allowed: refuse"),
    ("value = big", "range = lambda <= 3: refuse\nvalue = big", "7: range: a speed cannot be refused; allowed for lambda"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[message for *_, message in MISTAKES])
def test_mistakes_of_a_rule_file_are_told_with_their_line(nocdyn, old, new, message):
    rule = OWN.format(formula="3")
    assert old in rule
    if old == "continuous = ":
        old = "continuous = 3"
    nocdyn.write("own.rule", rule.replace(old, new))
    error = refusal(nocdyn, "rule_file = 'own.rule' rated_speed_rpm = 1000")
    assert error.startswith(f"nocdyn: own.rule:{message}"), error


@pytest.mark.parametrize(
    ("old", "message"),
    [
        ("label = house rule\n", 'own.rule: the rule is not complete; required: a line "label = ..." or "name = ..."'),
        ("continuous = 3\n", 'own.rule: the rule is not complete; required: a line "continuous = FORMULA" or "margin = FORMULA"'),
        ("unit = MPa\n", 'own.rule: the rule is not complete; required: a line "unit = ..."'),
    ],
)
def test_a_rule_file_that_lacks_a_line_is_refused(nocdyn, old, message):
    nocdyn.write("own.rule", OWN.format(formula="3").replace(old, ""))
    assert refusal(nocdyn, "rule_file = 'own.rule' rated_speed_rpm = 1000") == f"nocdyn: {message}\n"


M68 = "rule = 'iacs_m68' rated_speed_rpm = 1000 "
CRANK = "rule = 'iacs_m53' rated_speed_rpm = 1000 tensile_strength = 6e8 choices = 'free_form' "


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("rule = 'iacs_m68' tensile_strength = 6e8", "the rule IACS UR M68 needs rated_speed [rad/s] or rated_speed_rpm"),
        (M68, "the rule IACS UR M68 needs tensile_strength"),
        (M68 + "tensile_strength = 3e8", "the rule IACS UR M68 allows sigma_B >= 400; it is 300"),
        (M68 + "tensile_strength = 6e8 choices = 'tail'", "has no choice 'tail'; allowed: 'intermediate', 'thrust', 'propeller'"),
        (M68 + "tensile_strength = 6e8 choices = 'thrust', 'propeller'", "takes one of the choices 'thrust' and 'propeller'"),
        (M68 + "tensile_strength = 6e8 rule_symbols = 'x' rule_values = 1", "has no symbol 'x'; allowed: none"),
        ("rule = 'kr_generator' rated_speed_rpm = 1000 c_k = 1", "the rule KR generator shaft does not use c_k"),
        ("rule = 'kr_crankshaft' rated_speed_rpm = 1000", "KR crankshaft needs one of the choices 'four_stroke', 'other'"),
        (CRANK, "the rule IACS UR M53 needs 'E' among rule_symbols, with its number in rule_values"),
        ("rule_file = 'own.rule' rated_speed_rpm = 1000", "house rule has no positive limit at lambda = 1 with these numbers"),
        ("rule_file = 'none.rule'", "rule_file: none.rule: cannot be read: "),
        ("rule_file = 'moment.rule'", "the rule limits 'torque', but coupling 'shaft' has no such quantity in a response"),
        ("rule_file = 'margin.rule'", "margin only has no limits; allowed: as margin_rule of &response"),
    ],
)  # fmt: skip
def test_numbers_that_a_rule_cannot_take_are_refused(nocdyn, keys, message):
    nocdyn.write("own.rule", OWN.format(formula="1 - 1 / lambda"))
    nocdyn.write("moment.rule", "name = m\nquantity = torque\nunit = Nm\ncontinuous = 3\n")
    nocdyn.write("margin.rule", "name = margin only\nmargin = 0.2\n")
    nocdyn.write("machine.nml", text(keys))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == (3 if "none.rule" in keys else 2)
    assert outcome.stderr.startswith("nocdyn: machine.nml:7: &limit: ") and message in outcome.stderr, outcome.stderr


def test_a_rule_can_limit_a_moment(nocdyn):
    nocdyn.write("own.rule", "name = mine\nquantity = total_moment\nunit = kNm\ncontinuous = 0.05 * lambda\n")
    answer(nocdyn, "rule_file = 'own.rule' rated_speed_rpm = 1000")
    table = nocdyn.values("out", "response.csv")
    for speed, limit in zip(table["omega_one"], table["limit_moment_shaft"], strict=True):
        assert limit == pytest.approx(50 * speed / RPM / 1000, rel=EXACT)


@pytest.mark.parametrize("command", ["response", "campbell"])
@pytest.mark.parametrize(
    ("operating", "finding"), [("1000, 1200", "exceeded"), ("1150, 1400", "kept"), ("900, 1100", "exceeded")]
)
def test_a_rule_of_margins_judges_each_critical_speed(nocdyn, command, operating, finding):
    """The natural frequency of the discs is 2 x 974.6 rpm; API 617 asks for 10 %."""
    report = answer(nocdyn, "vibratory_moment = 1e5", f"operating_rpm = {operating} margin_rule = 'api_617'", command=command)
    (line,) = lines(report, rule="API 617")
    low, high = map(float, operating.split(","))
    critical = math.sqrt(5e4 * (1 / 2 + 1 / 3)) / 2 / RPM
    distance = max(0, (low - critical) / low, (critical - high) / high)
    assert line["value"] == pytest.approx(100 * distance, rel=1e-2, abs=1e-9) and line["limit"] == 10
    assert (line["finding"], line["element"], "order 2" in line["assessment"]) == (finding, "mode 1", True)
    assert len(lines(report, criterion="distance of a critical speed, at least")) == 1


def test_a_margin_of_ones_own_may_depend_on_the_order(nocdyn):
    nocdyn.write("own.rule", "name = mine\nvalue = least: 0.05\nmargin = if(order < 1.5, 0.1, least)\n")
    report = answer(nocdyn, "vibratory_moment = 1e5", "operating_rpm = 1050, 1200 margin_rule_file = 'own.rule'")
    (line,) = lines(report, rule="mine")
    assert (line["limit"], line["finding"]) == (5, "kept")


def test_a_rule_without_a_margin_is_refused_as_one(nocdyn):
    nocdyn.write("own.rule", OWN.format(formula="3"))
    error = refusal(nocdyn, "vibratory_moment = 1e5", "operating_rpm = 1050, 1200 margin_rule_file = 'own.rule'")
    assert 'house rule has no margin; allowed: a rule with a line "margin = FORMULA"' in error


HEATED = """\
&body name = 'engine' inertia = 50 speed_rpm = 600 /
&body name = 'driven' inertia = 80 speed_rpm = 600 /
&coupling name = 'rubber' bodies = 'engine', 'driven' stiffness = 2.0e5 relative_damping = 0.9
  damping_frequency_hz = 12 /
&excitation name = 'gas' body = 'engine' kind = 'orders' orders = 1, 2 amplitudes = 8000, 3000 /
&response body = 'engine' speed_rpm = 500, 900 /
&limit coupling = 'rubber' {} /
&run t_end = 1 /
"""


@pytest.mark.parametrize(("heat", "finding"), [(300, "exceeded"), (1e6, "kept")])
def test_the_heat_of_a_coupling_has_a_limit(nocdyn, heat, finding):
    nocdyn.write("machine.nml", HEATED.format(f"heat = {heat}"))
    assert nocdyn("response", "machine.nml", "--out", "out").returncode == 0
    (line,) = json.loads((nocdyn.folder / "out/response.json").read_text())["verdict"]["lines"]
    table = nocdyn.values("out", "response.csv")
    assert line["value"] == pytest.approx(max(table["heat_rubber"]), rel=EXACT)
    assert (line["criterion"], line["limit"], line["unit"], line["finding"]) == ("heat", heat, "W", finding)
    outcome = nocdyn("run", "machine.nml", "--out", "run")
    assert outcome.returncode == 0 and "not assessed" in outcome.stdout


@pytest.mark.parametrize("form", ["lists", "file"])
def test_the_moment_of_an_order_has_a_curve_over_the_frequency(nocdyn, form):
    """The limit falls with the frequency, as catalogues of couplings have it; beyond its ends it is constant."""
    frequencies, moments = [10, 14, 25], [3000.0, 1500.0, 700.0]
    keys = f"vibratory_frequency_hz = {str(frequencies)[1:-1]} vibratory_moments = {str(moments)[1:-1]}"
    if form == "file":
        rows = "".join(f"{2 * math.pi * f!r} {m}\n" for f, m in zip(frequencies, moments, strict=True))
        nocdyn.write("curve.txt", rows)
        keys = "table_file = 'curve.txt'"
    nocdyn.write("machine.nml", HEATED.format(keys))
    outcome = nocdyn("response", "machine.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    (line,) = json.loads((nocdyn.folder / "out/response.json").read_text())["verdict"]["lines"]
    worst = (0.0, None)
    stiffness, inertia = 2e5 * (1 + 0.9j / (2 * math.pi)), 1 / (1 / 50 + 1 / 80)
    for rpm in (500 + 400 * i / 2000 for i in range(2001)):
        for order, amplitude in ((1, 8000), (2, 3000)):
            w = order * rpm * RPM
            moment = abs(amplitude / 50 * stiffness / (stiffness / inertia - w**2))
            f = min(max(w / 2 / math.pi, 10), 25)
            k = 0 if f <= 14 else 1
            part = (f - frequencies[k]) / (frequencies[k + 1] - frequencies[k])
            worst = max(worst, (moment / (moments[k] + part * (moments[k + 1] - moments[k])), f"order {order}"))
    assert line["ratio"] == pytest.approx(worst[0], rel=1e-4)
    assert worst[1] in line["assessment"] and "Hz" in line["assessment"]
    assert line["criterion"].endswith("moment, of one order over the frequency")


@pytest.mark.parametrize(("temperature", "factor"), [(10, 1.0), (30, 1.0), (45, 0.85), (60, 0.7), (80, 0.5)])
def test_a_warm_coupling_carries_less(nocdyn, temperature, factor):
    warm = f"temperature = {temperature} derating_temperatures = 30, 60, 80 derating_factors = 1, 0.7, 0.5 "
    keys = "vibratory_moment = 4000 moment = 6000 vibratory_frequency_hz = 10, 20 vibratory_moments = 4000, 4000"
    for command, name in (("response", "response"), ("run", "summary")):
        found = []
        for more in ("", warm):
            nocdyn.write("machine.nml", HEATED.format(keys + "\n" + more))
            outcome = nocdyn(command, "machine.nml", "--out", "out")
            assert outcome.returncode == 0, outcome.stderr
            report = json.loads((nocdyn.folder / f"out/{name}.json").read_text())
            found.append({line["criterion"]: line["limit"] for line in report["verdict"]["lines"] if "limit" in line})
        assert len(found[0]) == (3 if command == "response" else 1)
        assert found[1] == pytest.approx({criterion: factor * limit for criterion, limit in found[0].items()}, rel=EXACT)


def test_a_temperature_without_a_factor_is_refused(nocdyn):
    keys = "moment = 6000 temperature = 81 derating_temperatures = 30, 80 derating_factors = 1, 0.5"
    nocdyn.write("machine.nml", HEATED.format(keys))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert "temperature: there is no factor of it; allowed: up to 80 degC" in outcome.stderr
