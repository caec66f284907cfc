"""The machine description: what a machine is made of, and its files.  Units pass this door and no other."""

from trivet.model.machine import Chain, Leg, Machine, Mechanism
from trivet.model.paths import dimensions
from trivet.model.reading import catalogue, load, parse
from trivet.model.schema import schema
from trivet.model.writing import document_of, fingerprint, printed, to_text, write

__all__ = [
    "Chain", "Leg", "Machine", "Mechanism", "catalogue", "dimensions", "document_of", "fingerprint", "load", "parse", "printed",
    "schema", "to_text", "write",
]  # fmt: skip
