"""Files of a release agree with the package."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

import meltemi

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def yaml(name: str) -> Any:
    return YAML(typ="safe").load((ROOT / name).read_text(encoding="utf-8"))


def versions() -> list[str]:
    first, end = (int(n) for n in re.findall(r"3\.(\d+)", PROJECT["requires-python"]))
    return [f"3.{minor}" for minor in range(first, end)]


def test_citation_and_recipe_are_of_this_version() -> None:
    citation = yaml("CITATION.cff")
    assert citation["version"] == meltemi.__version__ == yaml("conda/recipe.yaml")["context"]["version"]
    assert PROJECT["license"] == yaml("conda/recipe.yaml")["about"]["license"] == f"{citation['license']} AND MIT"
    assert PROJECT["license-files"] == yaml("conda/recipe.yaml")["about"]["license_file"]
    assert citation["keywords"] == PROJECT["keywords"]
    assert f"## {meltemi.__version__}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_recipe_has_the_dependencies_of_the_package() -> None:
    run = yaml("conda/recipe.yaml")["requirements"]["run"]
    listed = {text.replace(" ", "").replace("matplotlib-base", "matplotlib") for text in run}
    assert {f"python>=${{{{python_min}}}},<3.{int(versions()[-1][2:]) + 1}", *PROJECT["dependencies"]} == listed


def test_workflows_have_the_supported_versions_and_systems() -> None:
    matrix = yaml(".github/workflows/test.yml")["jobs"]["test"]["strategy"]["matrix"]
    assert matrix["python"] == versions()
    others = {(row["os"], row["python"]) for row in matrix["include"]}
    ends = (versions()[0], versions()[-1])
    assert others == {(name, end) for name in ("windows-latest", "macos-latest") for end in ends}
    listed = [text.rpartition(" ")[2] for text in PROJECT["classifiers"] if re.search(r":: 3\.\d", text)]
    assert listed == versions()


def test_only_the_last_job_of_a_release_may_publish_and_without_a_secret() -> None:
    text = (ROOT / ".github/workflows/release.yml").read_text(encoding="utf-8")
    jobs = yaml(".github/workflows/release.yml")["jobs"]
    assert "secrets." not in text and jobs["publish"]["permissions"] == {"id-token": "write"}
    assert jobs["publish"]["needs"] == "build" and "permissions" not in jobs["build"]
