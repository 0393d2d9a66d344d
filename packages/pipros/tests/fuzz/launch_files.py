"""Any launch file becomes a Launch within limits, or raises LaunchError.

An input is a launch file, which may include itself as `/self.launch`.

python -m tests.fuzz.launch_files --seconds 60
"""

import errno
import sys

from pipros.basics.errors import NotFound
from pipros_tools.launch.load_context import CommandFailed, LoadContext
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.xml import load
from tests.fuzz import mutation
from tests.support.constants import changed

WORDS = [
    *(b"$(arg a)", b"$(arg b)", b"$(env HOME)", b"$(find p)", b"$(anon a)", b"$(dirname)", b"$(eval a + a)"),
    *(
        b"$(optenv A b)", b"$(", b")", b"$(arg ", b'<arg name="b" value="$(arg a)$(arg a)"/>', b"<group>",
        b"</group>",
    ),
    *(b'<include file="/self.launch"/>', b'<include file="/self.launch" pass_all_args="true"/>', b' ns="x"'),
    *(b' if="$(arg a)"', b' unless="false"', b' subst_value="true"', b' type="yaml"', b' command="echo"'),
    *(
        b'<rosparam file="/self.launch"/>', b'<param name="p" textfile="/self.launch"/>', b"<!--", b"-->",
        b"&#0;",
    ),
]  # fmt: skip
LONGER = (5000,)
LAUNCH_BYTES = 2_000_000
LAUNCH_INCLUDES = 50


def _find(package: str, path: str) -> str:
    if package != "p":
        raise NotFound(f"package [{package}] not found")
    return f"/p/{path}"


def _run(_: str) -> str:
    raise CommandFailed("there are no commands")


@changed(LAUNCH_FILES_BYTES=LAUNCH_BYTES, LAUNCH_INCLUDES=LAUNCH_INCLUDES, LAUNCH_INSERT_CHARACTERS=20_000)
def target(data: bytes) -> None:
    def read(path: str) -> bytes:
        if path != "/self.launch":
            raise FileNotFoundError(errno.ENOENT, "No such file or directory", path)
        return data

    context = LoadContext(_find, {"HOME": "/home/ada"}, lambda base: f"{base}_1", read, _run)
    try:
        launch = load(["/self.launch"], {"a": "1"}, context=context)
    except LaunchError:
        return
    assert len(launch.includes) <= LAUNCH_INCLUDES
    assert sum(len(str(value)) for value in launch.params.values()) <= 100 * LAUNCH_BYTES


if __name__ == "__main__":
    sys.exit(mutation.main(target, "launch_files", WORDS, LONGER))
