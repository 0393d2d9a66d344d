"""All mistakes in the definitions of a package at once; compiling a type stops at its first."""

from __future__ import annotations

from pipros.msg.compile.compiler import message_source, service_source
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.spec import DefinitionError


def find_mistakes(package: str, definitions: Definitions) -> list[DefinitionError]:
    """All mistakes in the definitions of a package, including those of the types they embed.

    Raises:
        NotFound: the package does not exist.
    """
    found: dict[str, DefinitionError] = {}
    for kind in ("msg", "srv"):
        for name in definitions.files.names(kind, package):
            try:
                _compile(kind, f"{package}/{name}", definitions)
            except DefinitionError as mistake:
                found |= {str(each): each for each in (mistake, *mistake.others)}
    return list(found.values())


def _compile(kind: str, type_name: str, definitions: Definitions) -> None:
    if kind == "msg":
        message_source(definitions.message(type_name), definitions.message)
    else:
        service_source(definitions.service(type_name), definitions.message)
