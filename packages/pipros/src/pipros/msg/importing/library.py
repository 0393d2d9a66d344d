"""Provide all types that can be imported, from the cache of compiled types or from their definitions."""

from __future__ import annotations

from pipros.msg.language.definition_files import DefinitionFiles

# Type checkers treat this as True; importing `typing` would take milliseconds.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from types import CodeType

    from pipros.msg.compile.cache import CompiledTypes
    from pipros.msg.language.definition_files import FindPackage
    from pipros.msg.language.definitions import Definitions


class Library:
    """Message and service types by name, each compiled when first needed.

    Args:
        find_package: function that returns the folder of a package.
        cache_folder: folder in which compiled types are kept between processes; None for no cache.
    """

    def __init__(self, find_package: FindPackage, cache_folder: str | None) -> None:
        self.files = DefinitionFiles(find_package)
        self._cache_folder = cache_folder
        self._cache: CompiledTypes | None = None
        self._definitions: Definitions | None = None

    @property
    def definitions(self) -> Definitions:
        if self._definitions is None:
            from pipros.msg.language.definitions import Definitions

            self._definitions = Definitions(self.files)
        return self._definitions

    def code(self, kind: str, type_name: str) -> tuple[CodeType, Mapping[str, str]]:
        """Return the code that defines a type's classes, and the names that it uses for embedded types.

        Raises:
            NotFound: the package or type does not exist.
            DefinitionError: the definition is invalid.
        """
        if self._cache_folder is None:
            return self._compile(kind, type_name)
        if self._cache is None:
            from pipros.msg.compile.cache import CompiledTypes

            self._cache = CompiledTypes(self._cache_folder, self.files)
        found = self._cache.get(kind, type_name)
        if found is None:
            found = self._compile(kind, type_name)
            self._cache.put(kind, type_name, *found)
        return found

    def _compile(self, kind: str, type_name: str) -> tuple[CodeType, Mapping[str, str]]:
        from pipros.msg.compile.compiler import message_source, service_source

        lookup = self.definitions.message
        if kind == "msg":
            source, embedded = message_source(lookup(type_name), lookup)
        else:
            source, embedded = service_source(self.definitions.service(type_name), lookup)
        return compile(source, f"<{kind} {type_name}>", "exec"), dict(embedded)
