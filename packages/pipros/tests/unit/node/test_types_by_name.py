"""Topics that are advertised and subscribed with the name of a type."""

from __future__ import annotations

import pytest
from std_msgs.msg import String

from pipros.basics.errors import NotFound
from pipros.node.codec import class_named


def test_a_type_is_a_class_or_its_name() -> None:
    assert class_named(String) is String
    assert class_named("std_msgs/String") is String
    with pytest.raises(NotFound, match="Nothing"):
        class_named("std_msgs/Nothing")
