"""All steady states of random machines are found: two speeds that a slipping coupling joins."""

import json

import pytest
from conftest import DATA
from steady_machines import Machine

STORED = json.loads((DATA / "steady_machines.json").read_text())
# Speeds are compared to what a bisection leaves; where a load creeps, to 1e-6 rad/s.
TOLERANCE = 1e-6


def machine_of(stored):
    return Machine(**{key: value for key, value in stored.items() if key != "steady"})


def speeds(values):
    return values["omega_motor [rad/s]"], values["omega_fan [rad/s]"]


@pytest.mark.parametrize("kind", STORED)
def test_the_stored_steady_states_are_those_of_the_machines(kind):
    stored = STORED[kind][0]
    for computed, kept in zip(machine_of(stored).steady_states(), stored["steady"], strict=True):
        assert computed == pytest.approx(kept, rel=1e-9)


@pytest.mark.parametrize("kind", STORED)
def test_no_steady_state_of_sixty_machines_is_missed_or_invented(nocdyn, kind):
    files = [nocdyn.write(f"m{i}.nml", machine_of(stored).text()) for i, stored in enumerate(STORED[kind])]
    outcome = nocdyn("equilibrium", *files, "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert len(files) == 60
    for i, stored in enumerate(STORED[kind]):
        states = json.loads((nocdyn.folder / f"out/m{i}/equilibrium.json").read_text())["steady_states"]
        found = sorted(speeds(state["values"]) for state in states)
        assert len(found) == len(stored["steady"]), f"machine {i}"
        for one, other in zip(found, sorted(map(tuple, stored["steady"])), strict=True):
            assert one == pytest.approx(other, rel=TOLERANCE, abs=TOLERANCE), f"machine {i}"
