"""tf2_web_republisher: a node that sends requested transforms to rosbridge clients."""

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
