"""Look up message, service and action types."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pipros.basics.errors import NotFound
from pipros.basics.limits import limit_text, process_limits
from pipros.msg.compile.layout import TypeLayouts
from pipros.msg.importing.hook import installed_library
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.digest import Lookup, check_nesting, message_md5, service_md5
from pipros.msg.language.spec import DefinitionError, MessageSpec
from pipros_workspace.index import PackageIndex

SECTION_MARK = "---\n"


@dataclass(frozen=True, slots=True)
class TypeCatalogue:
    """The types of one kind: messages, services or actions.

    Attributes:
        command: the tool that shows these types.
        kind: the file extension, which is also the name of the folder.
        noun: the word for a type of this kind in help and error texts.
        unknown: the start of the error text for an unknown type.
    """

    command: str
    kind: str
    noun: str
    unknown: str

    @property
    def definitions(self) -> Definitions:
        return installed_library().definitions

    def packages(self) -> Iterator[str]:
        """Yield the packages that define types of this kind, sorted."""
        for package in PackageIndex.from_environment():
            if self.names(package.name):
                yield package.name

    def names(self, package: str) -> list[str]:
        """Return the names of a package's types. Raise NotFound if the package does not exist."""
        return self.definitions.files.names(self.kind, package)

    def types_named(self, name: str) -> list[str]:
        """Return the types with the given name in all packages. A full name is returned unchanged."""
        if "/" in name:
            return [name]
        return [f"{package}/{name}" for package in self.packages() if name in self.names(package)]

    @staticmethod
    def is_malformed(name: str) -> bool:
        """Return True for a name with slashes that does not have the form `package/Type`.

        >>> [TypeCatalogue.is_malformed(name) for name in ("std_msgs/String", "String", "/std_msgs/String")]
        [False, False, True]
        """
        return name.startswith("/") or name.count("/") > 1

    def text(self, type_name: str, *, is_raw: bool) -> str:
        """Return a definition, as written if `is_raw`; otherwise without comments, and with embedded fields.

        Raises:
            NotFound, DefinitionError: the type does not exist or is invalid.
        """
        if self.is_malformed(type_name):
            raise NotFound(f"invalid name [{type_name}]")
        parts = self._parts(type_name)
        if is_raw:
            return self._raw(type_name, parts)
        lookup = self.definitions.message
        check_nesting(parts, lookup)
        fields, most = (
            sum(TypeLayouts(lookup).of(part).code_size for part in parts),
            process_limits().definition_fields,
        )
        if fields > most:
            reason = f"the definition has {fields} fields in total; {limit_text('definition_fields', most)}"
            raise DefinitionError(reason, file=parts[0].file)
        return SECTION_MARK.join(expanded(part, lookup) for part in parts)

    def md5(self, type_name: str) -> str:
        """Return the MD5 sum that peers compare.

        Raises:
            NotFound, DefinitionError: the type does not exist or is invalid.
        """
        lookup = self.definitions.message
        if self.kind == "srv":
            return service_md5(self.definitions.service(type_name), lookup)
        if self.kind == "action":
            type_name = f"{type_name}Action"
        return message_md5(lookup(type_name), lookup)

    def _parts(self, type_name: str) -> list[MessageSpec]:
        if self.kind == "msg":
            return [self.definitions.message(type_name)]
        if self.kind == "srv":
            service = self.definitions.service(type_name)
            return [service.request, service.response]
        if type_name.partition("/")[2] not in self.names(type_name.partition("/")[0]):
            raise NotFound(f"there is no action {type_name}")
        return [self.definitions.message(type_name + part) for part in ("Goal", "Result", "Feedback")]

    def _raw(self, type_name: str, parts: list[MessageSpec]) -> str:
        if self.kind == "srv":
            return self.definitions.service(type_name).text
        if self.kind == "action":
            return self.definitions.action(type_name).text
        return parts[0].text


def expanded(spec: MessageSpec, lookup: Lookup, indent: str = "") -> str:
    """Return a message's constants and fields. Embedded messages are indented below their fields."""
    lines = [f"{indent}{item.type} {item.name}={item.text}\n" for item in spec.constants]
    for field in spec.fields:
        lines.append(f"{indent}{field.type} {field.name}\n")
        if not field.type.is_builtin:
            lines.append(expanded(lookup(field.type.base), lookup, f"{indent}  "))
    return "".join(lines)


MESSAGES = TypeCatalogue("rosmsg", "msg", "message", "Unable to load msg")
SERVICES = TypeCatalogue("rossrv", "srv", "service", "Unknown srv type")
ACTIONS = TypeCatalogue("rosaction", "action", "action", "Unknown action type")
