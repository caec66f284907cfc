"""Stores of results: what others read, what is noticed of damage, and that nothing shows how a store came to be."""

from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
import zarr

from trivet.design.store import Chunk, Column, Layout, Store, open_store, read, writing
from trivet.errors import InputError

LAYOUT = Layout(
    (Column("link.length", "m", "length of the link"), Column("mean 1/C_xx", "N/m", "stiffness"), Column("mass", "kg", "")),
    count=23, chunk=5,
    attributes={"study": "machines\ncount = 23\n", "seed": 3, "variables": json.dumps([{"low": "1 mm", "high": "3 mm"}])},
    statuses=("done", "not reached"),
)  # fmt: skip


def chunk_of(k: int, layout: Layout = LAYOUT) -> Chunk:
    start, stop = layout.designs(k)
    designs = np.arange(start, stop)
    columns = np.stack([designs * (c + 1.5) for c in range(len(layout.columns))])
    columns[-1] = np.nan  # all of it: a chunk of nothing but fill values is written as well
    return Chunk(columns, 1 + designs % 2)


def fill(store: Store) -> None:
    for k in store.undone():
        store.write(k, chunk_of(k, store.layout))


def made(path: Path, layout: Layout = LAYOUT) -> Path:
    with open_store(path, layout) as store:
        fill(store)
    return path


def files(root: Path) -> dict[str, bytes]:
    return {str(path.relative_to(root)): path.read_bytes() for path in sorted(root.rglob("*")) if path.is_file()}


def test_others_read_it_while_it_grows(tmp_path: Path) -> None:
    with open_store(tmp_path / "s", LAYOUT) as store, warnings.catch_warnings():
        warnings.simplefilter("error")
        store.write(4, chunk_of(4))
        store.fail(1, "no reason", 3)
        data = xr.open_zarr(tmp_path / "s", consolidated=False).load()
        results = read(tmp_path / "s")
    assert data.sizes == {"design": 23, "chunk": 5}
    assert sorted(data) == ["digest", "link.length", "mass", "mean 1_C_xx", "status"]
    assert data["mean 1_C_xx"].attrs["long_name"] == "mean 1/C_xx"
    assert data["mean 1_C_xx"].attrs["units"] == "N/m"
    assert data["status"].attrs["flag_meanings"] == "not_yet_worked_out done not_reached"
    assert data["status"].values.tolist() == [0] * 20 + [1, 2, 1]
    assert np.array_equal(data["mean 1_C_xx"].values[20:], 2.5 * np.arange(20, 23))
    assert np.isnan(data["mean 1_C_xx"].values[:20]).all()
    assert data.attrs["study"] == LAYOUT.attributes["study"]
    assert results.done.tolist() == [False] * 4 + [True]
    assert not results.is_complete
    assert results.layout == LAYOUT
    assert np.array_equal(results.column("mean 1/C_xx", 19), data["mean 1_C_xx"].values[19:], equal_nan=True)
    assert results.status(21, 23).tolist() == [2, 1]


def test_the_files_are_those_that_zarr_writes(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    before = files(root)
    group = zarr.open_group(root, mode="r+")
    for name in group.array_keys():
        array: Any = group[name]
        array[:] = array[:]
    same = {name for name, data in files(root).items() if before.get(name) == data}
    assert same >= {name for name in before if not name.startswith("mass/c/")}  # zarr leaves out what is all NaN


def test_nothing_shows_how_it_came_to_be(tmp_path: Path) -> None:
    once = files(made(tmp_path / "once"))
    path = tmp_path / "often"
    for k in (3, 0, 4, 1, 2):
        with open_store(path, LAYOUT) as store:
            store.fail(k, "no reason", 3)
        with open_store(path, LAYOUT) as store:
            assert [failure.chunk for failure in store.failures] == [k]
            assert k in store.undone()
            store.write(k, chunk_of(k))
        (path / "mass" / "c" / f".{k}.0a1b.part").write_bytes(b"half of it")
    made(path)
    assert files(path) == once


class DeathError(BaseException):
    """Nothing is cleared away after it."""


def test_a_death_at_any_step_is_gone_on_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    layout = replace(LAYOUT, count=8)
    whole = files(made(tmp_path / "whole", layout))
    own, step = os.replace, 0
    for death in range(1, 100):
        root, step = tmp_path / str(death), 0

        def dying(source: Path, target: Path, death: int = death) -> None:
            nonlocal step
            step += 1
            if step > death:
                raise DeathError
            if step == death:
                (Path(target).parent / ".half.0a1b.part").write_bytes(b"half of it")
                raise DeathError
            own(source, target)

        with monkeypatch.context() as patch:
            patch.setattr(os, "replace", dying)
            try:
                made(root, layout)
                break
            except DeathError:
                pass
        with open_store(root, layout) as store:
            assert not store.faults()
            fill(store)
        assert files(root) == whole
    assert death > len(layout.columns) * 3


def test_names_become_folders_whatever_they_are() -> None:
    names = ["a/b", "a_b", "a b", "..", "", "__x", "status", "digest", "zeile\n", "zarr.json"]
    names += ["c\\d", ".half.0a1b.part", "ä" * 200]
    arrays = Layout(tuple(Column(name, "", "") for name in names), 1, 1, {}).arrays
    assert arrays[:9] == ("a_b", "a_b_2", "a b", "_", "__2", "_x", "status_2", "digest_2", "zeile_")
    assert arrays[9] == "zarr.json_2"
    assert arrays[10:12] == ("c_d", "_half.0a1b.part")
    assert arrays[12] == "ä" * 100


def damage(path: Path, kind: str) -> None:
    data = bytearray(path.read_bytes())
    if kind == "missing":
        path.unlink()
    elif kind == "cut short":
        path.write_bytes(data[:-1])
    elif kind == "empty":
        path.write_bytes(b"")
    else:
        place = {"first": 0, "middle": len(data) // 2, "last": len(data) - 1}[kind]
        data[place] ^= 1
        path.write_bytes(data)


@pytest.mark.parametrize("kind", ["missing", "cut short", "empty", "first", "middle", "last"])
def test_damage_is_noticed_named_and_repaired_in_every_file(tmp_path: Path, kind: str) -> None:
    root = made(tmp_path / "s")
    whole = files(root)
    for name in whole:
        damage(root / name, kind)
        is_digest, is_metadata = name.startswith("digest/c/"), name.endswith("zarr.json")
        with open_store(root, LAYOUT) as store:
            faults = store.faults()
            if is_digest and kind == "missing":
                assert not faults  # the chunk is not done
            else:
                assert [fault.file for fault in faults] == [name]
                cut = "is cut short" if kind in ("cut short", "empty") else "is altered"
                what = "does not fit" if is_digest else "is missing" if kind == "missing" else cut
                assert faults[0].what.startswith(what)
                designs = LAYOUT.designs(int(name.rpartition("/")[2])) if not is_metadata else (0, 0)
                assert ("designs" in str(faults[0])) == (not is_metadata)
                assert is_metadata or faults[0].designs == (designs[0], designs[1] - 1)
                if "zarr.json" not in name:
                    with pytest.raises(InputError, match=r"designs \d+ to \d+.*run the study again"):
                        read(root)
                elif not kind.startswith("last"):
                    with pytest.raises(InputError, match="run the study again"):
                        read(root)
            store.repair(faults)
            assert len(list(store.undone())) == (0 if is_metadata else 1)
            fill(store)
        assert files(root) == whole


def test_swapped_and_older_files_are_noticed(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    shutil.copy(root / "mass/c/0", root / "mass/c/1")  # the same numbers: the file is the same
    shutil.copy(root / "link.length/c/0", root / "link.length/c/1")
    shutil.copy(root / "digest/c/2", root / "digest/c/3")
    with open_store(root, LAYOUT) as store:
        faults = store.faults()
    assert [fault.file for fault in faults] == ["digest/c/1", "digest/c/3"]
    assert [fault.chunk for fault in faults] == [1, 3]


def test_a_whole_chunk_of_another_place_or_study_is_noticed(tmp_path: Path) -> None:
    root, other = made(tmp_path / "s"), made(tmp_path / "other", replace(LAYOUT, attributes={}))
    for name in (*LAYOUT.arrays, "status", "digest"):
        shutil.copy(root / name / "c" / "0", root / name / "c" / "1")
        shutil.copy(other / name / "c" / "3", root / name / "c" / "3")
    with open_store(root, LAYOUT) as store:
        assert [fault.file for fault in store.faults()] == ["digest/c/1", "digest/c/3"]


def test_a_file_of_numbers_that_reads_as_metadata_is_damaged(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    (root / "mass/c/1").write_bytes(b"{}")
    with pytest.raises(InputError, match="mass/c/1 is cut short, 2 of 44 bytes"):
        read(root)


def test_a_store_that_another_process_makes_meanwhile_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = writing.Lock

    def late(folder: Path, name: Path) -> writing.Lock:
        with monkeypatch.context() as patch:
            patch.setattr(writing, "Lock", own)
            made(name, replace(LAYOUT, chunk=6))
        return own(folder, name)

    monkeypatch.setattr(writing, "Lock", late)
    with pytest.raises(InputError, match="designs_per_chunk is 6 there and 5 here"):
        open_store(tmp_path / "s", LAYOUT)


def test_a_store_of_another_study_is_refused(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    whole = files(root)
    others = [
        (replace(LAYOUT, attributes={**LAYOUT.attributes, "seed": 4}), "seed is 3 there and 4 here"),
        (replace(LAYOUT, attributes={**LAYOUT.attributes, "study": "machines\ncount = 24\n"}),
         'line 2 of study is "count = 23" there and "count = 24" here'),
        (replace(LAYOUT, attributes={"seed": 3}), "study is .* there and nothing here"),
        (replace(LAYOUT, attributes={**LAYOUT.attributes, "variables": json.dumps([{"low": "2 mm", "high": "3 mm"}])}),
         r'variables\.1\.low is "1 mm" there and "2 mm" here'),
        (replace(LAYOUT, chunk=6), "designs_per_chunk is 5 there and 6 here"),
        (replace(LAYOUT, columns=LAYOUT.columns[:2]), "the number of columns is 3 there and 2 here"),
        (replace(LAYOUT, columns=(*LAYOUT.columns[:2], Column("mass", "g", ""))), r'columns.3.units is "kg" there and "g"'),
        (replace(LAYOUT, statuses=("done",)), "the number of statuses is 2 there and 1 here"),
        (replace(LAYOUT, version="9.9"), f"was made by trivet {LAYOUT.version}, and this is 9.9"),
    ]  # fmt: skip
    for layout, message in others:
        with pytest.raises(InputError, match=message):
            open_store(root, layout)
    assert files(root) == whole


def test_a_store_of_another_format_is_refused(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    text = (root / "zarr.json").read_text().replace("trivet study 1", "trivet study 2")
    (root / "zarr.json").write_text(text)
    for refused in (lambda: open_store(root, LAYOUT), lambda: read(root)):
        with pytest.raises(InputError, match="format \"trivet study 2\"; this version of trivet knows 'trivet study 1'"):
            refused()


def test_a_damaged_store_of_another_study_is_refused(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    (root / "zarr.json").write_bytes(b"{")
    with pytest.raises(InputError, match="is not the store of a study"):
        open_store(root, replace(LAYOUT, chunk=6))


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "file").write_text("mine")
    zarr.create_group(tmp_path / "group")
    before = files(tmp_path)
    for name, message in {"file": "is a file", "folder": "is not the store", "group": "is not the store"}.items():
        with pytest.raises(InputError, match=message):
            open_store(tmp_path / name, LAYOUT)
        with pytest.raises(InputError, match=r"is not the store|is no folder"):
            read(tmp_path / name)
    with pytest.raises(InputError, match="cannot be made: No such file"):
        open_store(tmp_path / "not" / "there", LAYOUT)
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(InputError, match="link: is a link to where nothing is"):
        open_store(tmp_path / "link", LAYOUT)
    assert files(tmp_path) == before


def test_a_store_whose_making_was_interrupted_is_made(tmp_path: Path) -> None:
    whole = files(made(tmp_path / "whole"))
    root = tmp_path / "s"
    (root / "status").mkdir(parents=True)
    (root / "status" / ".lock").write_text("process 1 on elsewhere")
    (root / ".zarr.json.0a1b.part").write_bytes(b"{")
    assert files(made(root)) == whole
    for name in ("mass/zarr.json", "digest/zarr.json"):
        shutil.rmtree(root)
        open_store(root, LAYOUT).close()
        (root / name).unlink()
        with open_store(root, LAYOUT) as store:
            assert not store.faults()
        assert files(made(root)) == whole


HOLD = "import sys; from trivet.design.store.disk import Lock; from pathlib import Path; p = Path(sys.argv[1]); "
HOLD += "lock = Lock(p, p); print('held', flush=True); sys.stdin.read()"


def test_one_process_at_a_time_and_a_dead_one_lets_go(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(root / "status")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(InputError, match=f"is being worked at by process {other.pid} on .*; wait for it or end it"):
            open_store(root, LAYOUT)
        assert read(root).is_complete
        other.kill()
    with open_store(root, LAYOUT), pytest.raises(InputError, match=f"process {os.getpid()} on"):
        open_store(root, LAYOUT)
    assert not (root / "status" / ".lock").exists()


def test_a_full_disk_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = files(made(tmp_path / "whole"))
    layout = LAYOUT
    with open_store(tmp_path / "s", layout) as store:
        store.write(0, chunk_of(0))
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20, limit[1]))
        try:
            with pytest.raises(InputError, match=r"link\.length/c/1: cannot be written: File too large"):
                store.write(1, chunk_of(1))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        assert list(store.undone()) == [1, 2, 3, 4]
        calls = iter([None] * 2 * len(layout.columns))

        def full(descriptor: int) -> None:
            if next(calls, 0) is not None:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(InputError, match="cannot be written: No space left on device"):
                fill(store)
    with open_store(tmp_path / "s", layout) as store:
        assert not store.faults()
        assert 0 < len(list(store.undone())) < 5
    assert files(made(tmp_path / "s")) == whole


def test_no_digest_is_written_before_its_chunk_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []

    def noted(name: str, path_of: Callable[[Any], str]) -> None:
        own: Any = getattr(os, name)

        def called(*arguments: Any) -> Any:
            told.append(f"{name} {path_of(arguments[-1])}")
            return own(*arguments)

        monkeypatch.setattr(os, name, called)

    with open_store(tmp_path / "s", LAYOUT) as store:
        noted("replace", os.fspath)
        noted("fsync", lambda descriptor: os.readlink(f"/proc/self/fd/{descriptor}"))
        store.write(0, chunk_of(0))
    named = [line.replace(str(tmp_path / "s") + "/", "") for line in told]
    digest = named.index("replace digest/c/0")
    for folder in (*LAYOUT.arrays, "status"):
        renamed = named.index(f"replace {folder}/c/0")
        assert [line.startswith(f"fsync {folder}/c/.0.") for line in named[:renamed]].count(True) == 1
        assert renamed < named.index(f"fsync {folder}/c") < digest
    assert named[digest - 1].startswith("fsync digest/c/.0.")
    assert named[digest + 1 :] == ["fsync digest/c"]


def test_more_than_the_disk_holds_is_refused_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_store(tmp_path / "s", LAYOUT) as store:
        store.write(0, chunk_of(0))
        store.write(1, chunk_of(1))
    taken = 3 * (5 * (3 * 8 + 1) + 8)  # of three chunks that are still to come: columns, statuses and a digest
    for free in (taken - 1, taken):
        monkeypatch.setattr(shutil, "disk_usage", lambda _, free=free: SimpleNamespace(free=free))
        if free < taken:
            with pytest.raises(InputError, match="MB, the disk has room for"):
                open_store(tmp_path / "s", LAYOUT)
        else:
            open_store(tmp_path / "s", LAYOUT).close()


def test_failures_are_told_and_survive_damage(tmp_path: Path) -> None:
    with open_store(tmp_path / "s", LAYOUT) as store:
        store.fail(4, "ValueError: \u00e4\n", 3)
        store.fail(1, "no reason", 3)
    with open_store(tmp_path / "s", LAYOUT) as store:
        store.fail(4, "other reason", 3)
        assert [str(failure) for failure in store.failures] == [
            "designs 5 to 9: no reason (attempts: 3)", "designs 20 to 22: other reason (attempts: 6)",
        ]  # fmt: skip
    for damaged in ("[[1", '[[5, [25, 29], 3, "no such chunk"]]', '[[-1, [0, 4], 3, "no such chunk"]]'):
        (tmp_path / "s" / "status" / "failures.json").write_text(damaged)
        with open_store(tmp_path / "s", LAYOUT) as store:
            assert [str(fault) for fault in store.faults()] == ["status/failures.json is altered"]
            store.repair(store.faults())
            assert not store.faults()


@pytest.mark.parametrize("name", ["mass/c/1", "digest/c/1", "status/failures.json"])
def test_what_is_in_the_place_of_a_file_is_named(tmp_path: Path, name: str) -> None:
    root = made(tmp_path / "s")
    whole = files(root)
    for make, remove in ((os.mkfifo, os.unlink), (os.mkdir, os.rmdir)):
        (root / name).unlink(missing_ok=True)
        make(root / name)
        with (
            pytest.raises(InputError, match=f"{name}: is in the place of a file; remove it"),
            open_store(root, LAYOUT) as store,
        ):
            store.faults()
        remove(root / name)
        with open_store(root, LAYOUT) as store:
            store.repair(store.faults())
            fill(store)
        assert files(root) == whole


def test_a_failure_of_a_chunk_that_is_done_is_forgotten(tmp_path: Path) -> None:
    root = made(tmp_path / "s")
    whole = files(root)
    (root / "status" / "failures.json").write_text(json.dumps([[2, [10, 14], 3, "no reason"]]))
    open_store(root, LAYOUT).close()
    assert files(root) == whole


@pytest.mark.parametrize(
    "chunk",
    [
        Chunk(np.zeros((3, 4)), np.ones(5)), Chunk(np.zeros((2, 5)), np.ones(5)), Chunk(np.zeros((3, 5)), np.ones(4)),
        Chunk(np.zeros((3, 5)), np.zeros(5)), Chunk(np.zeros((3, 5)), np.full(5, 3)),
        Chunk(np.zeros((3, 5), np.float32), np.ones(5)),
    ],
)  # fmt: skip
def test_a_chunk_of_another_shape_is_a_mistake(tmp_path: Path, chunk: Chunk) -> None:
    with open_store(tmp_path / "s", LAYOUT) as store, pytest.raises(ValueError, match="chunk 0"):
        store.write(0, chunk)
