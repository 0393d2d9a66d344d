"""`rviz`: opens the page at the Scene tab, with a configuration file."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path
from typing import Any

from pipros.packages import SHARE
from pipros_page.commands.page_command import page_parser, show
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, add_flag, run
from pipros_tools.cli.server_options import without_remappings

INCOMPLETE = 3
"""Exit status if something is missing from a picture."""

_IGNORED = "accepted for compatibility, without effect"


@command
def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _main(sys.argv[1:] if argv is None else argv))


def _main(argv: Sequence[str]) -> int:
    options, words = _parser().parse_args(without_remappings(argv))
    if len(words) > 1:
        raise CommandError(f"unexpected argument: {words[1]}")
    name = options.display_config or (words[0] if words else "")
    if options.png is not None:
        return _save_picture(options, name, argv)
    from pipros_page.scene.layout_file import SceneFile

    try:
        path = config_path(name)
        file = SceneFile(path, options.fixed_frame or "", is_smooth=not options.disable_anti_aliasing)
    except OSError as error:
        raise CommandError(f"cannot read {error.filename or name}: {error.strerror}") from None
    if path.is_relative_to(SHARE):  # start from the default; saving creates the user's own file
        file.path = Path.home() / ".rviz" / f"{name or 'default'}.rviz"
    remappings = [word for word in argv if word not in without_remappings([word])]
    return show("rviz", "scene", options, argv=tuple(remappings), scene=file)


def _save_picture(options: Any, name: str, argv: Sequence[str]) -> int:
    from pipros_page.commands.scene_picture import picture_size, save_picture

    arguments = [word for word in argv if word not in without_remappings([word])]
    if name:
        config_path(name)  # fail now if the file is missing
        arguments += ["-d", name]
    if options.fixed_frame:
        arguments += ["-f", options.fixed_frame]
    if options.disable_anti_aliasing:
        arguments.append("--disable-anti-aliasing")
    size = picture_size(options.size)
    problems, missing = save_picture(Path(options.png), arguments, size, options.timeout)
    for problem in problems:
        print(f"rviz: {problem}", file=sys.stderr)
    for each in missing:
        print(f"rviz: missing: {each}", file=sys.stderr)
    return INCOMPLETE if missing else 0


def _parser() -> OptionParser:
    parser = page_parser("rviz", "[options] [FILE]")
    parser.add_option(
        "-d", "--display-config", metavar="FILE", help="a .rviz file, or the name of one in ~/.rviz"
    )
    parser.add_option("-f", "--fixed-frame", metavar="FRAME", help="the fixed frame, instead of the file's")
    parser.add_option("--png", metavar="FILE", help="write a picture and exit; needs Chromium")
    parser.add_option("--size", metavar="WxH", default="1280x720", help="size of the picture (1280x720)")
    parser.add_option(
        "--timeout",
        metavar="SECONDS",
        type="float",
        default=10.0,
        help="how long to wait for data for the picture (10)",
    )
    add_flag(parser, "--disable-anti-aliasing", help="draw faster, with jagged edges")
    for names in (("-s", "--splash-screen"), ("--help-file",), ("--opengl",)):
        parser.add_option(*names, metavar="VALUE", help=_IGNORED)
    for names in (
        ("--fullscreen",),
        ("-l", "--ogre-log"),
        ("--in-mc-wrapper",),
        ("--no-stereo",),
        ("-v", "--verbose"),
        ("--log-level-debug",),
    ):
        add_flag(parser, *names, help=_IGNORED)
    return parser


def config_path(name: str, home: Path | None = None) -> Path:
    """Return the file that `-d NAME` selects: a path, `~/.rviz/NAME.rviz`, or pipros's default.

    An empty name means `default`.

    Raises:
        CommandError: the name looks like a path, but the file does not exist.
    """
    path = Path(name)
    if name and path.is_file():
        return path
    named = (home or Path.home()) / ".rviz" / f"{name or 'default'}.rviz"
    if named.is_file():
        return named
    if name.endswith(".rviz") or "/" in name:
        raise CommandError(f"cannot read {name}: no such file")
    return Path(SHARE, "rviz", "default.rviz")
