"""Analyses of periodic motions that are killed or interrupted go on from their journal and end as if nothing had happened."""

import random
import signal

from conftest import wait_for

MACHINE = """\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 0.05 /
&coupling name = 'spring' bodies = 'ground', 'a' stiffness = 1.0 cubic_stiffness = 1.0 damping = 0.002 /
&coupling name = 'absorber' bodies = 'a', 'b' stiffness = 0.0453 cubic_stiffness = 0.0042 damping = 0.013 /
&excitation name = 'shaker' body = 'a' amplitude = 0.11 frequency = 0.8 /
&run t_end = 10.0 /
&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.4 count = 401 /
"""
FILES = ["orbit.csv", "orbit.json", "orbit_columns.json"]


def whole(nocdyn, text):
    """The files of an analysis that ran through."""
    nocdyn.write("machine.nml", text)
    assert nocdyn("orbit", "machine.nml", "--out", "whole", "-q").returncode == 0
    return results(nocdyn, "whole")


def results(nocdyn, folder):
    assert nocdyn.files(folder) == FILES
    return [(nocdyn.folder / folder / name).read_bytes() for name in FILES]


def journal(nocdyn, folder="out"):
    return nocdyn.folder / folder / "orbit.journal"


def start(nocdyn, *words, least=1):
    """An analysis that has found some motions."""
    process = nocdyn.start("orbit", "machine.nml", "--out", "out", *words)
    wait_for(lambda: process.poll() is not None or (journal(nocdyn).exists() and journal(nocdyn).stat().st_size > least))
    assert process.poll() is None
    return process


def test_an_analysis_that_is_killed_again_and_again_ends_as_one_that_is_not(nocdyn):
    expected = whole(nocdyn, MACHINE)
    moments = random.Random(20261128)
    sizes = [0]
    for _ in range(6):
        process = nocdyn.start("orbit", "machine.nml", "--out", "out", "--resume")
        moment = sizes[-1] + moments.randrange(20000)
        wait_for(
            lambda p=process, m=moment: p.poll() is not None or (journal(nocdyn).exists() and journal(nocdyn).stat().st_size > m)
        )
        process.kill()
        process.communicate()
        if not journal(nocdyn).exists():
            break
        sizes.append(journal(nocdyn).stat().st_size)
        assert not (nocdyn.folder / "out/orbit.csv").exists()
    assert sizes == sorted(sizes) and sizes[-1] > 0
    assert nocdyn("orbit", "machine.nml", "--out", "out", "--resume", "-q").returncode == 0
    assert results(nocdyn, "out") == expected


def test_an_interrupted_analysis_leaves_its_motions_and_goes_on(nocdyn):
    expected = whole(nocdyn, MACHINE)
    for stop in (signal.SIGINT, signal.SIGTERM):
        process = start(nocdyn, least=40000)
        process.send_signal(stop)
        _, errors = process.communicate()
        assert process.returncode == 1
        assert "machine.nml: interrupted; out has orbit.partial.csv; repeat the command with --resume to continue" in errors
        assert nocdyn.files("out") == ["orbit.journal", "orbit.partial.csv"]
        rows = (nocdyn.folder / "out/orbit.partial.csv").read_bytes().splitlines()
        assert 2 < len(rows) < len(expected[0].splitlines())
        assert expected[0].splitlines()[: len(rows)] == rows
        assert nocdyn("orbit", "machine.nml", "--out", "out", "--resume", "-q").returncode == 0
        assert results(nocdyn, "out") == expected


def test_isolated_branches_are_not_lost(nocdyn):
    text = MACHINE.replace("amplitude = 0.11", "amplitude = 0.15").replace("0.8, 1.4 count = 401", "1.9, 1.3 starts = 24")
    expected = whole(nocdyn, text)
    for least in (300000, 500000):
        process = nocdyn.start("orbit", "machine.nml", "--out", "out", "--resume")
        wait_for(
            lambda p=process, s=least: p.poll() is not None or (journal(nocdyn).exists() and journal(nocdyn).stat().st_size > s)
        )
        process.kill()
        process.communicate()
    assert nocdyn("orbit", "machine.nml", "--out", "out", "--resume", "-q").returncode == 0
    assert results(nocdyn, "out") == expected


def test_a_journal_is_not_replaced_nor_continued_by_another_input(nocdyn):
    nocdyn.write("machine.nml", MACHINE)
    process = start(nocdyn, least=20000)
    process.kill()
    process.communicate()
    outcome = nocdyn("orbit", "machine.nml", "--out", "out")
    assert outcome.returncode == 2
    assert (
        "out/orbit.journal holds the motions of an unfinished analysis; continue it with --resume, or remove it" in outcome.stderr
    )
    held = journal(nocdyn).read_bytes()
    outcome = nocdyn("orbit", "machine.nml", "--out", "out", "--resume", "--set", "orbit.count=400")
    assert outcome.returncode == 2
    assert "out/orbit.journal is of another input or another nocdyn; continue with those, or remove it" in outcome.stderr
    assert journal(nocdyn).read_bytes() == held
    journal(nocdyn).write_bytes(held[:-7])  # an entry that was not written as a whole
    assert nocdyn("orbit", "machine.nml", "--out", "out", "--resume", "-q").returncode == 0
    assert results(nocdyn, "out") == whole(nocdyn, MACHINE)
