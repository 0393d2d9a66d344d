"""`rosmaster.master_api`: the XML-RPC methods of a master; a facade of `pipros.master.api`."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any
from xmlrpc.client import Error

from pipros.basics.lazy_names import star_names as _star_names
from pipros.master.api import MasterApi
from pipros.master.params import ParamTree
from pipros.master.registry import Notice, Registry
from pipros.net.checked_calls import apivalidate as apivalidate
from pipros.net.workers import Workers
from rosgraph.names import resolve_name as resolve_name
from rosgraph.xmlrpc import XmlRpcHandler as XmlRpcHandler
from rosmaster.master import NUM_WORKERS as NUM_WORKERS
from rosmaster.paramserver import ParamDictionary
from rosmaster.registrations import RegistrationManager as RegistrationManager
from rosmaster.util import xmlrpcapi as xmlrpcapi
from rosmaster.validators import ParameterInvalid as ParameterInvalid
from rosmaster.validators import empty_or_valid_name as empty_or_valid_name
from rosmaster.validators import is_api as is_api
from rosmaster.validators import is_service as is_service
from rosmaster.validators import is_topic as is_topic
from rosmaster.validators import non_empty as non_empty
from rosmaster.validators import non_empty_str as non_empty_str
from rosmaster.validators import not_none as not_none
from rosmaster.validators import valid_name as valid_name
from rosmaster.validators import valid_type_name as valid_type_name

_star_names(__name__, "os rosgraph rosmaster sys time traceback")

STATUS, MSG, VAL = 0, 1, 2
"""Indices of the status code, status message and value in a response."""

LOG_API = False

_log = logging.getLogger("rosmaster.master")


def mloginfo(msg: object, *args: object) -> None:
    """Log an action of the master."""
    _log.info(msg, *args)


def mlogwarn(msg: object, *args: object) -> None:
    """Log and print a warning."""
    _log.warning(msg, *args)
    print(str(msg) % args if args else msg)


def publisher_update_task(api: str, topic: str, pub_uris: Sequence[str]) -> Any:
    """Notify a subscriber of the publishers of its topic."""
    return xmlrpcapi(api).publisherUpdate("/master", topic, list(pub_uris))  # type: ignore[union-attr]


def service_update_task(api: str, service: str, uri: str) -> Any:
    """Notify a node of a service. Current nodes no longer provide the method that this function calls."""
    return xmlrpcapi(api).serviceUpdate("/master", service, uri)  # type: ignore[union-attr]


class _OrderedTasks:
    """Queue of tasks that run in threads. Tasks with the same marker run one after another."""

    def __init__(self) -> None:
        self._workers: dict[str, Workers] = {}

    def queue_task(self, marker: str, task: Callable[..., object], args: Sequence[Any] = ()) -> None:
        """Queue `task(*args)`."""
        self._workers.setdefault(marker, Workers("notices", 1, kept_idle=0)).run(task, *args)


class ROSMasterHandler(XmlRpcHandler):
    """Handler of the Master API and the Parameter Server API, for `rosgraph.xmlrpc.XmlRpcNode`.

    Threads notify nodes of changes. (`rosmaster.master.Master` uses an event loop instead.)

    Attributes:
        uri: the master's URI; set when the server is ready.
        done: whether a shutdown was requested.
        reg_manager, param_server: the registrations and the parameters.
    """

    def __init__(self, num_workers: int = NUM_WORKERS) -> None:
        """`num_workers` is accepted for compatibility and has no effect."""
        del num_workers
        self.uri: str | None = None
        self.done = False
        self.thread_pool = _OrderedTasks()
        self.ps_lock = threading.Condition()
        self._registry = Registry()
        tree = ParamTree()
        self.reg_manager = RegistrationManager(self.thread_pool, self._registry)
        self.publishers = self.reg_manager.publishers
        self.subscribers = self.reg_manager.subscribers
        self.services = self.reg_manager.services
        self.param_subscribers = self.reg_manager.param_subscribers
        self.param_server = ParamDictionary(self.reg_manager, tree)
        self._api = MasterApi(self._registry, tree, notify=self._notify, shutdown=self._end)

    @property
    def topics_types(self) -> dict[str, str]:
        """The type of each topic."""
        return self._registry.topic_types

    def _ready(self, uri: str) -> None:
        self.uri = self._api.uri = uri

    def _shutdown(self, reason: str) -> None:
        del reason
        self.done = True

    def _end(self, reason: str) -> bool:
        print(f"shutdown request: {reason}")
        self._shutdown(reason)
        return True

    def _notify(self, notices: Iterable[Notice]) -> None:
        for notice in notices:
            self.thread_pool.queue_task(notice.api, self._deliver, (notice,))

    def _deliver(self, notice: Notice) -> None:
        with contextlib.suppress(OSError, Error):
            getattr(xmlrpcapi(notice.api), notice.method)(*notice.params)
        with self.ps_lock:
            self._registry.notice_done(notice)

    def param_update_task(self, caller_id: str, caller_api: str, param_key: str, param_value: Any) -> None:
        """Notify a subscriber of the new value of a parameter."""
        del caller_id
        with contextlib.suppress(OSError, Error):
            xmlrpcapi(caller_api).paramUpdate("/master", param_key, param_value)  # type: ignore[union-attr]


def _answering(name: str) -> Callable[..., tuple[int, str, Any]]:
    def answer(self: ROSMasterHandler, *args: Any, **kwds: Any) -> tuple[int, str, Any]:
        del kwds
        with self.ps_lock:
            code, text, value = self._api.methods[name](*args)
        return code, text, value

    answer.__name__ = name
    answer.__doc__ = f"Handle `{name}` of the Master API; return `(code, status message, value)`."
    return answer


for _name in (
    *("getPid", "getUri", "shutdown", "lookupNode", "lookupService"),
    *("registerPublisher", "unregisterPublisher", "registerSubscriber", "unregisterSubscriber"),
    *("registerService", "unregisterService", "getTopicTypes", "getPublishedTopics", "getSystemState"),
    *("getParam", "setParam", "hasParam", "deleteParam", "searchParam", "getParamNames"),
    *("subscribeParam", "unsubscribeParam"),
):
    setattr(ROSMasterHandler, _name, _answering(_name))
