"""The cache of compiled kernels: kept, renewed with the sources, and never in the way."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

import realitygap.kernels
from realitygap.kernels.compile import cache as kernel_cache
from realitygap.kernels.compile import decorators, progress
from realitygap.kernels.math import elementary

CODE = """
from realitygap.kernels.math import elementary
print(elementary.tanh(0.5))
print(elementary.tanh.stats.cache_hits.total(), elementary.tanh.stats.cache_misses.total())
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
    kernel_cache.write_sealed(path, list(range(1000)))
    whole = path.read_bytes()
    for damaged in damage(whole):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="is damaged"):
            kernel_cache.read_sealed(path)
    path.write_bytes(whole)
    assert kernel_cache.read_sealed(path) == list(range(1000))


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
    folder = kernel_cache.private_folder(tmp_path / "root")
    assert folder.stat().st_mode & 0o777 == (tmp_path / "root").stat().st_mode & 0o777 == 0o700
    folder.chmod(0o777)
    assert kernel_cache.private_folder(tmp_path / "root").stat().st_mode & 0o777 == 0o700


def test_a_folder_of_another_user_is_refused(tmp_path, monkeypatch):
    kernel_cache.private_folder(tmp_path)
    monkeypatch.setattr(kernel_cache.os, "getuid", lambda: 54321)
    with pytest.raises(PermissionError, match="another user owns it"):
        kernel_cache.private_folder(tmp_path)


def test_a_link_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "kernels").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OSError, match=r"symbolic links|Not a directory"):
        kernel_cache.private_folder(tmp_path)


def test_a_root_that_every_user_can_write_to_is_refused_unless_it_is_sticky(tmp_path):
    tmp_path.chmod(0o777)
    with pytest.raises(PermissionError, match="every user can write"):
        kernel_cache.private_folder(tmp_path)
    tmp_path.chmod(0o1777)
    assert kernel_cache.private_folder(tmp_path).is_dir()


def test_a_folder_that_cannot_be_written_is_said_and_passed_over():
    done = start("/dev/null/cache")
    assert value_and_cache(done)[1] == (0, 1)
    assert done.stderr.count("cannot be saved in /dev/null/cache") == 1


@pytest.mark.parametrize("folder", ["", "caches", "./caches"])
def test_a_relative_folder_for_caches_is_none(folder, monkeypatch):
    # an empty one put the kernels into whatever folder a command was run in
    monkeypatch.setattr(kernel_cache.sys, "platform", "linux")
    monkeypatch.delenv("REALITYGAP_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", folder)
    assert kernel_cache.cache_root() == Path.home() / ".cache" / "realitygap"


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
        ("tasks/coverage", (1, 0)),
        ("math/elementary", (0, 1)),
        ("compile/decorators", (0, 1)),
        ("compile/lower", (0, 1)),
    ]:
        changed = copy / "kernels" / f"{module}.py"
        changed.write_text(changed.read_text() + "\n# another comment\n")
        done = start(tmp_path / "cache", PYTHONPATH=str(copy.parent))
        assert value_and_cache(done)[1] == counts, module


def modules_of_hash(module: str) -> set[str]:
    """Return the modules whose sources are part of the hash of a module."""
    seen = []
    original = kernel_cache._imported
    try:
        kernel_cache._imported = lambda module, source: (seen.append(module), original(module, source))[1]
        kernel_cache.sources_hash.__wrapped__(module)
    finally:
        kernel_cache._imported = original
    return set(seen)


def test_the_hash_of_a_module_covers_what_its_imports_import():
    folder = Path(realitygap.kernels.__file__).parent
    assert "walls" not in (folder / "jyro" / "run.py").read_text()
    covered = modules_of_hash("realitygap.kernels.jyro.run")
    assert {"jyro.run", "jyro.trial", "jyro.walls", "neat.species", "math.bits"} <= covered
    assert {"compile.decorators", "compile.cache", "compile.pipeline", "compile.lower"} <= covered
    assert not any(module.startswith("sim.") for module in covered)


def test_the_hash_of_a_kernel_elsewhere_covers_each_file_of_kernels():
    folder = Path(realitygap.kernels.__file__).parent
    files = {".".join(path.relative_to(folder).with_suffix("").parts) for path in folder.rglob("*.py")}
    assert "sim.words" in files
    assert modules_of_hash("tests.kernels.elsewhere") == files


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("from .walls import f", "jyro.walls"),
        ("from . import walls", "jyro.walls"),
        ("from ..math import bits", "math.bits"),
        ("from ..math.bits import f", "math.bits"),
        ("from ..math import f", "math.__init__"),
        ("from realitygap.kernels.math.bits import f", "math.bits"),
        ("from realitygap.kernels.math import bits", "math.bits"),
        ("import realitygap.kernels.math.bits as bits", "math.bits"),
    ],
)
def test_an_edit_in_a_folder_changes_the_hash_of_who_imports_it(tmp_path, monkeypatch, line, name):
    for folder in ("compile", "jyro", "math"):
        (tmp_path / folder).mkdir()
    for path in (
        "compile/cache",
        "compile/decorators",
        "jyro/walls",
        "math/bits",
        "math/other",
        "math/__init__",
    ):
        (tmp_path / f"{path}.py").write_text("")
    (tmp_path / "jyro" / "trial.py").write_text(f"def late():\n    {line}\n")
    monkeypatch.setattr(kernel_cache, "_FOLDER", tmp_path)

    def hash_now():
        return kernel_cache.sources_hash.__wrapped__("realitygap.kernels.jyro.trial")

    before = hash_now()
    (tmp_path / "math" / "other.py").write_text("# an edit\n")
    assert hash_now() == before
    (tmp_path / f"{name.replace('.', '/')}.py").write_text("# an edit\n")
    assert hash_now() != before


# without the faster way through Numba

CODE_OF_BOTH = """
import warnings
import numba
import numpy as np
numba.__version__ = {version} or numba.__version__
from realitygap.kernels.compile import decorators, pipeline
from realitygap.kernels.math import elementary
from realitygap.kernels.neat import distances
if {broken}:
    def refuse(*_):
        raise AttributeError("another Numba")
    pipeline._Entry.define_pipelines = refuse
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    measure = distances.make_measure(0, 4, 3, True)
    behaviors = distances.make_behaviors(2, 12)
    for row, cells in enumerate(([0, 5, 7], [1, 5])):
        distances.describe(measure, np.array(cells, np.uint8), len(cells), 0.5, 0.25, behaviors, row)
    between = np.zeros((2, 2))
    distances.distances_between(measure, behaviors, behaviors, between)
print([float(elementary.tanh(x)).hex() for x in (-3.0, 0.1, 0.7)], between.tolist())
print(decorators._is_plain, [str(item.message)[:60] for item in caught])
"""


def run_both(cache: Path, *, broken: bool, version: str, **environment: str) -> subprocess.CompletedProcess:
    code = CODE_OF_BOTH.replace("{broken}", str(broken)).replace("{version}", repr(version))
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={"PATH": "/usr/bin:/bin", "REALITYGAP_CACHE": str(cache), **environment},
        check=False,
    )


def results(cache: Path, *, broken: bool = False, version: str = "", **environment: str) -> list[str]:
    done = run_both(cache, broken=broken, version=version, **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_numbas_own_pipeline_gives_the_same_results(tmp_path):
    fast = results(tmp_path)
    assert fast[1] == "False []"
    for _ in range(2):  # compiled, and loaded
        plain = results(tmp_path, **{decorators.PLAIN: "1"})
        assert plain == [fast[0], "True []"]


@pytest.mark.slow
def test_a_numba_of_another_make_compiles_in_its_own_way_after_one_warning(tmp_path):
    expected = results(tmp_path)[0]
    got, state = results(tmp_path / "other", broken=True, version="0.99.0")
    assert got == expected
    assert state.startswith("True ['Numba ")
    assert state.count("compiles in another way") == 1


@pytest.mark.slow
def test_a_fault_of_our_pipeline_is_raised_with_a_known_numba(tmp_path):
    done = run_both(tmp_path, broken=True, version="")
    assert done.returncode == 1
    assert "AttributeError: another Numba" in done.stderr
    assert "REALITYGAP_PLAIN_NUMBA=1" in done.stderr


def test_the_warning_names_what_was_raised(monkeypatch):
    monkeypatch.setattr(numba, "__version__", "0.99.0")
    monkeypatch.setattr(decorators, "_is_plain", False)
    monkeypatch.setattr(elementary.tanh, "_plain_entry", lambda x: x)
    with pytest.warns(RuntimeWarning, match=r"Numba 0.99.0 .* \(KeyError: 'a part'\)"):
        assert elementary.tanh._call_plainly((0.5,), KeyError("a part")) == 0.5


# kernels that others call

CODE_OF_SHARED = """
import numpy as np
from realitygap.kernels.neat import genome
from tests.kernels.genome_arrays import rules_of, settings
from tests.reference.neat import Neat
rules = rules_of(Neat(settings(), 4, 2, 3))
genomes = genome.make_genomes(5, 2, 29, 3)
genome.first_genomes(genomes, rules, np.uint64(7), np.int64(0), np.int64(0))
print(genomes.weight.sum().hex())
print(genome.first_genomes.stats.cache_hits.total(), genome.first_genomes.stats.cache_misses.total())
"""


def start_shared(cache: Path) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", CODE_OF_SHARED],
        capture_output=True,
        text=True,
        env={"PATH": "/usr/bin:/bin", "REALITYGAP_CACHE": str(cache)},
        cwd=Path(__file__).parents[2],
        check=True,
    )
    return done.stdout.splitlines()


@pytest.mark.slow
def test_a_shared_kernel_is_a_file_of_its_own_that_its_callers_need(tmp_path):
    value, counts = start_shared(tmp_path)
    assert counts == "0 1"
    caller, callee = sorted(
        tmp_path.rglob("*first_genomes*.kernel"), key=lambda path: path.stat().st_mtime_ns
    )[::-1]
    assert kernel_cache.read_sealed(caller)[2] == [kernel_cache.SHARED + callee.stem]
    assert start_shared(tmp_path) == [value, "1 0"]
    callee.unlink()  # compiled again, and its caller with it
    assert start_shared(tmp_path) == [value, "0 1"]
    assert start_shared(tmp_path) == [value, "1 0"]


# what is kept


def test_files_that_no_process_has_read_for_long_are_deleted(tmp_path):
    old, recent, unfinished = (tmp_path / name for name in ("a.kernel", "b.kernel", ".writing-c"))
    for path in (old, recent, unfinished):
        kernel_cache.write_sealed(path, 1)
    for path, age in ((old, 1.1), (recent, 0.5), (unfinished, 1.1)):
        when = time.time() - age * kernel_cache.UNUSED_S
        os.utime(path, (when, when))
    assert kernel_cache.read_sealed(recent) == 1
    assert recent.stat().st_mtime > time.time() - 60
    kernel_cache.write_sealed(tmp_path / "d.kernel", 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b.kernel", "d.kernel"]


def test_a_wrong_argument_is_an_error_and_changes_nothing():
    with pytest.raises(numba.errors.NumbaError):
        elementary.tanh("0.5")
    assert not decorators._is_plain
    assert elementary.tanh(0.5) == pytest.approx(0.46211715726)


# what is reported


def test_a_long_compilation_is_reported_with_its_time(monkeypatch):
    lines = []
    monkeypatch.setattr(progress, "_listener", lines.append)
    monkeypatch.setattr(progress, "LONG_S", 0.0)
    progress.begin_compiling("run")
    progress._started["run"][0].join()
    progress.end_compiling("run")
    assert lines == ["Compiling the kernel run (once per version) ...", "Compiled run in 0 s."]


def test_a_short_compilation_is_not_reported(monkeypatch):
    lines = []
    monkeypatch.setattr(progress, "_listener", lines.append)
    monkeypatch.setattr(progress, "LONG_S", 60.0)
    progress.begin_compiling("run")
    progress.end_compiling("run")
    assert lines == []
