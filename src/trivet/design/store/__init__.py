"""Results of a study in a folder that grows chunk by chunk, a zarr group that others read meanwhile.

Every file is written whole, under another name first.  A chunk counts as done when its digest is there and true; it is written
after all else of the chunk has reached the disk.  Nothing in the folder tells when or how often it was worked at.
"""

from trivet.design.store.faults import Fault
from trivet.design.store.kept_failures import Failure
from trivet.design.store.layout import Chunk, Column, Layout
from trivet.design.store.reading import Results, read
from trivet.design.store.writing import Store, open_store

__all__ = ["Chunk", "Column", "Failure", "Fault", "Layout", "Results", "Store", "open_store", "read"]
