"""Entities of one DXF layer, in the drawing and in its block references (extra ``cad``)."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

# Largest depth of nested block references.
NESTED = 32
# Largest number of entities of a layer, block references resolved. A short file can contain
# billions of entities by nested block arrays.
MAXIMUM_ENTITIES = 200_000


class TooManyError(ValueError):
    """More than :data:`MAXIMUM_ENTITIES` on a layer."""


def layer_of(entity: Any, inherited: str = "0") -> str:
    """Returns the layer of an entity in lower case; layer 0 is that of the block reference."""
    layer = str(entity.dxf.get("layer", "0")).lower()
    return inherited if layer == "0" else layer


class Layer:
    """Entities of one layer, at their positions in the drawing.

    Parameters
    ----------
    name
        The layer. DXF compares names of layers without regard to case.
    whole
        Types of block content. A block reference on the layer is yielded itself if its block
        contains no such entity that is explicitly on the layer. Empty: all block references are
        resolved.

    Attributes
    ----------
    skipped
        Number of entities that were not imported, by type and reason.
    """

    def __init__(self, name: str, whole: tuple[str, ...] = ()) -> None:
        self.name = name.lower()
        self.skipped: Counter[str] = Counter()
        self._whole = whole
        self._concerned: dict[str, bool] = {}
        self._count = 0

    def skip(self, entity: Any, reason: str = "") -> None:
        """Counts an entity that is not imported."""
        kind = entity if isinstance(entity, str) else entity.dxftype()
        self.skipped[f"{kind} ({reason})" if reason else kind] += 1

    def entities(
        self, content: Iterable[Any], inherited: str = "0", depth: int = 0
    ) -> Iterator[Any]:
        """Yields the entities of the layer from a layout or a resolved block reference.

        Raises
        ------
        TooManyError
            For more than :data:`MAXIMUM_ENTITIES`.
        """
        for entity in content:
            own = layer_of(entity, inherited)
            if entity.dxftype() != "INSERT":
                if own == self.name:
                    yield self._counted(entity)
            elif self._whole and own == self.name and not self._holds(entity):
                for reference in self._references(entity):
                    yield self._counted(reference)
            elif own == self.name or self._concerns(entity.dxf.name, entity.doc):
                for reference in self._references(entity):
                    yield from self._resolved(reference, own, depth)

    def _resolved(self, insert: Any, own: str, depth: int) -> Iterator[Any]:
        from ezdxf.lldxf.const import DXFError

        if depth >= NESTED:
            self.skip(insert, f"more than {NESTED} nested blocks")
            return
        lost: list[Any] = []
        try:
            parts = insert.virtual_entities(
                skipped_entity_callback=lambda entity, _: lost.append(entity)
            )
            content = [self._counted(it) for it in parts]
        except TooManyError:
            raise
        # ValueError, ArithmeticError and others: a block with values that cannot be transformed.
        except (DXFError, ValueError, ArithmeticError, TypeError, AttributeError) as error:
            self.skip(insert, f"block {insert.dxf.name!r}: {error}")
            return
        for entity in lost:
            if layer_of(entity, own) == self.name:
                self.skip(entity, "cannot be scaled as its block reference is")
        before = self.skipped.total()
        found = 0
        for entity in self.entities(content, own, depth + 1):
            found += 1
            yield entity
        if own == self.name and not found and not lost and self.skipped.total() == before:
            self.skip(insert, f"block {insert.dxf.name!r} has nothing on this layer")

    def _references(self, insert: Any) -> Iterator[Any]:
        """Yields the single references of a block array (MINSERT)."""
        if insert.mcount > 1:
            yield from insert.multi_insert()
        else:
            yield insert

    def _counted(self, entity: Any) -> Any:
        self._count += 1
        if self._count > MAXIMUM_ENTITIES:
            raise TooManyError(f"more than {MAXIMUM_ENTITIES} entities, block references resolved")
        return entity

    def _holds(self, insert: Any) -> bool:
        """Returns whether a block has an entity of the types ``whole`` explicitly on the layer."""
        block = insert.block()
        return block is not None and any(
            it.dxftype() in self._whole and layer_of(it) == self.name != "0" for it in block
        )

    def _concerns(self, name: str, drawing: Any) -> bool:
        """Returns whether a block, or a nested one, has an entity explicitly on the layer."""
        known = self._concerned.get(name)
        if known is not None:
            return known
        self._concerned[name] = False  # also ends a cycle of references
        block = None if drawing is None else drawing.blocks.get(name)
        found = block is not None and any(
            layer_of(it) == self.name
            or (it.dxftype() == "INSERT" and self._concerns(it.dxf.name, drawing))
            for it in block
        )
        self._concerned[name] = found
        return found
