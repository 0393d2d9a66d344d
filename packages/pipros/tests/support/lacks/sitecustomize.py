"""Take from pipros what another system lacks, in this process and in all Python processes that it starts.

`PIPROS_TEST_LACKS` names the system, windows or macos. This folder must be in PYTHONPATH, and must be the
first that has a module of this name; see `environment` in the package.

Only modules of pipros are affected, as in a different Python library: their imports of missing modules fail,
and `os`, `select`, `signal`, `socket`, `subprocess`, `sys` and others look to them as they do on that system.
`sys.platform` and `os.name` cannot be changed for all, because Linux's own library would then look for
`_winapi` and `_scproxy`. For the same reason, the library and pytest keep Linux's functions, so these remain
those of Linux: paths and file names, files that cannot be replaced while they are open, the event loops of
asyncio except for their selector, and whatever a library calls inside.

Processes of Windows end at once if they are terminated. `CTRL_BREAK_EVENT` is sent as SIGUSR2, to which
`SIGBREAK` refers. The system call `accept4` is used by Python alone, so its lack cannot be shown.
"""

import builtins
import os
import sys
from collections.abc import Callable, Mapping
from types import FrameType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

SYSTEM = os.environ.get("PIPROS_TEST_LACKS", "")
_PACKAGES = os.path.abspath(os.path.join(os.path.realpath(__file__), *[".."] * 5))
_OURS = tuple(
    os.path.join(folder, name, part, "")
    for folder in (_PACKAGES, os.path.join(os.path.dirname(_PACKAGES), "plugins"))
    for name in os.listdir(folder)
    for part in ("src", "facades")
)
_LIBRARY = (os.path.join(os.path.dirname(os.__file__), ""), "<frozen ")
_NOT_LIBRARY = os.path.join(os.path.dirname(os.__file__), "site-packages", "")

_LINUX_SOCKETS = (
    "AF_ALG AF_CAN AF_NETLINK AF_PACKET AF_QIPCRTR AF_RDS AF_TIPC AF_VSOCK ALG_* CAN_* J1939_* "
    "MSG_CMSG_CLOEXEC MSG_CONFIRM MSG_ERRQUEUE MSG_FASTOPEN MSG_MORE MSG_NOSIGNAL NETLINK_* PACKET_* "
    "SCM_CREDENTIALS SOCK_CLOEXEC SOCK_NONBLOCK SO_BINDTODEVICE SO_DOMAIN SO_INCOMING_CPU SO_MARK "
    "SO_PASSCRED SO_PASSSEC SO_PEERCRED SO_PEERSEC SO_PRIORITY SO_PROTOCOL TCP_CONGESTION TCP_CORK "
    "TCP_DEFER_ACCEPT TCP_INFO TCP_LINGER2 TCP_QUICKACK TCP_SYNCNT TCP_USER_TIMEOUT TCP_WINDOW_CLAMP "
    "TIPC_*"
)
_LINUX_OS = (
    "EFD_* GRND_* MFD_* O_DIRECT O_LARGEFILE O_NOATIME O_PATH O_RSYNC O_TMPFILE POSIX_FADV_* P_PIDFD "
    "RWF_* SCHED_BATCH SCHED_IDLE SCHED_RESET_ON_FORK SPLICE_* XATTR_* copy_file_range eventfd "
    "eventfd_read eventfd_write fdatasync getrandom getresgid getresuid getxattr listxattr memfd_create "
    "pidfd_open pipe2 posix_fadvise posix_fallocate removexattr sched_getaffinity sched_getparam "
    "sched_getscheduler sched_rr_get_interval sched_setaffinity sched_setparam sched_setscheduler "
    "setresgid setresuid setxattr setns splice unshare"
)
_MODULES = {
    "macos": "spwd ossaudiodev msvcrt winreg _winapi",
    "windows": (
        "_posixsubprocess crypt curses fcntl grp nis ossaudiodev posix pty pwd readline resource spwd "
        "syslog termios tty"
    ),
}
"""Modules that the systems lack."""
_NAMES = {
    "macos": {
        "fcntl": (
            "DN_* F_ADD_SEALS F_GETLEASE F_GETPIPE_SZ F_GETSIG F_GET_SEALS F_NOTIFY F_OFD_* F_SEAL_* "
            "F_SETLEASE F_SETPIPE_SZ F_SETSIG"
        ),
        "mmap": "MAP_DENYWRITE MAP_EXECUTABLE MAP_POPULATE MAP_STACK",
        "os": _LINUX_OS,
        "select": "EPOLL* POLLMSG POLLRDHUP epoll",
        "selectors": "EpollSelector",
        "signal": "SIGCLD SIGPOLL SIGPWR SIGRT* SIGSTKFLT pidfd_send_signal sigtimedwait sigwaitinfo",
        "socket": f"{_LINUX_SOCKETS} TCP_KEEPIDLE",
        "sys": "",
        "subprocess": "",
    },
    "windows": {
        "ctypes": "",
        "mmap": "MAP_* MADV_* PROT_*",
        "os": (
            f"{_LINUX_OS} "
            "CLD_* EX_C* EX_D* EX_I* EX_N* EX_OS* EX_P* EX_S* EX_T* EX_U* F_LOCK F_TEST F_TLOCK F_ULOCK "
            "O_ACCMODE O_ASYNC O_CLOEXEC O_DIRECTORY O_DSYNC O_FSYNC O_NDELAY O_NOCTTY O_NOFOLLOW "
            "O_NONBLOCK O_SYNC POSIX_SPAWN_* PRIO_* P_ALL P_PGID P_PID RTLD_* SCHED_* SEEK_DATA SEEK_HOLE "
            "ST_* WCONTINUED WCOREDUMP WEXIT* WIF* WNO* WSTOP* WTERMSIG WUNTRACED chown chroot confstr "
            "confstr_names ctermid environb fchdir fchmod fchown fork forkpty fpathconf fstatvfs "
            "get_blocking getegid getenvb geteuid getgid getgrouplist getgroups getloadavg getpgid "
            "getpgrp getpriority getsid getuid initgroups killpg lchown lockf login_tty major makedev "
            "minor mkfifo mknod nice openpty pathconf pathconf_names posix_spawn posix_spawnp pread "
            "preadv pwrite pwritev readv register_at_fork sched_* sendfile set_blocking setegid seteuid "
            "setgid setgroups setpgid setpgrp setpriority setregid setreuid setsid setuid spawnlp "
            "spawnlpe spawnvp spawnvpe statvfs sync sysconf sysconf_names tcgetpgrp tcsetpgrp ttyname "
            "uname wait wait3 wait4 waitid writev"
        ),
        "select": "EPOLL* PIPE_BUF POLL* epoll poll",
        "selectors": "EpollSelector PollSelector",
        "signal": (
            "ITIMER_* ItimerError SIGALRM SIGBUS SIGC* SIGHUP SIGIO SIGIOT SIGKILL SIGP* SIGQUIT SIGRT* "
            "SIGST* SIGSYS SIGTRAP SIGTSTP SIGTTIN SIGTTOU SIGU* SIGV* SIGW* SIGX* SIG_BLOCK SIG_SETMASK "
            "SIG_UNBLOCK alarm getitimer pause pidfd_send_signal pthread_kill pthread_sigmask setitimer "
            "siginterrupt sigpending sigtimedwait sigwait sigwaitinfo struct_siginfo"
        ),
        "socket": (
            f"{_LINUX_SOCKETS} "
            "AF_UNIX CMSG_* MSG_DONTWAIT MSG_EOR SCM_RIGHTS SO_REUSEPORT recv_fds send_fds sethostname"
        ),
        "sys": "getdlopenflags setdlopenflags abiflags",
        "subprocess": "",
    },
}
"""Names that they lack; a `*` stands for any ending. The modules without such names have others."""
_PLATFORMS = {"macos": ("darwin", "posix"), "windows": ("win32", "nt")}


class _Seen(ModuleType):
    """A module as pipros sees it. Tests may replace names in the real one, which then shows through."""

    def __init__(self, real: ModuleType, lacking: str, others: Mapping[str, Any]) -> None:
        super().__init__(real.__name__, real.__doc__)
        exact = {word for word in lacking.split() if not word.endswith("*")}
        beginnings = tuple(word[:-1] for word in lacking.split() if word.endswith("*"))
        before = vars(real)
        vars(self).update(
            _real=real, _replaced={}, _is_lacking=lambda name: name in exact or name.startswith(beginnings),
            _others={name: (before.get(name), other) for name, other in others.items()},
        )  # fmt: skip

    def __getattr__(self, name: str) -> Any:
        real = vars(self)["_real"]
        if name in self._others:
            before, other = self._others[name]
            if before is vars(real).get(name):
                return other
        elif self._is_lacking(name):
            raise AttributeError(f"module {real.__name__!r} has no attribute {name!r}")
        return getattr(real, name)

    def __setattr__(self, name: str, value: object) -> None:
        real = vars(self)["_real"]
        if name in vars(real):
            self._replaced.setdefault(name, vars(real)[name])
        setattr(real, name, value)

    def __delattr__(self, name: str) -> None:
        """Restore the attribute that was replaced. pytest undoes a patch by deleting it."""
        real = vars(self)["_real"]
        if name in self._replaced:
            setattr(real, name, self._replaced.pop(name))
        else:
            delattr(real, name)

    def __dir__(self) -> list[str]:
        return [name for name in dir(vars(self)["_real"]) if not self._is_lacking(name)]


def _others(real: ModuleType) -> dict[str, Any]:
    """Return what a module has on the other system instead."""
    if real.__name__ == "sys":
        return {"platform": _PLATFORMS[SYSTEM][0]}
    if real.__name__ == "selectors":
        name = "PollSelector" if SYSTEM == "macos" else "SelectSelector"  # macOS has kqueue
        return {"DefaultSelector": getattr(real, name)}
    if real.__name__ == "subprocess":
        group = {"CREATE_NEW_PROCESS_GROUP": 0x200} if SYSTEM == "windows" else {}
        return _rebound(real, _popen(real)) | group
    if SYSTEM == "macos":
        # Under Linux, both names have the same meaning.
        return {"TCP_KEEPALIVE": vars(real)["TCP_KEEPIDLE"]} if real.__name__ == "socket" else {}
    if real.__name__ == "ctypes":
        kernel = SimpleNamespace(SetConsoleCtrlHandler=lambda *_: 0)  # refuses
        return {"WINFUNCTYPE": real.CFUNCTYPE, "windll": SimpleNamespace(kernel32=kernel)}
    return {"os": _os_of_windows, "select": _select_of_windows, "signal": _signal_of_windows}.get(
        real.__name__, lambda _: {}
    )(real)


def _os_of_windows(real: Any) -> dict[str, Any]:
    import signal

    def open_file(path: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        if dir_fd is not None:
            raise NotImplementedError("dir_fd unavailable on this platform")
        if not isinstance(path, int) and os.path.isdir(path):
            raise PermissionError(13, "Permission denied", path)
        return int(real.open(path, flags, mode))

    def kill(process: int, number: int) -> None:
        breaks = {signal.SIGUSR2: signal.SIGUSR2, 0: signal.SIGINT}  # CTRL_C_EVENT is 0
        real.kill(process, breaks.get(number, signal.SIGKILL))

    def without_folders(function: Callable[..., Any]) -> Callable[..., Any]:
        def called(*args: Any, **options: Any) -> Any:
            if any(options.pop(name, None) is not None for name in ("dir_fd", "src_dir_fd", "dst_dir_fd")):
                raise NotImplementedError("dir_fd unavailable on this platform")
            return function(*args, **options)

        return called

    names = ("chmod", "mkdir", "readlink", "rename", "replace", "rmdir", "stat", "unlink", "utime")
    return {
        "O_BINARY": 0, "kill": kill, "name": "nt", "open": open_file, "supports_bytes_environ": False,
        "supports_dir_fd": set(), "supports_fd": {real.stat, real.truncate},
    } | {name: without_folders(getattr(real, name)) for name in names}  # fmt: skip


def _select_of_windows(real: Any) -> dict[str, Any]:
    import stat

    def select(reading: Any, writing: Any, failing: Any, timeout_s: float | None = None) -> Any:
        for each in (*reading, *writing, *failing):
            descriptor = each if isinstance(each, int) else each.fileno()
            if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                raise OSError(10038, "An operation was attempted on something that is not a socket")
        return real.select(reading, writing, failing, timeout_s)

    return {"select": select}


def known_signals() -> set[int]:
    """Return the signals that Windows has."""
    import signal

    names = ("SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM", "SIGUSR2")
    return {getattr(signal, name) for name in names}


def handle_signal(number: int, handler: Any) -> Any:
    """Do what `signal.signal` does on Windows. In the module, so that it can be pickled."""
    import signal

    if number not in known_signals():
        raise ValueError("invalid signal value")
    return signal.signal(number, handler)


def _signal_of_windows(real: Any) -> dict[str, Any]:
    return {
        "CTRL_BREAK_EVENT": real.SIGUSR2, "CTRL_C_EVENT": real.SIGINT, "SIGBREAK": real.SIGUSR2,
        "signal": handle_signal, "valid_signals": known_signals,
    }  # fmt: skip


def _check_program(args: Any) -> None:
    """Refuse to start scripts, except for those of the environment, which are programs on Windows."""
    import shutil

    program = os.fsdecode(args if isinstance(args, (str, bytes, os.PathLike)) else next(iter(args)))
    found = shutil.which(program)
    if found is not None and os.path.dirname(found) != os.path.dirname(sys.executable):
        with open(found, "rb") as file:
            if file.read(2) == b"#!":
                raise OSError(8, "%1 is not a valid Win32 application", program)


def _rebound(real: Any, popen: type) -> dict[str, Any]:
    """Return the names of `subprocess` that start processes, with another Popen."""
    names = ("Popen", "run", "call", "check_call", "check_output")
    scope = {**vars(real), "Popen": popen}
    for name in names[1:]:
        function = scope[name]
        copied = FunctionType(function.__code__, scope, name, function.__defaults__, function.__closure__)
        copied.__kwdefaults__ = function.__kwdefaults__
        scope[name] = copied
    return {name: scope[name] for name in names}


def _popen(real: Any) -> type:
    """Return a Popen whose children also lack something, and which behaves as on the other system."""
    import signal

    class Popen(real.Popen):  # type: ignore[misc]
        def __init__(self, args: Any, *others: Any, **options: Any) -> None:
            # An isolated interpreter would not read PYTHONPATH.
            if not isinstance(args, (str, bytes, os.PathLike)) and list(args)[:2] == [sys.executable, "-I"]:
                args = [sys.executable, *[word for word in list(args)[2:3] if word != "-S"], *list(args)[3:]]
            if SYSTEM == "windows":
                _check_program(args)
                if options.get("preexec_fn") is not None or options.get("pass_fds"):
                    raise ValueError("preexec_fn and pass_fds are not supported on Windows platforms")
                # Windows ignores start_new_session. A new group is the nearest to CREATE_NEW_PROCESS_GROUP.
                options["start_new_session"] = bool(options.pop("creationflags", 0) & 0x200)
            if options.get("env") is not None:
                names = ("PIPROS_TEST_LACKS", "PYTHONPATH")
                carried = {name: os.environ[name] for name in names if name in os.environ}
                options["env"] = {**carried, **options["env"]}
            super().__init__(args, *others, **options)

        if SYSTEM == "windows":

            def send_signal(self, number: int) -> None:
                if number == signal.SIGTERM:
                    super().send_signal(signal.SIGKILL)
                elif number in (signal.SIGUSR2, signal.SIGINT):
                    super().send_signal(number)
                else:
                    raise ValueError(f"Unsupported signal: {number}")

            def terminate(self) -> None:
                super().send_signal(signal.SIGKILL)

            kill = terminate

    return Popen


def _is_ours() -> bool:
    """Return whether pipros called the function, directly or through the standard library."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        file = frame.f_code.co_filename
        if file.startswith(_OURS):
            return True
        if file != __file__ and (not file.startswith(_LIBRARY) or file.startswith(_NOT_LIBRARY)):
            return False
        frame = frame.f_back
    return False


def _is_in_proc(path: object) -> bool:
    if isinstance(path, os.PathLike):
        path = os.fspath(path)
    return isinstance(path, str) and (path == "/proc" or path.startswith("/proc/"))


def _hide_proc() -> None:
    def refuse(event: str, arguments: tuple[Any, ...]) -> None:
        if event in ("open", "os.listdir", "os.scandir"):
            if _is_in_proc(arguments[0]) and _is_ours():
                raise FileNotFoundError(2, "No such file or directory", arguments[0])
        elif event == "socket.bind" and isinstance(arguments[1], (str, bytes)) and _is_ours():
            raise OSError(22, "no Unix sockets that pipros could use")

    def without_proc(function: Callable[..., Any]) -> Callable[..., Any]:
        def called(path: Any, *args: Any, **options: Any) -> Any:
            if _is_in_proc(path) and _is_ours():
                raise FileNotFoundError(2, "No such file or directory", path)
            return function(path, *args, **options)

        return called

    for name in ("lstat", "readlink", "stat"):
        function = getattr(os, name)
        replaced = without_proc(function)
        for supported in (os.supports_dir_fd, os.supports_fd, os.supports_follow_symlinks):
            if function in supported:
                supported.add(replaced)
        setattr(os, name, replaced)
    sys.addaudithook(refuse)


def install() -> None:
    """Take away what the system lacks."""
    real_import = builtins.__import__
    missing = frozenset(_MODULES[SYSTEM].split())
    names = _NAMES[SYSTEM]
    seen: dict[str, _Seen] = {}

    def import_there(name: str, *others: Any, **options: Any) -> ModuleType:
        scope = others[0] if others else options.get("globals")
        is_ours = str((scope or {}).get("__file__", "")).startswith(_OURS)
        if is_ours and name.partition(".")[0] in missing:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        found = real_import(name, *others, **options)
        if not is_ours or found.__name__ not in names:
            return found
        if found.__name__ not in seen:
            seen[found.__name__] = _Seen(found, names[found.__name__], _others(found))
        return seen[found.__name__]

    builtins.__import__ = import_there
    for module in list(sys.modules.values()):  # those that pipros.pth has imported
        if str(getattr(module, "__file__", "")).startswith(_OURS):
            for name, value in list(vars(module).items()):
                if isinstance(value, ModuleType) and value.__name__ in names:
                    setattr(module, name, import_there(value.__name__, vars(module)))
    _hide_proc()
    if SYSTEM == "windows":
        import socket

        def missing_method(_: object) -> None:
            raise AttributeError("sockets of Windows have no such method")

        for method in ("recvmsg", "recvmsg_into", "sendmsg", "sendmsg_afalg"):
            setattr(socket.socket, method, property(missing_method))


if SYSTEM:
    install()
