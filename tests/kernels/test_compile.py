"""The cache of compiled kernels: kept, renewed with the sources, and never in the way."""

import subprocess
import sys
from pathlib import Path

import numba
import pytest

import realitygap.kernels
from realitygap.kernels import _cache, _compile, _compiling, _math

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
    (tmp_path / "kernels").symlink_to(tmp_path / "elsewhere")
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


def copy_of_package(folder: Path) -> Path:
    """A copy of the sources of the package, to be changed."""
    copy = folder / "realitygap"
    original = Path(realitygap.kernels.__file__).parent.parent
    for path in original.rglob("*.py"):
        target = copy / path.relative_to(original)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(path.read_bytes())
    return copy


@pytest.mark.slow
def test_an_edit_compiles_the_kernels_that_import_it_and_no_others(tmp_path):
    copy = copy_of_package(tmp_path / "copy")
    start(tmp_path / "cache", PYTHONPATH=str(copy.parent))
    for module, counts in [
        ("_coverage", (1, 0)),
        ("_math", (0, 1)),
        ("_compile", (0, 1)),
        ("_lower", (0, 1)),
    ]:
        changed = copy / "kernels" / f"{module}.py"
        changed.write_text(changed.read_text() + "\n# another comment\n")
        done = start(tmp_path / "cache", PYTHONPATH=str(copy.parent))
        assert value_and_cache(done)[1] == counts, module


def test_the_hash_of_a_module_covers_what_its_imports_import():
    folder = Path(_cache.__file__).parent
    assert "_walls" not in (folder / "_run.py").read_text()
    seen = []
    original = _cache._imported
    try:
        _cache._imported = lambda module: (seen.append(module), original(module))[1]
        _cache.sources_hash.__wrapped__("realitygap.kernels._run")
    finally:
        _cache._imported = original
    assert {"_run", "_trial", "_walls", "_species", "_compile", "_pipeline", "_lower"} <= set(seen)
    assert not any(module.startswith("_sim") for module in seen)


# without the faster way through Numba

CODE_OF_BOTH = """
import warnings
import numpy as np
from realitygap.kernels import _compile, _distances, _math, _pipeline
if {broken}:
    def refuse(*_):
        raise AttributeError("another Numba")
    _pipeline._Entry.define_pipelines = refuse
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    measure = _distances.make_measure(0, 4, 3, True)
    behaviors = _distances.make_behaviors(2, 12)
    for row, cells in enumerate(([0, 5, 7], [1, 5])):
        _distances.describe(measure, np.array(cells, np.uint8), len(cells), 0.5, 0.25, behaviors, row)
    between = np.zeros((2, 2))
    _distances.distances_between(measure, behaviors, behaviors, between)
print([float(_math.tanh(x)).hex() for x in (-3.0, 0.1, 0.7)], between.tolist())
print(_compile._is_plain, [str(item.message)[:60] for item in caught])
"""


def results(cache: Path, *, broken: bool = False, **environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", CODE_OF_BOTH.replace("{broken}", str(broken))],
        capture_output=True,
        text=True,
        env={"PATH": "/usr/bin:/bin", "REALITYGAP_CACHE": str(cache), **environment},
        check=True,
    )
    return done.stdout.splitlines()


@pytest.mark.slow
def test_numbas_own_pipeline_gives_the_same_results(tmp_path):
    fast = results(tmp_path)
    assert fast[1] == "False []"
    for _ in range(2):  # compiled, and loaded
        plain = results(tmp_path, **{_compile.PLAIN: "1"})
        assert plain == [fast[0], "True []"]


@pytest.mark.slow
def test_a_numba_of_another_make_compiles_in_its_own_way_after_one_warning(tmp_path):
    expected = results(tmp_path)[0]
    got, state = results(tmp_path / "other", broken=True)
    assert got == expected
    assert state.startswith("True ['Numba ")
    assert state.count("compiles in another way") == 1


def test_a_wrong_argument_is_an_error_and_changes_nothing():
    with pytest.raises(numba.errors.NumbaError):
        _math.tanh("0.5")
    assert not _compile._is_plain
    assert _math.tanh(0.5) == pytest.approx(0.46211715726)


# what is reported


def test_a_long_compilation_is_reported_with_its_time(monkeypatch):
    lines = []
    monkeypatch.setattr(_compiling, "_listener", lines.append)
    monkeypatch.setattr(_compiling, "LONG_S", 0.0)
    _compiling.begin_compiling("run")
    _compiling._started["run"][0].join()
    _compiling.end_compiling("run")
    assert lines == ["Compiling the kernel run (once per version) ...", "Compiled run in 0 s."]


def test_a_short_compilation_is_not_reported(monkeypatch):
    lines = []
    monkeypatch.setattr(_compiling, "_listener", lines.append)
    monkeypatch.setattr(_compiling, "LONG_S", 60.0)
    _compiling.begin_compiling("run")
    _compiling.end_compiling("run")
    assert lines == []
