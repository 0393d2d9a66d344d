"""Shared code of the rosbridge and Foxglove servers, which connect browsers and programs in any language."""
