"""The cache of compiled kernels: kept, renewed with the sources, and never in the way."""

import subprocess
import sys
from pathlib import Path

import pytest

import realitygap.kernels
from realitygap.kernels import _cache

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


@pytest.mark.slow
def test_the_second_start_loads_what_the_first_compiled(tmp_path):
    first = value_and_cache(start(tmp_path))
    assert first == (first[0], (0, 1))
    assert value_and_cache(start(tmp_path)) == (first[0], (1, 0))


def damage(content: bytes) -> list[bytes]:
    flipped = [bytearray(content) for _ in range(6)]
    for k, bits in enumerate(flipped):  # in the seal, at both ends of the machine code, and between
        bits[k * (len(bits) - 1) // 5] ^= 1 << k
    return [content[:kept] for kept in (0, 1, 40, len(content) // 2)] + [bytes(bits) for bits in flipped]


def test_damage_anywhere_in_a_file_is_noticed(tmp_path):
    path = tmp_path / "a.kernel"
    _cache.write_sealed(path, list(range(1000)))
    whole = path.read_bytes()
    for damaged in damage(whole):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="is damaged"):
            _cache.read_sealed(path)
    path.write_bytes(whole)
    assert _cache.read_sealed(path) == list(range(1000))


@pytest.mark.slow
def test_a_damaged_file_is_compiled_again_and_replaced(tmp_path):
    value, _ = value_and_cache(start(tmp_path))
    (path,) = tmp_path.rglob("*.kernel")
    path.write_bytes(damage(path.read_bytes())[-2])
    done = start(tmp_path)
    assert value_and_cache(done) == (value, (0, 1))
    assert "Traceback" not in done.stderr
    assert value_and_cache(start(tmp_path)) == (value, (1, 0))


def test_the_cache_folder_is_private_even_if_it_was_open(tmp_path):
    folder = _cache.private_folder(tmp_path / "root")
    assert folder.stat().st_mode & 0o777 == (tmp_path / "root").stat().st_mode & 0o777 == 0o700
    folder.chmod(0o777)
    assert _cache.private_folder(tmp_path / "root").stat().st_mode & 0o777 == 0o700


def test_a_folder_of_another_user_is_refused(tmp_path, monkeypatch):
    _cache.private_folder(tmp_path)
    monkeypatch.setattr(_cache.os, "getuid", lambda: 54321)
    with pytest.raises(PermissionError, match="another user owns it"):
        _cache.private_folder(tmp_path)


def test_a_link_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / f"kernels-{_cache.sources_hash()}").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OSError, match=r"symbolic links|Not a directory"):
        _cache.private_folder(tmp_path)


def test_a_root_that_every_user_can_write_to_is_refused_unless_it_is_sticky(tmp_path):
    tmp_path.chmod(0o777)
    with pytest.raises(PermissionError, match="every user can write"):
        _cache.private_folder(tmp_path)
    tmp_path.chmod(0o1777)
    assert _cache.private_folder(tmp_path).is_dir()


def test_a_folder_that_cannot_be_written_is_said_and_passed_over():
    done = start("/dev/null/cache")
    assert value_and_cache(done)[1] == (0, 1)
    assert done.stderr.count("cannot be saved in /dev/null/cache") == 1


@pytest.mark.parametrize("folder", ["", "caches", "./caches"])
def test_a_relative_folder_for_caches_is_none(folder, monkeypatch):
    # an empty one put the kernels into whatever folder a command was run in
    monkeypatch.setattr(_cache.sys, "platform", "linux")
    monkeypatch.delenv("REALITYGAP_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", folder)
    assert _cache.cache_root() == Path.home() / ".cache" / "realitygap"


@pytest.mark.slow
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
