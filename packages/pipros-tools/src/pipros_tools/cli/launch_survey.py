"""`roslaunch-check --survey` and `--csv`: determine which programs in many launch files are available."""

from __future__ import annotations

import sys
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from pipros.packages.apt_names import PLUGIN_PACKAGES, PROGRAM_PACKAGES
from pipros_tools.launch.survey import (
    CPP,
    PYTHON,
    STARTED,
    Owner,
    Providers,
    Use,
    figures,
    read_csv,
    read_trees,
)
from pipros_workspace.index import SHIPPED_FOLDERS, PackageIndex

_PACKAGES_SHOWN = 25


def survey_trees(folders: Sequence[str]) -> int:
    """Print the programs in all launch files below folders, with the provider of each, such as Debian.

    Return 0 if no program is missing, 1 if one is, and 2 if a launch file cannot be read.
    """
    errors: list[str] = []
    uses = read_trees(folders, errors.append)
    index = PackageIndex([*map(Path, folders), *PackageIndex.from_environment().folders])
    code = _print_owners(uses, Providers(index))
    for error in errors:
        print(f"ERROR: {error}", file=sys.stderr)
    return 2 if errors else code


def survey_csv(path: str, without: Collection[str]) -> int:
    """Print the programs listed in a CSV file, with their providers, and statistics about C++ nodes.

    Return 0 if no program is missing, otherwise 1.

    Args:
        without: packages shipped with pipros. The files are also counted as if pipros lacked these packages.
    """
    uses = read_csv(path)
    index = PackageIndex(SHIPPED_FOLDERS)
    others = {use.in_package for use in uses}
    providers = Providers(index, others=others)
    code = _print_owners(uses, providers)
    _print_languages(uses)
    needs: dict[str, list[Use]] = defaultdict(list)
    for use in uses:
        if (use.element, use.language) == ("node", CPP):
            needs[use.file].append(use)
    now = figures(needs, providers)
    before = figures(needs, Providers(index, without=without, others=others))
    print()
    _print_row("files with C++ nodes for which pipros has", "without", "with", f"{len(without)} packages")
    _print_row("  a package of each name", before.with_packages, now.with_packages)
    _print_row("  each program and nodelet", before.with_programs, now.with_programs)
    print("  all but those of one package:")
    for name, _ in (before.lacking | now.lacking).most_common(_PACKAGES_SHOWN):
        _print_row(f"    {name}", before.lacking[name], now.lacking[name])
    print()
    _print_row("C++ packages", "files", "nodes")
    nodes = Counter(use.package for each in needs.values() for use in each)
    files = Counter(name for each in needs.values() for name in {use.package for use in each})
    for name, count in files.most_common(_PACKAGES_SHOWN):
        _print_row(f"    {name}", count, nodes[name], "has" if providers.ships_package(name) else "")
    return code


def _print_owners(uses: Sequence[Use], providers: Providers) -> int:
    named = [use for use in uses if use.element]
    counts = Counter((providers.owner(use), use.name) for use in named)
    files = Counter(pair for pair, _ in {((providers.owner(use), use.name), use.file) for use in named})
    debian = {use.name: _debian_package(use) for use in named}
    order = list(Owner)
    print(f"{'provided by':<12}{'files':>6}{'uses':>6}  name")
    for owner, name in sorted(files, key=lambda pair: (order.index(pair[0]), -files[pair], pair[1])):
        hint = f" (apt-get install {debian[name]})" if owner is Owner.DEBIAN and debian[name] else ""
        print(f"{owner.value:<12}{files[owner, name]:>6}{counts[owner, name]:>6}  {name}{hint}")
    incomplete = {use.file for use in named if providers.owner(use).is_missing}
    total = Counter(owner for owner, _ in files)
    print(f"\n{', '.join(f'{owner.value}: {total[owner]}' for owner in order)}")
    everything = {use.file for use in uses}
    print(f"{len(everything)} launch files, {len(everything - incomplete)} of them without a missing program")
    return 1 if incomplete else 0


def _debian_package(use: Use) -> str:
    table = PLUGIN_PACKAGES if "/" in use.nodelet or not use.program else PROGRAM_PACKAGES
    return table.get(use.provider, "")


def _print_languages(uses: Sequence[Use]) -> None:
    started = [use for use in uses if use.element in STARTED]
    cpp = [use for use in started if use.language == CPP]
    packages = {use.package for use in cpp}
    both = packages & {use.package for use in started if use.language == PYTHON}
    everything, any_, with_cpp = (_files(each) for each in (uses, started, cpp))
    nodes = _files(use for use in cpp if use.element == "node")
    print(
        f"{len(started)} nodes, {len(cpp)} ({100 * len(cpp) // max(1, len(started))} %) of them in C++, from "
        f"{len(packages)} packages, {len(both)} of which also have nodes in Python\n"
        f"files that start nothing: {len(everything - any_)}, only Python: {len(any_ - with_cpp)}, "
        f"C++ only in tests: {len(with_cpp - nodes)}, C++ nodes: {len(nodes)}"
    )


def _print_row(name: str, first: object, second: object, more: str = "") -> None:
    print(f"{name:<46}{first!s:>9}{second!s:>9}  {more}".rstrip())


def _files(uses: Iterable[Use]) -> set[str]:
    return {use.file for use in uses}
