"""Advice that `pipros.packages` gives about packages that the page replaces."""

PLUGINS = "its rqt is a page in the browser, whose tabs pipros --help lists."
"""Advice for rqt plugins that have no tab."""

MODULES = (
    " Its rqt is a page in the browser: "
    "rqt_graph, rqt_plot, rqt_console, rqt_image_view, rqt_reconfigure, rqt_tf_tree and others"
)
"""Advice for modules of rqt and Qt."""
