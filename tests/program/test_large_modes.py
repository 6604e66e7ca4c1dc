"""nocdyn modes of machines with many bodies: closed forms, the modes that are chosen, and what is refused."""

import json
from math import pi, sin, sqrt

import pytest
from conftest import TRAPS_EXCEPTIONS, peak_memory

EXACT = 1e-10
STIFFNESS, DAMPING = 1e4, 1.0
without_checks = pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build checks every index")


def chain(count, extra=""):
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(count)]
    lines += [
        f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = {STIFFNESS} damping = {DAMPING} /"
        for i in range(count - 1)
    ]
    return "\n".join(lines) + "\n" + extra + "&run t_end = 1.0 /\n"


def damped(count, number):
    """Frequency [Hz], undamped frequency [Hz] and damping ratio of a mode of the chain."""
    natural = 2 * sqrt(STIFFNESS) * sin(pi * number / (2 * count))
    ratio = DAMPING / STIFFNESS * natural / 2
    return natural * sqrt(1 - ratio**2) / (2 * pi), natural / (2 * pi), ratio


def modes_of(nocdyn, text, *options):
    outcome = nocdyn("modes", nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    content = json.loads((nocdyn.folder / "out/modes.json").read_text())
    return content, [mode for mode in content["modes"] if mode["kind"] == "oscillating"]


def check(mode, count, number):
    frequency, undamped, ratio = damped(count, number)
    assert mode["frequency_Hz"] == pytest.approx(frequency, rel=EXACT)
    assert mode["undamped_frequency_Hz"] == pytest.approx(undamped, rel=EXACT)
    assert mode["damping_ratio"] == pytest.approx(ratio, rel=EXACT)


def test_a_chain_has_all_its_modes(nocdyn):
    content, modes = modes_of(nocdyn, chain(400))
    assert len(modes) == 399 and len(content["modes"]) == 400
    for number, mode in enumerate(modes, start=1):
        check(mode, 400, number)


@without_checks
def test_the_lowest_modes_of_10000_bodies_need_no_dense_matrix(nocdyn):
    nocdyn.write("long.nml", chain(10000))
    megabytes, _ = peak_memory(nocdyn, "modes", "long.nml", "--modes", "20")
    assert megabytes < 400  # a dense matrix has 800
    content, modes = modes_of(nocdyn, chain(10000), "--modes", "20")
    assert len(modes) == 20
    for number, mode in enumerate(modes, start=1):
        check(mode, 10000, number)
    assert "20 oscillating modes are listed, of the lowest frequencies of 9999 undamped ones" in content["notes"][1]


@without_checks
def test_a_machine_of_more_than_1000_degrees_of_freedom_has_its_100_lowest_modes(nocdyn):
    content, modes = modes_of(nocdyn, chain(1001))
    assert len(modes) == 100
    check(modes[-1], 1001, 100)
    assert any("100 oscillating modes are listed, of the lowest frequencies of 1000 " in note for note in content["notes"])


@pytest.mark.parametrize("count", [30, 300])
def test_modes_are_chosen_by_their_number_or_by_a_range(nocdyn, count):
    content, modes = modes_of(nocdyn, chain(count), "--modes", "7")
    assert len(modes) == 7 and len(content["modes"]) == 8
    check(modes[-1], count, 7)
    low, high = damped(count, 12)[0], damped(count, 20)[0]
    content, modes = modes_of(nocdyn, chain(count), "--range_hz", f"{low * 0.999},{high * 1.001}")
    assert len(modes) == len(content["modes"]) == 9
    assert [mode["mode"] for mode in content["modes"]] == list(range(12, 21))  # as without the range
    check(modes[0], count, 12)
    check(modes[-1], count, 20)
    assert any(f"of {count - 1} undamped ones, 11 are below" in note for note in content["notes"])


@pytest.mark.parametrize("count", [30, 300])
def test_a_range_without_modes_has_none(nocdyn, count):
    content, modes = modes_of(nocdyn, chain(count), "--range_hz", "50,60")
    assert modes == content["modes"] == []


@without_checks
def test_tables_of_holzer_are_of_the_modes_that_are_chosen(nocdyn):
    modes_of(nocdyn, chain(300), "--modes", "3", "--holzer")
    rows = (nocdyn.folder / "out/holzer.csv").read_text().splitlines()
    assert {row.split(",")[0] for row in rows[1:]} == {"1", "2", "3"}


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--modes", "0"), "--modes 0: allowed: a number from 1 on"),
        (("--modes", "many"), "--modes many: allowed: a number from 1 on"),
        (("--range_hz", "5"), "--range_hz 5: allowed: LOW,HIGH with 0 <= LOW < HIGH <= 1e12, frequencies in Hz"),
        (("--range_hz", "5,2"), "--range_hz 5,2: allowed: LOW,HIGH with 0 <= LOW < HIGH <= 1e12, frequencies in Hz"),
        (("--range_hz", "-1,2"), "--range_hz -1,2: allowed: LOW,HIGH with 0 <= LOW < HIGH <= 1e12, frequencies in Hz"),
        (("--range_hz", "1,x"), "--range_hz 1,x: allowed: LOW,HIGH with 0 <= LOW < HIGH <= 1e12, frequencies in Hz"),
        (("--modes", "2", "--range_hz", "1,2"), "--modes and --range_hz exclude each other"),
    ],
)
def test_a_wrong_choice_is_refused(nocdyn, words, complaint):
    outcome = nocdyn("modes", nocdyn.write("machine.nml", chain(3)), *words)
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (2, "", f"nocdyn: {complaint}\n")


@without_checks
def test_too_many_modes_of_a_large_machine_are_refused(nocdyn):
    path = nocdyn.write("long.nml", chain(5000))
    outcome = nocdyn("modes", path, "--modes", "1001")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert (
        "long.nml: --modes 1001: these are 1002 undamped modes; at most 1000 are allowed for this machine of 5000 "
        in outcome.stderr
    )
    outcome = nocdyn("modes", path, "--range_hz", "0,30")
    assert outcome.returncode == 2
    assert "long.nml: --range_hz 0,30: these are 3915 undamped modes" in outcome.stderr


@without_checks
def test_decays_that_are_approximate_in_a_large_machine_are_told(nocdyn):
    text = chain(1600, "&load name = 'l' body = 'b0' viscous = 2.0 /\n&motor name = 'm' body = 'b3' a = 10.0 b = 1.0 c = 0.0 /\n")
    text = text.replace(f"damping = {DAMPING}", "relative_damping = 0.2")
    outcome = nocdyn("modes", nocdyn.write("machine.nml", text), "--modes", "3")
    assert outcome.returncode == 0
    assert (
        "note: 1 mode that does not oscillate has an approximate decay: relative damping has no frequency there\n"
        in outcome.stdout
    )
