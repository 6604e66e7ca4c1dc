"""What the packages declare: the same as the scripts install."""

import re
import tomllib

import pytest
from conftest import SOURCE

PROJECT = tomllib.loads((SOURCE / "pyproject.toml").read_text())
REQUIREMENTS = SOURCE / "scripts/requirements"


def test_the_wheel_brings_the_packages_of_figures_and_reports():
    needed = {name for part in ("figures", "report") for name in (REQUIREMENTS / f"{part}.txt").read_text().split()}
    assert set(PROJECT["project"]["dependencies"]) == needed


def test_the_wheel_is_built_by_the_version_that_scripts_install():
    versions = (REQUIREMENTS / "versions.txt").read_text().split()
    assert set(PROJECT["build-system"]["requires"]) <= set(versions)


@pytest.mark.parametrize("part", ["figures", "report"])
def test_a_missing_package_of_a_part_would_be_named(part, monkeypatch):
    monkeypatch.syspath_prepend(SOURCE / "scripts")
    from nocdyn_report.__main__ import PACKAGES

    assert set((REQUIREMENTS / f"{part}.txt").read_text().split()) <= set(PACKAGES.values())


def test_the_debian_package_recommends_what_figures_and_reports_need():
    text = (SOURCE / "cmake/debian.cmake").read_text()
    recommended = set(re.findall(r"python3-([a-z0-9-]+)", text))
    needed = {name.lower() for part in ("figures", "report") for name in (REQUIREMENTS / f"{part}.txt").read_text().split()}
    assert {name.removesuffix("-py") for name in needed} - recommended == {"f90nml"}  # which the package itself has
