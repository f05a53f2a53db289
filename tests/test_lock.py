"""requirements.lock has a version of each package that pyproject.toml names, within its bounds, with hashes."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parent.parent


def needed(extra: str | None = None) -> Iterator[Requirement]:
    """Yield the requirements of the package, or of an extra and the extras that it names."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for text in project["optional-dependencies"][extra] if extra else project["dependencies"]:
        requirement = Requirement(text)
        if requirement.name == project["name"]:
            for other in requirement.extras:
                yield from needed(other)
        else:
            yield requirement


def test_lock_satisfies_the_project():
    """A newer version on the registry is no mistake; `.ci/lock --compare` lists those."""
    text = (ROOT / "requirements.lock").read_text().replace("\\\n", "")
    entries = re.findall(r"^([\w.-]+)==([^\s;]+)(.*)$", text, re.MULTILINE)
    versions: dict[str, list[str]] = {}
    for name, version, rest in entries:
        assert "--hash=sha256:" in rest, f"{name} has no hash. Run .ci/lock."
        versions.setdefault(name, []).append(version)
    for requirement in [*needed(), *needed("dev")]:
        name = requirement.name.lower().replace("_", "-")
        assert name in versions, f"{name} is missing. Run .ci/lock."
        for version in versions[name]:
            assert requirement.specifier.contains(version), (
                f"{name} {version} is not {requirement}. Run .ci/lock."
            )
