"""What bytes the files of a store hold, as zarr writes them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from trivet.design.store.layout import CHUNK, DESIGN, DIGEST, NOT_YET, ROOT, STATUS, Chunk, Layout

WIDTH = 8
"""Bytes of a digest."""


def key_of(array: str, k: int) -> str:
    """The file of a chunk of an array, within the folder."""
    return f"{array}/c/{k}"


def digest_of(layout: Layout, files: Mapping[str, bytes]) -> bytes:
    """What tells whether the files of a chunk are those that were written."""
    digest = hashlib.blake2b(layout.fingerprint.encode(), digest_size=WIDTH)
    for key in sorted(files):
        digest.update(f"\0{key}\0{len(files[key])}\0".encode() + files[key])
    return digest.digest()


class Scratch:
    """A store in memory, which holds no chunk longer than it takes to ask for its bytes."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._files: dict[str, Any] = {}
        self._arrays = _arrays(layout, self._files)
        self.metadata = {key: data.to_bytes() for key, data in sorted(self._files.items(), key=lambda one: one[0] != ROOT)}
        """Files that tell what there is, that of the group first."""

    def encoded(self, k: int, chunk: Chunk) -> dict[str, bytes]:
        """Files of a chunk but for its digest.

        Raises:
            ValueError: for a chunk of another shape or kind than the layout has.
        """
        start, stop = self.layout.designs(k)
        values, status = np.asarray(chunk.columns), np.asarray(chunk.status)
        if values.shape != (len(self.layout.columns), stop - start) or values.dtype != np.float64:
            expected = len(self.layout.columns)
            raise ValueError(f"chunk {k}: columns {values.shape} of {values.dtype}; expected {expected} of float64")
        if status.shape != (stop - start,) or not np.all((status >= 1) & (status <= len(self.layout.statuses))):
            raise ValueError(f"chunk {k}: its statuses are not one of 1 to {len(self.layout.statuses)} for each design")
        for name, column in zip((*self.layout.arrays, STATUS), (*values, status.astype(np.int8)), strict=True):
            self._arrays[name][start:stop] = column
        return {key: self._taken(key) for key in self.keys(k)}

    def keys(self, k: int) -> list[str]:
        """Files of a chunk but for its digest."""
        return [key_of(name, k) for name in (*self.layout.arrays, STATUS)]

    def is_sound(self, k: int, array: str, data: bytes) -> bool:
        """Whether a file of a chunk has its length and its checksum."""
        from zarr.core.buffer import default_buffer_prototype

        start, stop = self.layout.designs(k)
        self._files[key_of(array, k)] = default_buffer_prototype().buffer.from_bytes(data)
        try:
            self._arrays[array][start:stop]
            return True
        except (ValueError, RuntimeError):
            return False
        finally:
            self._taken(key_of(array, k))

    def _taken(self, key: str) -> bytes:
        data: bytes = self._files.pop(key).to_bytes()
        return data


def _arrays(layout: Layout, files: dict[str, Any]) -> dict[str, Any]:
    """The arrays by name, all of which are empty yet, with the group that holds them."""
    import zarr
    from zarr.codecs import Crc32cCodec
    from zarr.storage import MemoryStore

    group = zarr.create_group(MemoryStore(files), zarr_format=3, attributes=layout.document)

    def made(name: str, dtype: str, fill: float, attributes: dict[str, Any], **other: Any) -> Any:
        common: dict[str, Any] = {
            "shape": (layout.count,), "chunks": (layout.chunk,), "dimension_names": (DESIGN,), "filters": None,
            "compressors": (Crc32cCodec(),), "config": {"write_empty_chunks": True},
        }  # fmt: skip
        told = {**attributes, "fingerprint": layout.fingerprint}
        return group.create_array(name, dtype=dtype, fill_value=fill, attributes=told, **(common | other))

    arrays = {}
    for name, column in zip(layout.arrays, layout.columns, strict=True):
        told = {"units": column.unit, "long_name": column.name, "comment": column.meaning}
        arrays[name] = made(name, "float64", float("nan"), told)
    meanings = [NOT_YET, *layout.statuses]
    flags = {"flag_values": list(range(len(meanings))), "flag_meanings": " ".join("_".join(one.split()) for one in meanings)}
    arrays[STATUS] = made(STATUS, "int8", 0, flags)
    # No checksum for a digest: it is one.
    shape: dict[str, Any] = {"shape": (layout.chunks,), "chunks": (1,), "dimension_names": (CHUNK,), "compressors": None}
    arrays[DIGEST] = made(DIGEST, "uint64", 0, {"long_name": "digest of a chunk of designs, there when it is done"}, **shape)
    return arrays
