"""The node of the rosapi package. Its services describe the running system to rosbridge clients."""

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
