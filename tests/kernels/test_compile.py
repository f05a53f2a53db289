"""The cache of compiled kernels: kept, renewed with the sources, and never in the way."""

import subprocess
import sys
from pathlib import Path

import pytest

import realitygap.kernels
from realitygap.kernels import _compile

CODE = """
from realitygap.kernels import _math
print(_math.tanh(0.5))
print(_math.tanh.stats.cache_hits.total(), _math.tanh.stats.cache_misses.total())
"""


def start(cache: Path | str, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", CODE],
        capture_output=True,
        text=True,
        env={"PATH": "/usr/bin:/bin", "REALITYGAP_CACHE": str(cache), **environment},
        check=True,
    )


def value_and_cache(done: subprocess.CompletedProcess) -> tuple[float, tuple[int, ...]]:
    first, second = done.stdout.splitlines()
    return float(first), tuple(int(word) for word in second.split())


def test_the_second_start_loads_what_the_first_compiled(tmp_path):
    first = value_and_cache(start(tmp_path))
    assert first == (first[0], (0, 1))
    assert value_and_cache(start(tmp_path)) == (first[0], (1, 0))


def test_torn_files_mean_compiling_again(tmp_path):
    value, _ = value_and_cache(start(tmp_path))
    files = [path for path in tmp_path.rglob("*.nb?") if path.is_file()]
    assert files
    for kept in (0, 1, 40):
        for path in files:
            path.write_bytes(path.read_bytes()[:kept])
        done = start(tmp_path)
        assert value_and_cache(done) == (value, (0, 1))
        assert "Traceback" not in done.stderr


def test_a_folder_that_cannot_be_written_is_said_and_passed_over():
    done = start("/dev/null/cache")
    assert value_and_cache(done)[1] == (0, 1)
    assert done.stderr.count("cannot be kept in /dev/null/cache") == 1


@pytest.mark.parametrize("folder", ["", "caches", "./caches"])
def test_a_relative_folder_for_caches_is_none(folder, monkeypatch):
    # an empty one put the kernels into whatever folder a command was run in
    monkeypatch.setattr(_compile.sys, "platform", "linux")
    monkeypatch.delenv("REALITYGAP_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", folder)
    assert _compile.cache_root() == Path.home() / ".cache" / "realitygap"


def test_another_source_means_another_folder(tmp_path):
    start(tmp_path)
    (folder,) = tmp_path.iterdir()
    copy = tmp_path / "copy" / "realitygap"
    original = Path(realitygap.kernels.__file__).parent.parent
    for path in original.rglob("*.py"):
        target = copy / path.relative_to(original)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(path.read_bytes())
    changed = copy / "kernels" / "_coverage.py"
    changed.write_text(changed.read_text() + "\n# another comment\n")
    start(tmp_path / "cache2", PYTHONPATH=str(copy.parent))
    (other,) = (tmp_path / "cache2").iterdir()
    assert folder.name != other.name
