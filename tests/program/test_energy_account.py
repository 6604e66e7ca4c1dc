"""The energy account: where the energy of a run came from and where it went."""

import pytest
from conftest import CASE_2, DATA

# Sums of the same numbers in another order.
SAME = 1e-12


@pytest.fixture(scope="module")
def full(shared_nocdyn):
    assert shared_nocdyn("run", DATA / "full_machine.nml", "--out", "full").returncode == 0
    return shared_nocdyn


def test_the_works_of_the_elements_add_up_to_the_columns(full):
    account = full.summary("full")["energy_account"]
    header, rows = full.table("full")
    last = dict(zip(header, rows[-1]))
    works = account["work_in_J"]
    assert list(works) == [
        "coupling shaft", "coupling anchor", "motor drive", "motor booster", "load fan", "excitation engine", "excitation gust",
    ]
    put_in = sum(work for name, work in works.items() if name.startswith(("motor", "excitation")))
    assert put_in == pytest.approx(last["work_in [J]"], rel=SAME)
    assert put_in - sum(works.values()) == pytest.approx(last["work_out [J]"], rel=SAME)
    assert account["kinetic_J"][1] == last["kinetic_energy [J]"]
    assert account["kinetic_J"][0] == rows[0][header.index("kinetic_energy [J]")]
    assert list(account["stored_J"]) == ["shaft", "belt", "anchor"]
    for moment, label in enumerate((rows[0], rows[-1])):
        stored = sum(energies[moment] for energies in account["stored_J"].values())
        assert stored == pytest.approx(label[header.index("elastic_energy [J]")], rel=SAME)
    assert account["residual_J"] == pytest.approx(last["energy_residual [J]"], abs=SAME * last["work_in [J]"])


def test_the_printed_lists_are_sorted_and_their_shares_are_of_all_that_was_put_in(nocdyn):
    text = nocdyn("run", CASE_2).stdout
    account = nocdyn.summary("results/case2")["energy_account"]
    _, table = text.split("energy came from [J]\n")
    sources, rest = table.split("and went to [J]\n")
    sinks, rest = rest.split("what does not add up ")
    put_in = account["work_in_J"]["motor drive"] + account["work_in_J"]["excitation shaker"]
    expected = {
        "motor drive": account["work_in_J"]["motor drive"],
        "excitation shaker": account["work_in_J"]["excitation shaker"],
        "load work": -account["work_in_J"]["load work"],
        "kinetic energy": account["kinetic_J"][1],
        "stored in coupling": account["stored_J"]["coupling"][1],
    }
    entries = [line.rsplit(maxsplit=3) for line in (sources + sinks).splitlines()]
    assert [name.strip() for name, *_ in entries] == list(expected)
    for name, energy, share, unit in entries:
        assert float(energy) == pytest.approx(expected[name.strip()], rel=1e-6)
        assert (float(share), unit) == (pytest.approx(100 * expected[name.strip()] / put_in, rel=1e-2), "%")
    assert float(rest.split()[0]) == pytest.approx(account["residual_J"], rel=1e-6)


def test_energy_of_the_start_that_is_given_away_counts_as_put_in(nocdyn, spinner):
    text = nocdyn("run", spinner).stdout
    _, table = text.split("energy came from [J]\n")
    lines = table.splitlines()
    assert lines[0].startswith("  kinetic energy ") and lines[0].endswith("  100 %")
    assert lines[1] == "and went to [J]"
    assert lines[2].startswith("  load drag ") and lines[2].endswith("  100 %")


def test_of_many_entries_the_smallest_are_one(nocdyn):
    bodies = "".join(f"&body name = 'b{i}' inertia = {1 + i}.0 speed = 1.0 /\n" for i in range(15))
    loads = "".join(f"&load name = 'l{i}' body = 'b{i}' viscous = 1.0 /\n" for i in range(15))
    text = nocdyn("run", nocdyn.write("many.nml", bodies + loads + "&run t_end = 1.0 /\n")).stdout
    _, table = text.split("and went to [J]\n")
    lines = table.splitlines()
    energies = [float(line.split()[-3]) for line in lines[:10]]
    assert lines[9].startswith("  6 others ") and lines[10].startswith("what does not add up")
    assert energies[:9] == sorted(energies[:9], reverse=True)
    works = nocdyn.summary("results/many")["energy_account"]["work_in_J"]
    assert sum(energies) == pytest.approx(-sum(works.values()), rel=1e-6)


def test_a_machine_that_turns_over_no_energy_has_no_lists(nocdyn):
    text = nocdyn("run", nocdyn.write("free.nml", "&body name = 'a' inertia = 1.0 /\n&run t_end = 1.0 /\n")).stdout
    assert "energy came from" not in text


def test_a_run_that_fails_has_the_account_of_its_rows(nocdyn):
    assert nocdyn("run", CASE_2, "--set", "run.max_steps=100").returncode == 1
    account = nocdyn.summary("results/case2")["energy_account"]
    header, rows = nocdyn.table("results/case2", "trajectory.partial.csv")
    assert account["kinetic_J"][1] == rows[-1][header.index("kinetic_energy [J]")]
