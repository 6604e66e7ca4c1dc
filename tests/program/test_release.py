"""scripts/release: the tag of a release, and why it is not made."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from conftest import SOURCE

VERSION = "1.2.3"
HELD = {
    "CMakeLists.txt": "project(nocdyn VERSION {} LANGUAGES",
    "src/base/core/version.f90": "version = '{}'",
    "CITATION.cff": "version: {}",
    "README.md": "nocdyn-{}-py3-none",
}
FILES = {name: text.format(VERSION) + "\n" for name, text in HELD.items()} | {
    "CHANGELOG.md": f"## [Unreleased]\n\n## [{VERSION}] - 2026-01-02\n\n- Gears.\n\n## [1.2.2] - 2026-01-01\n\n- Old.\n",
    "scripts/test": "#!/usr/bin/env bash\necho tests >> .git/calls\n",
}


class Project:
    """A repository with what scripts/release looks at."""

    def __init__(self, folder: Path):
        self.folder = folder
        for name, text in FILES.items():
            self.write(name, text)
        shutil.copy(SOURCE / "scripts/release", folder / "scripts/release")
        (folder / "scripts/test").chmod(0o755)
        self.git("init", "--quiet")
        self.commit()

    def write(self, name, text):
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")

    def git(self, *words):
        names = {f"GIT_{who}_{what}": "x@example.org" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
        environment = os.environ | names | {"GIT_CONFIG_GLOBAL": os.devnull}
        return subprocess.run(
            ["git", *words], cwd=self.folder, env=environment, check=True, capture_output=True, text=True
        ).stdout

    def commit(self):
        self.git("add", "--all")
        self.git("commit", "--quiet", "--message", "All")

    def release(self, *words):
        names = {"GIT_COMMITTER_NAME": "x", "GIT_COMMITTER_EMAIL": "x@example.org"}
        command = [self.folder / "scripts/release", *words]
        return subprocess.run(command, env=os.environ | names, check=False, capture_output=True, text=True)


@pytest.fixture
def project(tmp_path):
    return Project(tmp_path)


def test_a_release_is_tagged_with_its_changes_after_the_tests(project):
    outcome = project.release(VERSION)
    assert outcome.returncode == 0, outcome.stderr
    assert (project.folder / ".git/calls").read_text() == "tests\n"
    assert project.git("cat-file", "-t", f"v{VERSION}") == "tag\n"
    assert project.git("tag", "--list", "--format=%(contents)") == f"nocdyn {VERSION}\n\n- Gears.\n\n"


def assert_refused(project, reason, version=VERSION):
    outcome = project.release(version)
    assert outcome.returncode == 1
    assert f"scripts/release: {reason}" in outcome.stderr
    return outcome


@pytest.mark.parametrize("version", ["", "v1.2.3", "1.2", "1.2.3-rc1"])
def test_a_wrong_version_is_refused(project, version):
    assert_refused(project, "usage: scripts/release MAJOR.MINOR.PATCH", version)


@pytest.mark.parametrize("name", [name for name in FILES if name != "scripts/test"])
def test_a_file_of_another_version_is_refused(project, name):
    project.write(name, FILES[name].replace(VERSION, "1.2.2"))
    project.commit()
    assert_refused(project, f"{name} does not hold: ")
    assert project.git("tag", "--list") == "" and not (project.folder / ".git/calls").exists()


@pytest.mark.parametrize("name", ["CITATION.cff", "new.txt"])
def test_changes_that_are_not_committed_are_refused(project, name):
    project.write(name, FILES.get(name, "") + "more\n")
    assert_refused(project, "there are changes that are not committed")


def test_a_tag_that_exists_is_refused(project):
    project.git("tag", f"v{VERSION}")
    assert_refused(project, f"the tag v{VERSION} exists")


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("## [Unreleased]\n", "## [Unreleased]\n\n- Shafts.\n", "CHANGELOG.md has changes under [Unreleased]"),
        ("- Gears.\n", "", f"CHANGELOG.md says nothing of {VERSION}"),
    ],
)
def test_an_unfinished_changelog_is_refused(project, old, new, reason):
    project.write("CHANGELOG.md", FILES["CHANGELOG.md"].replace(old, new, 1))
    project.commit()
    assert_refused(project, reason)


def test_failing_tests_are_refused(project):
    project.write("scripts/test", "#!/usr/bin/env bash\nexit 1\n")
    project.commit()
    assert_refused(project, "tests fail")
    assert project.git("tag", "--list") == ""


@pytest.mark.parametrize("name", HELD)
def test_the_sources_are_of_one_version(name):
    version = re.search(r"project\(nocdyn VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())[1]
    assert HELD[name].format(version) in (SOURCE / name).read_text(encoding="utf-8")
