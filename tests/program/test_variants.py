"""--variant DIR:NUMBER: a variant of a sweep as an input of its own, with the numbers that the sweep had."""

import csv

import pytest
from sweep_inputs import SWEEP, TWO_DISCS, needs_sweeps

pytestmark = needs_sweeps

# Tied numbers by a factor, one in degrees, one of the run. One machine at a time gives the same steps as the sweep by rk45.
VARIED = (
    TWO_DISCS.replace("atol = 1e-8", "atol = 1e-8 method = 'rk45'")
    + """\
&coupling name = 'other' bodies = 'disc', 'wheel' stiffness = 7.0 rest_twist_deg = 1.0 /
&sweep    design = 'sobol' samples = 16 seed = 5 /
&vary     target = 'coupling.*.stiffness' scale = 'relative' low = 0.7 high = 1.3 /
&vary     target = 'coupling.other.rest_twist_deg' low = 0.1 high = 2.0 /
&vary     target = 'run.t_end' low = 2.0 high = 3.0 /
&record   quantity = 'omega_wheel' statistic = 'final', 'max', 'min' /
"""
)
USAGE = "allowed: DIR:NUMBER, the folder of a sweep and the number of a variant, from 1 on"


def done(nocdyn, *words):
    outcome = nocdyn(*words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return outcome.stdout


def swept(nocdyn, text=VARIED):
    """The rows of sweep.csv."""
    nocdyn.write("m.nml", text)
    done(nocdyn, "sweep", "m.nml", "--out", "sweep", "--csv", "-q")
    with open(nocdyn.folder / "sweep/sweep.csv", newline="") as table:
        return list(csv.DictReader(table))


@pytest.mark.parametrize("variant", [1, 11, 16])
def test_a_run_of_a_variant_has_the_numbers_that_the_sweep_recorded(nocdyn, variant):
    row = swept(nocdyn)[variant - 1]
    done(nocdyn, "run", "--variant", f"sweep:{variant}")
    folder = f"sweep/variant-{variant}"
    found = nocdyn.summary(folder)["columns"]["omega_wheel [rad/s]"]
    last = {name: column[-1] for name, column in nocdyn.values(folder).items()}
    assert float(row["omega_wheel_max [rad/s]"]) == found["max"]
    assert float(row["omega_wheel_min [rad/s]"]) == found["min"]
    assert float(row["omega_wheel_final [rad/s]"]) == last["omega_wheel [rad/s]"]
    assert float(row["run.t_end [s]"]) == last["t [s]"]


def test_the_input_of_a_variant_is_complete_and_has_no_sweep(nocdyn):
    swept(nocdyn)
    done(nocdyn, "run", "m.nml", "--variant", "sweep:7", "--out", "seven")
    text = (nocdyn.folder / "seven/input.nml").read_text()
    assert not {"&sweep", "&vary", "&record"} & set(text.split())
    done(nocdyn, "run", "seven/input.nml", "--out", "again")
    for name in ("trajectory.csv", "input.nml"):
        assert (nocdyn.folder / "seven" / name).read_bytes() == (nocdyn.folder / "again" / name).read_bytes()


@pytest.mark.parametrize("command", ["check", "modes", "equilibrium", "matrices"])
def test_other_commands_take_the_machine_of_a_variant(nocdyn, command):
    """They say the same of the variant's own input; --set counts after the numbers of the variant."""
    swept(nocdyn)
    done(nocdyn, "run", "--variant", "sweep:7", "-q")
    printed = done(nocdyn, command, "--variant", "sweep:7")
    assert printed.replace("sweep/input.nml", "") == done(nocdyn, command, "sweep/variant-7/input.nml").replace(
        "sweep/variant-7/input.nml", ""
    )
    if command == "modes":
        assert printed != done(nocdyn, command, "--variant", "sweep:7", "--set", "body.disc.inertia=3")


def test_a_partial_sweep_has_variants_too(nocdyn):
    rows = swept(nocdyn)
    done(nocdyn, "sweep", "m.nml", "--out", "part", "--shard", "1/2", "-q")
    done(nocdyn, "run", "m.nml", "--variant", "part:12", "--out", "twelve", "-q")
    assert nocdyn.summary("twelve")["columns"]["omega_wheel [rad/s]"]["max"] == float(rows[11]["omega_wheel_max [rad/s]"])
    refused = nocdyn("run", "--variant", "part:12")
    message = "nocdyn: part: this sweep is not finished; needed: its input file beside --variant, m.nml\n"
    assert (refused.returncode, refused.stderr) == (2, message)


def test_a_list_of_variants_is_read_beside_its_input(nocdyn):
    nocdyn.write("list.csv", "load.drag.viscous\n0.25\n0.75\n")
    swept(
        nocdyn, TWO_DISCS + "&sweep design = 'list' file = 'list.csv' /\n&record quantity = 'omega_wheel' statistic = 'final' /\n"
    )
    done(nocdyn, "run", "m.nml", "--variant", "sweep:2", "-q")
    assert "viscous = 0.75" in (nocdyn.folder / "sweep/variant-2/input.nml").read_text()
    nocdyn.write("list.csv", "load.drag.viscous\n0.25\n0.85\n")
    refused = nocdyn("run", "m.nml", "--variant", "sweep:2", "-q")
    message = "nocdyn: m.nml: the list of variants is not the one of the sweep in sweep\n"
    assert (refused.returncode, refused.stderr) == (2, message)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--variant", "sweep"], 2, f"--variant sweep: {USAGE}"),
        (["--variant", "sweep:x"], 2, f"--variant sweep:x: {USAGE}"),
        (["--variant", "sweep:61"], 2, "--variant sweep:61: the sweep has no variant 61; allowed: 1 to 60"),
        (["--variant", "sweep:0"], 2, "--variant sweep:0: the sweep has no variant 0; allowed: 1 to 60"),
        (
            ["--variant", "nothing:1"],
            3,
            "nothing holds no sweep: neither sweep.nc with input.nml nor a journal; needed: the folder that nocdyn "
            "sweep has written to",
        ),
        (["plain.nml", "--variant", "sweep:1"], 2, "plain.nml: there is no &sweep in it, of which --variant would be one"),
        (
            ["other.nml", "--variant", "sweep:1"],
            2,
            "other.nml: sweep holds a sweep of another input: &run: rtol was 1e-08, is 1e-09",
        ),
        (["m.nml", "m.nml", "--variant", "sweep:1"], 2, "--variant is of one input; allowed: at most one FILE"),
    ],
)
def test_wrong_variants_are_refused(nocdyn, words, code, message):
    swept(nocdyn, TWO_DISCS + SWEEP)
    nocdyn.write("plain.nml", TWO_DISCS)
    nocdyn.write("other.nml", (TWO_DISCS + SWEEP).replace("rtol = 1e-8", "rtol = 1e-9"))
    refused = nocdyn("run", *words)
    assert (refused.returncode, refused.stderr) == (code, f"nocdyn: {message}\n")
