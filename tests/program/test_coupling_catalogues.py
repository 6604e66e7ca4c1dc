"""Catalogues of couplings, what data sheets give beside stiffness, and conditions of load cases."""

import json

import pytest

MACHINE = """\
&body name = 'engine' inertia = 10.0 speed = 30 /
&body name = 'machine' inertia = 20.0 /
&coupling name = 'rubber' bodies = 'engine', 'machine' {rubber} /
&load name = 'work' body = 'machine' viscous = 20.0 /
&excitation name = 'gas' body = 'engine' kind = 'orders' orders = 1, 2 amplitudes = 300, 200 phases = 1, 2 /
&response body = 'engine' speed = 10, 60 count = 6 /
&run t_end = 0.1 /
"""
CATALOGUES = {
    "commas": "size,stiffness [kN m/rad],relative_damping,power_loss [W],maximum_torque [kN m],vibratory_torque [N m],mass\n"
    "A 200,4.5,1.1,200,2.5,400,12\nA 250,9,1.0,300,5,800,20\n",
    "semicolons": "Size;Stiffness [kN m/rad];Relative damping [-];Power loss [W];Maximum torque [kN m];Vibratory torque [N m]\n"
    "A 200;4,5;1,1;200;2,5;400\nA 250;9;1,0;300;5;800\n",
    "quotes": '"size",\'stiffness [kN m/rad]\',"relative_damping"\n"A 200",\'4.5\',1.1\n\'A 250\',"9",1.0\n',
    "tabs": "size\tstiffness\trelative_damping\tpower_loss\tmaximum_torque\tvibratory_torque\tfirst_inertia\tsecond_inertia\n"
    "A 200\t4500\t1.1\t200\t2500\t400\t0.5\t0.25\nA 250\t9000\t1.0\t300\t5000\t800\t1.0\t0.5\n",
}
FROM_CATALOGUE = "kind = 'rubber' catalogue_file = 'couplings.csv' size = 'A 250'"


def response(nocdyn, rubber, *words):
    nocdyn.done(MACHINE.format(rubber=rubber), "-q", *words, command="response")
    return (nocdyn.folder / "out/response.csv").read_text()


@pytest.mark.parametrize("dialect", CATALOGUES)
def test_a_size_gives_its_stiffness_and_damping(nocdyn, dialect):
    expected = response(nocdyn, "stiffness = 9000 relative_damping = 1.0")
    nocdyn.write("couplings.csv", CATALOGUES[dialect])
    assert response(nocdyn, FROM_CATALOGUE) == expected
    assert response(nocdyn, f"{FROM_CATALOGUE} stiffness = 4500", "--set", "coupling.rubber.relative_damping=1.1") == response(
        nocdyn, FROM_CATALOGUE, "--set", "coupling.rubber.size=A 200"
    )


def test_the_written_input_holds_the_catalogue(nocdyn):
    nocdyn.write("couplings.csv", CATALOGUES["commas"])
    nocdyn.done(MACHINE.format(rubber=FROM_CATALOGUE + " damping_frequency = 60"))
    written = (nocdyn.folder / "out/input.nml").read_text()
    assert "stiffness = 9000" not in written
    (nocdyn.folder / "couplings.csv").unlink()
    outcome = nocdyn("response", nocdyn.write("again.nml", written), "--set", "coupling.rubber.size=A 200", "--out", "again")
    assert outcome.returncode == 0, outcome.stderr
    assert (nocdyn.folder / "again/response.csv").read_text() == response(
        nocdyn, "stiffness = 4500 relative_damping = 1.1 damping_frequency = 60"
    )


def test_limits_and_inertias_of_a_catalogue(nocdyn):
    nocdyn.write("couplings.csv", CATALOGUES["tabs"])
    nocdyn.done(MACHINE.format(rubber=FROM_CATALOGUE + " limits = .true. inertias = .true."), command="response")
    verdict = json.loads((nocdyn.folder / "out/response.json").read_text())["verdict"]
    limits = {line["limit"] for line in verdict["lines"] if "limit" in line}
    assert {800.0, 5000.0, 300.0} <= limits
    table = nocdyn.values(name="response.csv")
    text = (
        MACHINE.format(rubber="stiffness = 9000 relative_damping = 1.0")
        .replace("= 10.0", "= 11.0")
        .replace("= 20.0 /", "= 20.5 /", 1)
    )
    nocdyn.done(text, command="response")
    plain = nocdyn.values(name="response.csv")
    assert max(table["peak_moment_rubber"]) == max(plain["peak_moment_rubber"])


THERMAL = "table_temperature = 30, 100 temperature_stiffness = 1, 0.7 temperature_damping = 1, 0.6 ambient_temperature = 30"


def test_load_cases_set_the_condition_in_one_line(nocdyn):
    rubber = f"kind = 'rubber' stiffness = 9000 relative_damping = 1.0 {THERMAL} warm_temperature = 100 thermal_resistance = 0.1"
    cases = "".join(f"&load_case name = '{case}' rubber = '{case}' /\n" for case in ("cold", "warm", "steady"))
    nocdyn.done(MACHINE.format(rubber=rubber) + cases, "-q", command="response")
    tables = {case: nocdyn.values(f"out/{case}", "response.csv") for case in ("cold", "warm", "steady")}
    for case, stiffness, psi in (("cold", 9000, 1.0), ("warm", 6300, 0.6)):
        response(nocdyn, f"stiffness = {stiffness} relative_damping = {psi}")
        plain = nocdyn.values(name="response.csv")
        label = "half_range_moment_rubber"
        assert max(tables[case][label]) == pytest.approx(max(plain[label]), rel=1e-9)
    assert 30 < min(tables["steady"]["temperature_rubber"]) < max(tables["steady"]["temperature_rubber"])


def test_warm_values_of_a_data_sheet(nocdyn):
    expected = response(nocdyn, "stiffness = 7000 relative_damping = 0.8")
    rubber = "kind = 'rubber' stiffness = 9000 relative_damping = 1.0 warm_stiffness = 7000 warm_damping = 0.8"
    assert response(nocdyn, rubber + " condition = 'warm'") == expected
    assert response(nocdyn, rubber) == response(nocdyn, "stiffness = 9000 relative_damping = 1.0")


def test_the_permissible_temperature_is_in_the_verdict(nocdyn):
    rubber = f"kind = 'rubber' stiffness = 9000 relative_damping = 1.0 {THERMAL} power_loss = 200 power_loss_rise = 70"
    limit = "&limit coupling = 'rubber' largest_temperature = {} /\n"
    for permissible, finding in ((31.0, "exceeded"), (500.0, "kept")):
        nocdyn.done(MACHINE.format(rubber=rubber) + limit.format(permissible), "-q", command="response")
        report = json.loads((nocdyn.folder / "out/response.json").read_text())
        line = next(line for line in report["verdict"]["lines"] if line["criterion"] == "temperature")
        assert (line["limit"], line["finding"]) == (permissible, finding)
        table = nocdyn.values(name="response.csv")
        assert line["value"] == max(table["temperature_rubber"]) == report["temperatures"][0]["highest_degC"]
    nocdyn.done(MACHINE.format(rubber="stiffness = 9000") + limit.format(80), "-q", command="response")
    report = json.loads((nocdyn.folder / "out/response.json").read_text())
    assert "does not heat up" in json.dumps(report["verdict"])


RUBBER = "kind = 'rubber' stiffness = 9000 relative_damping = 1.0"
REFUSED = {
    "kind = 'rubber'": "kind = 'rubber' needs stiffness > 0 [N m/rad]",
    "stiffness = 1 table_torque = 0, 1 torque_stiffness = 1, 2": "table_torque belongs to kind = 'rubber'",
    f"{RUBBER} gap = 0.1": "gap belongs to kind = 'elastic'",
    f"{RUBBER} table_torque = 0, 1 torque_stiffness = 1, 2, 3": "torque_stiffness has 3 values and table_torque has 2 values",
    f"{RUBBER} condition = 'steady'": "condition = 'steady' needs thermal_resistance [K/W]",
    f"{RUBBER} condition = 'warm'": "condition = 'warm' needs warm_temperature [degC]",
    f"{RUBBER} thermal_resistance = 0.1": "thermal_resistance needs ambient_temperature",
    f"{RUBBER} power_loss_rise = 70 ambient_temperature = 30": "power_loss_rise needs power_loss or catalogue_file",
    f"{RUBBER} limits = .true.": "limits need maximum_torque [N m]",
    f"{RUBBER} temperature_stiffness = 1, 2": "temperature_stiffness needs table_temperature",
    f"{RUBBER} size = 'A 250'": "size needs catalogue_file",
    "kind = 'rubber' catalogue_file = 'couplings.csv'": "catalogue_file needs size",
    "kind = 'rubber' catalogue_file = 'none.csv' size = 'A 250'": "none.csv",
    "kind = 'rubber' catalogue_file = 'couplings.csv' size = 'A 25'": "there is no size 'A 25' in couplings.csv; did you mean",
}


@pytest.mark.parametrize("rubber", REFUSED)
def test_wrong_data_are_refused(nocdyn, rubber):
    nocdyn.write("couplings.csv", CATALOGUES["commas"])
    outcome = nocdyn("check", nocdyn.write("machine.nml", MACHINE.format(rubber=rubber)))
    assert outcome.returncode == (3 if "none.csv" in rubber else 2)
    assert REFUSED[rubber] in outcome.stderr
    assert "machine.nml:3" in outcome.stderr


WRONG_CATALOGUES = {
    "size,stifness [N m/rad]\nA,1\n": "couplings.csv:1: 'stifness' is no column of a catalogue; did you mean 'stiffness'?",
    "size,stiffness [kg]\nA,1\n": "couplings.csv:1: stiffness: ",
    "stiffness,damping\n1,2\n": "couplings.csv:1: there is no column 'size'",
    "size,stiffness\nA 250,1\nA 250,2\n": "couplings.csv:3: the size 'A 250' is given twice",
    "size,stiffness,stiffness\nA 250,1,2\n": "the column 'stiffness' is given twice",
    "size,stiffness\nA 250,soft\n": "couplings.csv:2: ",
    "size,stiffness\nA 250,-1\n": "couplings.csv:2: stiffness = -1 is out of range",
    "size,stiffness\n": "couplings.csv: no row",
    "size,relative_damping\nA 250,1\n": "size: 'A 250' has no stiffness in couplings.csv; kind = 'rubber' needs one",
    "size,stiffness,relative_damping\nA 200,1,1\nA 250,,1\n": "size: 'A 250' has no stiffness in couplings.csv",
}


@pytest.mark.parametrize("text", WRONG_CATALOGUES)
def test_wrong_catalogues_are_refused(nocdyn, text):
    nocdyn.write("couplings.csv", text)
    outcome = nocdyn("check", nocdyn.write("machine.nml", MACHINE.format(rubber=FROM_CATALOGUE)))
    assert outcome.returncode == 2
    assert WRONG_CATALOGUES[text] in outcome.stderr


def test_conditions_of_load_cases_need_their_elements(nocdyn):
    for keys, message in (("rubber = 'warm'", "no &coupling of kind = 'rubber'"), ("misfire = 2", "no &engine")):
        text = MACHINE.format(rubber="stiffness = 9000") + f"&load_case name = 'case' {keys} /\n"
        outcome = nocdyn("check", nocdyn.write("machine.nml", text))
        assert outcome.returncode == 2
        assert message in outcome.stderr
