"""What every built-in shape is: a frozen dataclass of sizes that can be checked and meshed."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from geometry.errors import millimetres, refusal
from geometry.parameters import check_ranges, parameters

if TYPE_CHECKING:
    from geometry.cad import Named, Parts
    from geometry.tagged import TaggedMesh


class Shape(ABC):
    """Base of the shapes. A shape is a frozen dataclass; lengths in m, angles in rad.

    A shape gives `_relations` (what its sizes must satisfy together), `_draw` (the CAD) and the
    names of its groups. Cavities are closed inner voids: how the air is let in is left out.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    source: ClassVar[str]
    default_size: ClassVar[float]
    """Element size in m where the caller gives none."""

    def validate(self) -> None:
        """Refuse sizes that do not make a body, before gmsh is asked.

        Raises
        ------
        GeometryError
            naming the parameter, what is allowed and what to try
        """
        check_ranges(self)
        self._relations()
        if not 1e-3 <= self.extent <= 2.0:
            raise refusal(
                f"{self.name}: largest dimension {millimetres(self.extent)}",
                "1 mm to 2 m",
                "mm given where m are meant, or the reverse",
                "give the unit with every number, or fewer chambers",
            )

    @property
    @abstractmethod
    def extent(self) -> float:
        """Largest dimension of the body, m, from the parameters alone."""

    @property
    def linear(self) -> bool:
        """Whether it is built to lengthen rather than to bend."""
        return False

    def volume_names(self) -> tuple[str, ...]:
        """Names of the volumes that the mesh will have."""
        return ("body",)

    @abstractmethod
    def surface_names(self) -> tuple[str, ...]:
        """Names of the surfaces that the mesh will have."""

    def describe(self) -> str:
        """The shape in words: its name and the parameters that differ from the default."""
        given = [
            f"{item.name} {item.text(getattr(self, item.name))}"
            for item in parameters(self)
            if getattr(self, item.name) != item.default
        ]
        return f"{self.name} ({', '.join(given)})" if given else self.name

    def mesh(self, size: float | None = None, order: int = 2) -> TaggedMesh:
        """Mesh the shape.

        Parameters
        ----------
        size : element size in m; None: the shape's default
        order : 2, ten-node tets, curved on round walls; 1, straight four-node tets

        Returns
        -------
        TaggedMesh
            checked (geometry.checks); the same input gives the same mesh

        Raises
        ------
        GeometryError
            where sizes, element size or order are out of range, or the mesh does not pass
        """
        from geometry.cad import split
        from geometry.checks import check
        from geometry.mesher import CadMeasure, check_request, mesh_named
        from geometry.session import MM

        self.validate()
        size = self.default_size if size is None else size
        check_request(size, order, self.extent)

        def build(gmsh: Any) -> tuple[Named, float]:
            return split(gmsh, self._draw(gmsh)), MM

        def examine(mesh: TaggedMesh, cad: CadMeasure) -> None:
            check(mesh, surfaces=self.surface_names(), volumes=self.volume_names(), cad=cad)

        return mesh_named(build, size, order, self.describe(), examine)[0]

    @abstractmethod
    def _relations(self) -> None:
        """Refuse sizes that are each in range and do not go together."""

    @abstractmethod
    def _draw(self, gmsh: Any) -> Parts:
        """Draw the shape in the current gmsh model, in mm."""

    def replace(self, **changes: Any) -> Any:
        """The same shape with some parameters changed (not checked before `validate`)."""
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]
